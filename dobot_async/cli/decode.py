"""`decode`: which frames are in some bytes, what they say, and what is wrong with the rest.

    AA AA 02 0A 00 F6 | AA AA 02 0A 00 F5 | AA AA 13 54      GetPose; a wrong checksum; the beginning of a frame

Frames are found as the driver finds them, by its own parser; only the names of the rest are made here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import click

from dobot_async.cli.output import words
from dobot_async.cli.session import Session
from dobot_async.cli.trace import REPLY, REQUEST, raw, readings
from dobot_async.magician.frame import Frame, Parser

__all__ = ["decode"]

HEADER = b"\xaa\xaa"
OVERHEAD = 4  # header, Len, checksum
LENGTHS = set(range(2, 251)) - {HEADER[0]}
SEPARATORS = re.compile(r"0x|[\s,:;-]+", re.IGNORECASE)


@click.command()
@click.argument("digits", metavar="HEX...", nargs=-1, required=True)
@click.pass_obj
def decode(session: Session, digits: tuple[str, ...]) -> None:
    """Decode the bytes of frames.

    They may be of either direction, such as AA AA 02 0A 00 F6. Spaces, commas, colons and 0x may stand between the
    bytes. A frame that can be a request and a reply is shown as both. What is no frame is junk, shown with the reason.
    """
    try:
        data = bytes.fromhex(SEPARATORS.sub("", " ".join(digits)))
    except ValueError:
        raise click.UsageError("expected pairs of hexadecimal digits, such as AA AA 02 0A 00 F6") from None

    pieces = list(cut(data))
    session.output.answer({"pieces": pieces}, "\n".join(map(text_of, pieces)))


def cut(data: bytes) -> Iterator[dict[str, Any]]:
    """Yields what the bytes consist of, in order: frames as the parser finds them, and junk between them."""
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


def text_of(piece: dict[str, Any]) -> str:
    """A piece as lines of text."""
    data = piece["raw"].hex(" ").upper()
    if "junk" in piece:
        return f"{data}\n    junk: {piece['junk']}"

    roles = [f"{role}: {words(piece[role])}" for role in (REQUEST, REPLY) if role in piece]
    name = f"{piece['command']} ({piece['section']})" if piece["command"] else f"no command has the ID {piece['id']}"
    if piece["command"] and not roles:
        roles = ["its parameters fit neither a request nor a reply"]

    if not piece["rw_fits"]:
        roles.append(f"its Ctrl says {'write' if piece['write'] else 'read'}, which this command is not")

    head = f"{name}, {'queued' if piece['queued'] else 'immediate'}"
    return "\n    ".join([data, head, *roles])
