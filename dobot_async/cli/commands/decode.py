"""`decode`: which frames are in some bytes, what they say, and what is wrong with the rest."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from dobot_async.cli.family import FamilyCommands
from dobot_async.cli.output import words
from dobot_async.cli.params import standard_input
from dobot_async.cli.session import CommandSession
from dobot_async.program.text import LARGEST, lines_in, shortened
from dobot_async.traces.words import MASK, REPLY, REQUEST

__all__ = ["decode"]

SEPARATORS = re.compile(r"0x|[\s,:;-]+", re.IGNORECASE)


@click.command()
@click.argument("digits", metavar="HEX...", nargs=-1)
@click.option(
    "--file", type=click.Path(), help="What to decode: a file of --trace, of hexadecimal digits, or of bytes."
)
@click.pass_obj
def decode(session: CommandSession, digits: tuple[str, ...], file: str | None) -> None:
    """Decode the bytes of frames, or lines of text.

    They may be of either direction, such as AA AA 02 0A 00 F6. Spaces, commas, colons and 0x may stand between the
    bytes; - reads standard input, in the forms of --file. An ultraarm's lines may be given as they are: G0 X200. A
    frame that can be a request and a reply is shown as both. What is no frame is junk, shown with the reason.
    """
    session.refuse("nothing is asked of an arm", "url", "trace")
    if bool(digits) == bool(file):
        raise click.UsageError("give bytes, such as AA AA 02 0A 00 F6, or --file FILE, or - for standard input")

    if file or digits == ("-",):
        pieces = list(pieces_in(session.family, content(file or "-")))
    else:
        pieces = list(session.family.pieces(bytes_in(session.family, " ".join(digits))))

    session.output.answer({"pieces": pieces}, "\n".join(map(text_of, pieces)))


def content(file: str) -> bytes:
    """The bytes of a file, or of standard input."""
    if file == "-":
        return standard_input()

    with Path(file).open("rb") as opened:
        return opened.read(LARGEST)


def pieces_in(family: FamilyCommands, data: bytes) -> Iterator[dict[str, Any]]:
    """Yields the pieces of a trace, of hexadecimal digits, of text, or of bytes."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        yield from family.pieces(data)
        return

    if text.lstrip().startswith("{"):
        for number, line in enumerate(lines_in(text), 1):
            if line.strip():
                yield from traced_pieces(family, number, line)
    else:
        yield from family.pieces(bytes_in(family, text))


def traced_pieces(family: FamilyCommands, number: int, line: str) -> Iterator[dict[str, Any]]:
    """Yields the pieces of one line of a trace."""
    try:
        told = json.loads(line)
        if told["kind"] not in {"frame", "junk"} or "raw" not in told:
            return

        raw = told["raw"]
        data = b"" if MASK in raw else bytes.fromhex(raw)
    except (ValueError, LookupError, TypeError, RecursionError):
        raise click.UsageError(f"line {number} is no line of a trace: {shortened(line)!r}") from None

    also = {name: told[name] for name in ("time", "direction", "arm") if name in told}
    if MASK in raw:
        yield {**also, "raw": b"", "junk": "left out of the trace"}

    for piece in family.pieces(data):
        yield {**also, **piece}


def bytes_in(family: FamilyCommands, text: str) -> bytes:
    """The bytes that hexadecimal digits stand for, or those of lines of text, where an arm speaks them."""
    try:
        return bytes.fromhex(SEPARATORS.sub("", text))
    except ValueError:
        if family.text:
            return text.encode()

        raise click.UsageError(
            "expected pairs of hexadecimal digits, such as AA AA 02 0A 00 F6; or --file FILE"
        ) from None


def text_of(piece: dict[str, Any]) -> str:
    """A piece as lines of text."""
    data = piece["raw"].hex(" ").upper()
    if "junk" in piece:
        return f"{data}\n    junk: {piece['junk']}"

    roles = [f"{role}: {words(piece[role])}" for role in (REQUEST, REPLY) if role in piece]
    unknown = f"no command has the ID {piece['id']}" if "id" in piece else "an error"
    name = f"{piece['command']} ({piece['section']})" if piece["command"] else unknown
    if piece["command"] and not roles:
        roles = ["its parameters fit neither a request nor a reply"]

    if "queued" not in piece:
        return "\n    ".join([data, name, *roles])

    if not piece["rw_fits"]:
        roles.append(f"its Ctrl says {'write' if piece['write'] else 'read'}, which this command is not")

    head = f"{name}, {'queued' if piece['queued'] else 'immediate'}"
    return "\n    ".join([data, head, *roles])
