"""Whatever programs and arms do in a cell: nobody is left to wait who could go on or never will; no answer is false.

The machine keeps its own record of who holds what and who waits, and judges each answer by it (`waits.py`). Programs
command arms, each other's and two at once too, hold zones, meet at a barrier, start tasks, give up and end; arms come
to rest and tell where, or do not, fail, and work again. As on a loop, who was answered goes on some time later.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from itertools import permutations
from random import Random
from typing import Any, TypeVar

import pytest
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule
from quick_suite import examples
from waits import Scene, Wait, named

from dobot_async import DobotError, MotionStopped
from dobot_async.fleet import ZoneDeadlock, ZoneOccupied
from dobot_async.fleet.zone_locks import ProgramWait, ZoneHolder, ZoneLocks, ZoneRequest

ZONES = "ABC"
ARMS = "abcd"
TASKS = {"e": "a", "f": "a", "g": "e"}
"""Who was started by whom."""

PLACES = ["", "", *ZONES, "AB"]
WAYS = [*ZONES, *ZONES, "AB", "BC", "ABC"]
MOMENTS = 300

T = TypeVar("T")
Then = Callable[[], None]
Pick = Callable[[Sequence[Any]], Any]


@dataclass(eq=False, repr=False)
class Doer:
    """A program, or a task of one.

    Attributes:
        wait: What it waits for.
        then: What it does next, once it has its turn on the loop.
    """

    name: str
    parent: Doer | None = None
    alive: bool = True
    wait: Wait | None = None
    then: Then | None = None
    paused: AbstractContextManager[None] | None = None

    def __post_init__(self) -> None:
        self.holder = ZoneHolder(f"program {self.name}")

    def __repr__(self) -> str:
        return self.name

    def line(self) -> frozenset[ZoneHolder]:
        """As whom it acts."""
        return frozenset([self.holder]) | (self.parent.line() if self.parent else frozenset())


@dataclass(eq=False, repr=False)
class Arm:
    """An arm.

    Attributes:
        moves: Whether it does.
        jogged: Whether it does so for the length of a block of whoever has the turn.
        driver: Who has moved it last.
        turn: Whose turn it is to command it, from the moment on at which that is settled.
        commanding: The same, from the moment on at which that one goes on.
        behind: Who waits for a turn, and what for.
    """

    name: str
    moves: bool = False
    jogged: bool = False
    driver: Doer | None = None
    turn: Doer | None = None
    commanding: tuple[ZoneHolder, ...] = ()
    behind: list[tuple[Doer, Then]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.holder = ZoneHolder(self.name, moving=lambda: self.moves)

    def __repr__(self) -> str:
        return self.name


class Cell(RuleBasedStateMachine):
    """A cell, and what has to be the case in it."""

    def __init__(self) -> None:
        super().__init__()
        self.pick: Pick = Random(0).choice
        self.claims = ZoneLocks()
        self.arms = {name: Arm(name) for name in ARMS}
        self.doers = {name: Doer(name) for name in ARMS}
        for name, parent in TASKS.items():
            self.doers[name] = Doer(name, self.doers[parent])

        self.holds: dict[ZoneRequest, frozenset[str]] = {}
        self.waiting: list[ZoneRequest] = []
        self.pauses: list[ProgramWait] = []
        self.come: list[Doer] = []
        self.ending: DobotError | None = None

    @initialize(data=st.data())
    def begin(self, data: st.DataObject) -> None:
        self.pick = lambda of: data.draw(st.sampled_from(of))

    @rule()
    def something(self) -> None:
        """What one of those does who can do something."""
        able = {what: whom for what, (_, who) in ACTIONS.items() if (whom := who(self))}
        what = self.pick([what for what in able for _ in range(ACTIONS[what][0])])
        what(self, self.pick(able[what]))

    @invariant()
    def nobody_is_left_to_wait(self) -> None:
        assert not [f"{named(wait)}: {why}" for wait, why in self.scene().forgotten()]

    @invariant()
    def zones_are_held_by_whom_they_were_given(self) -> None:
        for zone in ZONES:
            holders = {claim.holder.name for claim, zones in self.holds.items() if zone in zones}
            assert {holder.name for holder in self.claims.holders(zone)} == holders

    @invariant()
    def who_waits_is_known_to_wait(self) -> None:
        assert self.claims.waiting == self.waiting

    # What programs do.

    def command(self, doer: Doer) -> None:
        """A program moves an arm, mostly its own."""
        arm = self.arms[self.pick(doer.name * 6 + ARMS if doer.name in ARMS else ARMS)]
        if not arm.holder.failure:
            go = partial(self.go, doer, arm, jogs=self.pick([False] * 4 + [True]))
            self.take_turn(doer, arm, go)

    def go(self, doer: Doer, arm: Arm, *, jogs: bool) -> None:
        """It has the arm's turn, and asks for the way; it keeps the turn as long as it jogs."""

        def granted() -> None:
            arm.moves = True
            arm.jogged = jogs

        arm.driver = doer
        claim = ZoneRequest(
            arm.holder,
            doer.line() | {arm.holder},
            frozenset(self.pick(WAYS)),
            patient=self.pick([True] * 4 + [False]),
            stuck=self.driven(doer),
            asker=doer.holder,
            parked=partial(self.parked, doer),
        )
        self.ask(doer, claim, granted)

    def end_jog(self, arm: Arm) -> None:
        """A program jogs no longer."""
        arm.jogged = False
        self.end_turn(arm)

    def start_together(self, doer: Doer) -> None:
        """A program starts two arms at one instant, each with a way of its own."""
        free = [arm for arm in self.arms.values() if not (arm.turn or arm.behind or arm.holder.failure)]
        if len(free) < 2:
            return

        arms = [free[0], self.pick(free[1:])]
        ways = dict(zip(self.pick(list(permutations(ZONES, 2))), arms, strict=True))
        for arm in arms:
            arm.turn, arm.commanding, arm.driver = doer, (doer.holder,), doer

        def granted() -> None:
            for zone, arm in ways.items():
                arm.moves = True
                self.take(arm, zone)

            self.give_back(claim)

        movers = frozenset(arm.holder for arm in arms)
        claim = ZoneRequest(
            ZoneHolder("the start"),
            doer.line() | movers,
            frozenset(ways),
            stuck=self.driven(doer),
            asker=doer.holder,
            movers=movers,
            parked=partial(self.parked, doer),
        )
        self.ask(doer, claim, granted)

    def hold(self, doer: Doer) -> None:
        """A program asks for zones for itself."""
        its = frozenset([self.arms[doer.name].holder] if doer.name in ARMS else [])
        own = doer.line() | its | self.driven(doer)
        zones = frozenset(self.pick(WAYS))
        self.ask(doer, ZoneRequest(doer.holder, own, zones, parked=partial(self.parked, doer)), lambda: None)

    def meet(self, doer: Doer) -> None:
        """A program comes to the barrier of all."""
        self.come.append(doer)
        if len(self.come) == len(ARMS):
            self.come.pop()
            self.open()
        elif not self.pause(doer, "at the barrier for", partial(self.absent, doer)):
            self.come.remove(doer)

    def give_up(self, doer: Doer) -> None:
        """A program waits no longer."""
        if isinstance(doer.wait, ZoneRequest):
            claim, doer.wait = doer.wait, None
            self.waiting.remove(claim)
            self.claims.release(claim)
            self.pass_on(doer)
            return

        if doer in self.come:
            self.open()

        for arm in self.arms.values():
            arm.behind = [each for each in arm.behind if each[0] is not doer]

        doer.then = None
        self.wake(doer)

    def end(self, doer: Doer) -> None:
        """A program ends, and so do its tasks; nobody waits for it at a barrier any more. Or another one begins."""
        if not doer.alive:
            doer.alive = doer.parent is None or doer.parent.alive
            return

        if any(each.alive and each.parent is doer for each in self.doers.values()):
            return

        for claim in self.held_by(doer.holder):
            self.give_back(claim)

        for arm in self.arms.values():
            arm.jogged = arm.jogged and arm.turn is not doer

        self.pass_on(doer)
        doer.alive = False
        if doer.name in ARMS:
            self.open()

        self.claims.settle()

    def go_on(self, doer: Doer) -> None:
        """A program goes on that was answered."""
        then, doer.then = doer.then, None
        assert then
        then()

    # What arms do.

    def rest(self, arm: Arm) -> None:
        """An arm comes to rest, somewhere where it was let, or it does not tell where."""
        held = self.held_by(arm.holder)
        stays = frozenset(self.pick([*PLACES, ZONES, ZONES]))
        arm.moves = False
        for claim in held:
            self.holds[claim] &= stays
            if not self.holds[claim]:
                del self.holds[claim]

        arm.holder.inside &= stays
        self.claims.keep(held, stays)

    def look(self, arm: Arm) -> None:
        """An arm that stands may yet turn out to be elsewhere."""
        arm.moves = True

    def turn_up(self, arm: Arm) -> None:
        """An arm is where it was not known to be."""
        arm.holder.inside = frozenset(self.pick(PLACES))
        self.take(arm, self.pick(WAYS))

    def fail(self, arm: Arm) -> None:
        """An arm fails."""
        arm.holder.failure = self.ending = MotionStopped("it failed")
        self.claims.fail([arm.holder], self.ending)

    def recover(self, arm: Arm) -> None:
        """An arm works again, and stands in no zone."""
        arm.holder.failure, arm.holder.inside, arm.moves = None, frozenset(), False
        held = self.held_by(arm.holder)
        for claim in held:
            del self.holds[claim]

        self.claims.keep(held, frozenset())

    def stop(self, arm: Arm) -> None:
        """An arm is stopped."""
        self.ending = MotionStopped("a stop")
        self.claims.interrupt(arm.holder, self.ending)

    def stop_all(self, _: Arm) -> None:
        """All are stopped."""
        self.ending = MotionStopped("a stop of all")
        self.claims.stop(self.ending)
        assert not self.waiting

    # What becomes of it.

    def scene(self) -> Scene:
        held = [(claim.holder, zones) for claim, zones in self.holds.items()]
        return Scene(held, list(self.waiting), list(self.pauses))

    def ready(self) -> list[Doer]:
        return [doer for doer in self.doers.values() if doer.alive and not doer.wait and not doer.then]

    def held_by(self, *holders: ZoneHolder) -> list[ZoneRequest]:
        return [claim for claim in self.holds if claim.holder in holders]

    def in_doubt(self) -> list[Doer]:
        return [doer for doer in self.doers.values() if doer.wait and not doer.then]

    def driven(self, doer: Doer) -> frozenset[ZoneHolder]:
        return frozenset(arm.holder for arm in self.arms.values() if arm.driver is doer)

    def parked(self, doer: Doer, holder: ZoneHolder) -> bool:
        """Whether nobody is left who would move an arm while a program waits."""
        arm, own = self.arms.get(holder.name), doer
        while own.parent:
            own = own.parent

        if arm is None or (self.doers[arm.name].alive and own.name != arm.name):
            return False

        return arm.driver is None or not arm.driver.alive

    def absent(self, doer: Doer) -> list[ZoneHolder]:
        """Who keeps one who has come from going on."""
        return (
            [self.doers[name].holder for name in ARMS if self.doers[name] not in self.come] if doer in self.come else []
        )

    def open(self) -> None:
        """Lets all go on who have come to the barrier, or tells them that it is broken."""
        woken, self.come = self.come, []
        for doer in woken:
            doer.then = partial(self.wake, doer)

    def take_turn(self, doer: Doer, arm: Arm, go: Then) -> None:
        """A program waits until nobody else commands an arm."""
        if arm.turn is None:
            arm.turn, arm.commanding = doer, (doer.holder,)
            go()
        elif arm.turn is not doer and self.pause(doer, f"to command {arm.name} behind", lambda: arm.commanding):
            arm.behind.append((doer, go))

    def pass_on(self, doer: Doer) -> None:
        """A program lets others command what it has had the turn of."""
        for arm in self.arms.values():
            if arm.turn is doer and not arm.jogged:
                self.end_turn(arm)

    def end_turn(self, arm: Arm) -> None:
        """The next one may command an arm."""
        arm.turn, arm.commanding = None, ()
        if arm.behind:
            arm.turn, go = arm.behind.pop(0)
            arm.turn.then = partial(self.begin_turn, arm.turn, arm, go)

    def begin_turn(self, doer: Doer, arm: Arm, go: Then) -> None:
        self.wake(doer)
        arm.commanding = (doer.holder,)
        go()

    def pause(self, doer: Doer, what: str, awaited: Callable[[], list[ZoneHolder] | tuple[ZoneHolder, ...]]) -> bool:
        """A program waits for others; False if it was told that it would do so for ever."""
        pause = ProgramWait(what, doer.holder, self.driven(doer) | {doer.holder}, awaited)
        self.pauses.append(pause)
        doer.wait, doer.paused = pause, self.claims.pausing(pause)
        try:
            doer.paused.__enter__()
        except ZoneDeadlock:
            assert pause in self.scene().endless()
            self.pauses.remove(pause)
            doer.wait = doer.paused = None
            return False

        return True

    def wake(self, doer: Doer) -> None:
        """A program waits for others no longer."""
        pause, doer.wait = doer.wait, None
        assert isinstance(pause, ProgramWait)
        assert doer.paused
        self.pauses.remove(pause)
        doer.paused.__exit__(None, None, None)

    def take(self, arm: Arm, zones: str) -> None:
        claim = ZoneRequest(arm.holder, frozenset([arm.holder]), frozenset(zones))
        self.holds[claim] = claim.zones
        self.claims.take(claim)

    def give_back(self, claim: ZoneRequest) -> None:
        self.holds.pop(claim, None)
        self.claims.release(claim)

    def ask(self, doer: Doer, claim: ZoneRequest, granted: Then) -> None:
        """A program makes a claim, with the turns of the arms that it is for."""

        def answer(error: DobotError | None) -> None:
            self.judge(claim, error)
            self.waiting.remove(claim)
            doer.wait, doer.then = None, partial(self.pass_on, doer) if error else then
            if not error:
                self.holds[claim] = claim.zones

        def then() -> None:
            granted()
            self.pass_on(doer)

        assert doer.line() | self.driven(doer) <= claim.stuck
        claim.answer = answer
        doer.wait = claim
        self.waiting.append(claim)
        self.claims.request(claim)

    def judge(self, claim: ZoneRequest, error: DobotError | None) -> None:
        """Whether an answer is true."""
        scene = self.scene()
        if error is None:
            assert scene.is_due(claim)
        elif isinstance(error, ZoneDeadlock):
            assert claim in scene.endless()
        elif not isinstance(error, ZoneOccupied):
            assert error is self.ending
        elif claim.patient:
            assert [*scene.in_vain(claim)]
        else:
            assert not scene.is_due(claim)


def ready_to_meet(cell: Cell) -> list[Doer]:
    """Those who may come to the barrier of all."""
    together = all(cell.doers[name].alive for name in ARMS)
    return [doer for doer in cell.ready() if together and doer.name in ARMS]


def all_arms(cell: Cell) -> list[Arm]:
    return list(cell.arms.values())


ACTIONS: dict[Callable[[Cell, Any], None], tuple[int, Callable[[Cell], Sequence[Any]]]] = {
    Cell.command: (8, Cell.ready),
    Cell.hold: (4, Cell.ready),
    Cell.start_together: (2, Cell.ready),
    Cell.meet: (3, ready_to_meet),
    Cell.end: (1, lambda cell: [doer for doer in cell.doers.values() if not doer.wait and not doer.then]),
    Cell.give_up: (2, Cell.in_doubt),
    Cell.go_on: (20, lambda cell: [doer for doer in cell.doers.values() if doer.then]),
    Cell.give_back: (6, lambda cell: cell.held_by(*(doer.holder for doer in cell.ready()))),
    Cell.end_jog: (2, lambda cell: [arm for arm in all_arms(cell) if arm.jogged and arm.turn in cell.ready()]),
    Cell.rest: (8, lambda cell: [arm for arm in all_arms(cell) if arm.moves]),
    Cell.look: (1, all_arms),
    Cell.turn_up: (1, all_arms),
    Cell.fail: (1, lambda cell: [arm for arm in all_arms(cell) if not arm.holder.failure]),
    Cell.recover: (10, lambda cell: [arm for arm in all_arms(cell) if arm.holder.failure]),
    Cell.stop: (1, all_arms),
    Cell.stop_all: (1, all_arms),
}
"""How often something is done, and by whom."""

PHASES = (Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink)
Cell.TestCase.settings = settings(max_examples=examples(40), stateful_step_count=50, deadline=None, phases=PHASES)
test_any_cell = Cell.TestCase


@pytest.mark.cases(2)
@pytest.mark.parametrize("first", range(0, 40, 10))
def test_cells_that_go_on_for_long(first: int) -> None:
    for seed in range(first, first + 10):
        cell = Cell()
        cell.pick = Random(seed).choice
        for _ in range(MOMENTS):
            cell.something()
            cell.nobody_is_left_to_wait()
            cell.zones_are_held_by_whom_they_were_given()
            cell.who_waits_is_known_to_wait()
