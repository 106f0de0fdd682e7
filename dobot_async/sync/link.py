"""A connection, for programs without asyncio."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

from dobot_async import ConnectionLost, LinkState, LinkStats
from dobot_async import Link as AsyncLink
from dobot_async._core.protocol.contract import LineLimits
from dobot_async._core.util.events import Events as AsyncEvents
from dobot_async._core.util.events import Watched as AsyncWatched
from dobot_async._core.util.hooks import Hooks
from dobot_async.sync.twin import Items, Twin, same

__all__ = ["Events", "Link", "Watched"]

T = TypeVar("T")


class Events(Twin[AsyncEvents[T]], Generic[T]):
    """Where events are published; iterating listens from now on, and ends when the connection ends."""

    __slots__ = ()

    def __iter__(self) -> Items[T]:
        return Items(lambda: self.asynchronous, same)


class Watched(Twin[AsyncWatched[T]], Generic[T]):
    """A value that changes; iterating yields each new value from now on, and ends when the connection ends."""

    __slots__ = ()

    @property
    def value(self) -> T:
        """What it is now."""
        return self.asynchronous.value

    def __iter__(self) -> Items[T]:
        return Items(lambda: self.asynchronous, same)


class Link(Twin[AsyncLink[Any]]):
    """One connection to one arm: what can be seen of it."""

    __slots__ = ()

    @property
    def url(self) -> str:
        """Where the arm is, without secrets."""
        return self.asynchronous.url

    @property
    def open(self) -> bool:
        """Whether it is open just now."""
        return self.asynchronous.open

    @property
    def outages(self) -> int:
        """How often it was lost and reopened."""
        return self.asynchronous.outages

    @property
    def limits(self) -> LineLimits:
        """What the transport can carry at a time; it may change when the link is reopened."""
        return self.asynchronous.limits

    @property
    def stats(self) -> LinkStats:
        """A snapshot of what went over the link so far."""
        return self.asynchronous.stats

    @property
    def round_trip(self) -> float | None:
        """Seconds that an answer takes on the average; None before the first one."""
        return self.asynchronous.round_trip

    @property
    def state(self) -> Watched[LinkState]:
        """Its `value` says whether it is open, is being reopened, was lost or closed; `for` yields changes."""
        return Watched(self.asynchronous.state)

    @property
    def events(self) -> Events[object]:
        """What happened unasked: frames that answered nothing, as `Unexpected`, and what the family adds."""
        return Events(self.asynchronous.events)

    @property
    def on_frame(self) -> Hooks[[bool, Any]]:
        """Hooks, called with (outgoing, frame) for each frame, in the arms' thread: they must not wait for an arm."""
        return self.asynchronous.on_frame

    @property
    def on_unsolicited(self) -> Hooks[[Any]]:
        """Hooks, called with each frame that answered nothing, in the arms' thread."""
        return self.asynchronous.on_unsolicited

    @property
    def on_lost(self) -> Hooks[[ConnectionLost]]:
        """Hooks, called once with what every later call raises when the link is lost, in the arms' thread."""
        return self.asynchronous.on_lost
