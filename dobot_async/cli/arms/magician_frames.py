"""The frames of a Magician in words: which command, as a request or an answer, with which values; junk with its reason.

    AA AA 02 0A 00 F6 | AA AA 02 0A 00 F5 | AA AA 13 54      GetPose; a wrong checksum; the beginning of a frame

A Wi-Fi password is left out of a trace, and so are the length and the checksum, which tell something of it. All names,
layouts and sections are those of the command table.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from typing import Any

from dobot_async._core.protocol.wire import Command, Number, u64
from dobot_async.arms.magician import alarms
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame, Parser
from dobot_async.cli.output import plain
from dobot_async.cli.trace import MASK, REPLY, REQUEST
from dobot_async.errors import ProtocolError

__all__ = ["described", "pieces"]

INDEX = Number[int](u64)
SECRET = {c.SET_WIFI_PASSWORD.id}
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


def readings(frame: Frame, roles: Iterable[str]) -> tuple[Command[Any, Any] | None, dict[str, Any]]:
    """Returns what a frame can be: the command, and its values in each role ("request", "reply") that they fit.

    The rows of the frame's ID are tried in turn, the one of its own rw bit first, for frames with another one exist.
    Where nothing fits the command is that of the first row, None for an ID that is not in the table.
    """
    rows = [c.BY_KEY[key] for key in ((frame.id, frame.write), (frame.id, not frame.write)) if key in c.BY_KEY]
    for row in rows:
        fitting = dict(fits(row, frame, roles))
        if fitting:
            return row, fitting

    return (rows[0] if rows else None), {}


def raw(frame: Frame) -> bytes:
    """Returns the bytes of a frame, also of one that is longer than may be sent."""
    payload = bytes((frame.id, frame.ctrl)) + frame.params
    return b"\xaa\xaa" + bytes((len(payload),)) + payload + bytes((-sum(payload) & 0xFF,))


def described(frame: Frame, *, outgoing: bool) -> dict[str, Any]:
    """What a trace says of a frame."""
    role = REQUEST if outgoing else REPLY
    command, values = readings(frame, [role])
    if frame.id in SECRET and frame.params:
        return {**head(outgoing, command), "value": MASK, "raw": f"aa aa {MASK} {frame.id:02x} {frame.ctrl:02x} {MASK}"}

    line = {**head(outgoing, command), "value": values.get(role), "raw": raw(frame).hex(" ")}
    if role not in values:
        line["problem"] = f"the parameters do not fit a {role}" if command else f"no command has the ID {frame.id}"

    return line


def head(outgoing: bool, command: Command[Any, Any] | None) -> dict[str, Any]:
    """When a frame went which way, and what it is called."""
    direction = "out" if outgoing else "in"
    return {"time": time.time(), "direction": direction, "command": command and command.name}


def fits(row: Command[Any, Any], frame: Frame, roles: Iterable[str]) -> Iterator[tuple[str, Any]]:
    """Yields the roles in which the parameters fit a row, with their values."""
    for role in roles:
        try:
            if role == REQUEST:
                yield role, plain(row.request.decode(frame.params))
            elif frame.queued:
                yield role, {"index": INDEX.decode(frame.params)}
            elif row is c.GET_ALARMS_STATE:
                yield role, [f"0x{alarm.code:02X} {alarm.name}" for alarm in alarms.decode(frame.params)]
            else:
                yield role, plain(row.reply.decode(frame.params))
        except ProtocolError:
            continue
