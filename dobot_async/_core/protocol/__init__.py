"""Bytes and values, no I/O: layouts, rows of command tables, and what a link needs of a family's frames."""
