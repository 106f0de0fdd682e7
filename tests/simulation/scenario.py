"""One seed is one run: a program at random, on a line with faults at random, in virtual time; it must tell the truth.

    seed --> Plan (line, arm, window) --> Run (actions, what each was told) --> judgement.judge (what the arm recorded)

The driver and the simulated arm run in one process on one virtual clock, and all that is random comes from the seed, so
a seed that fails once fails always. Each command has a number of its own, so none can be mistaken for another.
"""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable, Coroutine, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from random import Random
from types import FrameType
from typing import Any, Literal

import async_solipsism
from judgement import Fate, Kind, Record, Violation, judge

from dobot_async import DobotError, Magician, PTPMode
from dobot_async.magician import commands as c
from dobot_async.magician.frame import Frame
from dobot_async.pending import LINGER
from dobot_async.simulator import Faults, Simulation, simulate
from dobot_async.simulator.work import DeviceOptions

__all__ = ["Outcome", "Plan", "Violation", "run_seed"]

SPEED = 20.0
LONG = 120.0  # virtual seconds within which everything completes once the line is good again
PATIENT = 60.0  # virtual seconds that a read may take on a bad line
WALL = 30  # seconds after which a run counts as endless
ADC_STEP = 100

COMMANDS: dict[Kind, Callable[[int], tuple[Any, Any]]] = {
    "move": lambda number: (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 200 + number / 8, 40 * (-1) ** number, 40)),
    "step": lambda number: (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ_INC, 0, 0, (number + 1) / 1024)),
    "far": lambda number: (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 500 + number, 0, 0)),
    "wait": lambda number: (c.SET_WAIT_CMD, c.WAITCmd(500 + number)),
    "pwm": lambda number: (c.SET_IOPWM, c.IOPWM(1, 1000 + number, 50)),
}
"""What the command of a number is: absolute, relative, out of reach, one that takes time, one that takes none."""

MOMENTS = (0.0, 0.0, 0.0005, 0.001, 0.003, 0.01, 0.03, 0.1, 0.5, 2.0)


@dataclass(frozen=True)
class Plan:
    """What a seed stands for.

    Attributes:
        severity: Of the line: "none", "mild" or "harsh".
        datagrams: Whether the line doubles and reorders messages; a stream splits, merges and stalls.
        kinds: What is put.
        disaster: What happens once, if anything.
    """

    severity: Literal["none", "mild", "harsh"]
    datagrams: bool
    faults: Faults
    options: DeviceOptions
    window: int
    kinds: Sequence[Kind]
    disaster: Literal["", "power", "unplug"]
    steps: int
    doubles: bool

    @property
    def disorder(self) -> float:
        """Of the line, in seconds."""
        return self.faults.jitter + self.faults.reorder

    @classmethod
    def of(cls, random: Random) -> Plan:
        severity: Any = random.choice(["none", "mild", "harsh", "harsh"])
        datagrams = random.random() < 0.4
        kinds: list[Kind] = ["move", "move", "move", "step", "wait", "pwm", "pwm"]
        if random.random() < 0.4:
            kinds.remove("step")

        if random.random() < 0.3:
            kinds.append("far")

        faults = line(random, severity, datagrams=datagrams)
        return cls(
            severity,
            datagrams,
            faults,
            DeviceOptions(capacity=random.choice([1, 2, 8, 32]), on_fault=random.choice(["halt", "continue"])),
            random.choice([1, 4]) if severity == "none" and not datagrams else 1,
            kinds,
            random.choice(["power", "unplug"]) if random.random() < 0.1 else "",
            random.randint(5, 40),
            faults.dup > 0,
        )


def line(random: Random, severity: str, *, datagrams: bool) -> Faults:
    """What the line does."""
    latency = random.choice([0.0, 0.0005, 0.003, 0.01])
    if severity == "none":
        return Faults(latency=latency)

    scale = 1.0 if severity == "harsh" else 0.1
    faults = Faults(
        loss=random.choice([0, 0.05, 0.2]) * scale,
        corrupt=random.choice([0, 0.05]) * scale,
        noise=random.choice([0, 0.05]) * scale,
        stall=random.choice([0, 0, 0.01]) * scale,
        latency=latency,
    )
    if datagrams:
        faults.dup = random.choice([0, 0.05]) * scale
        faults.jitter = random.choice([0.002, 0.005, 0.02])
        faults.reorder = random.choice([0, 0.005, 0.01])
    else:
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
    unknown: int = 0


@dataclass
class Run:
    """A program under way."""

    plan: Plan
    random: Random
    sim: Simulation
    arm: Magician
    record: Record
    entries: list[tuple[Any, Any]] = field(default_factory=list)
    tasks: list[asyncio.Task[None]] = field(default_factory=list)

    @property
    def now(self) -> float:
        return asyncio.get_running_loop().time()

    async def play(self) -> None:
        """Takes all steps, a disaster among them if there is to be one."""
        disaster = self.random.randrange(self.plan.steps) if self.plan.disaster else -1
        if self.plan.disaster == "power":
            await self.arm.clear_alarms(timeout=PATIENT)  # so that the alarm of a restart tells

        for number in range(self.plan.steps):
            if number == disaster:
                await self.strike()

            if self.plan.disaster == "unplug" and number >= disaster:
                break

            with self.tolerating():
                await self.step()

    async def step(self) -> None:
        """One thing that a user does; a put goes on beside the next ones."""
        random = self.random
        action = random.choices(list(ACTIONS), list(ACTIONS.values()))[0]
        seconds = random.choice(MOMENTS)
        self.record.note(f"{action}, {seconds} s")
        await getattr(self, action)(seconds)

    async def put(self, seconds: float) -> None:
        self.putting(self.pick())
        await asyncio.sleep(seconds)

    async def batch(self, seconds: float) -> None:
        self.putting(self.pick(self.random.randint(2, 7)))
        await asyncio.sleep(seconds)

    async def cancel_put(self, seconds: float) -> None:
        before = len(self.record.fates)
        task = self.putting(self.pick(self.random.randint(1, 3)))
        await asyncio.sleep(seconds)
        if not task.done():
            task.cancel()
            for fate in self.record.fates[before:]:
                fate.cancelled = True

    async def wait(self, seconds: float) -> None:
        motions = [fate.motion for fate in self.record.fates if fate.motion]
        if motions:
            with suppress(DobotError):
                await self.random.choice(motions).wait(seconds)

    async def cancel_wait(self, seconds: float) -> None:
        motions = [fate.motion for fate in self.record.fates if fate.motion]
        if motions:
            waiting = asyncio.create_task(self.random.choice(motions).wait())
            await asyncio.sleep(seconds)
            waiting.cancel()
            await asyncio.wait([waiting])

    async def own_move(self, seconds: float) -> None:
        """A move that belongs to its call, cancelled after a while."""
        fate = self.fate(self.random.choice([kind for kind in self.plan.kinds if kind != "pwm"]), watched=False)
        start = self.now
        task = asyncio.create_task(self._own(fate))
        await asyncio.wait([task], timeout=seconds)
        if not task.done():
            cancelled_at = self.now
            task.cancel()
            fate.cancelled = True
            await asyncio.wait([task])
            self.record.stops.append((cancelled_at, self.now))
            self.record.standstills.append((start, self.now, fate.number))

        with suppress(asyncio.CancelledError):
            task.result()

    async def stop(self, seconds: float) -> None:
        await self.stopping(self.random.choice([self.arm.stop, self.arm.queue.clear]))

    async def recover(self, seconds: float) -> None:
        await self.stopping(self.recovering)

    async def recovering(self) -> None:
        """As `arm.recover`, with more patience."""
        await self.arm.clear_alarms(timeout=PATIENT)
        await self.arm.queue.clear()

    async def pause(self, seconds: float) -> None:
        await self.arm.pause()

    async def resume(self, seconds: float) -> None:
        await self.arm.resume()

    async def join(self, seconds: float) -> None:
        with suppress(DobotError):
            await self.arm.queue.join(seconds)

    async def pose(self, seconds: float) -> None:
        self.spawn(self._read_pose())
        await asyncio.sleep(seconds)

    async def inputs(self, seconds: float) -> None:
        for _ in range(self.random.randint(1, 4)):
            self.spawn(self._read_input(self.random.randint(1, 20)))

        await asyncio.sleep(seconds)

    async def sleep(self, seconds: float) -> None:
        await asyncio.sleep(seconds)

    async def strike(self) -> None:
        """The power fails for a moment, or the cable is pulled."""
        self.record.struck_at = self.now
        if self.plan.disaster == "power":
            self.sim.arm.power_cycle()
        else:
            self.sim.unplug()

    async def finish(self) -> None:
        """On a line that is good again, everything comes to its end, and the arm moves once more."""
        faults = self.sim.faults
        faults.loss = faults.corrupt = faults.noise = faults.stall = faults.dup = 0.0
        unplugged = self.plan.disaster == "unplug"
        ending = asyncio.create_task(self.end(unplugged=unplugged))
        await asyncio.wait([ending], timeout=LONG)
        if not ending.done():
            waiting = [str(task.get_stack(limit=1)) for task in asyncio.all_tasks()]
            ending.cancel()
            await asyncio.wait([ending])
            raise Violation(f"not everything ended within {LONG} s on a good line: {waiting}")

        ending.result()

        await asyncio.sleep(LINGER + 1)
        self.record.left_over = len(self.arm.link._pending)
        self.record.pending = self.arm.queue.pending
        self.record.entering = len(self.arm.queue._entering)

    async def end(self, *, unplugged: bool) -> None:
        """Waits for all that was begun, then moves once more."""
        with self.tolerating():
            await self.arm.resume()

        with self.tolerating():
            await self.all_told()

        if not unplugged:
            await self.last_moves()

    async def all_told(self) -> None:
        """Waits for every task and every Motion."""
        while any(not task.done() for task in self.tasks):
            await asyncio.wait(self.tasks)

        for task in self.tasks:
            if not task.cancelled():
                task.result()

        for fate in self.record.fates:
            await self._watch(fate)

    async def last_moves(self) -> None:
        """What a cancelled put has left behind nobody waits for; the next command brings it to light."""
        for _ in range(3):
            try:
                await self.arm.queue.wait(0)
                await self.arm.queue.join()
                break
            except DobotError as error:
                self.record.failed(error)

        await self.stopping(self.arm.recover)
        await self.arm.move_to(220, 0, 40)
        pose = await self.arm.get_pose()
        if abs(pose.x - 220) + abs(pose.y) + abs(pose.z - 40) > 0.1:
            raise Violation(f"after the last move the arm stands at {pose}")

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
        return self.spawn(self._put(fates))

    async def stopping(self, how: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Throws away what is queued, and notes when."""
        start, before = self.now, len(self.record.fates)
        try:
            await how()
        finally:
            self.record.stops.append((start, self.now))

        self.record.standstills.append((start, self.now, before - 1))

    def spawn(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        self.tasks.append(asyncio.create_task(work))
        return self.tasks[-1]

    @contextmanager
    def tolerating(self) -> Iterator[None]:
        """Notes how a call failed; whether it was allowed to is judged at the end."""
        try:
            yield
        except DobotError as error:
            self.record.failed(error)

    async def _own(self, fate: Fate) -> None:
        row, value = self.entries[fate.number]
        try:
            await self.arm.perform(row, value, None)
        except DobotError as error:
            fate.error = error

        fate.ended = self.now

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
                if fate.motion is None:
                    fate.ended, fate.error = self.now, error

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

        if fate.ended is not None and fate.error is not error:
            raise Violation(f"{fate} ended twice: {fate.error!r}, {error!r}")

        if fate.ended is None:
            fate.error, fate.ended = error, self.now
            self.record.note(f"{fate.kind} {fate.number} ended: {error!r}")

    async def _read_pose(self) -> None:
        start = self.now
        with self.tolerating():
            pose = await self.arm.get_pose(timeout=PATIENT)
            self.record.check_pose(pose, start - 2 * self.arm.link.disorder, self.now)

    async def _read_input(self, address: int) -> None:
        with self.tolerating():
            if address % 2:
                got, want = int(await self.arm.get_input(address, timeout=PATIENT)), address // 2 % 2
            else:
                got, want = await self.arm.get_adc(address, timeout=PATIENT), ADC_STEP * address

            if got != want:
                raise Violation(f"the input at {address} is {want}, and was read as {got}")


ACTIONS = {
    "put": 30,
    "batch": 8,
    "cancel_put": 6,
    "wait": 12,
    "cancel_wait": 4,
    "own_move": 6,
    "stop": 3,
    "recover": 2,
    "pause": 2,
    "resume": 4,
    "join": 4,
    "pose": 8,
    "inputs": 6,
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
        for address in range(1, 21):
            sim.arm.set_input(address, address // 2 % 2)
            sim.arm.set_adc(address, ADC_STEP * address)

        answer = sim.arm.answer

        def recorded(frame: Frame) -> bytes:
            reply: bytes = answer(frame)
            record.answered(loop.time(), frame, reply)
            if trace:
                trace(f"{loop.time():10.4f}      arm  {named(frame)} -> {reply.hex(' ')}")

            return reply

        vars(sim.arm)["answer"] = recorded
        async with Magician.connect(sim.url, window=plan.window, timeout=PATIENT, on_error="leave") as arm:

            def heard(outgoing: bool, frame: Frame) -> None:
                record.heard(loop.time(), outgoing=outgoing)
                if trace:
                    trace(f"{loop.time():10.4f} {'-->' if outgoing else '<--'}      {named(frame)}")

            arm.link.trace = heard
            run = Run(plan, random, sim, arm, record)
            try:
                await run.play()
                await run.finish()
            finally:
                for task in run.tasks:
                    task.cancel()

                if run.tasks:
                    await asyncio.wait(run.tasks)

            stats = arm.link.stats

        if plan.disaster == "unplug":
            async with Magician.connect(sim.url, timeout=PATIENT) as arm:
                await arm.recover()
                await arm.move_to(220, 0, 40)

        judge(record, sim, plan)
        doubled = len(sim.arm.executed) - len({(each.index, each.value) for each in sim.arm.executed})
        return Outcome(loop.time(), stats.sent, len(sim.arm.executed), doubled, len(record.failures))


def named(frame: Frame) -> str:
    """A frame for the trace."""
    row = c.BY_KEY.get((frame.id, frame.write))
    return f"{row.name if row else frame.id} {'q ' if frame.queued else ''}{frame.params.hex(' ')}"


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
        rung.append(Endless(f"still running after {WALL} s"))
        raise rung[0]

    previous = signal.signal(signal.SIGALRM, endless)
    signal.alarm(WALL)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, previous)

    # Raised in the middle of a task that nobody awaits, it would end that task alone, and the run would count as good.
    if rung:
        raise rung[0]


class Endless(BaseException):
    """Passes every `except Exception` on its way out."""
