"""What comes out of each verb when the arm cannot do it, alone, queued and in a batch; what the arm recorded decides.

A motion that did not happen raises, and nothing behind it is begun. An arm that nobody commands any more stands.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest
from virtual import virtual

from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.errors import (
    ArmAlarm,
    CommandRejected,
    DobotError,
    MotionStopped,
    MotionUnknown,
    ReplyTimeout,
    UnsupportedError,
)
from dobot_async.simulator import MyCobotQuirks, Simulation, simulate

NEW, OLD = MyCobotQuirks(), MyCobotQuirks(acknowledges=False, later=False)
HERE = (30.0, -20.0, -40.0, -10.0, 20.0, 60.0)
HERE_OF_7 = (30.0, 40.0, 10.0, -60.0, 0.0, 40.0, 0.0)
BEHIND = c.JointMove(3, -35.0)
STALL = 30.0
Place = Callable[[MyCobot, str, tuple[Any, ...], dict[str, Any]], Awaitable[None]]


@dataclass(frozen=True)
class Verb:
    """One verb, with a target that the arm can reach, and with others that it cannot.

    Attributes:
        name: Of the method.
        args: A target that is far from where the arm stands.
        kwargs: The rest of it.
        unreachable: Arguments of a target that the model allows, and the arm has no joints for.
        limited: Whether it turns joint 1 to beyond 45 degrees.
        gripper: Whether it moves the gripper alone.
        model: The arm.
    """

    name: str
    args: tuple[Any, ...] = ()
    kwargs: dict[str, Any] = field(default_factory=dict)
    unreachable: tuple[Any, ...] | None = None
    limited: bool = False
    gripper: bool = False
    model: str = "mycobot280"

    def __str__(self) -> str:
        return "-".join((self.name, *self.kwargs))


FAR = (270, 270, 400, 0, 0, 0)
VERBS = (
    Verb("home"),
    Verb("move_joints", (90, -20, -40, -10, 20, 60), limited=True),
    Verb("move_joint", (1, 90), limited=True),
    Verb("step_joint", (1, 60), limited=True),
    Verb("move_to", (160, 60, 200, -150, 0, -90), unreachable=FAR),
    Verb("move_to", (), {"z": 230}, unreachable=(270, 270)),
    Verb("move_by", (0, 0, -40), unreachable=(50, 80, 0)),
    Verb("move_coord", ("z", 230), unreachable=("x", -270)),
    Verb("step_coord", ("z", -40), unreachable=("z", 90)),
    Verb("move_encoders", (3100, 2048, 2048, 2048, 2048, 2048), limited=True),
    Verb("move_elbow", (-60,), unreachable=(89,), model="myarm300"),
    Verb("gripper", (False,), gripper=True),
    Verb("gripper_to", (80,), gripper=True),
)
each_verb = pytest.mark.parametrize("verb", VERBS, ids=str)
firmwares = pytest.mark.parametrize("quirks", [NEW, OLD], ids=["new", "old"])


async def alone(arm: MyCobot, name: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> None:
    """On the arm."""
    await getattr(arm, name)(*args, **kwargs)


async def queued(arm: MyCobot, name: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> None:
    """On the queue, with a motion behind it, which must not be begun if the first one is not done."""
    motion = await getattr(arm.queue, name)(*args, **kwargs)
    behind = await arm.queue.move_joint(BEHIND.joint, BEHIND.angle)
    await both(motion, behind)


async def in_a_batch(arm: MyCobot, name: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> None:
    """In a batch, with a motion behind it."""
    async with arm.queue.batch() as batch:
        motion = getattr(batch, name)(*args, **kwargs)
        behind = batch.move_joint(BEHIND.joint, BEHIND.angle)

    await both(motion, behind)


async def both(motion: Any, behind: Any) -> None:
    """Awaits a motion; what is behind one that failed fails as well."""
    try:
        await motion
    except DobotError:
        with pytest.raises(DobotError):
            await behind

        raise

    await behind


each_place = pytest.mark.parametrize("place", [alone, queued, in_a_batch])


@asynccontextmanager
async def arms(
    quirks: MyCobotQuirks, model: str = "mycobot280", speed: float = 1.0
) -> AsyncIterator[tuple[Simulation, MyCobot]]:
    """An arm in the middle of its range, and who commands it."""
    async with simulate(model, quirks=quirks, speed=speed) as sim, MyCobot.connect(sim.url, model=model) as arm:
        sim.arm.guide_to(*(HERE if model == "mycobot280" else HERE_OF_7))
        yield sim, arm


@dataclass(frozen=True)
class Seen:
    """What the arm recorded at a time."""

    joints: tuple[float, ...]
    gripper: float
    done: int

    @classmethod
    def of(cls, sim: Simulation) -> Seen:
        """Now."""
        done = [each for each in sim.arm.executed if each.outcome == "done" and each.command.moves]
        return cls(sim.arm.joints, sim.arm.gripper.value, len(done))


def lacks(verb: Verb, quirks: MyCobotQuirks) -> None:
    """Older firmware of a 280 is given by `quirks`; a myArm of any age has its elbow."""
    if verb.name == "step_coord" and quirks is OLD:
        pytest.skip("a row of newer firmware")


@each_place
@each_verb
@firmwares
@virtual
async def test_what_can_be_done_is_done(quirks: MyCobotQuirks, verb: Verb, place: Place) -> None:
    """The table's targets are good ones: what raises below raises for its reason alone."""
    lacks(verb, quirks)
    async with arms(quirks, verb.model) as (sim, arm):
        before = Seen.of(sim)
        await place(arm, verb.name, verb.args, verb.kwargs)
        after = Seen.of(sim)
        assert (after.gripper != before.gripper) is verb.gripper
        assert after.done == before.done + (not verb.gripper) + (place is not alone)
        assert not sim.arm.moving
        assert not sim.arm.gripper.moving


@each_place
@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb.unreachable], ids=str)
@firmwares
@virtual
async def test_out_of_reach(quirks: MyCobotQuirks, verb: Verb, place: Place) -> None:
    lacks(verb, quirks)
    async with arms(quirks, verb.model) as (sim, arm):
        if verb.name == "move_elbow":
            sim.arm.ways.limits[0] = (0, 60)

        before = Seen.of(sim)
        assert verb.unreachable
        with pytest.raises(ArmAlarm if quirks is NEW else CommandRejected, match="reach"):
            await place(arm, verb.name, verb.unreachable, {})  # which the model's range allows

        assert Seen.of(sim) == before


@each_place
@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb.limited], ids=str)
@firmwares
@virtual
async def test_beyond_a_limit_of_the_arm(quirks: MyCobotQuirks, verb: Verb, place: Place) -> None:
    async with arms(quirks) as (sim, arm):
        sim.arm.ways.limits[0] = (-45, 45)
        before = Seen.of(sim)
        with pytest.raises(ArmAlarm if quirks is NEW else CommandRejected, match=r"limit|within reach"):
            await place(arm, verb.name, verb.args, verb.kwargs)

        assert Seen.of(sim) == before


@each_place
@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb.limited and verb.name != "move_encoders"], ids=str)
@virtual
async def test_beyond_a_limit_of_the_caller(verb: Verb, place: Place) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, limits={"j1": (-45, 45)}) as arm:
        sim.arm.guide_to(*HERE)
        before = Seen.of(sim)
        requests = sim.arm.counters.requests
        stepped = verb.name == "step_joint"  # where it leads is known when the arm has been asked where it stands
        with pytest.raises(CommandRejected if stepped else ValueError, match="joint 1 must be in -45 to 45"):
            await place(arm, verb.name, verb.args, verb.kwargs)

        assert stepped or sim.arm.counters.requests == requests
        assert Seen.of(sim) == before


@each_place
@each_verb
@firmwares
@virtual
async def test_no_power(quirks: MyCobotQuirks, verb: Verb, place: Place) -> None:
    lacks(verb, quirks)
    async with arms(quirks, verb.model) as (sim, arm):
        sim.arm.power(on=False)
        before = Seen.of(sim)
        with pytest.raises(CommandRejected, match="not powered"):
            await place(arm, verb.name, verb.args, verb.kwargs)

        assert Seen.of(sim) == before


@each_place
@each_verb
@firmwares
@virtual
async def test_the_power_fails_on_the_way(quirks: MyCobotQuirks, verb: Verb, place: Place) -> None:
    lacks(verb, quirks)
    async with arms(quirks, verb.model, speed=0.2) as (sim, arm):
        before = Seen.of(sim)
        asyncio.get_running_loop().call_later(0.8, lambda: sim.arm.power(on=False))
        with pytest.raises((MotionStopped, CommandRejected)):
            await place(arm, verb.name, verb.args, verb.kwargs)

        assert Seen.of(sim).done == before.done


@each_place
@pytest.mark.parametrize("verb", [verb for verb in VERBS if not verb.gripper], ids=str)
@firmwares
@virtual
async def test_released_servos(quirks: MyCobotQuirks, verb: Verb, place: Place) -> None:
    lacks(verb, quirks)
    async with arms(quirks, verb.model) as (sim, arm):
        sim.arm.release(None)
        before = Seen.of(sim)
        with pytest.raises(CommandRejected, match="are the servos on"):
            await place(arm, verb.name, verb.args, verb.kwargs)

        assert Seen.of(sim) == before


@each_place
@each_verb
@firmwares
@virtual
async def test_a_dead_line(quirks: MyCobotQuirks, verb: Verb, place: Place) -> None:
    lacks(verb, quirks)
    async with arms(quirks, verb.model) as (sim, arm):
        before = Seen.of(sim)
        sim.faults.silent = True
        with pytest.raises((MotionUnknown, ReplyTimeout)):
            await place(arm, verb.name, verb.args, verb.kwargs)

        assert Seen.of(sim) == before
        sim.faults.silent = False
        await arm.stop()


@each_place
@each_verb
@firmwares
@virtual
async def test_the_line_stalls_on_the_way(quirks: MyCobotQuirks, verb: Verb, place: Place) -> None:
    lacks(verb, quirks)
    async with arms(quirks, verb.model, speed=0.02) as (sim, arm):
        before = Seen.of(sim)
        loop = asyncio.get_running_loop()
        loop.call_later(1.0, setattr, sim.faults, "stalled", True)
        loop.call_later(1.0 + STALL, setattr, sim.faults, "stalled", False)
        with pytest.raises((MotionUnknown, ReplyTimeout)):
            await place(arm, verb.name, verb.args, verb.kwargs)

        assert sim.faults.stalled, "it is told before the line is back"
        await asyncio.sleep(STALL + 2)
        after = Seen.of(sim)
        assert after.done == before.done
        await asyncio.sleep(20)
        assert Seen.of(sim).joints == after.joints, "the stop was repeated until it was heard"
        assert not sim.arm.moving


@each_place
@each_verb
@firmwares
@virtual
async def test_cancelled(quirks: MyCobotQuirks, verb: Verb, place: Place) -> None:
    lacks(verb, quirks)
    async with arms(quirks, verb.model, speed=0.2) as (sim, arm):
        before = Seen.of(sim)
        at = asyncio.get_running_loop().time()
        with pytest.raises(TimeoutError) as caught:
            async with asyncio.timeout(0.8):
                await place(arm, verb.name, verb.args, verb.kwargs)

        assert type(caught.value) is TimeoutError
        assert asyncio.get_running_loop().time() - at < 2
        assert Seen.of(sim).done == before.done
        if place is alone and not verb.gripper:
            joints = sim.arm.joints
            assert joints != before.joints
            await asyncio.sleep(20)
            assert sim.arm.joints == joints, "who awaits a motion of the arm owns it"
        else:
            await arm.queue.join()
            await asyncio.sleep(20)
            assert (Seen.of(sim).done > before.done) or verb.gripper, "a motion of the queue goes on"


# Jogs are on the arm alone.


@pytest.mark.parametrize("direction", ["j1+", "j6-", "x-", "z-"])
@firmwares
@virtual
async def test_a_jog(quirks: MyCobotQuirks, direction: str) -> None:
    async with arms(quirks) as (sim, arm):
        before = Seen.of(sim)
        await arm.jog(direction, 0.5)
        after = Seen.of(sim)
        assert after.joints != before.joints
        sim.arm.power(on=False)
        with pytest.raises(CommandRejected, match=r"not powered"):
            await arm.jog(direction, 0.5)

        sim.arm.power(on=True)
        sim.arm.release(None)
        with pytest.raises(CommandRejected, match=r"did not move.*are the servos on"):
            await arm.jog(direction, 0.5)

        assert Seen.of(sim).joints == after.joints
        sim.arm.focus(0)
        sim.arm.raise_error(2, 81)
        with pytest.raises(ArmAlarm, match="OVER_CURRENT"):
            await arm.jog(direction, 0.5)

        assert Seen.of(sim).joints == after.joints


@firmwares
@virtual
async def test_a_jog_into_a_limit_and_at_it(quirks: MyCobotQuirks) -> None:
    async with arms(quirks) as (sim, arm):
        with pytest.raises(MotionStopped, match="before the jog was to end: joint 1 is at its limit of 168"):
            await arm.jog("j1+", 8)

        assert sim.arm.joints[0] == 168
        with pytest.raises(CommandRejected, match="did not move: joint 1 is at its limit"):
            await arm.jog("j1+", 0.5)

        await arm.jog("j1-", 0.5)
        with pytest.raises(MotionStopped, match="at the end of its reach"):
            await arm.jog("z+", 8)


@firmwares
@virtual
async def test_a_jog_on_a_dead_line_and_on_one_that_stalls(quirks: MyCobotQuirks) -> None:
    async with arms(quirks) as (sim, arm):
        before = Seen.of(sim)
        sim.faults.silent = True
        with pytest.raises(ReplyTimeout):
            await arm.jog("j1+", 0.5)

        sim.faults.silent = False
        await arm.stop()
        assert Seen.of(sim).joints == before.joints
        asyncio.get_running_loop().call_later(0.3, setattr, sim.faults, "stalled", True)
        with pytest.raises(ReplyTimeout):
            await arm.jog("j1+", 0.8, speed=1)

        await asyncio.sleep(STALL)
        sim.faults.stalled = False
        await asyncio.sleep(1)
        joints = sim.arm.joints
        await asyncio.sleep(20)
        assert sim.arm.joints == joints


@firmwares
@virtual
async def test_a_jog_that_is_cancelled_or_left_by_an_error(quirks: MyCobotQuirks) -> None:
    async with arms(quirks) as (sim, arm):
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.5):
                await arm.jog("j1+", 60, speed=5)

        with pytest.raises(ZeroDivisionError):
            async with arm.jogging("j1+", speed=5):
                await asyncio.sleep(0.5)
                raise ZeroDivisionError

        joints = sim.arm.joints
        assert joints[0] > HERE[0]
        await asyncio.sleep(20)
        assert sim.arm.joints == joints


@firmwares
@virtual
async def test_a_jog_during_a_motion_is_refused(quirks: MyCobotQuirks) -> None:
    async with arms(quirks) as (sim, arm):
        motion = await arm.queue.move_joint(1, 90)
        with pytest.raises(CommandRejected, match="1 motions are under way"):
            await arm.jog("j2+", 0.5)

        await motion
        assert sim.arm.joints == pytest.approx((90, *HERE[1:]), abs=0.01)
        await arm.jog("j2+", 0.5)


@each_place
@virtual
async def test_a_wait_needs_no_arm(place: Place) -> None:
    async with arms(NEW) as (_, arm):
        at = asyncio.get_running_loop().time()
        await place(arm, "wait", (0.75,), {})
        waited = asyncio.get_running_loop().time() - at
        assert waited == pytest.approx(0.75, abs=0.01) if place is alone else waited >= 0.75
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1):
                await place(arm, "wait", (60,), {})

        await arm.stop()


@each_place
@virtual
async def test_suction_is_something_that_these_arms_do_not_have(place: Place) -> None:
    async with arms(NEW) as (sim, arm):
        requests = sim.arm.counters.requests
        with pytest.raises(UnsupportedError, match="a myCobot 280 has no suction"):
            await place(arm, "suction", (True,), {})

        assert sim.arm.counters.requests == requests
