"""What a family of arms is to the commands."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

__all__ = ["CommandAnswer", "FamilyCommands", "MonitorReading", "Pieces"]

Pieces = Callable[[bytes], Iterator[dict[str, Any]]]
"""Yields what bytes consist of, in order: each with "offset" and "raw", and "junk" (the reason) or what it says."""


@dataclass(frozen=True, slots=True)
class CommandAnswer:
    """An answer: as JSON, and in words."""

    value: Any
    text: str


class MonitorReading(Protocol):
    """What an arm told at one time."""

    @property
    def rows(self) -> Mapping[str, str]:
        """What a person wants to see of it."""
        ...


@dataclass(frozen=True, slots=True)
class FamilyCommands:
    """One family of arms.

    Attributes:
        kind: Its class, with `connect`, `home` and `stop`.
        info: Tells who an arm is.
        pose: Tells where it is.
        read: Tells all that `monitor` shows.
        move: Moves to numbers, in one of the `modes`.
        modes: The ways to move, the usual one first.
        jog: Jogs in one of the `directions`, for so many seconds.
        directions: What a jog can be called.
        suction: Switches the pump.
        pieces: Finds the frames in bytes.
        numbers: How many numbers a move has at most.
        alarms: Whether it has `get_alarms` and `clear_alarms`.
        pump: Whether it has one.
        text: Whether it speaks lines of text.
    """

    kind: Any
    info: Callable[[Any], Awaitable[CommandAnswer]]
    pose: Callable[[Any], Awaitable[CommandAnswer]]
    read: Callable[[Any], Awaitable[MonitorReading]]
    move: Callable[[Any, Sequence[float], str], Awaitable[None]]
    modes: Sequence[str]
    jog: Callable[[Any, Any, float], Awaitable[None]]
    directions: Mapping[str, Any]
    suction: Callable[[Any, bool], Awaitable[None]]
    pieces: Pieces
    numbers: int = 4
    alarms: bool = False
    pump: bool = True
    text: bool = False
