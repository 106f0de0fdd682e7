"""Who holds which zones, who waits for them, and who waits for whom elsewhere.

No I/O and no clock: each request is told its answer by a call.

    request --> waiting --free of others, nobody before it--> granted --> release
                   |
                   `--> ZoneDeadlock, ZoneOccupied, or whatever `fail` says

A request is for one or several zones, and gets all of them at once. Requests for the same zone are granted in their
order, with one exception: a request passes an earlier one that waits, directly or not, for the holder that asks. That
one would otherwise wait for itself. A remaining cycle of waits is a deadlock, and the request that closes it fails. An
arm in motion may still leave a zone by itself; whether it does is known when it rests. So all requests are decided
again when something is released and when an arm comes to rest, even if its pose is not known then.
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
        holder: Who holds the zones then.
        own: The holders that do not stand in its way: itself, and those that it acts for.
        zones: What it is for.
        answer: Called once: with None when it is granted, with the error when it never will be.
        patient: False gives it an error where it would have to wait.
        stuck: The holders that release nothing as long as it waits: its own, and the arms that wait for its command.
        asker: Who goes on when it is answered; by default `holder`.
        movers: The arms that move when it is granted, whose stop ends it; by default `holder`.
        parked: Tells of an arm that stands whether nobody is left who would move it.
    """

    holder: ZoneHolder
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
        self.asker = self.asker or self.holder
        self.movers = self.movers or frozenset([self.holder])


@dataclass(eq=False, slots=True)
class ProgramWait:
    """A program's wait for others to do something: to come to a barrier, or to let it command an arm.

    Attributes:
        what: For messages, up to the name of who is awaited.
        asker: Who waits.
        stuck: The holders that release nothing as long as it waits.
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
    """All requests of one cell."""

    def __init__(self) -> None:
        self._held: list[ZoneRequest] = []
        self._waiting: list[ZoneRequest] = []
        self._prepared: list[ZoneRequest] = []
        self._pauses: list[ProgramWait] = []

    @property
    def held(self) -> list[ZoneRequest]:
        """The requests that are granted, oldest first."""
        return list(self._held)

    @property
    def waiting(self) -> list[ZoneRequest]:
        """The requests that wait, oldest first."""
        return list(self._waiting)

    def holders(self, zone: str) -> list[ZoneHolder]:
        """Returns who holds a zone."""
        return list(dict.fromkeys(request.holder for request in self._held if zone in request.zones))

    @contextmanager
    def preparing(self, request: ZoneRequest) -> Generator[None]:
        """While this is entered, a request is not judged yet, but ended as one that waits."""
        self._prepared.append(request)
        try:
            yield
        finally:
            self._prepared.remove(request)

    def request(self, request: ZoneRequest) -> None:
        """Enters a request; it may be answered before this returns."""
        self._waiting.append(request)
        self.settle()
        if not request.patient and request in self._waiting:
            self._waiting.remove(request)
            request.answer(ZoneOccupied(f"{request.holder.name} may not pass: {self._reason(request)}"))

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

    def take(self, request: ZoneRequest) -> None:
        """Grants a request to who is in the zones already, whoever else holds them."""
        self._held.append(request)
        self.settle()

    def release(self, request: ZoneRequest) -> None:
        """Gives back all zones of a request, which is withdrawn if it waits."""
        if request in self._waiting:
            self._waiting.remove(request)
            self.settle()
        else:
            self.keep([request], frozenset())

    def keep(self, requests: Collection[ZoneRequest], zones: frozenset[str]) -> None:
        """Gives back all that several requests hold but some zones. What is not held does not matter."""
        for request in [request for request in requests if request in self._held]:
            request.zones &= zones
            if not request.zones:
                self._held.remove(request)

        self.settle()

    def fail(self, holders: Collection[ZoneHolder], error: DobotError) -> None:
        """Ends the waiting of all that act for one of these holders."""
        self._end(lambda request: not request.stuck.isdisjoint(holders), error)

    def interrupt(self, holder: ZoneHolder, error: DobotError) -> None:
        """Ends the waiting for what one holder is to move by; not that of programs which act for it."""
        self._end(lambda request: holder in request.movers, error)

    def stop(self, error: DobotError) -> None:
        """Ends all waiting."""
        self._end(lambda _: True, error)

    def settle(self) -> None:
        """Answers all that can be answered; to be called when a holder has failed or come to rest."""
        while True:
            found = next((request for request in self._waiting if self._free(request) and self._next(request)), None)
            if found:
                self._waiting.remove(found)
                self._held.append(found)
                found.answer(None)
                continue

            refused = next(self._hopeless(), None)
            if refused is None:
                return

            request, error = refused
            self._waiting.remove(request)
            request.answer(error)

    def _end(self, concerned: Callable[[ZoneRequest], bool], error: DobotError) -> None:
        """Ends the waiting of some requests."""
        for request in filter(concerned, (*self._waiting, *self._prepared)):
            if request in self._waiting:
                self._waiting.remove(request)

            request.answer(error)

        self.settle()

    def _foreign(self, request: ZoneRequest) -> Iterator[tuple[ZoneHolder, str]]:
        """Who stands in the way of a request, and in which zone; who is in a zone may move in it, even beside others.

        To hold it is not enough: who only may be in a zone, beside another one who only may be there, could meet it.
        """
        for each in self._held:
            if each.holder not in request.own:
                for zone in sorted(each.zones & request.zones - request.holder.inside):
                    yield each.holder, zone

    def _free(self, request: ZoneRequest) -> bool:
        return next(self._foreign(request), None) is None

    def _next(self, request: ZoneRequest) -> bool:
        """Whether no earlier request has a better right."""
        return all(request in self._behind(earlier) for earlier in self._before(request))

    def _before(self, request: ZoneRequest) -> list[ZoneRequest]:
        """The earlier requests on the same zones that still wait."""
        earlier = self._waiting[: self._waiting.index(request)]
        return [each for each in earlier if not each.zones.isdisjoint(request.zones)]

    def _behind(self, request: ZoneRequest) -> set[Wait]:
        """All that a request waits for, directly or not."""
        found: set[Wait] = set()
        todo: list[Wait] = [request]
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
            for holder in wait.awaited():
                yield partial(keeps_away, holder), f"{wait.what} {holder.name}"
        else:
            for holder, zone in self._foreign(wait):
                yield partial(keeps_in, holder), f"for zone {zone}, which {holder.name} holds"

    def _held_up(self, obstacle: Callable[[Wait], bool]) -> list[Wait]:
        """The waits that have to end before an obstacle goes."""
        waits: list[Wait] = [*self._waiting, *self._pauses]
        return [wait for wait in waits if obstacle(wait)]

    def _hopeless(self) -> Iterator[tuple[ZoneRequest, DobotError]]:
        """Requests that wait for somebody who has failed, for an arm that nobody moves any more, or for themselves."""
        for request in reversed(self._waiting):
            for holder, zone in self._foreign(request):
                if holder.failure:
                    failed = f"{holder.name} has failed, and may still be in zone {zone}: {holder.failure}"
                    yield request, ZoneOccupied(failed)
                elif not holder.moving() and request.parked(holder):
                    parked = f"{holder.name} is in zone {zone}, and no program is left that moves it"
                    yield request, ZoneOccupied(parked)

            cycle = self._cycle(request) if request.patient else []
            if cycle:
                yield request, deadlock(cycle)

    def _cycle(self, start: Wait) -> list[str]:
        """The waits that lead from one back to itself, in words; empty if they do not."""
        ways: list[tuple[Wait, list[str]]] = [(start, [])]
        seen: set[Wait] = set()
        while ways:
            each, words = ways.pop(0)
            who = each.holder if isinstance(each, ZoneRequest) else each.asker
            for obstacle, why in self._obstacles(each):
                told = [*words, f"{who.name} waits {why}"]
                if obstacle(start):
                    return told

                for other in self._held_up(obstacle):
                    if other not in seen:
                        seen.add(other)
                        ways.append((other, told))

        return []

    def _reason(self, request: ZoneRequest) -> str:
        """Why a request has to wait, in words."""
        held = [f"{holder.name} holds zone {zone}" for holder, zone in self._foreign(request)]
        return "; ".join(held) or f"others wait for {', '.join(sorted(request.zones))}"


def keeps_in(holder: ZoneHolder, wait: Wait) -> bool:
    """Whether a holder that holds a zone leaves it only when a wait has ended."""
    return holder in wait.stuck and not holder.moving()


def keeps_away(holder: ZoneHolder, wait: Wait) -> bool:
    """Whether a holder does what is awaited of it only when a wait has ended."""
    return holder is wait.asker


def deadlock(cycle: Collection[str]) -> ZoneDeadlock:
    """What to raise for a cycle of waits."""
    return ZoneDeadlock(f"a deadlock: {'; '.join(cycle)}")
