"""What can be wrong with a recording, and with its file."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["RecordingFileError", "RecordingUnfit"]

SHOWN = 10


class RecordingFileError(ValueError):
    """A file is no recording, or something in it is wrong.

    Attributes:
        file: Its name, "" where it has none.
        place: Where in it: "steps 3", "line 12"; "" for all of it.
        reason: What is wrong there.
    """

    def __init__(self, file: str, place: str, reason: str) -> None:
        super().__init__(": ".join(part for part in (file, place, reason) if part))
        self.file = file
        self.place = place
        self.reason = reason


class RecordingUnfit(ValueError):
    """An arm cannot do what was recorded; nothing was sent.

    Attributes:
        problems: What is wrong, each with its step.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        more = f"; and {len(problems) - SHOWN} more" if len(problems) > SHOWN else ""
        super().__init__("; ".join(problems[:SHOWN]) + more)
        self.problems: tuple[str, ...] = tuple(problems)
