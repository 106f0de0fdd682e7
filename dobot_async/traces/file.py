"""A trace as a file: a line of JSON for everything that happened, in parts of a limited size.

    trace.jsonl.2   trace.jsonl.1   trace.jsonl        the oldest part to the newest, each readable alone
    {"kind": "trace", "version": 1, "run": "5f0c...", "part": 3, ...}
    {"kind": "connection", ...}
    {"kind": "frame", "t": 0.0021, "time": 1700000000.0, "direction": "out", "command": "GetPose", ...}

Whatever becomes of the disk, or of the reader of a pipe, a trace only ends: it never holds up an arm.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import stat
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self, TextIO

__all__ = ["VERSION", "NamedTrace", "TraceFile", "part_path"]

VERSION = 1
LEAST = 4096
logger: logging.Logger = logging.getLogger("dobot_async.trace")


class TraceFile:
    """Where traces of arms are written; to be opened by a `with` block, and given to `connect(record=)`.

    Args:
        target: A path, or an open stream of text, which is not closed and not cut into parts.
        max_bytes: Of one part, 4096 at least; a file that has become larger is renamed to `.1`.
        keep: How many parts are kept beside the newest one, 0 or more; the oldest ones are removed.

    Attributes:
        error: Why nothing more is written; None while all is well.

    Raises:
        ValueError: A number is out of its range.
        OSError: The file cannot be written, or nobody reads from the pipe.
    """

    def __init__(self, target: str | os.PathLike[str] | TextIO, *, max_bytes: int = 16 << 20, keep: int = 4) -> None:
        if max_bytes < LEAST:
            raise ValueError(f"max_bytes must be at least {LEAST}, not {max_bytes!r}")

        if keep < 0:
            raise ValueError(f"keep must be 0 or more, not {keep!r}")

        self.error: OSError | None = None
        self._path = Path(target) if isinstance(target, (str, os.PathLike)) else None
        self._file: TextIO | None = opened(Path(target)) if isinstance(target, (str, os.PathLike)) else target
        self._max_bytes = max_bytes if self._path and self._path.is_file() else None
        self._keep = keep
        self._size = 0
        self._run = os.urandom(16).hex()
        self._part = 0
        self._began: float | None = None
        self._connections: dict[object, Mapping[str, object]] = {}

    def named(self, name: str) -> NamedTrace:
        """Return this file for one of several arms, whose lines then have its name as "arm"."""
        return NamedTrace(self, name)

    def write(self, kind: str, fields: Mapping[str, object]) -> None:
        """Write a line, with both times; a file that cannot be written any more ends the trace and nothing else."""
        if self._file is None:
            return

        if not self._part or (self._max_bytes and self._size >= self._max_bytes):
            self._next_part()

        self._line(kind, fields)

    def connected(self, token: object, fields: Mapping[str, object]) -> None:
        """Write that a connection begins; each part of the file begins with those that have not ended."""
        self.write("connection", fields)
        self._connections[token] = {**fields, "continued": True}

    def disconnected(self, token: object, fields: Mapping[str, object]) -> None:
        """Write that a connection has ended."""
        self._connections.pop(token, None)
        self.write("end", fields)

    def close(self) -> None:
        """Close the file; it may be called again."""
        file, self._file = self._file, None
        if file and self._path:
            with suppress(OSError):  # what could not be written was told when it happened
                file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _next_part(self) -> None:
        """Begin the first part, or the next one."""
        if self._part and self._path and self._file:
            with suppress(OSError):
                self._file.close()

            self._file = None
            try:
                shift(self._path, self._keep)
                self._file = opened(self._path)
            except OSError as error:
                self._fail(error)

        self._part += 1
        self._size = 0
        from importlib import metadata  # noqa: PLC0415 - it is half as large as this library, and few record

        software = f"dobot_async {metadata.version('dobot-async')}"
        self._line("trace", {"version": VERSION, "software": software, "run": self._run, "part": self._part})
        for fields in self._connections.values():
            self._line("connection", fields)

    def _line(self, kind: str, fields: Mapping[str, object]) -> None:
        if self._file is None:
            return

        now = asyncio.get_running_loop().time()
        self._began = now if self._began is None else self._began
        times = {"t": round(now - self._began, 6), "time": round(time.time(), 6)}
        text = json.dumps({"kind": kind, **times, **fields}, default=str) + "\n"
        try:
            self._file.write(text)
            self._file.flush()
        except OSError as error:
            self._fail(error)
        else:
            self._size += len(text)  # JSON is ASCII here

    def _fail(self, error: OSError) -> None:
        """End the trace: the next frame may be the one that stops the arm, and has to get through."""
        file, self._file, self.error = self._file, None, error
        logger.warning("the trace ends here: %s", error)
        if file and self._path:
            with suppress(OSError):
                file.close()


@dataclass(frozen=True, slots=True)
class NamedTrace:
    """A trace file for one of several arms.

    Attributes:
        file: The file.
        name: The arm's name.
    """

    file: TraceFile
    name: str


def part_path(path: Path, number: int) -> Path:
    """Return where an older part of a trace is; 0 is the newest."""
    return path.with_name(f"{path.name}.{number}") if number else path


def shift(path: Path, keep: int) -> None:
    """Give each part the name of the one before it, and remove the oldest."""
    part_path(path, keep).unlink(missing_ok=True)
    for number in reversed(range(keep)):
        with suppress(FileNotFoundError):
            part_path(path, number).replace(part_path(path, number + 1))


def opened(path: Path) -> TextIO:
    """Return a new file.

    A pipe is written as far as its reader keeps up: neither it nor a reader that never comes may hold up an arm.
    """
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_NONBLOCK", 0)
    descriptor = os.open(path, flags, 0o666)
    if stat.S_ISDIR(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise IsADirectoryError(f"{path} is a directory")

    return os.fdopen(descriptor, "w", encoding="utf-8")
