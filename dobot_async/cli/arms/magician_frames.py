"""The frames of a Magician in words: which command, as a request or an answer, with which values; junk with its reason.

    AA AA 02 0A 00 F6 | AA AA 02 0A 00 F5 | AA AA 13 54      GetPose; a wrong checksum; the beginning of a frame

All names, layouts and sections are those of the command table.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from dobot_async.arms.magician.frame import Frame, Parser
from dobot_async.arms.magician.trace_words import raw, readings
from dobot_async.traces.words import REPLY, REQUEST

__all__ = ["pieces"]

HEADER = b"\xaa\xaa"
OVERHEAD = 4  # header, Len, checksum
LENGTHS = set(range(2, 251)) - {HEADER[0]}


def pieces(data: bytes) -> Iterator[dict[str, Any]]:
    """The pieces of a Magician's bytes; frames that can be a request and a reply are shown as both."""
    parser = Parser()
    at = 0
    for frame in [*parser.feed(data), *parser.resync()]:
        found = raw(frame)
        start = data.index(found, at)
        yield from cut_junk(data, at, start)
        yield {"offset": start, **piece_of(frame)}
        at = start + len(found)

    yield from cut_junk(data, at, len(data))


def cut_junk(data: bytes, at: int, end: int) -> Iterator[dict[str, Any]]:
    """Yields the junk in a range: each header begins a piece, which ends where its Len says or the next one begins."""
    while at < end:
        following = data.find(HEADER, at + 1, end)
        stop = end if following < 0 else following
        if data.startswith(HEADER, at) and at + 2 < stop and data[at + 2] in LENGTHS:
            stop = min(stop, at + OVERHEAD + data[at + 2])

        yield {"offset": at, "raw": data[at:stop], "junk": reason(data[at:stop])}
        at = stop


def reason(junk: bytes) -> str:
    """Why a piece is no frame."""
    if not junk.startswith(HEADER):
        return "no header"

    if len(junk) <= len(HEADER):
        return "incomplete"

    length = junk[2]
    missing = OVERHEAD + length - len(junk)
    if length not in LENGTHS:
        return f"no frame has a Len of {length}"

    if missing > 0:
        return f"incomplete, {missing} bytes are missing"

    return f"the checksum is {junk[-1]:02X}, {-sum(junk[3:-1]) & 0xFF:02X} would be right"


def piece_of(frame: Frame) -> dict[str, Any]:
    """What is to be said of a frame; "request" and "reply" are there if it can be one."""
    command, values = readings(frame, (REQUEST, REPLY))
    if not frame.params and values.get(REPLY) is not None:
        # Some text layouts accept no bytes at all, but an arm ends each text with NUL.
        del values[REPLY]

    return {
        "raw": raw(frame),
        "id": frame.id,
        "write": frame.write,
        "queued": frame.queued,
        "command": command and command.name,
        "section": command and command.section,
        "rw_fits": command is None or command.write == frame.write,
        **values,
    }
