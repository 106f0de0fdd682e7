"""A Magician's frames in the words of a trace: which command, as a request or an answer, with which values.

A Wi-Fi password is left out, and so are the length and the checksum, which tell something of it; an answer has *** as
the password.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from dobot_async._core.protocol.wire import Command, Number, u32, u64
from dobot_async._core.util.plain import plain
from dobot_async.arms.magician import alarms
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame, Parser
from dobot_async.errors import ProtocolError
from dobot_async.traces.words import MASK, REPLY, REQUEST, FrameWords

__all__ = ["FRAMES", "raw", "readings", "retimed"]

INDEX = Number[int](u64)
CLOCK = Number[int](u32)  # ms
WRAP = 1 << 32
SECRET = {c.SET_WIFI_PASSWORD.id}
ANYTHING = MASK.encode("ascii") + b"\0"


def described(frame: Frame, *, outgoing: bool) -> dict[str, object]:
    """Return what a trace says of a frame."""
    role = REQUEST if outgoing else REPLY
    command, values = readings(frame, [role])
    name = command and command.name
    if frame.id in SECRET and frame.params:
        # A replay has to know a request by what is left of it, and to answer with a whole frame.
        shown = f"aa aa {MASK} {frame.id:02x} {frame.ctrl:02x} {MASK}"
        return {
            "command": name,
            "value": MASK,
            "raw": shown if outgoing else raw(frame._replace(params=ANYTHING)).hex(" "),
        }

    line: dict[str, object] = {"command": name, "value": values.get(role), "raw": raw(frame).hex(" ")}
    if role not in values:
        line["problem"] = f"the parameters do not fit a {role}" if command else f"no command has the ID {frame.id}"

    return line


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


def once(frame: Frame) -> bool:
    """Return whether to send a request twice is to do it twice."""
    row = c.BY_KEY.get((frame.id, frame.write))
    return frame.queued or (row is not None and not row.repeatable)


def retimed(data: bytes, seconds: float) -> bytes:
    """Return an answer as it would be so many seconds later: the arm's clock goes on. Manual V1.1."""
    frames = Parser().feed(data)
    if len(frames) != 1 or frames[0].id != c.GET_DEVICE_TIME.id or len(frames[0].params) != CLOCK.struct.size:
        return data

    told = CLOCK.decode(frames[0].params)
    return bytes(frames[0]._replace(params=CLOCK.encode((told + round(1000 * seconds)) % WRAP)))


FRAMES = FrameWords("magician", described, lambda frame: frame.write, once)
