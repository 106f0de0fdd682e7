"""The table verb x trouble: what an ultraArm's await says, compared with what the simulated arm recorded.

verb    home, move_to, move_by, move_joints, move_joint, and what moves nothing; jogs and reads
place   alone, on the queue, in a batch, as a line of G-code; each with a pump behind it that only runs if it is done
trouble out of reach, no power, not homed, at a limit, the line dead or standing still for 30 s, cancelled
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest
from virtual import run_virtual

from dobot_async import ArmAlarm, CommandRejected, DobotError, MotionStopped, MotionUnknown, ReplyTimeout, UltraArm
from dobot_async.simulator import Faults, Simulation, UltraArmQuirks, simulate

pytestmark = pytest.mark.cases(3)

START = (200.0, 0.0, 60.0)
SOON = 2.0  # seconds within which a cancellation comes out
Verbs = Any  # the arm, its queue, or a batch


@dataclass(frozen=True)
class Verb:
    """A motion: how it is called in each place, what the arm records of it, and where it leads.

    Attributes:
        call: On the arm, its queue, or a batch.
        line: As G-code.
        names: What the arm may record of it.
    """

    call: Callable[[Verbs], Any]
    lines: tuple[str, ...]
    names: frozenset[str]


def verb(call: Callable[[Verbs], Any], line: str, *names: str) -> Verb:
    return Verb(call, tuple(line.split("; ")), frozenset(names))


MOTIONS = {
    "home": verb(lambda on: on.home(), "G28", "G28"),
    "move_to": verb(lambda on: on.move_to(200, 50, 60, speed=20), "G0 X200 Y50 Z60 F20", "G0"),
    "a line": verb(lambda on: on.move_to(200, 50, 60, speed=20), "G1 X200 Y50 Z60 F20", "G0", "G1"),
    "move_by": verb(lambda on: on.move_by(y=50, speed=20), "G91; G1 Y50 F20", "G0", "G1"),
    "move_joints": verb(lambda on: on.move_joints(30, 20, 20, speed=20), "M11 X30 Y20 Z20 F20", "M11"),
    "move_joint": verb(lambda on: on.move_joint(1, 30, speed=20), "M10 J1 A30 F20", "M10"),
}
OUT_OF_REACH = {
    "move_to": verb(lambda on: on.move_to(60, 0, 49), "G0 X60 Y0 Z49", "G0"),
    "move_by": verb(lambda on: on.move_by(-140, 0, -11), "G91; G1 X-140 Z-11", "G0", "G1"),
    "a line through the base": verb(lambda on: on.move_to(-200, 0, 60), "G1 X-200", "G0", "G1"),
}
BEYOND = {
    "move_to": verb(lambda on: on.move_to(z=140), "G0 Z140"),
    "move_by": verb(lambda on: on.move_by(z=100), "G91; G1 Z100"),
    "move_joints": verb(lambda on: on.move_joints(171, 0, 0), "M11 X171 Y0 Z0"),
    "move_joint": verb(lambda on: on.move_joint(2, 91), "M10 J2 A91"),
}
SETTINGS: dict[str, Callable[[Verbs], Any]] = {
    "suction": lambda on: on.suction(True),
    "gripper": lambda on: on.gripper(False),
    "gripper_to": lambda on: on.gripper_to(40),
    "laser": lambda on: on.laser(True),
    "set_position": lambda on: on.set_position(0, 0, 0),
    "wait": lambda on: on.wait(3),
    "relative": lambda on: on.relative(),
    "power_on": lambda on: on.power_on(),
}
READS: dict[str, Callable[[UltraArm], Coroutine[Any, Any, object]]] = {
    "get_pose": lambda arm: arm.get_pose(),
    "get_joints": lambda arm: arm.get_joints(),
    "get_info": lambda arm: arm.get_info(),
    "get_alarms": lambda arm: arm.get_alarms(),
    "clear_alarms": lambda arm: arm.clear_alarms(),
    "is_moving": lambda arm: arm.is_moving(),
    "pause": lambda arm: arm.pause(),
    "resume": lambda arm: arm.resume(),
    "release": lambda arm: arm.release(),
}


async def alone(arm: UltraArm, each: Verb) -> None:
    await each.call(arm)
    await arm.suction(True)


async def queued(arm: UltraArm, each: Verb) -> None:
    motion = await each.call(arm.queue)
    behind = await arm.queue.suction(True)
    results = await asyncio.gather(motion, behind, return_exceptions=True)
    failed_alike(results)


async def batched(arm: UltraArm, each: Verb) -> None:
    async with arm.queue.batch() as batch:
        motion = each.call(batch)
        behind = batch.suction(True)

    results = await asyncio.gather(motion, behind, return_exceptions=True)
    failed_alike(results)


async def as_gcode(arm: UltraArm, each: Verb) -> None:
    program = asyncio.ensure_future(run(arm, [*each.lines, "M23"]))
    (failure,) = await asyncio.gather(program, return_exceptions=True)
    if isinstance(failure, DobotError):
        known = isinstance(failure, (ArmAlarm, CommandRejected))
        named = [f"line {len(each.lines)} "] if known else ["line 1 ", "line 2 ", "the program's own G90"]
        assert failure.__notes__[0].startswith(tuple(named)), "the line that failed is named"

    if isinstance(failure, BaseException):
        raise failure


async def run(arm: UltraArm, lines: list[str]) -> None:
    await arm.run_gcode(lines)


def failed_alike(results: Sequence[Any]) -> None:
    """What is behind a motion that has failed has not been done either."""
    motion, behind = results
    if isinstance(motion, BaseException):
        assert isinstance(behind, BaseException)
        raise motion

    assert behind is None


PLACES: dict[str, Callable[[UltraArm, Verb], Coroutine[Any, Any, None]]] = {
    "alone": alone,
    "queued": queued,
    "batched": batched,
    "as G-code": as_gcode,
}
QUIRKS = (UltraArmQuirks(), UltraArmQuirks(acknowledge="nothing", jog_stop="all"))
in_each_place = pytest.mark.parametrize("place", PLACES)
with_each_firmware = pytest.mark.parametrize("quirks", QUIRKS, ids=["default", "silent"])


@dataclass
class Bench:
    """A simulated arm at START, the driver, and the line between them."""

    sim: Simulation
    arm: UltraArm
    faults: Faults
    before: int = 0

    def recorded(self, *names: str, outcome: str = "done") -> list[Any]:
        """What the arm has recorded since it came to START."""
        records = self.sim.arm.executed[self.before :]
        return [each for each in records if each.outcome == outcome and (not names or each.name in names)]

    @property
    def stands(self) -> bool:
        return not self.sim.arm.device.moving and not self.sim.arm.queue_size


def on_a_bench(
    work: Callable[[Bench], Awaitable[None]], quirks: UltraArmQuirks = QUIRKS[0], *, latency: float = 0.0
) -> None:
    """Runs a test on virtual time."""

    async def run() -> None:
        faults = Faults(latency=latency)
        async with (
            simulate("ultraarm", faults=faults, quirks=quirks, homed=True) as sim,
            UltraArm.connect(sim.url, on_error="leave") as arm,
        ):
            await arm.move_to(*START, speed=200)
            await work(Bench(sim, arm, faults, len(sim.arm.executed)))

    run_virtual(run())


@contextmanager
def failing(*kinds: type[BaseException], match: str | None = None) -> Iterator[None]:
    with pytest.raises(kinds, match=match):
        yield


# Motions.


@with_each_firmware
@in_each_place
@pytest.mark.parametrize("name", MOTIONS)
def test_a_motion_that_can_be_done(name: str, place: str, quirks: UltraArmQuirks) -> None:
    async def work(b: Bench) -> None:
        await PLACES[place](b.arm, MOTIONS[name])
        (motion,) = b.recorded(*MOTIONS[name].names)
        (pump,) = b.recorded("M23")
        assert motion.finished <= pump.started
        assert motion.finished > motion.started
        assert b.sim.arm.missed == 0

    on_a_bench(work, quirks)


@with_each_firmware
@in_each_place
@pytest.mark.parametrize("name", OUT_OF_REACH)
def test_out_of_reach(name: str, place: str, quirks: UltraArmQuirks) -> None:
    async def work(b: Bench) -> None:
        with failing(ArmAlarm, match="came to rest"):
            await PLACES[place](b.arm, OUT_OF_REACH[name])

        assert b.sim.arm.missed == 1
        assert not b.sim.arm.registers.pump
        assert not b.sim.arm.registers.relative
        await b.arm.move_to(200, 10, 60)  # places are meant again, and the arm goes on
        assert abs(b.sim.arm.pose.y - 10) < 0.01

    on_a_bench(work, quirks)


@in_each_place
@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("trouble", ["no power", "not homed"])
def test_what_somebody_else_has_done_to_the_motors(trouble: str, name: str, place: str) -> None:
    """The driver has not been told: the goal tells."""

    async def work(b: Bench) -> None:
        b.sim.arm.registers.release(b.sim.arm.device.joints)
        b.sim.arm.registers.powered = trouble == "not homed"
        if (trouble, name) == ("not homed", "home"):
            await PLACES[place](b.arm, MOTIONS[name])
            assert b.sim.arm.registers.homed
            return

        with failing(ArmAlarm, match="came to rest|nothing moved"):
            await PLACES[place](b.arm, MOTIONS[name])

        assert not b.sim.arm.registers.pump
        assert b.sim.arm.missed

    on_a_bench(work)


@pytest.mark.parametrize("stood", [(0, 0, 0, 0), (30, 10, 10, 0)], ids=["at home", "elsewhere"])
@pytest.mark.parametrize("switches", [(1, 1, 1), None], ids=["switches", "no switches"])
def test_home_without_power(switches: Any, stood: Any) -> None:
    async def run() -> None:
        async with (
            simulate("ultraarm", homed=True) as sim,
            UltraArm.connect(sim.url, home_switches=switches) as arm,
        ):
            sim.arm.guide_to(*stood)
            sim.arm.registers.powered = False
            with failing(ArmAlarm, match="nothing moved"):
                await arm.home()

            assert sim.arm.missed
            sim.arm.registers.powered = True
            await arm.home()
            assert [each.name for each in sim.arm.executed if each.finished > each.started] == ["G28"]

    run_virtual(run())


def test_power_that_is_lost_on_the_way_home() -> None:
    async def work(b: Bench) -> None:
        motion = await b.arm.queue.home()
        await asyncio.sleep(0.2)
        b.sim.arm.answer(b"M17")
        with failing(ArmAlarm, match="home switches read 1, 0, 0, not 1, 1, 1"):
            await motion

        assert not b.sim.arm.registers.homed

    on_a_bench(work)


@in_each_place
@pytest.mark.parametrize("name", BEYOND)
def test_at_a_limit(name: str, place: str) -> None:
    """What leads beyond the limits is not sent; of increments in a queue that shows when their turn comes."""

    async def work(b: Bench) -> None:
        requests = b.sim.arm.counters.requests
        with failing(ValueError, CommandRejected, match="must be in"):
            await PLACES[place](b.arm, BEYOND[name])

        if name != "move_by" or place == "alone":
            assert b.sim.arm.counters.requests == requests

        assert not b.recorded("G0", "G1", "M10", "M11", "M23")
        assert b.sim.arm.missed == 0
        assert abs(b.sim.arm.pose.z - 60) < 0.01

    on_a_bench(work)


@in_each_place
@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("after", [0.0, 0.5])
def test_a_dead_line(after: float, name: str, place: str) -> None:
    async def work(b: Bench) -> None:
        loop = asyncio.get_running_loop()
        b.faults.silent = not after
        loop.call_later(after, setattr, b.faults, "silent", True)
        started = loop.time()
        with failing(MotionUnknown):
            await PLACES[place](b.arm, MOTIONS[name])

        assert loop.time() < started + 15
        assert not b.sim.arm.registers.pump
        b.faults.silent = False
        await asyncio.sleep(1.5)
        assert b.stands, "it is told to stop until it has heard that"

    on_a_bench(work)


@in_each_place
@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("after", [0.0, 0.005, 0.5])
def test_a_line_that_stands_still_for_30_s(after: float, name: str, place: str) -> None:
    async def work(b: Bench) -> None:
        loop = asyncio.get_running_loop()
        loop.call_later(after, setattr, b.faults, "stalled", True)
        loop.call_later(30, setattr, b.faults, "stalled", False)
        with failing(MotionUnknown):
            await PLACES[place](b.arm, MOTIONS[name])

        await asyncio.sleep(35)
        assert b.stands
        assert len(b.recorded(*MOTIONS[name].names)) <= 1
        assert not b.sim.arm.registers.pump

    on_a_bench(work, latency=0.002)


@in_each_place
@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("after", [0.0, 0.001, 0.01, 0.5])
def test_cancelled(after: float, name: str, place: str) -> None:
    """What is awaited alone stops the arm; what is queued goes on, for it belongs to its queue."""

    async def work(b: Bench) -> None:
        loop = asyncio.get_running_loop()
        called = asyncio.ensure_future(PLACES[place](b.arm, MOTIONS[name]))
        await asyncio.sleep(after)
        called.cancel()
        cancelled = loop.time()
        with failing(asyncio.CancelledError):
            await called

        assert loop.time() <= cancelled + SOON
        if place in {"alone", "as G-code"}:
            assert b.stands
            here = b.sim.arm.pose
            await asyncio.sleep(10)
            assert b.sim.arm.pose == here
            assert not b.sim.arm.registers.pump
            assert not b.recorded(*MOTIONS[name].names)
        else:
            await b.arm.queue.join()
            done = b.recorded(*MOTIONS[name].names)
            assert len(b.recorded("M23")) <= len(done) <= 1, "the call may have been left before the pump was put"
            assert done or after == 0.0

    on_a_bench(work, latency=0.002)


@in_each_place
@pytest.mark.parametrize("name", MOTIONS)
def test_stopped(name: str, place: str) -> None:
    async def work(b: Bench) -> None:
        called = asyncio.ensure_future(PLACES[place](b.arm, MOTIONS[name]))
        await asyncio.sleep(0.5)
        await b.arm.stop()
        assert b.stands
        with failing(MotionStopped):
            await called

        assert b.recorded(*MOTIONS[name].names, outcome="aborted")
        assert not b.sim.arm.registers.pump

    on_a_bench(work)


# What moves nothing.


@pytest.mark.parametrize("trouble", ["dead line", "stall", "cancelled", "no power", "not homed"])
@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("place", ["alone", "queued"])
def test_settings(place: str, name: str, trouble: str) -> None:
    async def work(b: Bench) -> None:
        call = SETTINGS[name]
        loop = asyncio.get_running_loop()

        async def do() -> None:
            if place == "alone":
                await call(b.arm)
            else:
                await (await call(b.arm.queue))

        if trouble in {"no power", "not homed"}:
            b.sim.arm.registers.release(b.sim.arm.device.joints)
            b.sim.arm.registers.powered = trouble == "not homed"
            before = b.sim.arm.device.now
            await do()  # it needs neither
            assert b.recorded()
            if name == "wait":
                assert b.sim.arm.device.now >= before + 3
        elif trouble == "cancelled":
            called = asyncio.ensure_future(do())
            await asyncio.sleep(0)
            called.cancel()
            cancelled = loop.time()
            with failing(asyncio.CancelledError):
                await called

            assert loop.time() <= cancelled + SOON
        else:
            setattr(b.faults, "silent" if trouble == "dead line" else "stalled", True)
            loop.call_later(30, setattr, b.faults, "stalled", False)
            with failing(MotionUnknown, ReplyTimeout):
                await do()

            await asyncio.sleep(35)
            assert b.stands

    on_a_bench(work)


@pytest.mark.parametrize("name", READS)
@pytest.mark.parametrize("trouble", ["dead line", "stall", "cancelled"])
def test_reads(trouble: str, name: str) -> None:
    async def work(b: Bench) -> None:
        loop = asyncio.get_running_loop()
        await READS[name](b.arm)
        setattr(b.faults, "stalled" if trouble == "stall" else "silent", True)
        called = asyncio.ensure_future(READS[name](b.arm))
        started = loop.time()
        if trouble == "cancelled":
            await asyncio.sleep(0.1)
            called.cancel()
            with failing(asyncio.CancelledError):
                await called
        else:
            with failing(ReplyTimeout):
                await called

        assert loop.time() <= started + 6
        loop.call_later(30, setattr, b.faults, "stalled", False)
        await asyncio.sleep(31)
        b.faults.silent = False
        assert (await b.arm.get_pose()).x == 200

    on_a_bench(work)


# Jogs.


@pytest.mark.parametrize("word", ["x+", "x-", "y+", "y-", "z+", "z-", "j1+", "j1-", "j2+", "j2-", "j3+", "j3-"])
def test_a_jog_that_can_be_done(word: str) -> None:
    async def work(b: Bench) -> None:
        before = (*(await b.arm.get_pose()).joints, *b.sim.arm.device.joints)
        await b.arm.jog(word, 0.3, speed=10)
        assert b.stands
        assert b.recorded("M13", "M14")
        assert (*(await b.arm.get_pose()).joints, *b.sim.arm.device.joints) != before

    on_a_bench(work)


@pytest.mark.parametrize("trouble", ["at a limit", "into a limit", "no power", "not homed"])
@pytest.mark.parametrize("word", ["j1+", "j2-", "z+", "x+"])
def test_a_jog_that_does_not_go_on(word: str, trouble: str) -> None:
    async def work(b: Bench) -> None:
        if trouble == "at a limit":
            with failing(ArmAlarm, match="end of its way"):
                await b.arm.jog(word, 60, speed=200)
        elif trouble != "into a limit":
            b.sim.arm.registers.release(b.sim.arm.device.joints)
            b.sim.arm.registers.powered = trouble == "not homed"

        before = b.sim.arm.device.joints
        with failing(ArmAlarm, match="came to the end of its way" if trouble == "into a limit" else "did not set out"):
            await b.arm.jog(word, 20, speed=200)

        assert b.stands
        assert (b.sim.arm.device.joints != before) == (trouble == "into a limit")

    on_a_bench(work)


@pytest.mark.parametrize("trouble", ["a motion goes on", "another program's motion", "a jog goes on", "released"])
def test_a_jog_that_is_refused(trouble: str) -> None:
    async def work(b: Bench) -> None:
        match = {"released": "no power", "a motion goes on": "pending", "a jog goes on": "another jog"}
        motion = None
        if trouble == "a motion goes on":
            motion = await b.arm.queue.move_to(200, 50, 60, speed=20)
        elif trouble == "another program's motion":
            b.sim.arm.answer(b"G0 Y50 F20")
        elif trouble == "released":
            await b.arm.release()

        async def jog() -> None:
            with failing(CommandRejected, match=match.get(trouble, "moves")):
                await b.arm.jog("z+", 0.1)

        if trouble == "a jog goes on":
            async with b.arm.jogging("y+", speed=10):
                await jog()
                assert b.sim.arm.device.moving, "the first one goes on"
                with failing(CommandRejected, match="jog goes on"):
                    await b.arm.queue.move_to(200, 0, 60)
        else:
            await jog()

        if motion:
            await motion

        assert not b.recorded("M14") or trouble == "a jog goes on"

    on_a_bench(work)


def test_what_moves_nothing_is_done_inside_of_a_jog() -> None:
    async def work(b: Bench) -> None:
        loop = asyncio.get_running_loop()
        async with b.arm.jogging("z+", speed=10):
            before = loop.time()
            await b.arm.suction(True)
            await b.arm.gripper_to(0)
            assert loop.time() < before + 0.2
            assert b.sim.arm.registers.pump
            assert b.sim.arm.device.moving

        assert b.stands

    on_a_bench(work)


@pytest.mark.parametrize("trouble", ["dead before", "dead later", "stalls later", "cancelled"])
def test_a_jog_on_a_bad_line(trouble: str) -> None:
    async def work(b: Bench) -> None:
        loop = asyncio.get_running_loop()
        b.faults.silent = trouble == "dead before"
        called = asyncio.ensure_future(b.arm.jog("y+", 1.0, speed=2))
        await asyncio.sleep(0.5)
        if trouble == "cancelled":
            called.cancel()
            cancelled = loop.time()
            with failing(asyncio.CancelledError):
                await called

            assert loop.time() <= cancelled + SOON
            assert b.stands
            return

        if trouble != "dead before":
            setattr(b.faults, "silent" if trouble == "dead later" else "stalled", True)

        with failing(ReplyTimeout):
            await called

        if trouble != "dead before":
            assert b.sim.arm.device.moving, "nobody could tell it"

        b.faults.silent = b.faults.stalled = False
        await asyncio.sleep(1.5)
        assert b.stands

    on_a_bench(work)
