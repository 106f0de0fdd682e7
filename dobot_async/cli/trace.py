"""Frames in words: which command, as a request or as an answer, with which values; and the file of `--trace`.

    {"time": 1700000000.0, "direction": "out", "command": "GetPose", "value": null, "raw": "aa aa 02 0a 00 f6"}

A Wi-Fi password is left out, and so are the length and the checksum, which tell something of it. All names, layouts
and sections are those of the command table.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO

import click

from dobot_async.cli.output import plain
from dobot_async.errors import ProtocolError
from dobot_async.magician import alarms
from dobot_async.magician import commands as c
from dobot_async.magician.frame import Frame
from dobot_async.wire import Command, Number, u64

__all__ = ["REPLY", "REQUEST", "Trace", "described", "raw", "readings", "tracing"]

INDEX = Number[int](u64)
REQUEST, REPLY = "request", "reply"
SECRET = {c.SET_WIFI_PASSWORD.id}
MASK = "***"


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


@contextmanager
def tracing(path: str, describe: Callable[..., Mapping[str, Any]]) -> Iterator[Trace]:
    """Opens the file of a trace; "-" is standard error. `describe` says what a line says of a frame, by its family."""
    if path == "-":
        yield Trace(sys.stderr, describe)
        return

    file = opened(path)
    try:
        yield Trace(file, describe)
    finally:
        # What could not be written was told when it happened.
        with suppress(OSError):
            file.close()


class Trace:
    """What a link calls with each frame: writes it as a line."""

    def __init__(self, file: TextIO, describe: Callable[..., Mapping[str, Any]] | None = None) -> None:
        self._file: TextIO | None = file
        self._describe = describe or described

    def __call__(self, outgoing: bool, frame: Any) -> None:
        """Writes one frame; a file that cannot be written any more ends the trace and nothing else."""
        if self._file is None:
            return

        try:
            self._file.write(json.dumps(self._describe(frame, outgoing=outgoing)) + "\n")
            self._file.flush()
        except OSError as error:
            # The next frame may be the one that stops the arm: it must get through whatever becomes of the disk.
            self._file = None
            with suppress(OSError):
                click.echo(f"warning: the trace ends here: {error}", err=True)


def opened(path: str) -> TextIO:
    """Returns a new file; that it cannot be written is wrong usage."""
    try:
        return Path(path).open("w", encoding="utf-8")
    except OSError as error:
        raise click.BadParameter(str(error), param_hint="--trace") from error


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
