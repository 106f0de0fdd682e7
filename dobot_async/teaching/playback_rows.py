"""The rows of a `.playback` file: their items, as what they stand for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeVar

from dobot_async.program.text import parse_number, shortened
from dobot_async.teaching.problems import RecordingFileError

__all__ = ["Element", "Row"]

T = TypeVar("T")


@dataclass(slots=True)
class Element:
    """A head, or a row.

    Attributes:
        name: Its tag.
        line: Where it begins.
        items: The text of its children, by their numbers.
    """

    name: str
    line: int
    items: dict[int, str] = field(default_factory=dict[int, str])


@dataclass(frozen=True, slots=True)
class Row:
    """The items of a row, as what they stand for."""

    element: Element
    file: str

    def number(self, item: int, default: float | None = None) -> float:
        """Return a number; raise RecordingFileError for anything else."""
        text = self.element.items.get(item, "").strip()
        if not text and default is not None:
            return default

        try:
            return parse_number(text)
        except ValueError:
            raise self.wrong(item, f"cannot be {shortened(text) or 'nothing'}") from None

    def choice(self, item: int, choices: tuple[T, ...]) -> T | None:
        """Return one of several by its index, None for nothing; raise RecordingFileError for any other."""
        if not self.element.items.get(item, "").strip():
            return None

        index = self.number(item)
        if not index.is_integer() or not 0 <= index < len(choices):
            raise self.wrong(item, f"must be 0 to {len(choices) - 1}, not {index:g}")

        return choices[int(index)]

    def wrong(self, item: int, why: str) -> RecordingFileError:
        """What is raised for an item."""
        place = f"line {self.element.line}"
        return RecordingFileError(self.file, place, f"item_{item} of <{shortened(self.element.name)}> {why}")
