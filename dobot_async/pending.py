"""Who waits for which reply. Sans-I/O: the clock is passed in, and nothing here waits.

The protocols have no sequence numbers, so a reply is matched by its key (the command's ID), by its layout, and by its
place in line: replies of one key come in the order of their requests.

    expect --> WAITING --reply--> answered ------------.
                  |                                    |  requests sent more often than answered
                  `--timeout, cancellation----------> TOMBSTONE --reply, or in time--> gone

A tombstone stands in line for the replies that requests are still owed, and swallows them. Without it a late reply
would answer the next request of its key with wrong data; with it, at the worst, a good reply is swallowed in the place
of a lost one and its request is sent again, at once. What is owed is forgotten

- `linger` seconds after its request, if the call was never answered;
- twice as long after its request as the peer was last silent, if the call was answered by another one of its requests;
  but the last one owed in each line stands for `linger` seconds.

So a single reply may be late by up to `linger` seconds, and any number may be late together, as when the peer pauses,
and still none answers a later request. A link that loses much costs each call some requests more, not ever more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from typing import Any, Generic, Protocol, Self, TypeVar

from dobot_async.errors import ProtocolError

__all__ = ["LINGER", "SWALLOWED", "Keyed", "Pending", "Waiter"]

LINGER = 3.0
LEAST_SILENCE = 0.05
SWALLOWED = object()
"""Delivered instead of a reply when a tombstone has swallowed what may have been it."""


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
        self._silence = LEAST_SILENCE
        self._silence_ended = -math.inf
        self._silent_since: float | None = None
        self._lines: dict[Hashable, list[Waiter[F]]] = {}

    def expect(
        self, key: Hashable, accept: Callable[[F], Any], *, repeatable: bool = False, tombstone: bool = True
    ) -> Waiter[F]:
        """Returns a waiter, to be entered as a context manager before its request is sent.

        Args:
            key: The key of the reply.
            accept: Returns the reply's value, or raises ProtocolError if the frame cannot be the reply.
            repeatable: Its request may be sent again: it wants to hear when a tombstone has swallowed a reply.
            tombstone: False where `accept` can tell a late reply from the right one by its content.
        """
        return Waiter(self, key, accept, repeatable=repeatable, tombstone=tombstone)

    def resolve(self, frame: F) -> bool:
        """Gives a frame to the first in its line whom it fits; False if nobody waits for it."""
        self._hear()
        line = self._line(frame.key)
        for place, waiter in enumerate(line):
            if not waiter.owed:
                continue

            try:
                value = waiter.accept(frame)
            except ProtocolError as error:
                waiter.misfit = error
                continue

            if waiter.deliver:
                self._answer(waiter, value)
            else:
                waiter.owed.pop(0)
                for later in line[place + 1 :]:
                    later.nudge()

            if not waiter.owed:
                line.remove(waiter)

            break
        else:
            return False

        if not any(waiter.deliver for others in self._lines.values() for waiter in others):
            self._silent_since = None

        return True

    def fail(self, error: Exception) -> None:
        """Delivers an error to everybody who still waits, and forgets all lines."""
        lines, self._lines = self._lines, {}
        for line in lines.values():
            for waiter in line:
                waiter.answer(error)

    def __len__(self) -> int:
        """How many wait, tombstones included."""
        return sum(len(self._line(key)) for key in list(self._lines))

    def enter(self, waiter: Waiter[F]) -> None:
        """Puts a waiter at the end of its line, unless it still stands there."""
        line = self._lines.setdefault(waiter.key, [])
        if waiter not in line:
            line.append(waiter)

    def leave(self, waiter: Waiter[F]) -> None:
        """Takes a waiter out of its line, or leaves it there as a tombstone while replies are owed to it."""
        waiter.deliver = None
        line = self._line(waiter.key)
        if not waiter.tombstone and waiter in line:
            line.remove(waiter)

        if not line:
            self._lines.pop(waiter.key, None)

    def asked(self) -> None:
        """Notes that a request goes out now: from here on the peer is silent."""
        if self._silent_since is None:
            self._silent_since = self.clock()

    def _hear(self) -> None:
        """Measures the silence that a frame ends. It stands for the burst of frames that it has held back as well."""
        now = self.clock()
        silence = 0.0 if self._silent_since is None else now - self._silent_since
        if silence > LEAST_SILENCE:
            self._silence, self._silence_ended = silence, now
        elif now > self._silence_ended + self._silence:
            self._silence = LEAST_SILENCE

        self._silent_since = now

    def _answer(self, waiter: Waiter[F], value: Any) -> None:
        """Delivers a reply, and settles how long the others are awaited that its requests are owed."""
        waiter.owed.pop(0)
        if waiter.owed:
            for other in self._lines[waiter.key]:
                if other is not waiter and other.owed:
                    other.owed[-1] = min(other.owed[-1], other.soon)

            late, at_least = min(2 * self._silence, self.linger), self.clock() + 2 * LEAST_SILENCE
            soon = [max(sent + late, at_least) for sent in waiter.sends[-len(waiter.owed) :]]
            waiter.owed, waiter.soon = [*soon[:-1], max(soon[-1], waiter.owed[-1])], soon[-1]

        waiter.answer(value)

    def _line(self, key: Hashable) -> list[Waiter[F]]:
        """The line of a key, after what is no longer owed was taken out of it."""
        line = self._lines.get(key, [])
        now = self.clock()
        if any(waiter.owed and min(waiter.owed) <= now for waiter in line):
            for waiter in line:
                waiter.owed = [until for until in waiter.owed if waiter.deliver or until > now]

            line[:] = [waiter for waiter in line if waiter.owed or waiter.deliver]

        return line


class Waiter(Generic[F]):
    """One call's place in its line; a context manager, so that no way out forgets it.

    Attributes:
        sends: When its requests were sent.
        owed: For each reply that is still to come, until when it is awaited.
        soon: Until when the last one of an answered call is awaited, once there is another in its line.
        misfit: Why the last frame of this key could not be the reply, if one came.
    """

    __slots__ = (
        "accept",
        "deliver",
        "key",
        "misfit",
        "owed",
        "pending",
        "repeatable",
        "sends",
        "soon",
        "tombstone",
    )

    def __init__(
        self,
        pending: Pending[F],
        key: Hashable,
        accept: Callable[[F], Any],
        *,
        repeatable: bool,
        tombstone: bool,
    ) -> None:
        self.repeatable = repeatable
        self.pending = pending
        self.key = key
        self.accept = accept
        self.tombstone = tombstone
        self.deliver: Callable[[Any], None] | None = None
        self.misfit: ProtocolError | None = None
        self.sends: list[float] = []
        self.owed: list[float] = []
        self.soon = math.inf

    def listen(self, deliver: Callable[[Any], None]) -> None:
        """Says who is to hear of the reply; called once for each request that is sent, before `sent`."""
        self.deliver = deliver
        self.pending.enter(self)  # a reply may have come and missed the one who listened before

    def sent(self) -> None:
        """Notes that the request goes out now, for the first time or again."""
        now = self.pending.clock()
        self.pending.asked()
        self.sends.append(now)
        self.owed.append(now + self.pending.linger)

    def answer(self, value: Any) -> None:
        """Delivers a reply, or an error, to who listens."""
        deliver, self.deliver = self.deliver, None
        if deliver:
            deliver(value)

    def nudge(self) -> None:
        """Tells who listens that the reply may have been swallowed: the request may be sent again at once."""
        if self.deliver and self.repeatable:
            deliver, self.deliver = self.deliver, None
            deliver(SWALLOWED)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.pending.leave(self)
