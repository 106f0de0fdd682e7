"""Tools, pins, sensors, jogs and stops of a Magician, by what the simulated arm did."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from virtual import virtual

from dobot_async import (
    AccessoryVersion,
    ArmAlarm,
    Color,
    ColorPort,
    CommandRejected,
    InfraredPort,
    IOFunction,
    Jog,
    Magician,
    MotionStopped,
    PTPMode,
    ReplyTimeout,
    TriggerADCCondition,
    UnsupportedError,
)
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.jogs import OWN_LIMITS
from dobot_async.simulator import simulate

Attempt = Callable[[Magician], Awaitable[Any]]


class Truth:
    """A single truth, as NumPy has it: no number, no index."""

    def __init__(self, value: bool) -> None:
        self.value = value

    def __bool__(self) -> bool:
        return self.value

    def __float__(self) -> float:
        return float(self.value)


class Several:
    """An array of several."""

    def __bool__(self) -> bool:
        raise ValueError

    def __float__(self) -> float:
        raise TypeError


class Numeric:
    """A number of somebody else's."""

    def __float__(self) -> float:
        return 221.0


# Arguments.

WRONG: dict[str, tuple[Attempt, type[Exception], str]] = {
    "speed 0": (lambda arm: arm.set_speed(0), ValueError, "velocity must be above 0 percent, not 0"),
    "speed -5": (lambda arm: arm.set_speed(-5), ValueError, "velocity must be above 0 percent, not -5"),
    "speed 300": (lambda arm: arm.set_speed(300), ValueError, "velocity must be at most 100 percent, not 300"),
    "acceleration": (lambda arm: arm.set_speed(50, 0), ValueError, "acceleration must be above 0"),
    "ratio": (
        lambda arm: arm.request(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(50, 0)),
        ValueError,
        "acceleration_ratio must be above 0",
    ),
    "velocity": (
        lambda arm: arm.queue.put(c.SET_PTP_JOINT_PARAMS, c.PTPJointParams((1, 0, 1, 1), (1, 1, 1, 1))),
        ValueError,
        r"velocity\[1\] must be above 0",
    ),
    "jump": (
        lambda arm: arm.request(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(-10, 100)),
        ValueError,
        "jump_height must be at least 0",
    ),
    "port": (lambda arm: arm.set_color_sensor("COM3"), TypeError, "port must be one of ColorPort.GP1"),  # type: ignore[arg-type]
    "other port": (lambda arm: arm.get_infrared(ColorPort.GP2), TypeError, "port must be one of Infrared"),  # type: ignore[arg-type]
    "port 7": (lambda arm: arm.set_color_sensor(7), ValueError, "port must be one of .* not 7"),  # type: ignore[arg-type]
    "on": (lambda arm: arm.suction("on"), TypeError, "on must be True or False, not 'on'"),  # type: ignore[arg-type]
    "none": (lambda arm: arm.laser(None), TypeError, "on must be True or False, not None"),  # type: ignore[arg-type]
    "several": (lambda arm: arm.gripper(Several()), TypeError, "closed must be True or False"),  # type: ignore[arg-type]
    "level": (lambda arm: arm.set_output(2, "high"), TypeError, "level must be True or False"),  # type: ignore[arg-type]
    "mode": (lambda arm: arm.move_to(220, 0, 40, mode="movl"), TypeError, "mode must be one of PTPMode"),  # type: ignore[arg-type]
    "mode 42": (lambda arm: arm.move_to(220, 0, 40, mode=42), ValueError, "mode must be one of PTPMode"),  # type: ignore[arg-type]
    "function": (lambda arm: arm.configure_io(2, "do"), TypeError, "function must be one of IOFunction"),  # type: ignore[arg-type]
    "text": (lambda arm: arm.move_to("220", 0, 40), TypeError, "x must be a number, not '220'"),  # type: ignore[arg-type]
    "array": (lambda arm: arm.move_to(220, Several(), 40), TypeError, "y must be a number"),  # type: ignore[arg-type]
    "tuple": (lambda arm: arm.move_to((220, 0, 40)), TypeError, "x must be a number"),  # type: ignore[arg-type]
    "pulses": (lambda arm: arm.conveyor(50.5), TypeError, "speed must be a whole number"),  # type: ignore[arg-type]
    "fast": (lambda arm: arm.conveyor(10**10), ValueError, "speed must be .* pulses/s"),
    "for ever": (lambda arm: arm.conveyor(0, distance=5), ValueError, "speed must not be 0"),
    "factor": (lambda arm: arm.conveyor_mm(10, pulses_per_mm=0), ValueError, "pulses_per_mm must be above 0"),
    "slow": (lambda arm: arm.conveyor_mm(0.001, pulses_per_mm=160), ValueError, "speed must be at least one pulse"),
    "count": (lambda arm: arm.circle((230, 0, 40), (220, 10, 40), count=0), ValueError, "count must be 1 to"),
    "point": (lambda arm: arm.arc((230, 10), (240, 0, 40)), ValueError, r"via must be \(x, y, z\)"),
    "power": (lambda arm: arm.engrave_to(220, 0, 40, 101), ValueError, "power must be 0 to 100 percent"),
    "adc": (
        lambda arm: arm.wait_for_adc(2, TriggerADCCondition.LESS, 5000),
        ValueError,
        "threshold must be 0 to 4095",
    ),
    "tool": (lambda arm: arm.set_end_effector("suction"), TypeError, "tool must be SuctionCup"),  # type: ignore[arg-type]
    "color": (lambda arm: arm.wait_for_color("pink"), ValueError, "'red', 'green' or 'blue', not 'pink'"),
    "direction": (lambda arm: arm.jog("up", 1), ValueError, r"x\+ x- .* j4- l\+ l-, not 'up'"),
    "no word": (lambda arm: arm.jog(3, 1), TypeError, "direction must be a Jog"),  # type: ignore[arg-type]
    "stop": (lambda arm: arm.stop(tools="no"), ValueError, "tools must be 'off' or 'leave'"),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("case", WRONG)
@virtual
async def test_what_is_wrong_is_told_in_the_callers_words_before_a_byte_is_sent(case: str) -> None:
    attempt, kind, words = WRONG[case]
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        requests = sim.arm.counters.requests
        with pytest.raises(kind, match=words):
            await attempt(arm)

        assert sim.arm.counters.requests == requests


@virtual
async def test_numbers_and_truths_of_others_are_taken() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.suction(Truth(True))  # type: ignore[arg-type]
        await arm.request(c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(Truth(True), Truth(False)))  # type: ignore[arg-type]
        assert sim.arm.state.get(c.SET_END_EFFECTOR_SUCTION_CUP).is_sucked
        assert sim.arm.state.get(c.SET_END_EFFECTOR_LASER) == c.EndEffectorLaser(True, False)
        await arm.move_to(Numeric(), 0, 40, mode=2)  # type: ignore[arg-type]
        assert sim.arm.executed[-1].value == c.PTPCmd(PTPMode.MOVL_XYZ, 221, 0, 40)
        await arm.configure_io(2, 1)  # type: ignore[arg-type]
        await arm.set_output(2, 5)  # type: ignore[arg-type]
        assert sim.arm.output(2) == 1


# Pins.

PINS: dict[str, tuple[Attempt, IOFunction]] = {
    "output": (lambda arm: arm.set_output(7, True), IOFunction.DO),
    "queued output": (lambda arm: arm.queue.set_output(7, True), IOFunction.DO),
    "pwm": (lambda arm: arm.set_pwm(7, 50, 7.5), IOFunction.PWM),
    "input": (lambda arm: arm.get_input(7), IOFunction.DI),
    "adc": (lambda arm: arm.get_adc(7), IOFunction.ADC),
    "wait": (lambda arm: arm.wait_for_input(7, level=False), IOFunction.DI),
    "wait for adc": (lambda arm: arm.wait_for_adc(7, TriggerADCCondition.LESS, 5), IOFunction.ADC),
}


@pytest.mark.parametrize("case", PINS)
@virtual
async def test_a_pin_has_to_be_configured_first(case: str) -> None:
    attempt, function = PINS[case]
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        for other in (None, IOFunction.DUMMY, IOFunction.PWM if function is IOFunction.ADC else IOFunction.ADC):
            if other is not None:
                await arm.configure_io(7, other)

            done = len(sim.arm.executed)
            with pytest.raises(ValueError, match=rf"configure_io\(7, IOFunction.{function.name}\)"):
                await attempt(arm)

            assert len(sim.arm.executed) == done

        await arm.configure_io(7, function)
        await attempt(arm)
        asked = sim.arm.counters.requests
        await arm.get_output(7)
        assert sim.arm.counters.requests == asked + 1, "what is known is not asked again"


@virtual
async def test_a_pin_may_be_configured_in_the_queue_or_by_another_program() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        async with arm.queue.batch() as batch:
            batch.configure_io(7, IOFunction.DO)
            last = batch.set_output(7, True)

        await last
        assert sim.arm.output(7) == 1
        with pytest.raises(ValueError, match="not configured"):
            await arm.set_output(8, True)

        sim.arm.state.set(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(8, IOFunction.DO))
        await arm.set_output(8, True)
        assert sim.arm.output(8) == 1


@virtual
async def test_a_command_that_has_to_ask_first_is_not_overtaken() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        sim.arm.state.set(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(7, IOFunction.DO))
        await asyncio.gather(arm.queue.set_output(7, True), arm.queue.wait(0.5), arm.queue.set_output(7, False))
        await arm.queue.join()
        names = [each.name for each in sim.arm.executed if each.name in {"SetIODO", "SetWAITCmd"}]
        assert names[-3:] == ["SetIODO", "SetWAITCmd", "SetIODO"]


@virtual
async def test_a_stop_while_the_arm_is_asked_for_a_pin_ends_what_waits() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        sim.arm.state.set(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(7, IOFunction.DO))
        sim.faults.latency = 0.1
        putting = asyncio.create_task(arm.queue.set_output(7, True))
        await asyncio.sleep(0.05)
        await arm.stop()
        with pytest.raises(MotionStopped):
            await putting

        await asyncio.sleep(2)
        assert sim.arm.output(7) == 0


# Sensors.


@virtual
async def test_one_waits_for_what_sensors_see() -> None:
    loop = asyncio.get_running_loop()
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        sim.arm.color_version = sim.arm.infrared_version = AccessoryVersion.V2
        await arm.set_infrared_sensor(InfraredPort.GP4, version=AccessoryVersion.V2)
        await arm.set_color_sensor(ColorPort.GP2, version=AccessoryVersion.V2)
        loop.call_later(3, sim.arm.infrared.__setitem__, InfraredPort.GP4, True)
        began = loop.time()
        await arm.wait_for_infrared(InfraredPort.GP4)
        assert 3 <= loop.time() - began < 3.1
        sim.arm.color = Color(0, 1, 0)
        assert (await arm.wait_for_color()).name == "green"
        loop.call_later(2, setattr, sim.arm, "color", Color(0, 0, 1))
        assert await arm.wait_for_color("blue") == Color(0, 0, 1)
        for wait in (
            arm.wait_for_infrared(InfraredPort.GP4, seen=False, timeout=1),
            arm.wait_for_color("red", timeout=1),
        ):
            with pytest.raises(ReplyTimeout, match="within 1 s"):
                await wait


@virtual
async def test_waiting_for_a_sensor_stops_nothing() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.conveyor_mm(50, pulses_per_mm=160)
        await arm.set_infrared_sensor(InfraredPort.GP1)
        with pytest.raises(ReplyTimeout):
            await arm.wait_for_infrared(InfraredPort.GP1, timeout=1)

        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1):
                await arm.wait_for_infrared(InfraredPort.GP1)

        assert sim.arm.motors[0].speed == 8000


@pytest.mark.parametrize(
    ("color", "name"), [((1, 0, 0), "red"), ((0, 0, 0), ""), ((9, 200, 30), "green"), ((1, 1, 0), "")]
)
def test_the_name_of_a_color(color: tuple[int, int, int], name: str) -> None:
    assert Color(*color).name == name


# Belts, grippers, home.


@virtual
async def test_a_belt_in_mm() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await (await arm.queue.conveyor_mm(-50, pulses_per_mm=161.5, distance=20, motor=1))
        assert sim.arm.executed[-1].value == c.EMotorS(1, is_enabled=True, speed=-8075, distance=3230)
        assert sim.arm.motors[1].pulses == -3230


@virtual
async def test_what_a_magician_cannot_do() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        for place in (arm, arm.queue):
            with pytest.raises(UnsupportedError, match="Magician"):
                await place.gripper_to(50)

        with pytest.raises(UnsupportedError, match=r"set_rail\(\)"):
            await arm.get_rail()


@virtual
async def test_the_home_position_is_the_users() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.set_home(200, 20, 50, 30)
        await arm.home()
        pose = sim.arm.true_pose
        assert (pose.x, pose.y, pose.z, pose.r) == pytest.approx((200, 20, 50, 30), abs=1e-3)


# Jogs.


@virtual
async def test_words_are_directions() -> None:
    assert [Jog.of(word) for word in ("x+", "J2-", "l+")] == [Jog.X_PLUS, Jog.J2_MINUS, Jog.RAIL_PLUS]
    assert {Jog.of(each.word) for each in Jog} == set(Jog)
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        await arm.jog("j1+", 0.5)
        assert sim.arm.pose.j1 > 1
        await arm.set_rail()
        await arm.jog("l+", 2)
        assert sim.arm.rail > 50
        assert sim.arm.executed[-1].value == c.JOGCmd(is_joint=True, cmd=c.JOGKey.EP_DOWN)
        async with arm.jogging("l-"):
            await asyncio.sleep(1)

        assert sim.arm.executed[-1].value == c.JOGCmd(is_joint=True, cmd=c.JOGKey.EN_DOWN)


@pytest.mark.parametrize("direction", [each for each in Jog if not each.name.startswith("RAIL")])
@virtual
async def test_a_jog_into_a_limit_raises_and_so_does_the_next_one(direction: Jog) -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        for _ in range(2):
            with pytest.raises(ArmAlarm, match="LIMIT") as caught:
                await arm.jog(direction, 60)

            assert {alarm.code for alarm in caught.value.alarms} <= {alarm.code for alarm in sim.arm.alarms}
            assert {alarm.code for alarm in caught.value.alarms} <= OWN_LIMITS.get(direction, {*range(0x40, 0x4A)})

        back = Jog.of(direction.word.translate({ord("+"): "-", ord("-"): "+"}))
        await arm.jog(back, 0.5)
        await arm.move_to(220, 0, 40)


@virtual
async def test_a_jog_while_the_queue_executes_is_refused() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        motion = await arm.queue.move_to(220, 100, 40)
        with pytest.raises(CommandRejected, match="hears no jog"):
            await arm.jog("z+", 0.5)

        await motion
        await arm.queue.move_to(220, 0, 40)
        await asyncio.sleep(10)  # it is done, though nobody has seen it
        await arm.jog("z+", 0.5)
        assert sim.arm.pose.z > 41


# Stops.


async def burning(arm: Magician) -> None:
    """The laser on, both steppers turning, the pump running, and a motion that goes on."""
    await arm.laser(True)
    await arm.conveyor(8000)
    await arm.conveyor(-500, motor=1)
    await arm.suction(True)
    await arm.queue.move_to(200, 150, 40)
    await arm.queue.laser(True)
    await asyncio.sleep(0.3)


async def cancelled(arm: Magician) -> None:
    """A call that is cancelled."""
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.1):
            await arm.wait(60)


STOPS: dict[str, Attempt] = {
    "stop": lambda arm: arm.stop(),
    "queue": lambda arm: arm.queue.stop(),
    "cancelled": cancelled,
}


@pytest.mark.parametrize("case", STOPS)
@virtual
async def test_a_stop_ends_laser_and_steppers_but_not_the_pump(case: str) -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await burning(arm)
        await STOPS[case](arm)
        await asyncio.sleep(5)
        assert (sim.arm.laser, [motor.speed for motor in sim.arm.motors]) == (0, [0, 0])
        assert (sim.arm.suction, sim.arm.device.moving) == (True, False)


@virtual
async def test_an_alarm_ends_laser_and_steppers() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await burning(arm)
        with pytest.raises(ArmAlarm):
            await arm.move_to(500, 0, 0)

        await asyncio.sleep(1)
        assert (sim.arm.laser, [motor.speed for motor in sim.arm.motors]) == (0, [0, 0])


@virtual
async def test_a_stop_may_leave_the_tools() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await burning(arm)
        await arm.stop(tools="leave")
        assert (sim.arm.laser, sim.arm.motors[0].speed, sim.arm.device.moving) == (100, 8000, False)
        await asyncio.gather(arm.stop(), arm.stop(tools="leave"))
        assert (sim.arm.laser, sim.arm.motors[0].speed) == (0, 0)


@virtual
async def test_a_tool_that_the_queue_switches_on_before_it_hears_the_stop_is_switched_off() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        force_stop, hits = sim.arm.device.force_stop, []

        def late() -> None:
            hits.append(True)
            if len(hits) == 1:  # the first copy was lost, and what is queued goes on meanwhile
                asyncio.get_running_loop().call_later(0.005, sim.arm.perform, c.SET_E_MOTOR, c.EMotor(0, True, 500))
            else:
                force_stop()

        vars(sim.arm.device)["force_stop"] = late
        sim.faults.latency = 0.004
        await arm.stop()
        await asyncio.sleep(1)
        assert sim.arm.motors[0].speed == 0
