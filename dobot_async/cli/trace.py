"""The file of `--trace`: opened for the length of a command, and given to `connect(record=)`."""

from __future__ import annotations

import errno
import sys
from collections.abc import Generator
from contextlib import contextmanager, suppress

import click

from dobot_async.traces import TraceFile

__all__ = ["tracing"]


@contextmanager
def tracing(path: str | None) -> Generator[TraceFile | None]:
    """Opens the file of a trace for the length of a block; "-" is standard error, None is no trace."""
    if path is None:
        yield None
        return

    try:
        file = TraceFile(sys.stderr if path == "-" else path)
    except OSError as error:
        why = "nobody reads from this pipe" if error.errno == errno.ENXIO else str(error)
        raise click.BadParameter(why, param_hint="--trace") from error

    with file:
        try:
            yield file
        finally:
            if file.error:
                with suppress(OSError):  # it may be standard error
                    click.echo(f"warning: the trace ended early: {file.error}", err=True)
