"""Which reply belongs to which request, in protocols without sequence numbers. Sans-I/O: the clock is passed in.

    sent --> outstanding --its reply-------------------------> REPLY
                       `---the reply to one sent later-------> LOST

On a byte stream replies come in the order of their requests, and some never come. Three rules are the whole of it:

1. A reply belongs to the earliest outstanding request of its key that it fits. If it was a later one's, it is only
   fresher.
2. It proves that everything sent before that request will not be answered any more: those requests end as LOST.
3. Nothing else ends a request: no clock, no timeout, no cancellation. One that nobody waits for, an abandoned one,
   stays outstanding.

1 and 3 are the safety: no request is given a reply that was made before it was sent, however long the line stands
still. 2 is the liveness: who finds a request of his key outstanding asks something else (a barrier) and waits for its
answer, which ends everything that was sent before it.

On a link for datagrams two messages may overtake one another, or one arrive twice, within `reorder_window` seconds.
Rule 2 takes effect that much later there, and a frame within twice that time of the last one of its key may be a copy
and answers nobody.

A request may be `held`, for a peer that answers out of order (`stragglers`): its replies are kept, and prove
nothing, until something behind it is answered. One by then is its own; with none, or several, it is LOST. One that
cannot wait for that, a stop, takes its first reply, which `proves` nothing either.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from itertools import count
from typing import Any, Generic, TypeVar

from dobot_async._core.protocol.contract import Frame
from dobot_async.errors import ProtocolError

__all__ = ["Correlator", "Outcome", "Request"]

F = TypeVar("F", bound=Frame)


class Outcome(enum.Enum):
    """How a request ended."""

    REPLY = "reply"
    LOST = "lost"
    FAILED = "failed"


@dataclass(slots=True, eq=False)
class Request(Generic[F]):
    """A request that was sent.

    Attributes:
        key: Of the request, and of its reply.
        accept: Returns the value of a reply, or raises ProtocolError if a frame of the key is not its reply.
        number: Its place among all requests of the link.
        sent_at: When it was sent, in seconds.
        held: The replies that are kept; None if it takes the first one.
        expected: Whether the peer always replies to it.
        proves: Whether its reply shows that what was sent before it will not be answered any more (rule 2).
        outcome: How it ended, None while it is outstanding.
        value: What `accept` made of the reply, or the error that ended the link.
        misfit: Why the last frame of the key was not its reply, if one came.
        gone_at: From when on no reply to it can come.
        wakers: Called when it ends.
    """

    key: Hashable
    accept: Callable[[F], Any]
    number: int
    sent_at: float
    held: list[Any] | None = None
    expected: bool = True
    proves: bool = True
    outcome: Outcome | None = None
    value: Any = None
    misfit: ProtocolError | None = None
    gone_at: float = math.inf
    wakers: list[Callable[[], None]] = field(default_factory=list[Callable[[], None]])

    def end(self, outcome: Outcome, value: Any = None) -> None:
        """Give it its outcome, and wake those who wait for that."""
        self.outcome, self.value = outcome, value
        wakers, self.wakers = self.wakers, []
        for wake in wakers:
            wake()


class Correlator(Generic[F]):
    """All requests of one link that may still be answered.

    Args:
        clock: Returns seconds.
        reorder_window: Returns seconds within which messages may overtake one another, 0 on a stream; may change.
        on_lost: Called with each request that ends as LOST.
    """

    def __init__(
        self, clock: Callable[[], float], reorder_window: Callable[[], float], on_lost: Callable[[Request[F]], None]
    ) -> None:
        self._reorder_window = reorder_window
        self._clock = clock
        self._on_lost = on_lost
        self._numbers = count()
        self._outstanding: list[Request[F]] = []  # in the order in which they were sent
        self._heard_at: dict[Hashable, float] = {}
        self._expires_at = math.inf  # when the first of those is gone that turned out to be lost

    @property
    def reorder_window(self) -> float:
        """Seconds within which messages may overtake one another, and a doubled one arrive again."""
        return self._reorder_window()

    def __len__(self) -> int:
        """How many requests are outstanding, abandoned ones included."""
        return len(self._outstanding)

    def sent(
        self,
        key: Hashable,
        accept: Callable[[F], Any],
        *,
        held: bool = False,
        expected: bool = True,
        proves: bool = True,
    ) -> Request[F]:
        """Note that a request goes out now."""
        kept: list[Any] | None = [] if held else None
        request = Request(key, accept, next(self._numbers), self._clock(), kept, expected, proves and not held)
        self._outstanding.append(request)
        return request

    def resolve(self, frame: F) -> bool:
        """Give a frame to the request that it answers; return False if it answers none."""
        if self.reorder_window and self._clock() < self.calm_at(frame.key):
            return False

        self.expire()
        for place, request in enumerate(self._outstanding):
            if request.key == frame.key:
                try:
                    self._answered(place, request.accept(frame))
                except ProtocolError as error:
                    request.misfit = error
                else:
                    return True

        return False

    def newest(self, key: Hashable) -> Request[F] | None:
        """Return the outstanding request of a key that was sent last."""
        self.expire()
        return next((request for request in reversed(self._outstanding) if request.key == key), None)

    def earliest(self, key: Hashable) -> float:
        """Return the number of the outstanding request of a key that was sent first, infinite if there is none."""
        self.expire()
        return next((request.number for request in self._outstanding if request.key == key), math.inf)

    def calm_at(self, key: Hashable) -> float:
        """Return from when on no frame of a key can be a second copy of one that was heard: either way may double."""
        return self._heard_at.get(key, -math.inf) + 2 * self.reorder_window

    def expire(self) -> None:
        """End what turned out, a reorder window ago, to have been lost."""
        if self._expires_at < math.inf and (now := self._clock()) >= self._expires_at:
            gone = [request for request in self._outstanding if request.gone_at <= now]
            self._outstanding = [request for request in self._outstanding if request.gone_at > now]
            self._expires_at = min((request.gone_at for request in self._outstanding), default=math.inf)
            self._lose(gone)

    def fail(self, error: Exception) -> None:
        """End all requests with the error that ended the link."""
        requests, self._outstanding = self._outstanding, []
        for request in requests:
            request.end(Outcome.FAILED, error)

    def _answered(self, place: int, value: Any) -> None:
        """Apply rule 2, and give the request at a place its reply."""
        request, earlier = self._outstanding[place], self._outstanding[:place]
        if window := self.reorder_window:
            now = self._heard_at[request.key] = self._clock()
            del self._outstanding[place]
            for other in earlier:
                if other.sent_at <= request.sent_at - window:
                    other.gone_at = min(other.gone_at, now + window)
                    self._expires_at = min(self._expires_at, other.gone_at)
        elif request.proves:
            del self._outstanding[: place + 1]
            self._lose(earlier)
        elif request.held is None:
            del self._outstanding[place]

        if request.held is None:
            request.end(Outcome.REPLY, value)
        else:
            request.held.append(value)

    def _lose(self, requests: list[Request[F]]) -> None:
        """End requests that will not be answered any more; a single reply that was held is known to be right now."""
        for request in requests:
            if request.held is not None and len(request.held) == 1:
                request.end(Outcome.REPLY, request.held[0])
            else:
                self._on_lost(request)
                request.end(Outcome.LOST)
