"""The file of `--trace`: every frame as a line of JSON, in the words of the arm's family.

{"time": 1700000000.0, "direction": "out", "command": "GetPose", "value": null, "raw": "aa aa 02 0a 00 f6"}
"""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from typing import Any, TextIO

import click

__all__ = ["MASK", "REPLY", "REQUEST", "Trace", "TraceFile", "traced", "tracing"]

REQUEST, REPLY = "request", "reply"
MASK = "***"
"""What stands in a trace where something secret was."""


@contextmanager
def tracing(path: str | None) -> Generator[TraceFile | None]:
    """Opens the file of a trace for the length of a block; "-" is standard error, None is no trace."""
    if path is None:
        yield None
        return

    if path == "-":
        yield TraceFile(sys.stderr)
        return

    file = opened(path)
    try:
        yield TraceFile(file)
    finally:
        # What could not be written was told when it happened.
        with suppress(OSError):
            file.close()


class TraceFile:
    """Where frames are written, a line each."""

    def __init__(self, file: TextIO) -> None:
        self._file: TextIO | None = file

    def write(self, line: Mapping[str, Any]) -> None:
        """Writes a line; a file that cannot be written any more ends the trace and nothing else."""
        if self._file is None:
            return

        try:
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()
        except OSError as error:
            # The next frame may be the one that stops the arm: it must get through whatever becomes of the disk.
            self._file = None
            with suppress(OSError):
                click.echo(f"warning: the trace ends here: {error}", err=True)


class Trace:
    """What a link calls with each frame.

    Args:
        file: Where it is written.
        describe: Says what a line says of a frame, by the arm's family.
        also: What each line says beside that.
    """

    def __init__(self, file: TraceFile, describe: Callable[..., Mapping[str, Any]], **also: str) -> None:
        self._file = file
        self._describe = describe
        self._also = also

    def __call__(self, outgoing: bool, frame: Any) -> None:
        """Writes one frame."""
        self._file.write({**self._also, **self._describe(frame, outgoing=outgoing)})


def traced(kind: Any, trace: Trace) -> Any:
    """Returns a kind of arm whose link tells a trace of every frame, those of the greeting included."""

    class Traced(kind):  # type: ignore[misc]
        def __init__(self, link: Any, *arguments: Any, **options: Any) -> None:
            super().__init__(link, *arguments, **options)
            link.on_frame.add(trace)

    return Traced


def opened(path: str) -> TextIO:
    """Returns a new file; that it cannot be written is wrong usage.

    A pipe is written as far as its reader keeps up: neither it nor a reader that never comes may hold up an arm.
    """
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_NONBLOCK", 0)
        return os.fdopen(os.open(path, flags, 0o666), "w", encoding="utf-8")
    except OSError as error:
        why = "nobody reads from this pipe" if error.errno == errno.ENXIO else str(error)
        raise click.BadParameter(why, param_hint="--trace") from error
