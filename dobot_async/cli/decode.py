"""`decode`: which frames are in some bytes, what they say, and what is wrong with the rest; see `pieces`."""

from __future__ import annotations

import re
from typing import Any

import click

from dobot_async.cli.output import words
from dobot_async.cli.session import Session
from dobot_async.cli.trace import REPLY, REQUEST

__all__ = ["decode"]

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

    pieces = list(session.family.pieces(data))
    session.output.answer({"pieces": pieces}, "\n".join(map(text_of, pieces)))


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
