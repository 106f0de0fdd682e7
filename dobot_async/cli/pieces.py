r"""What bytes consist of: frames as the driver's own parsers find them, and junk between them with the reason.

    AA AA 02 0A 00 F6 | AA AA 02 0A 00 F5 | AA AA 13 54      GetPose; a wrong checksum; the beginning of a frame
    FE FE 02 20 FA | FE FE 02 20                             GetAngles; the beginning of a frame
    G0 X200 F50 \r | QUEUE SIZE[3] \r\n                      a request and an answer of an ultraArm

Only the names of the rest are made here.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

from dobot_async.cli.output import plain
from dobot_async.cli.trace import REPLY, REQUEST, raw, readings
from dobot_async.errors import ProtocolError
from dobot_async.magician.frame import Frame, Parser
from dobot_async.mycobot import frame as cobot
from dobot_async.mycobot.models import CobotModel
from dobot_async.ultraarm import commands as ultraarm
from dobot_async.ultraarm.frame import errors, split_words

__all__ = ["Pieces", "cobot_pieces", "magician_pieces", "ultraarm_pieces"]

Pieces = Callable[[bytes], Iterator[dict[str, Any]]]
"""Yields what bytes consist of, in order: each with "offset" and "raw", and "junk" (the reason) or what it says."""

HEADER = b"\xaa\xaa"
OVERHEAD = 4  # header, Len, checksum
LENGTHS = set(range(2, 251)) - {HEADER[0]}
COBOT_HEADER = b"\xfe\xfe"
LINE = re.compile(rb"[^\r\n]+[\r\n]*|[\r\n]+")


def magician_pieces(data: bytes) -> Iterator[dict[str, Any]]:
    """The pieces of a Magician's bytes; frames that can be a request and a reply are shown as both."""
    parser = Parser()
    at = 0
    for frame in [*parser.feed(data), *parser.resync()]:
        found = raw(frame)
        start = data.index(found, at)
        yield from cut_junk(data, at, start)
        yield {"offset": start, **described(frame)}
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


def described(frame: Frame) -> dict[str, Any]:
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


def cobot_pieces(model: CobotModel) -> Pieces:
    """What finds the pieces of a myCobot's bytes; which frames there are depends on the model."""

    def pieces(data: bytes) -> Iterator[dict[str, Any]]:
        parser = cobot.Parser(model.known)
        at = 0
        for frame in [*parser.feed(data), *parser.resync()]:
            start = data.index(bytes(frame), at)
            yield from cobot_junk(data, at, start)
            yield {"offset": start, **described_cobot(model, frame)}
            at = start + len(bytes(frame))

        yield from cobot_junk(data, at, len(data))

    return pieces


def cobot_junk(data: bytes, at: int, end: int) -> Iterator[dict[str, Any]]:
    """Yields the junk in a range as one piece."""
    junk = data[at:end]
    if junk:
        reason = (
            "incomplete, or its length, its footer and its command do not agree"
            if COBOT_HEADER in junk
            else "no header"
        )
        yield {"offset": at, "raw": junk, "junk": reason}


def described_cobot(model: CobotModel, frame: cobot.Frame) -> dict[str, Any]:
    """What is to be said of a frame; "request" and "reply" are there if it can be one."""
    row = model.row(model.by_id[frame.id])
    piece = {"raw": bytes(frame), "id": frame.id, "write": row.write, "command": row.name, "section": row.section}
    for role, layout in ((REQUEST, row.request), (REPLY, row.reply)):
        with suppress(ProtocolError):
            if len(frame.params) in getattr(layout, "lengths", {0}):
                piece[role] = plain(layout.decode(frame.params))

    return piece


def ultraarm_pieces(data: bytes) -> Iterator[dict[str, Any]]:
    """The pieces of an ultraArm's bytes: its lines."""
    for found in LINE.finditer(data):
        if text := found[0].strip():
            yield {"offset": found.start(), "raw": found[0], **described_line(text)}


def described_line(text: bytes) -> dict[str, Any]:
    """What is to be said of a line: a request, an answer, or an error of the arm."""
    with suppress(ValueError, LookupError, ProtocolError):
        letter, number = split_words(text)[0]
        row = ultraarm.BY_WORD[letter + number]
        rest = bytes(text.translate(None, b" \t")).upper().removeprefix((letter + number).encode())
        return {**named(row), REQUEST: plain(row.request.decode(rest))}

    if refused := errors(text):
        return {"command": None, "section": None, REPLY: refused[0]}

    for row in ultraarm.ALL:
        if not row.write:
            with suppress(ProtocolError):
                return {**named(row), REPLY: plain(row.reply.decode(text))}

    return {"junk": "no line that an ultraArm reads or says"}


def named(row: Any) -> dict[str, Any]:
    """The name of a row."""
    return {"command": row.name, "section": row.section}
