"""Who holds which zones, who waits for them, and who waits for whom elsewhere.

No I/O and no clock: each claim is told its answer by a call.

    request --> waiting --free of others, nobody before it--> granted --> release
                   |
                   `--> ZoneDeadlock, ZoneOccupied, or whatever `fail` says

A claim is for one or several zones, all of which it gets at once. Claims on the same zone are granted in the order of
their requests. There is one exception: a claim passes an earlier one that waits, directly or not, for the party that
asks, for that one would otherwise wait for itself. A cycle of waits that is left is a deadlock, and who closes it is
told so. An arm that still moves may yet leave a zone by itself; whether it does shows when it stands. So all claims are
judged anew when an arm comes to rest, as when something is released, also if it does not tell where it stands.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import chain

from dobot_async.errors import DobotError
from dobot_async.fleet.errors import ZoneDeadlock, ZoneOccupied

__all__ = ["ProgramWait", "ZoneHolder", "ZoneLocks", "ZoneRequest"]


@dataclass(eq=False, slots=True)
class ZoneHolder:
    """Somebody who can hold a zone: an arm, or a program.

    Attributes:
        name: For messages.
        failure: Why it will not leave what it holds; None while all is well.
        inside: The zones that it is known to be in, whoever else holds them: it may go on in them.
        moving: Tells whether it may leave what it holds without being told to.
    """

    name: str
    failure: DobotError | None = None
    inside: frozenset[str] = frozenset()
    moving: Callable[[], bool] = field(default=lambda: False)


@dataclass(eq=False, slots=True)
class ZoneRequest:
    """A wish for zones, and the hold on them once it is granted.

    Attributes:
        party: Who holds the zones then.
        own: The parties that do not stand in its way: itself, and those that it acts for.
        zones: What it is for.
        answer: Called once: with None when it is granted, with the error when it never will be.
        patient: False gives it an error where it would have to wait.
        stuck: The parties that release nothing as long as it waits: its own, and the arms that wait for its command.
        asker: Who goes on when it is answered; by default `party`.
        movers: The arms that move when it is granted, whose stop ends it; by default `party`.
        parked: Tells of an arm that stands whether nobody is left who would move it.
    """

    party: ZoneHolder
    own: frozenset[ZoneHolder]
    zones: frozenset[str]
    answer: Callable[[DobotError | None], None] = field(default=lambda _: None)
    patient: bool = True
    stuck: frozenset[ZoneHolder] = frozenset()
    asker: ZoneHolder | None = None
    movers: frozenset[ZoneHolder] = frozenset()
    parked: Callable[[ZoneHolder], bool] = field(default=lambda _: False)

    def __post_init__(self) -> None:
        self.stuck |= self.own
        self.asker = self.asker or self.party
        self.movers = self.movers or frozenset([self.party])


@dataclass(eq=False, slots=True)
class ProgramWait:
    """A program's wait for others to do something: to come to a barrier, or to let it command an arm.

    Attributes:
        what: For messages, up to the name of who is awaited.
        asker: Who waits.
        stuck: The parties that release nothing as long as it waits.
        awaited: Tells who is still to do it.
    """

    what: str
    asker: ZoneHolder
    stuck: frozenset[ZoneHolder]
    awaited: Callable[[], Collection[ZoneHolder]]


Wait = ZoneRequest | ProgramWait
Obstacle = tuple[Callable[[Wait], bool], str]
"""What keeps a wait from ending: whether another wait has to end before, and the words for it."""


class ZoneLocks:
    """All claims of one cell."""

    def __init__(self) -> None:
        self._held: list[ZoneRequest] = []
        self._waiting: list[ZoneRequest] = []
        self._prepared: list[ZoneRequest] = []
        self._pauses: list[ProgramWait] = []

    @property
    def held(self) -> list[ZoneRequest]:
        """The claims that are granted, oldest first."""
        return list(self._held)

    @property
    def waiting(self) -> list[ZoneRequest]:
        """The claims that wait, oldest first."""
        return list(self._waiting)

    def holders(self, zone: str) -> list[ZoneHolder]:
        """Returns who holds a zone."""
        return list(dict.fromkeys(claim.party for claim in self._held if zone in claim.zones))

    @contextmanager
    def preparing(self, claim: ZoneRequest) -> Generator[None]:
        """While this is entered, a claim is not judged yet, but ended as one that waits."""
        self._prepared.append(claim)
        try:
            yield
        finally:
            self._prepared.remove(claim)

    def request(self, claim: ZoneRequest) -> None:
        """Enters a claim; it may be answered before this returns."""
        self._waiting.append(claim)
        self.settle()
        if not claim.patient and claim in self._waiting:
            self._waiting.remove(claim)
            claim.answer(ZoneOccupied(f"{claim.party.name} may not pass: {self._reason(claim)}"))

    @contextmanager
    def pausing(self, pause: ProgramWait) -> Generator[None]:
        """While this is entered, a program waits for others; raises ZoneDeadlock if it would do so for ever."""
        cycle = self._cycle(pause)
        if cycle:
            raise deadlock(cycle)

        self._pauses.append(pause)
        self.settle()
        try:
            yield
        finally:
            self._pauses.remove(pause)

    def take(self, claim: ZoneRequest) -> None:
        """Grants a claim to who is in the zones already, whoever else holds them."""
        self._held.append(claim)
        self.settle()

    def release(self, claim: ZoneRequest) -> None:
        """Gives back all zones of a claim, which is withdrawn if it waits."""
        if claim in self._waiting:
            self._waiting.remove(claim)
            self.settle()
        else:
            self.keep([claim], frozenset())

    def keep(self, claims: Collection[ZoneRequest], zones: frozenset[str]) -> None:
        """Gives back all that several claims hold but some zones. What is not held does not matter."""
        for claim in [claim for claim in claims if claim in self._held]:
            claim.zones &= zones
            if not claim.zones:
                self._held.remove(claim)

        self.settle()

    def fail(self, parties: Collection[ZoneHolder], error: DobotError) -> None:
        """Ends the waiting of all that act for one of these parties."""
        self._end(lambda claim: not claim.stuck.isdisjoint(parties), error)

    def interrupt(self, party: ZoneHolder, error: DobotError) -> None:
        """Ends the waiting for what one party is to move by; not that of programs which act for it."""
        self._end(lambda claim: party in claim.movers, error)

    def stop(self, error: DobotError) -> None:
        """Ends all waiting."""
        self._end(lambda _: True, error)

    def settle(self) -> None:
        """Answers all that can be answered; to be called when a party has failed or come to rest."""
        while True:
            found = next((claim for claim in self._waiting if self._free(claim) and self._next(claim)), None)
            if found:
                self._waiting.remove(found)
                self._held.append(found)
                found.answer(None)
                continue

            refused = next(self._hopeless(), None)
            if refused is None:
                return

            claim, error = refused
            self._waiting.remove(claim)
            claim.answer(error)

    def _end(self, concerned: Callable[[ZoneRequest], bool], error: DobotError) -> None:
        """Ends the waiting of some claims."""
        for claim in filter(concerned, (*self._waiting, *self._prepared)):
            if claim in self._waiting:
                self._waiting.remove(claim)

            claim.answer(error)

        self.settle()

    def _foreign(self, claim: ZoneRequest) -> Iterator[tuple[ZoneHolder, str]]:
        """Who stands in the way of a claim, and in which zone; who is in a zone may move in it, even beside others.

        To hold it is not enough: who only may be in a zone, beside another one who only may be there, could meet it.
        """
        for each in self._held:
            if each.party not in claim.own:
                for zone in sorted(each.zones & claim.zones - claim.party.inside):
                    yield each.party, zone

    def _free(self, claim: ZoneRequest) -> bool:
        return next(self._foreign(claim), None) is None

    def _next(self, claim: ZoneRequest) -> bool:
        """Whether no earlier claim has a better right."""
        return all(claim in self._behind(earlier) for earlier in self._before(claim))

    def _before(self, claim: ZoneRequest) -> list[ZoneRequest]:
        """The earlier claims on the same zones that still wait."""
        earlier = self._waiting[: self._waiting.index(claim)]
        return [each for each in earlier if not each.zones.isdisjoint(claim.zones)]

    def _behind(self, claim: ZoneRequest) -> set[Wait]:
        """All that a claim waits for, directly or not."""
        found: set[Wait] = set()
        todo: list[Wait] = [claim]
        while todo:
            each = todo.pop()
            ends_before = [self._held_up(obstacle) for obstacle, _ in self._obstacles(each)]
            earlier = self._before(each) if isinstance(each, ZoneRequest) else []
            for other in (*chain.from_iterable(ends_before), *earlier):
                if other not in found:
                    found.add(other)
                    todo.append(other)

        return found

    def _obstacles(self, wait: Wait) -> Iterator[Obstacle]:
        """What keeps a wait from ending."""
        if isinstance(wait, ProgramWait):
            for party in wait.awaited():
                yield partial(keeps_away, party), f"{wait.what} {party.name}"
        else:
            for party, zone in self._foreign(wait):
                yield partial(keeps_in, party), f"for zone {zone}, which {party.name} holds"

    def _held_up(self, obstacle: Callable[[Wait], bool]) -> list[Wait]:
        """The waits that have to end before an obstacle goes."""
        waits: list[Wait] = [*self._waiting, *self._pauses]
        return [wait for wait in waits if obstacle(wait)]

    def _hopeless(self) -> Iterator[tuple[ZoneRequest, DobotError]]:
        """Claims that wait for somebody who has failed, for an arm that nobody moves any more, or for themselves."""
        for claim in reversed(self._waiting):
            for party, zone in self._foreign(claim):
                if party.failure:
                    failed = f"{party.name} has failed, and may still be in zone {zone}: {party.failure}"
                    yield claim, ZoneOccupied(failed)
                elif not party.moving() and claim.parked(party):
                    yield claim, ZoneOccupied(f"{party.name} is in zone {zone}, and no program is left that moves it")

            cycle = self._cycle(claim) if claim.patient else []
            if cycle:
                yield claim, deadlock(cycle)

    def _cycle(self, start: Wait) -> list[str]:
        """The waits that lead from one back to itself, in words; empty if they do not."""
        ways: list[tuple[Wait, list[str]]] = [(start, [])]
        seen: set[Wait] = set()
        while ways:
            each, words = ways.pop(0)
            who = each.party if isinstance(each, ZoneRequest) else each.asker
            for obstacle, why in self._obstacles(each):
                told = [*words, f"{who.name} waits {why}"]
                if obstacle(start):
                    return told

                for other in self._held_up(obstacle):
                    if other not in seen:
                        seen.add(other)
                        ways.append((other, told))

        return []

    def _reason(self, claim: ZoneRequest) -> str:
        """Why a claim has to wait, in words."""
        held = [f"{party.name} holds zone {zone}" for party, zone in self._foreign(claim)]
        return "; ".join(held) or f"others wait for {', '.join(sorted(claim.zones))}"


def keeps_in(party: ZoneHolder, wait: Wait) -> bool:
    """Whether a party that holds a zone leaves it only when a wait has ended."""
    return party in wait.stuck and not party.moving()


def keeps_away(party: ZoneHolder, wait: Wait) -> bool:
    """Whether a party does what is awaited of it only when a wait has ended."""
    return party is wait.asker


def deadlock(cycle: Collection[str]) -> ZoneDeadlock:
    """What to raise for a cycle of waits."""
    return ZoneDeadlock(f"a deadlock: {'; '.join(cycle)}")
