"""An arm in time: its queue, its motions, its alarms. Knows no bytes and no family."""
