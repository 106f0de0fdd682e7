"""Any program of puts, batches, waits, cancellations, stops, pauses and alarms: the queue tells the truth about it.

Hypothesis writes the programs; they run against the simulated arm on a virtual clock. What the arm has recorded is then
compared with what each call and each Motion said. Each command has a number of its own, so none can be mistaken.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Literal

import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st
from quick_suite import examples
from virtual import run_virtual

from dobot_async import ArmAlarm, DobotError, Magician, MotionStopped, PTPMode, ReplyTimeout
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.motion import Motion
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import Faults, Simulation, simulate
from dobot_async.simulator.device.work import DeviceOptions, Executed

Kind = Literal["move", "far", "wait", "pwm"]
Entry = tuple[Command[Any, None], Any]

SPEED = 1.0
NOTICED = 0.03  # seconds within which the end of a motion is noticed where nothing tells when it comes
LONG = 30.0
ROOMY = 200

COMMANDS: dict[Kind, Any] = {
    "move": lambda number: (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 200 + number / 4, 50 * (-1) ** number, 40)),
    "far": lambda number: (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 500 + number, 0, 0)),
    "wait": lambda number: (c.SET_WAIT_CMD, c.WAITCmd(500 + number)),
    "pwm": lambda number: (c.SET_IOPWM, c.IOPWM(1, 1000 + number, 50)),
}
"""What the command of a number is: a motion, one that ends by an alarm, one that takes time, one that takes none."""


@dataclass
class Fate:
    """What became of one command, as the program was told.

    Attributes:
        watched: Whether somebody waits for it all the time, so that its end is noticed within a poll.
        asked: When it was to be put.
        motion: Its Motion, once there is one.
        refused: How the call that put it failed, if it did.
        cancelled: Whether that call was cancelled.
        error: How it failed, if it did.
        ended: When its end was told, by its Motion or by the call.
    """

    number: int
    watched: bool
    asked: float
    motion: Motion | None = None
    refused: DobotError | None = None
    cancelled: bool = False
    error: DobotError | None = None
    ended: float | None = None


@dataclass
class Program:
    """A program under way, and its record."""

    sim: Simulation
    arm: Magician
    fates: list[Fate] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)
    batches: list[Sequence[Fate]] = field(default_factory=list)
    tasks: list[asyncio.Task[None]] = field(default_factory=list)
    stops: list[tuple[float, float]] = field(default_factory=list)

    @property
    def roomy(self) -> bool:
        """Whether the arm's queue is never full."""
        return bool(self.sim.arm.device.options.capacity == ROOMY)

    @property
    def now(self) -> float:
        return asyncio.get_running_loop().time()

    def put(self, kinds: Sequence[Kind], *, watched: bool) -> asyncio.Task[None]:
        """Begins to put one command, or a batch."""
        fates = []
        for kind in kinds:
            fates.append(Fate(len(self.fates), watched, self.now))
            self.fates.append(fates[-1])
            self.entries.append(COMMANDS[kind](fates[-1].number))

        self.batches.append(fates)
        return self.spawn(self._put(fates))

    async def wait(self, which: int, seconds: float) -> None:
        """Waits for one of the Motions for a time."""
        motion = self.motion(which)
        if motion:
            try:
                await motion.wait(seconds)
                assert motion.done
            except ReplyTimeout:
                pass
            except DobotError:
                assert motion.done

    async def cancel_wait(self, which: int, seconds: float) -> None:
        """Waits for one of the Motions, and is cancelled."""
        motion = self.motion(which)
        if motion:
            waiting = asyncio.create_task(motion.wait())
            await asyncio.sleep(seconds)
            waiting.cancel()
            await asyncio.wait([waiting])

    async def cancel_put(self, kinds: Sequence[Kind], seconds: float) -> None:
        """Puts, and is cancelled, if it is not done before."""
        before = len(self.fates)
        putting = self.put(kinds, watched=True)
        await asyncio.sleep(seconds)
        if not putting.done():
            putting.cancel()
            for fate in self.fates[before:]:
                fate.cancelled = True

    async def stop(self, how: Literal["stop", "clear", "recover"]) -> None:
        """Throws away what is queued, in one of the three ways."""
        start = self.now
        await {"stop": self.arm.stop, "clear": self.arm.queue.clear, "recover": self.arm.recover}[how]()
        self.stops.append((start, self.now))

    async def join(self, seconds: float) -> None:
        """Waits for everything for a time."""
        with suppress(ReplyTimeout, MotionStopped, ArmAlarm):
            await self.arm.queue.join(seconds)

    def motion(self, which: int) -> Motion | None:
        """One of the Motions that there are."""
        motions = [fate.motion for fate in self.fates if fate.motion]
        return motions[which % len(motions)] if motions else None

    def spawn(self, work: Any) -> asyncio.Task[None]:
        self.tasks.append(asyncio.create_task(work))
        return self.tasks[-1]

    async def finish(self) -> None:
        """Lets everything come to its end."""
        await resume(self.arm)
        async with asyncio.timeout(LONG):
            while any(not task.done() for task in self.tasks):
                await asyncio.wait(self.tasks)

            for task in self.tasks:
                assert task.cancelled() or task.exception() is None

            for fate in self.fates:
                await self._watch(fate)

            # What a cancelled put has left behind nobody waits for; the next command brings it to light.
            with suppress(ArmAlarm):
                await self.arm.queue.wait(0)
                await self.arm.queue.join()

            await self.stop("recover")

    async def _put(self, fates: Sequence[Fate]) -> None:
        queue = self.arm.queue
        try:
            if len(fates) == 1:
                self._have(fates[0], await queue.put(*self.entries[fates[0].number]))
            else:
                async with queue.batch() as batch:
                    for fate in fates:
                        self._have(fate, batch.put(*self.entries[fate.number]))
        except DobotError as error:
            for fate in fates:
                fate.refused = error
                if fate.motion is None:
                    fate.ended, fate.error = self.now, error

    def _have(self, fate: Fate, motion: Motion) -> None:
        fate.motion = motion
        if fate.watched:
            self.spawn(self._watch(fate))

    async def _watch(self, fate: Fate) -> None:
        """Awaits a Motion; it must end once, the same for everybody."""
        if fate.motion is None:
            return

        error = None
        try:
            await fate.motion
        except DobotError as caught:
            error = caught

        if fate.ended is not None:
            assert repr(fate.error) == repr(error)

        fate.error = error
        fate.ended = self.now if fate.ended is None else fate.ended


async def resume(arm: Magician) -> None:
    """Lets a paused arm go on; an alarm that has come up meanwhile stops it, and this too."""
    with suppress(ArmAlarm):
        await arm.resume()


def check(program: Program, latency: float) -> None:
    """Compares what the program was told with what the arm has recorded."""
    numbers = {value: number for number, (_, value) in enumerate(program.entries)}
    records = [each for each in program.sim.arm.executed if each.index is not None and each.value in numbers]
    by_number: dict[int, Executed] = {numbers[each.value]: each for each in records}
    order = [numbers[each.value] for each in records]
    assert order == sorted(set(order)), "something ran twice, or out of order"
    assert program.sim.arm.counters.overflowed == 0
    assert program.arm.queue.pending == 0
    for batch in program.batches:
        check_batch(batch)

    alarms = [each.finished / SPEED for each in records if each.outcome == "alarm"]
    slack = NOTICED + 24 * latency
    for fate in program.fates:
        record = by_number.get(fate.number)
        done = record is not None and record.outcome == "done"
        event(f"{type(fate.error).__name__}, {record.outcome if record else 'never ran'}")
        if fate.ended is None:
            assert fate.cancelled, "nobody was told anything"
            continue

        if fate.error is None:
            assert record
            assert done, "it was said to be done"
            assert record.finished / SPEED <= fate.ended + 1e-6
            continue

        assert isinstance(fate.error, (MotionStopped, ArmAlarm)), repr(fate.error)
        if done and fate.watched and record:
            assert record.finished / SPEED >= fate.ended - slack, "it was done, and not said to be"

        if isinstance(fate.error, ArmAlarm):
            assert any(time <= fate.ended + 1e-6 for time in alarms)
        elif not fate.cancelled:
            assert any(fate.asked <= end and start <= fate.ended for start, end in program.stops)


def check_batch(fates: Sequence[Fate]) -> None:
    """The arm gets the commands of a batch in order, and nothing between them."""
    motions = [fate.motion for fate in fates if fate.motion]
    firsts = {motion.index - place for place, motion in enumerate(motions) if motion.index is not None}
    assert len(firsts) <= 1


kinds = st.sampled_from(["move", "move", "move", "wait", "pwm", "far"])
several = st.lists(kinds, min_size=2, max_size=7)
one_or_more = st.one_of(kinds.map(lambda kind: [kind]), several)
moments = st.sampled_from([0.0, 0.0, 0.0005, 0.001, 0.003, 0.01, 0.03, 0.1, 0.5])
which = st.integers(0, 100)
steps = st.one_of(
    st.tuples(st.just("put"), one_or_more, st.booleans()),
    st.tuples(st.just("put"), one_or_more, st.booleans()),
    st.tuples(st.just("put"), one_or_more, st.booleans()),
    st.tuples(st.just("cancel put"), one_or_more, moments),
    st.tuples(st.just("wait"), which, moments),
    st.tuples(st.just("cancel wait"), which, moments),
    st.tuples(st.just("join"), moments),
    st.tuples(st.just("sleep"), moments),
    st.tuples(st.just("stop"), st.sampled_from(["stop", "clear", "recover"])),
    st.tuples(st.just("pause")),
    st.tuples(st.just("resume")),
)


async def perform(program: Program, step: tuple[Any, ...]) -> None:
    """One step of a program; a put goes on beside the next steps."""
    match step:
        case "put", kinds, watched:
            program.put(kinds, watched=watched)
        case "cancel put", kinds, seconds:
            await program.cancel_put(kinds, seconds)
        case "wait", which, seconds:
            await program.wait(which, seconds)
        case "cancel wait", which, seconds:
            await program.cancel_wait(which, seconds)
        case "join", seconds:
            await program.join(seconds)
        case "sleep", seconds:
            await asyncio.sleep(seconds)
        case "stop", how:
            await program.stop(how)
        case ("pause",):
            await program.arm.pause()
        case ("resume",):
            await resume(program.arm)


@pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
@settings(max_examples=examples(300), suppress_health_check=[HealthCheck.too_slow])
@given(
    script=st.lists(steps, min_size=1, max_size=25),
    capacity=st.sampled_from([1, 2, 3, 4, ROOMY]),
    window=st.integers(1, 4),
    latency=st.sampled_from([0.0, 0.0005]),
    on_fault=st.sampled_from(["halt", "continue"]),
)
def test_any_program_is_told_the_truth(
    script: list[tuple[Any, ...]], capacity: int, window: int, latency: float, on_fault: Any
) -> None:
    async def run() -> None:
        options = DeviceOptions(capacity=capacity, on_fault=on_fault)
        async with (
            simulate(options=options, speed=SPEED, faults=Faults(latency=latency)) as sim,
            Magician.connect(sim.url, window=window) as arm,
        ):
            sim.arm.state.set(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(1, c.IOFunction.PWM))
            program = Program(sim, arm)
            for step in script:
                await perform(program, step)

            await program.finish()
            check(program, latency)
            await arm.move_to(220, 0, 40)
            assert sim.arm.executed[-1].outcome == "done"
            assert arm.queue.pending == 0

    run_virtual(run())
