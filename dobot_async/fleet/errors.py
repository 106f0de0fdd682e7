"""What can go wrong between arms. Imports only the root of the exception tree.

DobotError
├── BarrierBroken    a partner failed, ended or gave up before it came to the barrier
├── ZoneDeadlock     who waits for a zone would wait for himself
└── ZoneOccupied     a zone on the way is not free, and waiting was not wanted or would not help
"""

from __future__ import annotations

from dobot_async.errors import DobotError

__all__ = ["BarrierBroken", "ZoneDeadlock", "ZoneOccupied"]


class BarrierBroken(DobotError):
    """A partner failed, ended or gave up, so that nobody gets past this barrier."""


class ZoneDeadlock(DobotError):
    """Waiting for a zone would never end: its holder waits, in the end, for who asks; the message names the cycle."""


class ZoneOccupied(DobotError):
    """A zone on the way is held by another arm; nothing was sent."""
