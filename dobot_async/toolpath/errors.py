"""What can be wrong with a toolpath, its file, or this installation."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

from dobot_async.arms.magician.kinematics import BEYOND_LIMIT, Unreachable

__all__ = ["MissingLibrary", "ToolpathFileError", "UnreachableStroke", "library"]


class MissingLibrary(ImportError):
    """A library that drawing needs is not installed; the message says how to install it."""


class ToolpathFileError(ValueError):
    """A file cannot be read as what it is said to be.

    Attributes:
        file: Its name, "" where it has none.
        place: Where in it: "line 12, column 5", "entity LINE #2A"; "" where nothing tells.
        reason: What is wrong there.
    """

    def __init__(self, file: str, place: str, reason: str) -> None:
        super().__init__(": ".join(part for part in (file, place, reason) if part))
        self.file = file
        self.place = place
        self.reason = reason


class UnreachableStroke(Unreachable):
    """The arm cannot draw a toolpath, of which nothing was sent.

    Attributes:
        stroke: The number of the stroke, from 0, as in `toolpath.strokes`.
        point: The number of the point in it, from 0, on the way to which the reach ends.
        place: Where that is, x, y, z of the arm in mm.
        reason: Why the arm cannot go there.
        alarm: The code of the alarm that a Magician would raise.
    """

    def __init__(
        self, stroke: int, point: int, place: tuple[float, float, float], reason: str, *, alarm: int = BEYOND_LIMIT
    ) -> None:
        where = ", ".join(f"{number:.1f}" for number in place)
        what = reason if reason.startswith(f"({where})") else f"({where}) is out of reach: {reason}"
        super().__init__(f"stroke {stroke}, point {point}: {what}", alarm)
        self.stroke = stroke
        self.point = point
        self.place = place
        self.reason = reason


@contextmanager
def library() -> Generator[None]:
    """Around the import of a library of the extra: say which extra it is in if it is missing."""
    try:
        yield
    except ImportError as error:
        name = error.name or str(error)
        message = f"{name} is not installed, and this needs it: pip install 'dobot-async[draw]'"
        raise MissingLibrary(message, name=error.name) from error
