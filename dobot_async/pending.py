"""Who waits for which reply. Sans-I/O: the clock is passed in, and nothing here waits.

The protocols have no sequence numbers, so a reply is matched by its key (the command's ID), by its layout, and by its
place in line: replies of one key come in the order of their requests.

    expect --> WAITING --reply--> answered, and owed no reply more --> gone
                  |                 `--it was repeated, and is still owed one--.
                  `--timeout, cancellation--> TOMBSTONE <----------------------'
                                                  `--replies, or time--> gone

A tombstone stands in line for the replies that a request is still owed, and swallows them. Without it a late reply
would answer the next request of its key with wrong data; with it, at the worst, a good reply is swallowed in the place
of a lost one. Then its request is told to hurry, that is to ask again soon, and is itself owed one reply too many. So
that this debt is not handed on for ever, a request that was answered and repeated only shortly before asks for `quiet`:
the next of its key waits for that long, and what has not come by then counts as lost.

Outside of this promise are a reply later than `linger` seconds after its request, and one that comes more than `SPREAD`
seconds later than the replies to the same request's other repetitions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable
from typing import Any, Generic, Protocol, Self, TypeVar

from dobot_async.errors import ProtocolError

__all__ = ["LINGER", "Keyed", "Pending", "Waiter"]

LINGER = 3.0
SPREAD = 0.2
QUIET_LIMIT = 0.5  # who would need more quiet than this leaves a tombstone instead


class Keyed(Protocol):
    """What the family's parser makes: an answer, with the key that says which requests it can belong to."""

    @property
    def key(self) -> Hashable:
        """What requests and replies are matched by."""


F = TypeVar("F", bound=Keyed)


class Pending(Generic[F]):
    """Everybody who waits for a reply on one link.

    Args:
        clock: Returns seconds.
        linger: Seconds for which a reply may be late and is still recognised.
    """

    def __init__(self, clock: Callable[[], float], linger: float = LINGER) -> None:
        self.clock = clock
        self.linger = linger
        self._lines: dict[Hashable, list[Waiter[F]]] = {}

    def expect(self, key: Hashable, accept: Callable[[F], Any], *, tombstone: bool = True) -> Waiter[F]:
        """Returns a waiter, to be entered as a context manager before its request is sent.

        Args:
            key: The key of the reply.
            accept: Returns the reply's value, or raises ProtocolError if the frame cannot be the reply.
            tombstone: False where `accept` can tell a late reply from the right one by its content.
        """
        return Waiter(self, key, accept, tombstone=tombstone)

    def resolve(self, frame: F) -> bool:
        """Gives a frame to the first in its line whom it fits; False if nobody waits for it."""
        line = self._line(frame.key)
        for place, waiter in enumerate(line):
            if waiter.owed <= 0:
                continue

            try:
                value = waiter.accept(frame)
            except ProtocolError as error:
                waiter.misfit = error
                continue

            waiter.owed -= 1
            if waiter.deliver:
                waiter.answer(value)
            else:
                hurry_first(line[place + 1 :])
                if waiter.owed <= 0:
                    self._remove(waiter)

            return True

        return False

    def fail(self, error: Exception) -> None:
        """Delivers an error to everybody who still waits, and forgets all lines."""
        lines, self._lines = self._lines, {}
        for line in lines.values():
            for waiter in line:
                waiter.owed = 0
                waiter.answer(error)

    def __len__(self) -> int:
        """How many wait, tombstones included."""
        return sum(len(self._line(key)) for key in list(self._lines))

    def enter(self, waiter: Waiter[F]) -> None:
        """Puts a waiter at the end of its line."""
        self._lines.setdefault(waiter.key, []).append(waiter)

    def leave(self, waiter: Waiter[F]) -> None:
        """Takes a waiter out of its line, or leaves it there as a tombstone while replies are owed to it."""
        waiter.deliver = waiter.hurry = None
        if not (waiter.tombstone and waiter.owed > 0):
            self._remove(waiter)
            return

        needed = waiter.sent_at - waiter.first_sent_at + SPREAD
        if waiter.answered and needed <= QUIET_LIMIT:
            waiter.quiet = needed
            waiter.expires_at = self.clock() + needed
        else:
            waiter.expires_at = waiter.sent_at + self.linger

    def _line(self, key: Hashable) -> list[Waiter[F]]:
        """The line of a key, after the tombstones that have expired were taken out of it."""
        line = self._lines.get(key, [])
        now = self.clock()
        for waiter in [waiter for waiter in line if waiter.expires_at <= now]:
            self._remove(waiter)

        return line

    def _remove(self, waiter: Waiter[F]) -> None:
        line = self._lines.get(waiter.key, [])
        if waiter in line:
            line.remove(waiter)
            if not line:
                del self._lines[waiter.key]


class Waiter(Generic[F]):
    """One request's place in its line; a context manager, so that no way out forgets it.

    Attributes:
        owed: Requests sent less replies received.
        misfit: Why the last frame of this key could not be the reply, if one came.
        hurry: Called when a reply was swallowed that may have been this waiter's.
        quiet: Once it has left, seconds for which no request of this key is to be sent.
    """

    __slots__ = (
        "accept",
        "answered",
        "deliver",
        "expires_at",
        "first_sent_at",
        "hurry",
        "key",
        "misfit",
        "owed",
        "pending",
        "quiet",
        "sent_at",
        "tombstone",
    )

    def __init__(self, pending: Pending[F], key: Hashable, accept: Callable[[F], Any], *, tombstone: bool) -> None:
        self.pending = pending
        self.key = key
        self.accept = accept
        self.tombstone = tombstone
        self.deliver: Callable[[Any], None] | None = None
        self.hurry: Callable[[], None] | None = None
        self.misfit: ProtocolError | None = None
        self.answered = False
        self.owed = 0
        self.quiet = 0.0
        self.first_sent_at = self.sent_at = -math.inf
        self.expires_at = math.inf

    @property
    def repeats(self) -> bool:
        """Whether its request was sent already."""
        return self.sent_at > -math.inf

    def listen(self, deliver: Callable[[Any], None]) -> None:
        """Says who is to hear of the reply; called once for each request that is sent, before `sent`."""
        self.deliver = deliver
        self.hurry = None
        self.answered = False

    def sent(self) -> None:
        """Notes that the request goes out now, for the first time or again."""
        now = self.pending.clock()
        if not self.repeats:
            self.first_sent_at = now

        self.sent_at = now
        self.owed += 1

    def answer(self, value: Any) -> None:
        """Delivers a reply, or an error, to who listens."""
        deliver, self.deliver = self.deliver, None
        if deliver:
            self.answered = True
            deliver(value)

    def __enter__(self) -> Self:
        self.pending.enter(self)
        return self

    def __exit__(self, *_: object) -> None:
        self.pending.leave(self)


def hurry_first(line: Iterable[Waiter[Any]]) -> None:
    """Tells the first who still waits that a reply was swallowed."""
    for waiter in line:
        if waiter.deliver:
            if waiter.hurry:
                waiter.hurry()

            return
