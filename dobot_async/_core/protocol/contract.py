"""What a family brings to its link: frames, a parser and an encoder; and what a link tells about itself."""

from __future__ import annotations

import enum
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from dobot_async._core.protocol.wire import Command

__all__ = ["Encoder", "Frame", "LineLimits", "LinkState", "LinkStats", "Parser", "Unexpected"]


class Frame(Protocol):
    """What a family's parser makes and its transport carries."""

    @property
    def key(self) -> Hashable:
        """What requests and replies are matched by."""
        ...

    @property
    def params(self) -> bytes:
        """The parameters, for the command's layout."""
        ...

    def __bytes__(self) -> bytes: ...


F = TypeVar("F", bound=Frame)
F_co = TypeVar("F_co", bound=Frame, covariant=True)


class Parser(Protocol[F]):
    """Finds a family's frames in a stream that may be cut anywhere and may hold anything."""

    junk_bytes: int
    bad_frames: int

    def feed(self, data: bytes) -> list[F]:
        """Takes the next bytes of the stream, returns the frames that they complete."""
        ...

    def resync(self) -> list[F]:
        """Gives up an incomplete frame, returns the frames found inside of it."""
        ...

    def reset(self) -> None:
        """Forgets an incomplete frame: another stream begins."""


class Encoder(Protocol[F_co]):
    """Makes a family's request frame of a command's row and its parameters."""

    def __call__(self, command: Command[Any, Any], params: bytes, *, queued: bool) -> F_co:
        """Returns the frame; raises ValueError where the arm cannot take it so."""
        ...


class LinkState(enum.Enum):
    """What a link is good for."""

    OPEN = "open"
    REOPENING = "reopening"
    LOST = "lost"
    CLOSED = "closed"


@dataclass(frozen=True, slots=True)
class Unexpected(Generic[F]):
    """A frame that nobody waited for: a copy, of another client, or of no request at all."""

    frame: F


@dataclass(frozen=True, slots=True)
class LineLimits:
    """What a transport can carry at a time; see `transports.base.Transport`.

    Attributes:
        in_flight: Requests that may be unanswered.
        window: Queued commands that may be unacknowledged.
        reorder_window: Seconds within which messages may overtake one another.
    """

    in_flight: int
    window: int
    reorder_window: float


@dataclass(slots=True)
class LinkStats:
    """What went over a link so far.

    Attributes:
        sent: Requests, repeated ones included.
        received: Whole frames with a good checksum.
        repeated: Requests that were sent again.
        lost: Requests that the arm did not answer in their turn: they, or the answers to them, were lost.
        timeouts: Calls that failed because no answer came.
        unexpected: Frames that nobody waited for.
        junk_bytes: Bytes that belong to no frame.
        bad_frames: Frames with a wrong checksum.
    """

    sent: int = 0
    received: int = 0
    repeated: int = 0
    lost: int = 0
    timeouts: int = 0
    unexpected: int = 0
    junk_bytes: int = 0
    bad_frames: int = 0
