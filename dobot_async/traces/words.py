"""What a family says of its frames in a trace, and what is kept out of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from dobot_async._core.protocol.contract import Frame

__all__ = ["MASK", "REPLY", "REQUEST", "FrameWords", "masked"]

REQUEST, REPLY = "request", "reply"
MASK = "***"
"""What stands in a trace where something secret was."""


class Describe(Protocol):
    """Says what a trace says of a frame."""

    def __call__(self, frame: Any, *, outgoing: bool) -> Mapping[str, object]:
        """Return "command", "value" and "raw", and "problem" where the parameters do not fit."""
        ...


@dataclass(frozen=True, slots=True)
class FrameWords:
    """A family's frames in words.

    Attributes:
        family: Its name.
        describe: Says what a trace says of a frame; secrets are `MASK` in it.
        writes: Says whether a request changes anything.
        once: Says whether to send a request twice is to do it twice.
    """

    family: str
    describe: Describe
    writes: Callable[[Any], bool]
    once: Callable[[Any], bool]

    def line(self, frame: Frame, *, outgoing: bool) -> dict[str, object]:
        """Return the fields of a frame's line."""
        fields: dict[str, object] = {"direction": "out" if outgoing else "in", "key": str(frame.key)}
        if outgoing:
            fields |= {"write": self.writes(frame), "once": self.once(frame)}

        return {**fields, **self.describe(frame, outgoing=outgoing)}


def masked(raw: str) -> Iterator[bytes | None]:
    """Yield what a `raw` consists of: bytes, and None where something was left out."""
    for place, part in enumerate(raw.split(MASK)):
        if place:
            yield None

        if part.strip():
            yield bytes.fromhex(part)
