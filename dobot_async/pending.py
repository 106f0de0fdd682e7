"""Who waits for which reply. Sans-I/O: the clock is passed in, and nothing here waits.

The protocols have no sequence numbers, so a reply is matched by its key (the command's ID), by its layout, and by its
place in line: replies come in the order of their requests.

    expect --> WAITING --reply--> answered ------------.
                  |                                    |  requests sent more often than answered
                  `--timeout, cancellation----------> TOMBSTONE --reply, or in time--> gone

A tombstone stands in line for the replies that requests are still owed, and swallows them. Without it a late reply
would answer the next request of its key with wrong data; with it, at the worst, a good reply is swallowed in the place
of a lost one and its request is sent again, at once. What is owed ends

- when a request that was sent later, of whatever key, is answered: replies come in order, so this one was lost. But it
  may yet be a straggler, that came to be late alone: it is recognised for `linger` seconds;
- `linger` seconds after its request; a peer that has just shown that it pauses for longer is given twice as long.

Where a straggler may come, a call can `hold` its replies until something that was asked behind it is answered: one by
then is the right one, of two nothing tells which is.

So any number of replies may be late, together, as when the peer pauses, or alone, and still none answers a later
request. On a link with `disorder` "later" means later by that much, of each key only the last straggler is recognised,
and a reply so close behind another of its key that it may be a second copy answers nobody.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from itertools import count
from typing import Any, Generic, Protocol, Self, TypeVar

from dobot_async.errors import ProtocolError

__all__ = ["LINGER", "SWALLOWED", "Keyed", "Pending", "Waiter"]

LINGER = 3.0
SWALLOWED = object()
"""Delivered instead of a reply when a tombstone has swallowed what may have been it."""


class Keyed(Protocol):
    """What the family's parser makes: an answer, with the key that says which requests it can belong to."""

    @property
    def key(self) -> Hashable:
        """What requests and replies are matched by."""


F = TypeVar("F", bound=Keyed)


@dataclass(slots=True, eq=False)
class Sent(Generic[F]):
    """A request that went out, and the reply that it is owed.

    Attributes:
        waiter: Whose it is, or was.
        number: Of all that went out.
        at: When it did.
        until: Until when its reply may come in its turn.
        straggles: Until when it may come alone, behind those of later requests.
        passed: From when on it can come in no other way.
        succeeds: Whether a straggler may come in its place: which of two that could come first has come is not known.
    """

    waiter: Waiter[F]
    number: int
    at: float
    until: float
    straggles: float
    passed: float = math.inf
    succeeds: bool = False


class Pending(Generic[F]):
    """Everybody who waits for a reply on one link.

    Args:
        clock: Returns seconds.
        linger: Seconds for which a reply may be late and is still recognised.
        disorder: Returns the seconds within which messages may overtake one another, and a doubled one arrive again.
    """

    def __init__(
        self, clock: Callable[[], float], linger: float = LINGER, disorder: Callable[[], float] = lambda: 0.0
    ) -> None:
        self.clock = clock
        self.linger = linger
        self._disorder = disorder
        self._numbers = count()
        self._heard: dict[Hashable, float] = {}
        self._lines: dict[Hashable, list[Sent[F]]] = {}

    def expect(
        self,
        key: Hashable,
        accept: Callable[[F], Any],
        *,
        echo: Hashable = None,
        repeatable: bool = False,
        lenient: bool = False,
        tombstone: bool = True,
    ) -> Waiter[F]:
        """Returns a waiter, to be entered as a context manager before its request is sent.

        Args:
            key: The key of the reply.
            accept: Returns the reply's value, or raises ProtocolError if the frame cannot be the reply.
            echo: What `accept` looks for in the reply, by which it tells it from those to other requests of its key.
            repeatable: Its request may be sent again: it wants to hear when a tombstone has swallowed a reply.
            lenient: It may be answered by a straggler: nothing is swallowed for fear of one.
            tombstone: False where `accept` can tell a late or doubled reply from the right one by its content.
        """
        return Waiter(self, key, accept, echo=echo, repeatable=repeatable, lenient=lenient, tombstone=tombstone)

    def resolve(self, frame: F) -> bool:
        """Gives a frame to the first in its line whom it fits; False if nobody waits for it."""
        now = self.clock()
        doubled = self._disorder() > 0 and now < self.calm_at(frame.key)
        line = self.line(frame.key)
        found = self._find(line, frame, now, doubled=doubled)
        if found or not doubled:
            self._heard[frame.key] = now

        if found is None:
            return False

        place, value = found
        sent, waiter = line[place], line[place].waiter
        if waiter.held is not None:
            waiter.held.append(value)
            return True

        self._take(line, place)
        if waiter.tombstone:
            self._pass(sent)

        if waiter.deliver:
            waiter.answer(value)
        else:
            # It may have been the reply to what was asked behind; but not if it comes in its turn before a fence does.
            for other in {later.waiter for later in line[place:]}:
                if sent.passed <= now or not other.fenced:
                    other.nudge()

        if not line:
            self._lines.pop(frame.key, None)

        return True

    def fail(self, error: Exception) -> None:
        """Delivers an error to everybody who still waits, and forgets all lines."""
        lines, self._lines = self._lines, {}
        for line in lines.values():
            for sent in line:
                sent.waiter.answer(error)

    def owed(self, key: Hashable, *, but: Waiter[F] | None = None) -> float | None:
        """When the last request of a key, but for one call's, was sent whose reply may still come in its turn."""
        if key not in self._lines:
            return None

        now = self.clock()
        return max((sent.at for sent in self.line(key) if sent.passed > now and sent.waiter is not but), default=None)

    def haunted(self, waiter: Waiter[F]) -> bool:
        """Whether a straggler may come that would pass for the reply to a call."""
        return any(sent.waiter is not waiter or sent.succeeds for sent in self.line(waiter.key))

    def line(self, key: Hashable) -> list[Sent[F]]:
        """The line of a key, after what is no longer owed was taken out of it."""
        line = self._lines.get(key)
        if line is None:
            return []

        if len(line) == 1 and line[0].waiter.deliver:
            return line  # as it nearly always is

        if any(not sent.waiter.deliver for sent in line):
            now = self.clock()
            latest = {sent.waiter.echo: sent for sent in line if sent.passed <= now and not sent.waiter.deliver}
            line[:] = [sent for sent in line if sent.waiter.deliver or self._stands(sent, now, latest)]

        if not line:
            del self._lines[key]

        return line

    def calm_at(self, key: Hashable) -> float:
        """From when on no reply of a key can be the second copy of one that was heard.

        Either the request or its reply may have been doubled on the way, so it takes the disorder of both ways.
        """
        return self._heard.get(key, -math.inf) + 2 * self._disorder()

    def __len__(self) -> int:
        """How many replies are awaited, those of tombstones included."""
        return sum(len(self.line(key)) for key in list(self._lines))

    def enter(self, waiter: Waiter[F]) -> None:
        """A request goes out now; its reply is awaited behind those of its key that went out before."""
        for other in {sent.waiter for sent in self._lines.get(waiter.key, ())} - {waiter}:
            other.give_up()  # a reply to this one would count for it: nothing can be proven any more

        now = self.clock()
        until = now + self.linger
        sent = Sent(waiter, next(self._numbers), now, until, until)
        self._lines.setdefault(waiter.key, []).append(sent)

    def leave(self, waiter: Waiter[F]) -> None:
        """Nobody waits any more; what is owed stays in line, if it needs to."""
        waiter.give_up()
        waiter.deliver = None
        line = self._lines.get(waiter.key)
        if line is None:
            return

        if not waiter.tombstone:
            line[:] = [sent for sent in line if sent.waiter is not waiter]

        if not line:
            del self._lines[waiter.key]

    def _find(self, line: list[Sent[F]], frame: F, now: float, *, doubled: bool) -> tuple[int, Any] | None:
        """Returns whose place in the line a frame fits, and what it means."""
        excused = len(line) > 1 and any(
            sent.waiter.deliver and (sent.waiter.lenient or sent.waiter.held is not None) for sent in line
        )
        for place, sent in enumerate(line):
            waiter = sent.waiter
            if waiter.tombstone and (doubled or (excused and sent.passed <= now and not waiter.deliver)):
                continue

            try:
                return place, waiter.accept(frame)
            except ProtocolError as error:
                waiter.misfit = error

        return None

    def proven(self, waiter: Waiter[F], held: list[Any]) -> None:
        """What was asked behind a call's last request is answered: what has come is its reply, or a straggler."""
        line = self.line(waiter.key)
        place = max((place for place, sent in enumerate(line) if sent.waiter is waiter), default=None)
        if len(held) == 1 and place is not None:
            self._pass(line.pop(place))
            waiter.answer(held[0])
            return

        self.unproven(waiter, held)
        waiter.nudge()

    def unproven(self, waiter: Waiter[F], held: list[Any]) -> None:
        """Replies have come, and nothing tells to which requests: to those sent first, for all that is known."""
        line = self.line(waiter.key)
        for _ in held:
            if line:
                self._take(line, 0, provable=True)

    def _take(self, line: list[Sent[F]], place: int, *, provable: bool = False) -> None:
        """Takes a reply's place out of its line.

        If nothing but a straggler could come there, either it has come, or the reply was that of one which is awaited
        in its turn, and the straggler may yet come in the next one's place. That is awaited for its own time where the
        next reply is proven to be one or the other, and else no longer than the straggler, or it would never end.
        """
        taken, now = line.pop(place), self.clock()
        if place < len(line) and (taken.succeeds or taken.passed <= now):
            heir = line[place]
            heir.succeeds = True
            if not provable and any(sent.passed > now for sent in line[place:]):
                heir.straggles = min(heir.straggles, taken.straggles)

    def _pass(self, answered: Sent[F]) -> None:
        """What was sent before something that is answered now was answered, or lost; the rest may be as late."""
        disorder, now = self._disorder(), self.clock()
        passed, late = now + disorder, 2 * (now - answered.at) if answered.waiter.deliver else 0.0
        for line in self._lines.values():
            for sent in line:
                sent.until = max(sent.until, min(sent.at + late, now + self.linger))
                if sent.number < answered.number and sent.at <= answered.at - disorder:
                    sent.passed = min(sent.passed, passed)

    def _stands(self, sent: Sent[F], now: float, latest: dict[Hashable, Sent[F]]) -> bool:
        """Whether a tombstone is still needed."""
        if sent.passed > now:
            return sent.until > now

        # Where much is lost and nothing is proven, to wait for more than the latest would cost each call a reply more.
        return sent.straggles > now and (not self._disorder() or sent is latest[sent.waiter.echo])


class Waiter(Generic[F]):
    """One call's place in its line; a context manager, so that no way out forgets it.

    Attributes:
        sends: When its requests were sent.
        fenced: Whether something else was asked before its request, because replies of its key were owed.
        held: Replies that are kept back until it is proven that none of them is a straggler; None if that is not done.
        misfit: Why the last frame of this key could not be the reply, if one came.
    """

    __slots__ = (
        "accept",
        "deliver",
        "echo",
        "fenced",
        "held",
        "key",
        "lenient",
        "misfit",
        "pending",
        "repeatable",
        "sends",
        "tombstone",
    )

    def __init__(
        self,
        pending: Pending[F],
        key: Hashable,
        accept: Callable[[F], Any],
        *,
        echo: Hashable,
        repeatable: bool,
        lenient: bool,
        tombstone: bool,
    ) -> None:
        self.echo = echo
        self.repeatable = repeatable
        self.lenient = lenient
        self.pending = pending
        self.key = key
        self.accept = accept
        self.tombstone = tombstone
        self.deliver: Callable[[Any], None] | None = None
        self.fenced = False
        self.held: list[Any] | None = None
        self.misfit: ProtocolError | None = None
        self.sends: list[float] = []

    def listen(self, deliver: Callable[[Any], None]) -> None:
        """Says who is to hear of the reply; called once for each request that is sent, before `sent`."""
        self.deliver = deliver

    def sent(self) -> None:
        """Notes that the request goes out now, for the first time or again."""
        self.sends.append(self.pending.clock())
        self.pending.enter(self)

    def hold(self) -> None:
        """From now on replies are kept back, until `prove` or `give_up`."""
        self.held = []

    def prove(self, _: object = None) -> None:
        """What was asked behind the last request is answered: a single reply that was kept back is the right one."""
        held, self.held = self.held, None
        if held is not None:
            self.pending.proven(self, held)

    def give_up(self) -> None:
        """What was asked behind the last request is not answered in time."""
        held, self.held = self.held, None
        if held:
            self.pending.unproven(self, held)

    def answer(self, value: Any) -> None:
        """Delivers a reply, or an error, to who listens."""
        deliver, self.deliver = self.deliver, None
        if deliver:
            deliver(value)

    def nudge(self) -> None:
        """Tells who listens that the reply may have been swallowed: the request may be sent again at once."""
        if self.repeatable:
            self.answer(SWALLOWED)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.pending.leave(self)
