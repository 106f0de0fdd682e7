"""One seed is one run: a program at random, on a line with faults at random, in virtual time; it must tell the truth.

    seed --> Plan (line, arm, window) --> Run (calls, what each was told) --> judgement.judge (what the arm recorded)

The driver and the simulated arm run in one process on one virtual clock, and all that is random comes from the seed, so
a seed that fails once fails always. Each command has a number of its own, so none can be mistaken for another.
"""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from random import Random
from types import FrameType
from typing import Any, Literal

import async_solipsism
from calls import MOMENTS, Call, How, Mine, Violation, draw_how, made
from judgement import Fate, Jogging, Kind, Record, Standstill, check_jogs, judge, judge_answer, judge_set
from observed import Observed

from dobot_async import DobotError, Jog, Magician, PTPMode
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import Faults, Simulation, simulate
from dobot_async.simulator.device.work import DeviceOptions

__all__ = ["Outcome", "Plan", "Violation", "run_seed"]

SPEED = 20.0
LONG = 120.0  # virtual seconds within which everything completes once the line is good again
PATIENT = 60.0  # virtual seconds that a read may take on a bad line
ASKED = 8  # times that something is asked while the line comes back
LEAVING = 4.0  # virtual seconds that leaving the connection's block by an error may take, the closing included
ENDLESS = 3000.0  # virtual seconds in which a program ends that waits for nothing but calls and moments
MOST_CPU = 30  # seconds after which a run counts as endless
DATAGRAM_DISORDER = 0.005  # seconds within which a line that doubles messages doubles them

COMMANDS: dict[Kind, Callable[[int], tuple[Any, Any]]] = {
    "move": lambda number: (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 200 + number / 8, 40 * (-1) ** number, 40)),
    "step": lambda number: (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ_INC, 0, 0, (number + 1) / 1024)),
    "far": lambda number: (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 500 + number, 0, 0)),
    "wait": lambda number: (c.SET_WAIT_CMD, c.WAITCmd(500 + number)),
    "setting": lambda number: (c.SET_PTPL_PARAMS, c.PTPLParams(1000 + number, 50)),
}
"""What the command of a number is: absolute, relative, out of reach, one that takes time, one that takes none."""

READS: Sequence[tuple[Any, Sequence[Any]]] = (
    (c.GET_POSE, [None]),
    (c.GET_POSE, [None]),
    (c.GET_DEVICE_TIME, [None]),
    (c.GET_ALARMS_STATE, [None]),
    (c.GET_QUEUED_CMD_LEFT_SPACE, [None]),
    (c.GET_QUEUED_CMD_CURRENT_INDEX, [None]),
    (c.GET_KINEMATICS, [None]),
    (c.GET_IODI, range(1, 21)),
    (c.GET_IOADC, range(1, 21)),
    (c.GET_IOADC, [7]),
)
"""What is read, and with which parameters."""

JOGS = (Jog.Z_PLUS, Jog.Z_MINUS, Jog.J4_PLUS, Jog.J1_MINUS)
CRAWL = (0.001,) * 4
"""The speed of jogs: so low that none meets a limit."""


@dataclass(frozen=True)
class Plan:
    """What a seed stands for.

    Attributes:
        severity: Of the line: "none"; "standing" does nothing but stand still and fall silent; "mild" or "harsh".
        datagrams: Whether the line doubles and reorders messages; a stream splits, merges and stalls.
        late: Probability that an answer comes alone, on a line that loses nothing.
        kinds: What is put.
        reads: What is read, little enough that the same is read again soon.
        disaster: What happens once, if anything; "leave" ends the connection's block by an error.
    """

    severity: Literal["none", "standing", "mild", "harsh"]
    datagrams: bool
    late: float
    faults: Faults
    options: DeviceOptions
    window: int
    kinds: Sequence[Kind]
    reads: Sequence[tuple[Any, Sequence[Any]]]
    disaster: Literal["", "power", "unplug", "leave"]
    steps: int
    doubles: bool
    loses: bool
    reorder_window: float

    @classmethod
    def of(cls, random: Random) -> Plan:
        severity: Any = random.choices(["none", "standing", "mild", "harsh"], [25, 25, 20, 30])[0]
        datagrams = random.random() < 0.4
        kinds: list[Kind] = ["move", "move", "move", "step", "wait", "setting", "setting"]
        if random.random() < 0.4:
            kinds.remove("step")

        if random.random() < 0.3:
            kinds.append("far")

        late = 0.02 if severity == "none" and not datagrams and random.random() < 0.4 else 0.0
        faults = line(random, severity, datagrams=datagrams)
        if late:
            faults.late_time = random.choice([0.01, 0.05, 0.2])

        shift = faults.jitter + faults.reorder
        return cls(
            severity,
            datagrams,
            late,
            faults,
            DeviceOptions(capacity=random.choice([1, 2, 8, 32]), on_fault=random.choice(["halt", "continue"])),
            random.choice([1, 4]) if severity == "none" and not datagrams else 1,
            kinds,
            random.sample(READS, 3),
            random.choice(["power", "unplug", "leave", "leave"]) if random.random() < 0.2 else "",
            random.randint(5, 40),
            faults.dup > 0,
            faults.loss + faults.corrupt + faults.noise > 0,
            max(shift, DATAGRAM_DISORDER) if shift or faults.dup else 0.0,
        )


def line(random: Random, severity: str, *, datagrams: bool) -> Faults:
    """What the line does."""
    faults = Faults(latency=random.choice([0.0, 0.0005, 0.003, 0.01]))
    if severity == "none":
        return faults

    rare = {"standing": 1.0, "harsh": 0.5, "mild": 0.2}[severity]
    faults.stall = random.choice([0, 0.005, 0.02]) * rare
    faults.stall_time = random.choice([0.2, 1.0, 4.0, 10.0])
    faults.silence = random.choice([0, 0, 0.005, 0.01]) * rare
    faults.silence_time = random.choice([0.2, 1.0, 4.0, 10.0])
    if severity != "standing":
        scale = 1.0 if severity == "harsh" else 0.1
        faults.loss = random.choice([0, 0.05, 0.2]) * scale
        faults.corrupt = random.choice([0, 0.05]) * scale
        faults.noise = random.choice([0, 0.05]) * scale
        faults.dup = random.choice([0, 0.05]) * scale if datagrams else 0

    if datagrams:
        faults.jitter = random.choice([0.002, 0.005, 0.02])
        faults.reorder = random.choice([0, 0.005, 0.01])
    elif severity != "standing":
        faults.split = random.choice([0, 0.1, 0.5])
        faults.merge = random.choice([0, 0.1])

    return faults


@dataclass
class Outcome:
    """What a run was like, for statistics."""

    seconds: float = 0.0
    sent: int = 0
    executed: int = 0
    doubled: int = 0
    failed: int = 0
    outages: int = 0


@dataclass
class Run:
    """A program under way."""

    plan: Plan
    random: Random
    sim: Simulation
    arm: Magician
    record: Record
    seen: Observed
    entries: list[tuple[Any, Any]] = field(default_factory=list)
    tasks: list[asyncio.Task[None]] = field(default_factory=list)
    sets: int = 0
    jogs: asyncio.Lock = field(default_factory=asyncio.Lock)

    @property
    def now(self) -> float:
        return asyncio.get_running_loop().time()

    async def play(self) -> None:
        """Takes all steps, a disaster among them if there is to be one."""
        disaster = self.random.randrange(self.plan.steps) if self.plan.disaster else -1
        if self.plan.disaster == "power":
            # So that the alarm of a restart tells.
            await self.call("clear alarms", lambda: self.arm.clear_alarms(timeout=PATIENT), PATIENT)

        for number in range(self.plan.steps):
            if number == disaster:
                self.strike()

            if self.plan.disaster in {"unplug", "leave"} and number >= disaster:
                break

            await self.step()

    async def step(self) -> None:
        """One thing that a user does; some go on beside the next ones."""
        random = self.random
        action = random.choices(list(ACTIONS), list(ACTIONS.values()))[0]
        seconds = random.choice(MOMENTS)
        self.record.note(f"{action}, {seconds} s")
        await getattr(self, action)(seconds)

    # What a user does.

    async def put(self, seconds: float) -> None:
        self.putting(self.pick())
        await asyncio.sleep(seconds)

    async def batch(self, seconds: float) -> None:
        self.putting(self.pick(self.random.randint(2, 7)))
        await asyncio.sleep(seconds)

    async def wait(self, seconds: float) -> None:
        motions = [fate.motion for fate in self.record.fates if fate.motion]
        if motions:
            motion = self.random.choice(motions)
            self.beside("wait", lambda: motion.wait(seconds), judged=False)
            await asyncio.sleep(seconds)

    async def join(self, seconds: float) -> None:
        self.beside("join", lambda: self.arm.queue.join(seconds), judged=False)
        await asyncio.sleep(seconds)

    async def own_move(self, seconds: float) -> None:
        """A move that belongs to its call."""
        fate = self.fate(self.random.choice([kind for kind in self.plan.kinds if kind != "setting"]), watched=False)
        self.spawn(self._own(fate, *draw_how(self.random)))
        await asyncio.sleep(seconds)

    async def stop(self, seconds: float) -> None:
        """From one task, or from several at once."""
        for _ in range(self.random.choice([1, 1, 2, 3])):
            self.spawn(self._stop("stop", self.arm.stop, *draw_how(self.random), certain=True))
            await asyncio.sleep(self.random.choice([0.0, 0.0, 0.001]))

        await asyncio.sleep(seconds)

    async def clear(self, seconds: float) -> None:
        await self._stop("clear", self.arm.queue.clear, *draw_how(self.random))

    async def recover(self, seconds: float) -> None:
        await self._stop("recover", self.recovering, *draw_how(self.random))

    async def recovering(self) -> None:
        """As `arm.recover`, with more patience."""
        await self.arm.clear_alarms(timeout=PATIENT)
        await self.arm.queue.clear()

    async def pause(self, seconds: float) -> None:
        await self.call("pause", self.arm.pause)

    async def resume(self, seconds: float) -> None:
        await self.call("resume", self.arm.resume)

    async def read(self, seconds: float) -> None:
        for _ in range(self.random.randint(1, 4)):
            row, values = self.random.choice(self.plan.reads)
            timeout = self.random.choice([None, 0.1, PATIENT, PATIENT])
            self.spawn(self._read(row, self.random.choice(values), timeout, *draw_how(self.random)))

        await asyncio.sleep(seconds)

    async def set(self, seconds: float) -> None:
        """Something that nothing depends on, with a value of its own each time."""
        self.sets += 1
        self.spawn(self._set(c.SET_LOST_STEP_PARAMS, float(self.sets), *draw_how(self.random)))
        await asyncio.sleep(seconds)

    async def jog(self, seconds: float) -> None:
        way = self.random.choice(["over", "error", "cancel", "cancel", "limit"])
        hurried = self.random.choice(MOMENTS)
        if not self.jogs.locked():
            self.spawn(self._jog(self.random.choice(JOGS), way, seconds, hurried))
            await asyncio.sleep(self.random.choice(MOMENTS))

    async def sleep(self, seconds: float) -> None:
        await asyncio.sleep(seconds * self.random.choice([1, 1, 5]))

    def strike(self) -> None:
        """The power fails for a moment, or the cable is pulled."""
        if self.plan.disaster == "power":
            self.record.struck_at = self.now
            self.sim.arm.power_cycle()
        elif self.plan.disaster == "unplug":
            self.record.struck_at = self.now
            self.sim.unplug()

    # The end.

    async def finish(self) -> None:
        """On a line that is good again, everything comes to its end, and the arm moves once more."""
        self.mend()
        await self.ends(self.end(), "good line")
        self.record.pending = self.arm.queue.pending

    def mend(self) -> None:
        """From now on the line carries everything; a stall or a silence that goes on comes to its end."""
        faults = self.sim.faults
        faults.loss = faults.corrupt = faults.noise = faults.dup = faults.stall = faults.silence = 0.0
        self.seen.late = 0.0

    async def ends(self, work: Coroutine[Any, Any, None], where: str) -> None:
        """Does something that ends within a bounded time once the line is good."""
        ending = asyncio.create_task(work)
        patience = max(self.now, *(end for _, end in (*self.sim.outages, (0.0, 0.0)))) + LONG - self.now
        await asyncio.wait([ending], timeout=patience)
        if not ending.done():
            waiting = [str(task.get_stack(limit=1)) for task in asyncio.all_tasks()]
            ending.cancel()
            await asyncio.wait([ending])
            self.complain()
            check_jogs(self.record, self.seen, self.sim, self.plan)
            raise Violation(f"not everything ended within {LONG} s on a {where}: {waiting}")

        ending.result()

    async def end(self) -> None:
        """Waits for all that was begun, then moves once more."""
        # A pause that was cancelled must not overtake the last resume.
        good = self.seen.good_from(self.now, 2 * self.plan.reorder_window)
        await self.impatient(good)
        await asyncio.sleep(good - self.now)
        for row, values in self.plan.reads:
            self.spawn(self._read(row, values[0], PATIENT, "plain", 0.0))

        await self.call("resume", self.arm.resume, how="plain")
        await self.all_told()
        if self.plan.disaster != "unplug":
            await self.last_moves()

    async def impatient(self, until: float) -> None:
        """Asks until the line is good, each time for a moment: answers to all of it may come when nobody waits."""
        for _ in range(ASKED):
            for row, values in self.plan.reads if self.now < until else ():
                self.spawn(self._read(row, values[0], 0.1, "plain", 0.0))

            await asyncio.sleep((until - self.now) / 2)

    async def all_told(self) -> None:
        """Waits for every task and every Motion."""
        while any(not task.done() for task in self.tasks):
            await asyncio.wait(self.tasks)

        self.complain()
        for fate in self.record.fates:
            await self._watch(fate)

    def complain(self) -> None:
        """Raises what a task has found to be wrong."""
        for task in self.tasks:
            if task.done() and not task.cancelled():
                task.result()

    async def last_moves(self) -> None:
        """What a cancelled put has left behind nobody waits for; the next command brings it to light."""
        with suppress(DobotError):
            await self.arm.queue.join()  # tells of failures that were judged when they happened

        for _ in range(3):
            call = await self.call("wait 0", self.last_wait, how="plain")
            if call.good:
                break

        await self._stop("recover", self.arm.recover, "plain", 0.0)
        await self.arm.move_to(220, 0, 40)
        pose = await self.arm.get_pose()
        if abs(pose.x - 220) + abs(pose.y) + abs(pose.z - 40) > 0.1:
            raise Violation(f"after the last move the arm stands at {pose}")

    async def last_wait(self) -> None:
        await self.arm.queue.wait(0)
        await self.arm.queue.join()

    # Calls.

    async def call(
        self,
        name: str,
        work: Callable[[], Awaitable[Any]],
        timeout: float | None = None,
        *,
        how: How | None = None,
        judged: bool = True,
    ) -> Call:
        """Makes a call that may be cancelled; whether it was allowed to fail is judged at the end."""
        call = Call(name, timeout)
        drawn, seconds = draw_how(self.random)
        await made(call, work, how or drawn, seconds)
        self.note(call, judged=judged)
        return call

    def note(self, call: Call, *, judged: bool = True) -> None:
        self.record.note(f"ended: {call}")
        if judged and isinstance(call.error, DobotError):
            self.record.failed.append(call)

    def beside(self, name: str, work: Callable[[], Awaitable[Any]], *, judged: bool) -> None:
        async def calling() -> None:
            await self.call(name, work, judged=judged)

        self.spawn(calling())

    def pick(self, count: int = 1) -> list[Fate]:
        watched = self.random.random() < 0.6
        return [self.fate(self.random.choice(self.plan.kinds), watched=watched) for _ in range(count)]

    def fate(self, kind: Kind, *, watched: bool) -> Fate:
        fates = self.record.fates
        row, value = COMMANDS[kind](len(fates))
        fates.append(Fate(len(fates), kind, value, watched, self.now))
        self.entries.append((row, value))
        return fates[-1]

    def putting(self, fates: Sequence[Fate]) -> asyncio.Task[None]:
        return self.spawn(self._put(fates, *draw_how(self.random)))

    def spawn(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        self.tasks.append(asyncio.create_task(work))
        return self.tasks[-1]

    async def _stop(
        self, name: str, work: Callable[[], Awaitable[Any]], how: How, seconds: float, *, certain: bool = False
    ) -> None:
        """Throws away what is queued, and notes when."""
        call = Call(name)
        last: list[int] = []

        async def stopping() -> None:
            last.append(self.record.begun)
            await work()

        await made(call, stopping, how, seconds)
        self.note(call)
        if call.begun is not None and call.ended is not None:
            heard = self.seen.good_from(call.ended, 0.0 if call.good else 5.0)
            self.record.stops.append((call.begun, max(call.ended, heard)))
            ended = call.ended if call.good else None
            self.record.standstills.append(Standstill(str(call), (0, last[0]), call.begun, ended, certain))

    async def _own(self, fate: Fate, how: How, seconds: float) -> None:
        row, value = self.entries[fate.number]
        call = Call(f"{fate.kind} {fate.number}")

        async def moving() -> None:
            self.record.begun = max(self.record.begun, fate.number)
            await self.arm.perform(row, value, None)

        await made(call, moving, how, seconds)
        self.record.note(f"ended: {call}")
        fate.cancelled = call.hurried is not None
        if call.begun is None or call.ended is None:
            fate.cancelled = True
        elif isinstance(call.error, DobotError) or call.good:
            fate.error = call.error if isinstance(call.error, DobotError) else None
            fate.ended = call.ended

        if call.error and call.begun is not None and call.ended is not None:
            over = call.ended if call.hurried is None else call.hurried
            self.record.stops.append((over, self.seen.good_from(call.ended, 5.0)))
            self.record.standstills.append(Standstill(str(call), (fate.number, fate.number), over, None))

    async def _put(self, fates: Sequence[Fate], how: How, seconds: float) -> None:
        queue = self.arm.queue

        async def putting() -> None:
            self.record.begun = max(self.record.begun, fates[-1].number)
            if len(fates) == 1:
                self._have(fates[0], await queue.put(*self.entries[fates[0].number]))
            else:
                async with queue.batch() as batch:
                    for fate in fates:
                        self._have(fate, batch.put(*self.entries[fate.number]))

        def hurried() -> None:
            for fate in fates:
                fate.cancelled = True

        call = Call(f"put of {fates[0].number} to {fates[-1].number}")
        await made(call, putting, how, seconds, hurried)
        self.record.note(f"ended: {call}")
        if isinstance(call.error, DobotError):
            for fate in fates:
                if fate.motion is None:
                    fate.ended, fate.error = self.now, call.error

    def _have(self, fate: Fate, motion: Any) -> None:
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

        if fate.ended is not None and repr(fate.error) != repr(error):
            raise Violation(f"{fate} ended twice: {fate.error!r}, {error!r}")

        if fate.ended is None:
            fate.error, fate.ended = error, self.now
            self.record.note(f"{fate.kind} {fate.number} ended: {error!r}")

    async def _read(self, row: Any, value: Any, timeout: float | None, how: How, seconds: float) -> None:
        call = Call(row.name, timeout)
        await made(call, lambda: self.arm.request(row, value, timeout=timeout), how, seconds)
        self.note(call)
        judge_answer(call, row, value, self.seen, self.plan)

    async def _set(self, row: Any, value: Any, how: How, seconds: float) -> None:
        call = Call(row.name)
        await made(call, lambda: self.arm.request(row, value), how, seconds)
        self.note(call)
        judge_set(call, row, value, self.seen)

    async def _jog(self, direction: Jog, way: str, seconds: float, hurried: float) -> None:
        """Jogs until the block is left, normally, by an error, or by being cancelled."""
        async with self.jogs:
            call = Call(f"jog, left by {way}")
            jogging = Jogging(call, self.now)
            self.record.joggings.append(jogging)

            async def block() -> None:
                async with self.arm.jogging(direction):
                    try:
                        await asyncio.sleep(seconds if way in {"over", "error"} else PATIENT)
                        if way == "error":
                            raise Mine
                    finally:
                        jogging.over = self.now

            how: How = "cancel" if way == "cancel" else "limit" if way == "limit" else "plain"
            try:
                await made(call, block, how, hurried)
            finally:
                if jogging.over is None:
                    jogging.over = self.now if call.hurried is None else call.hurried

            self.note(call)
            if way == "error" and not isinstance(call.error, Mine) and jogging.over != call.ended:
                raise Violation(f"an error was replaced by another one: {call}")


ACTIONS = {
    "put": 30,
    "batch": 8,
    "wait": 12,
    "join": 4,
    "own_move": 8,
    "stop": 3,
    "clear": 1,
    "recover": 2,
    "pause": 2,
    "resume": 4,
    "read": 14,
    "set": 4,
    "jog": 4,
    "sleep": 5,
}
"""What a user may do, and how often."""


async def play(seed: int, trace: Callable[[str], None] | None = None) -> Outcome:
    """Runs a seed; raises Violation."""
    random = Random(seed)
    plan = Plan.of(random)
    if trace:
        trace(str(plan))

    loop = asyncio.get_running_loop()
    record = Record(SPEED, loop.time, trace)
    async with simulate(faults=plan.faults, seed=seed, options=plan.options, speed=SPEED) as sim:
        sim.arm.state.set(c.SET_JOG_JOINT_PARAMS, c.JOGJointParams(CRAWL, (100,) * 4))
        sim.arm.state.set(c.SET_JOG_COORDINATE_PARAMS, c.JOGCoordinateParams(CRAWL, (100,) * 4))
        seen = Observed(sim, loop.time, random, trace, plan.late)
        runs: list[Run] = []
        playing = loop.create_task(connected(plan, random, sim, record, seen, runs))
        await asyncio.wait([playing], timeout=ENDLESS)
        if not playing.done():
            playing.cancel()
            await asyncio.wait([playing])
            raise Violation("calls go on for ever on a line that is bad now and then")

        error = None if playing.cancelled() else playing.exception()
        try:
            if plan.disaster == "leave":
                await left(runs[0], error, cancelled=playing.cancelled())
            elif error:
                raise error
        finally:
            for task in (task for run in runs for task in run.tasks):
                task.cancel()

            for run in runs:
                if run.tasks:
                    await asyncio.wait(run.tasks)

        if plan.disaster == "unplug":
            await asyncio.wait_for(again(sim), LONG)

        judge(record, seen, sim, plan)
        doubled = len(sim.arm.executed) - len({(each.index, each.value) for each in sim.arm.executed})
        return Outcome(loop.time(), seen.sent, len(sim.arm.executed), doubled, len(record.failed), len(sim.outages))


async def again(sim: Simulation) -> None:
    """Another program connects to an arm whose cable was pulled, perhaps in the middle of a jog, and moves it."""
    async with Magician.connect(sim.url, timeout=PATIENT) as arm:
        await arm.stop()
        await arm.recover()
        await arm.move_to(220, 0, 40)


async def connected(
    plan: Plan, random: Random, sim: Simulation, record: Record, seen: Observed, runs: list[Run]
) -> None:
    """The block of a connection, which is left normally, by an error, or by being cancelled."""
    leaves = plan.disaster == "leave"
    # A line that stands still while it is connected to tells nothing: it fails as it should.
    faults, stall, silence = sim.faults, sim.faults.stall, sim.faults.silence
    faults.stall = faults.silence = 0.0
    connecting = Magician.connect(sim.url, window=plan.window, timeout=PATIENT, on_error="stop" if leaves else "leave")
    async with connecting as arm:
        faults.stall, faults.silence = stall, silence
        run = Run(plan, random, sim, arm, record, seen)
        runs.append(run)
        try:
            await run.play()
        finally:
            record.left_at = run.now if leaves else record.left_at

        if not leaves:
            await run.finish()
            return

        record.note("left")
        if random.random() < 0.5:
            raise Mine

        current = asyncio.current_task()
        assert current
        current.cancel()
        await asyncio.sleep(0)


async def left(run: Run, error: BaseException | None, *, cancelled: bool) -> None:
    """A block that was left by an error has left an arm that stands, as soon as the line lets it hear of it."""
    record, now = run.record, run.now
    if not (cancelled or isinstance(error, Mine)):
        raise error or Violation("a block that was cancelled ended as if nothing had happened")

    if now > record.left_at + LEAVING:
        raise Violation(f"it took {now - record.left_at:.2f} s to leave the connection's block")

    record.stops.append((record.left_at, now))
    run.mend()
    await run.ends(run.all_told(), "connection that is closed")
    stream = not run.plan.datagrams and not run.plan.loses
    silenced = run.plan.faults.silence_time and run.seen.silent(record.left_at - 1, now, 1.0)
    if stream and not silenced:
        begun = record.left_at
        limit = run.seen.good_from(begun, 1.0)
        await asyncio.sleep(max(0.0, limit - run.now))
        device = run.sim.arm.device
        if device.executing or device.beside:
            raise Violation(f"the block was left at {begun:.4f}, and the arm moves at {limit:.4f}")

        record.standstills.append(Standstill("left", (0, record.begun), begun, None))


def run_seed(seed: int, trace: Callable[[str], None] | None = None) -> Outcome:
    """Runs a seed on a virtual clock.

    Raises:
        Violation: Something was not as it must be; or it never ends, or tasks are left behind.
    """

    async def checked() -> Outcome:
        outcome = await play(seed, trace)
        left = asyncio.all_tasks() - {asyncio.current_task()}
        if left:
            raise Violation(f"tasks are left behind: {left}")

        return outcome

    with wall_clock(), asyncio.Runner(loop_factory=async_solipsism.EventLoop) as runner:
        return runner.run(checked())


@contextmanager
def wall_clock() -> Iterator[None]:
    """Ends what never ends by itself: a virtual clock runs as fast as it can."""

    rung = []

    def endless(_signal: int, _frame: FrameType | None) -> None:
        rung.append(Endless(f"still running after {MOST_CPU} s of the processor"))
        raise rung[0]

    previous = signal.signal(signal.SIGVTALRM, endless)
    signal.setitimer(signal.ITIMER_VIRTUAL, MOST_CPU)  # seconds of the processor, which others may be using
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, previous)

    # Raised in the middle of a task that nobody awaits, it would end that task alone, and the run would count as good.
    if rung:
        raise rung[0]


class Endless(BaseException):
    """Passes every `except Exception` on its way out."""
