"""What went over a connection, written down while it happens, and read back.

async with Magician.connect(url, record="trace.jsonl") as arm: ...
async with Magician.connect("replay:trace.jsonl") as arm: ...
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dobot_async._core.util.late import late

if TYPE_CHECKING:
    from dobot_async.traces.file import TraceFile
    from dobot_async.traces.reader import (
        Trace,
        TraceLine,
        TraceProblem,
        read_trace,
    )
else:
    __getattr__ = late(
        __name__,
        {
            "file": ("TraceFile",),
            "reader": ("Trace", "TraceLine", "TraceProblem", "read_trace"),
        },
    )

__all__ = ["Trace", "TraceFile", "TraceLine", "TraceProblem", "read_trace"]
