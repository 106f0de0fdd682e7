"""The lines of an ultraArm in the words of a trace."""

from __future__ import annotations

from contextlib import suppress

from dobot_async._core.util.plain import plain
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.frame import Frame
from dobot_async.errors import ProtocolError
from dobot_async.traces.words import FrameWords

__all__ = ["FRAMES"]


def described(frame: Frame, *, outgoing: bool) -> dict[str, object]:
    """Return what a trace says of a request, or of the lines of an answer."""
    text = frame.params.decode("ascii", "replace").strip()
    line: dict[str, object] = {"command": frame.word.decode("ascii") or None, "value": text}
    line["raw"] = bytes(frame).hex(" ")
    row = c.BY_WORD.get(str(line["command"])) if outgoing else None
    if row and text:
        with suppress(ProtocolError):  # the text says it as well
            line["value"] = plain(row.request.decode(frame.params))

    return line


def writes(frame: Frame) -> bool:
    """Return whether a request changes anything."""
    return frame.word not in READS


def once(frame: Frame) -> bool:
    """Return whether to send a request twice is to do it twice."""
    row = c.BY_WORD.get(frame.word.decode("ascii"))
    return row is None or not row.repeatable


READS = {row.name.encode("ascii") for row in c.ALL if not row.write}
FRAMES = FrameWords("ultraarm", described, writes, once)
