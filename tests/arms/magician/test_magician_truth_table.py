"""Each verb in each mishap: what comes out of the call, and what the simulated arm recorded.

verb x {out of reach, not homed, at a limit, alarm set, dead line, line stalls for 30 s, cancelled}
     x {alone, queued, in a batch}
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal

import pytest
from virtual import virtual

from dobot_async import ArmAlarm, DobotError, IOFunction, Magician, MotionUnknown, ReplyTimeout
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import SimulatedMagician, Simulation, simulate

Place = Literal["alone", "queued", "in a batch"]
PLACES: tuple[Place, ...] = ("alone", "queued", "in a batch")
START = (200.0, -100.0, 20.0)
NOT_LONGER = 40.0  # seconds after which a call that hangs is told from one that waits


@dataclass(frozen=True)
class Verb:
    """A verb: its row, a call that an arm can do, one that leads out of its reach, and whether it takes time."""

    row: Command[Any, Any]
    call: Callable[[Any], Any]
    far: Callable[[Any], Any] | None = None
    takes_time: bool = True


VERBS: dict[str, Verb] = {
    "home": Verb(c.SET_HOME_CMD, lambda on: on.home()),
    "move_to": Verb(c.SET_PTP_CMD, lambda on: on.move_to(200, 150, 40), lambda on: on.move_to(500, 0, 0)),
    "move_by": Verb(c.SET_PTP_CMD, lambda on: on.move_by(0, 200, 0), lambda on: on.move_by(400)),
    "move_joints": Verb(
        c.SET_PTP_CMD, lambda on: on.move_joints(60, 40, 40, 0), lambda on: on.move_joints(0, 120, 0, 0)
    ),
    "along the rail": Verb(
        c.SET_PTP_WITH_L_CMD, lambda on: on.move_to(200, 50, 40, l=400), lambda on: on.move_to(200, 50, 40, l=4000)
    ),
    "arc": Verb(
        c.SET_ARC_CMD,
        lambda on: on.arc((250, 0, 20), (200, 100, 20)),
        lambda on: on.arc((400, 0, 20), (200, 100, 20)),
    ),
    "circle": Verb(
        c.SET_CIRCLE_CMD,
        lambda on: on.circle((230, -70, 20), (200, -40, 20), count=2),
        lambda on: on.circle((400, 0, 20), (200, 100, 20)),
    ),
    "path_to": Verb(c.SET_CP_CMD, lambda on: on.path_to(200, 150, 20), lambda on: on.path_to(500, 0, 0)),
    "engrave_to": Verb(
        c.SET_CPLE_CMD, lambda on: on.engrave_to(200, 150, 20, 50), lambda on: on.engrave_to(500, 0, 0, 5)
    ),
    "wait": Verb(c.SET_WAIT_CMD, lambda on: on.wait(2)),
    "wait_for_input": Verb(c.SET_TRIG_CMD, lambda on: on.wait_for_input(4)),
    "wait_for_adc": Verb(c.SET_TRIG_CMD, lambda on: on.wait_for_adc(5, c.TriggerADCCondition.GREATER, 100)),
    "belt": Verb(c.SET_E_MOTOR_S, lambda on: on.conveyor(1000, distance=2000)),
    "conveyor": Verb(c.SET_E_MOTOR, lambda on: on.conveyor(1000), takes_time=False),
    "conveyor_mm": Verb(c.SET_E_MOTOR, lambda on: on.conveyor_mm(10, pulses_per_mm=160), takes_time=False),
    "suction": Verb(c.SET_END_EFFECTOR_SUCTION_CUP, lambda on: on.suction(True), takes_time=False),
    "gripper": Verb(c.SET_END_EFFECTOR_GRIPPER, lambda on: on.gripper(True), takes_time=False),
    "laser": Verb(c.SET_END_EFFECTOR_LASER, lambda on: on.laser(True), takes_time=False),
    "configure_io": Verb(c.SET_IO_MULTIPLEXING, lambda on: on.configure_io(9, IOFunction.DO), takes_time=False),
    "set_output": Verb(c.SET_IODO, lambda on: on.set_output(2, True), takes_time=False),
    "set_pwm": Verb(c.SET_IOPWM, lambda on: on.set_pwm(3, 50, 7.5), takes_time=False),
    "set_speed": Verb(c.SET_PTP_COMMON_PARAMS, lambda on: on.set_speed(40), takes_time=False),
    "set_home": Verb(c.SET_HOME_PARAMS, lambda on: on.set_home(200, 0, 50), takes_time=False),
}
MOTIONS = [name for name, verb in VERBS.items() if verb.row.moves]
LONG = [name for name, verb in VERBS.items() if verb.takes_time]
everywhere = pytest.mark.parametrize("place", PLACES)


class Scene:
    """A simulated arm and its driver, made ready for any of the verbs."""

    def __init__(self, sim: Simulation[SimulatedMagician], arm: Magician) -> None:
        self.sim = sim
        self.arm = arm
        self.before = 0

    async def prepare(self) -> None:
        """Declares what the verbs need, and drives to the start; what is recorded from here on counts."""
        arm = self.arm
        await arm.set_rail()
        for address, function in ((2, IOFunction.DO), (3, IOFunction.PWM), (4, IOFunction.DI), (5, IOFunction.ADC)):
            await arm.configure_io(address, function)

        await arm.move_to(*START)
        self.before = len(self.sim.arm.executed)
        asyncio.get_running_loop().call_later(2, self.world)

    def world(self) -> None:
        """What those who wait for an input wait for."""
        self.sim.arm.set_input(4, 1)
        self.sim.arm.set_adc(5, 4000)

    async def tell(self, place: Place, call: Callable[[Any], Any]) -> None:
        """Calls a verb, and waits for the end of what it does."""
        if place == "alone":
            await call(self.arm)
        elif place == "queued":
            await (await call(self.arm.queue))
        else:
            async with self.arm.queue.batch() as batch:
                motion = call(batch)

            await motion

    def outcomes(self, verb: Verb) -> list[str]:
        """How the arm ended what it did of a verb; what a stop switches off does not count."""
        return [
            each.outcome
            for each in self.sim.arm.executed[self.before :]
            if each.command is verb.row
            and getattr(each.value, "is_enabled", getattr(each.value, "is_on", True))
            and each.value != c.WAITCmd(0)
        ]

    @property
    def elsewhere(self) -> float:
        """By how many mm the tool is elsewhere than the arm believes."""
        true, believed = self.sim.arm.true_pose, self.sim.arm.pose
        return math.dist((true.x, true.y, true.z), (believed.x, believed.y, believed.z))

    @property
    def stands(self) -> bool:
        """Whether nothing moves, burns or turns."""
        arm = self.sim.arm
        return not arm.device.moving and not arm.laser and not any(motor.speed for motor in arm.motors)


def in_scene(test: Callable[..., Any]) -> Callable[..., None]:
    """Runs a test with a homed arm and its driver, on a virtual clock."""

    @virtual
    async def run(name: str, place: Place) -> None:
        async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
            scene = Scene(sim, arm)
            await scene.prepare()
            async with asyncio.timeout(600):
                await test(scene, VERBS[name], place)

    return run


@everywhere
@pytest.mark.parametrize("name", [name for name, verb in VERBS.items() if verb.far])
@in_scene
async def test_out_of_reach(scene: Scene, verb: Verb, place: Place) -> None:
    assert verb.far
    with pytest.raises(ArmAlarm):
        await scene.tell(place, verb.far)

    assert scene.outcomes(verb) == ["alarm"]


@everywhere
@pytest.mark.parametrize("name", VERBS)
@virtual
async def test_not_homed(name: str, place: Place) -> None:
    """The arm believes that it is there, and says so: only homing makes that true."""
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        scene, verb = Scene(sim, arm), VERBS[name]
        await scene.prepare()
        await scene.tell(place, verb.call)
        assert scene.outcomes(verb) == ["done"]
        assert (scene.elsewhere < 1e-6) is sim.arm.homed is (name == "home")


@pytest.mark.parametrize("why", ["at a limit", "alarm set"])
@everywhere
@pytest.mark.parametrize("name", VERBS)
@virtual
async def test_alarms_hold_motions_back_and_nothing_else(name: str, place: Place, why: str) -> None:
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        scene, verb = Scene(sim, arm), VERBS[name]
        await scene.prepare()
        if why == "alarm set":
            sim.arm.raise_alarm(0x22)
        else:
            with suppress(ArmAlarm):
                await arm.jog("j1-", 60)

        stood = sim.arm.pose
        if verb.row.moves:
            with pytest.raises(ArmAlarm):
                await scene.tell(place, verb.call)

            assert (scene.outcomes(verb), sim.arm.pose) == ([], stood)
        else:
            await scene.tell(place, verb.call)
            assert scene.outcomes(verb) == ["done"]


@everywhere
@pytest.mark.parametrize("name", VERBS)
@in_scene
async def test_a_line_that_was_dead_before(scene: Scene, verb: Verb, place: Place) -> None:
    scene.sim.faults.silent = True
    async with asyncio.timeout(NOT_LONGER):
        with pytest.raises((ReplyTimeout, MotionUnknown)):
            await scene.tell(place, verb.call)

    scene.sim.faults.silent = False
    await asyncio.sleep(30)
    assert (scene.outcomes(verb), scene.stands) == ([], True)


@everywhere
@pytest.mark.parametrize("name", LONG)
@in_scene
async def test_a_line_that_dies_meanwhile(scene: Scene, verb: Verb, place: Place) -> None:
    asyncio.get_running_loop().call_later(0.3, setattr, scene.sim.faults, "silent", True)
    async with asyncio.timeout(NOT_LONGER):
        with pytest.raises(MotionUnknown):
            await scene.tell(place, verb.call)

    scene.sim.faults.silent = False
    await asyncio.sleep(30)
    assert scene.outcomes(verb) in (["done"], ["aborted"])
    assert scene.stands


@everywhere
@pytest.mark.parametrize("name", VERBS)
@in_scene
async def test_a_line_that_stalls_for_half_a_minute(scene: Scene, verb: Verb, place: Place) -> None:
    """Everything arrives late and in order: what was given up must not be done after all, and nothing is done twice."""
    loop = asyncio.get_running_loop()
    began = loop.time()
    loop.call_later(0.3 if verb.takes_time else 0, setattr, scene.sim.faults, "stalled", True)
    loop.call_later(30, setattr, scene.sim.faults, "stalled", False)
    await asyncio.sleep(0)
    if not verb.takes_time:
        await asyncio.sleep(0.1)

    with pytest.raises((MotionUnknown, ReplyTimeout)) as failed:
        await scene.tell(place, verb.call)

    assert loop.time() - began < 30, "nobody waits for longer than an arm may be silent"
    assert not (verb.takes_time and not isinstance(failed.value, MotionUnknown))
    await asyncio.sleep(60)
    found = scene.outcomes(verb)
    if verb.takes_time:
        assert found in (["done"], ["aborted"])
        assert scene.stands
    elif place != "alone":
        assert found in ([], ["done"]), "a queued command is sent once"
    else:
        assert set(found) <= {"done"}, "a setting may be said again"


@everywhere
@pytest.mark.parametrize("name", LONG)
@in_scene
async def test_cancelled(scene: Scene, verb: Verb, place: Place) -> None:
    """A call on the arm owns what it does; a Motion belongs to the queue."""
    with pytest.raises(TimeoutError) as ended:
        async with asyncio.timeout(0.3):
            await scene.tell(place, verb.call)

    assert not isinstance(ended.value, DobotError)
    if place == "alone":
        assert scene.outcomes(verb) == ["aborted"]
        assert scene.stands
    else:
        await scene.arm.queue.join()
        assert scene.outcomes(verb) == ["done"]


# What is on the arm alone.


async def jog(scene: Scene) -> None:
    """Jogs for two seconds."""
    await scene.arm.jog("j1+", 2)


@pytest.mark.parametrize("mishap", ["silent", "stalled"])
@virtual
async def test_a_jog_on_a_line_that_dies_meanwhile(mishap: str) -> None:
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        scene = Scene(sim, arm)
        await scene.prepare()
        loop = asyncio.get_running_loop()
        loop.call_later(0.5, setattr, sim.faults, mishap, True)
        with pytest.raises(ReplyTimeout):
            await jog(scene)

        loop.call_later(20, setattr, sim.faults, mishap, False)
        await asyncio.sleep(25)
        assert scene.stands


@virtual
async def test_a_cancelled_jog() -> None:
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        scene = Scene(sim, arm)
        await scene.prepare()
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.5):
                await jog(scene)

        stood = sim.arm.pose
        await asyncio.sleep(5)
        assert (scene.stands, sim.arm.pose) == (True, stood)


READS: dict[str, Callable[[Magician], Any]] = {
    "get_pose": lambda arm: arm.get_pose(),
    "get_joints": lambda arm: arm.get_joints(),
    "get_rail": lambda arm: arm.get_rail(),
    "get_info": lambda arm: arm.get_info(),
    "get_alarms": lambda arm: arm.get_alarms(),
    "get_input": lambda arm: arm.get_input(4),
    "get_output": lambda arm: arm.get_output(2),
    "get_adc": lambda arm: arm.get_adc(5),
    "get_color": lambda arm: arm.get_color(),
    "get_infrared": lambda arm: arm.get_infrared(c.InfraredPort.GP1),
    "wait_for_infrared": lambda arm: arm.wait_for_infrared(c.InfraredPort.GP1),
    "wait_for_color": lambda arm: arm.wait_for_color(),
    "move_to(z)": lambda arm: arm.move_to(z=50),
    "move_by(l)": lambda arm: arm.move_by(l=50),
}


@pytest.mark.parametrize("name", READS)
@virtual
async def test_what_asks_on_a_dead_line(name: str) -> None:
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        scene = Scene(sim, arm)
        await scene.prepare()
        sim.faults.silent = True
        async with asyncio.timeout(NOT_LONGER):
            with pytest.raises(ReplyTimeout):
                await READS[name](arm)

        sim.faults.silent = False
        await asyncio.sleep(10)
        assert len(sim.arm.executed) == scene.before
