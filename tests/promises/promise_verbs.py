"""Every public call that awaits, of each family: on the arm, on its queue, on a motion, on the way in and out.

`test_cancellation` checks that this table is complete, so a verb that is added later is missed there.
"""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from promise_arms import Family

from dobot_async.arms.magician import commands as m
from dobot_async.arms.mycobot import commands as y
from dobot_async.arms.ultraarm import commands as u

Call = Callable[[Any, Any], Awaitable[Any]]
"""Given the arm, and what was prepared."""

BEFORE: Mapping[str, float] = {"dead before": 0.0}
SHORT: Mapping[str, float] = {"dead before": 0.0, "reply lost": 0.015}
LONG: Mapping[str, float] = {"dead before": 0.0, "reply lost": 0.015, "dead later": 0.5}
INSIDE: Mapping[str, float] = {"dead inside": 0.05}

__all__ = ["INTERNAL", "Verb", "public_calls", "verbs"]

INTERNAL = frozenset(
    {
        "aclose",
        "attach",
        "connect",  # the two rows "connect" and "leaving" are it
        "exclusively",
        "fail",
        "greet",  # what connect does with an arm
        "leave",
        "begin_own_stop",
        "begin_stop",  # what the arms and the poller do with the queue
        "beside",
        "cancel_writer",
        "count",
        "give_up",
        "led_by",
        "look",
        "note",
        "rest",
        "unplanned_motion",
        "watch",
        "no_more_room",
        "write_on",
        "writer_ended",
        "perform",
        "perform_from_goal",
        "goal",
        "find_goal",
        "planned",
        "prepare",
        "put_all",
        "stopping",
        "stops_heard",
        "update",
        "watching",
    }
)
"""Public by their names today, and nobody's verbs: what one part of the driver calls of another one."""


@dataclass(frozen=True)
class Verb:
    """One call.

    Attributes:
        name: Of the method, with "queue." before it for one of the queue.
        call: The call itself.
        moments: When the line goes dead: seconds after the call began.
        prepare: What has to be done before, on a good line.
        at_once: It may return although the line is dead, for all that it needs is on this side.
        refused: It may say at once that this arm cannot do it.
        model: Another model than the family's.
        core: All ways to end it are tried in the quick form too.
        what: Which part of it, where there are several.
    """

    name: str
    call: Call
    moments: Mapping[str, float] = field(default_factory=lambda: SHORT)
    prepare: Callable[[Any], Awaitable[Any]] | None = None
    at_once: bool = False
    refused: bool = False
    model: str = ""
    core: bool = False
    what: str = ""

    def __str__(self) -> str:
        return f"{self.name} {self.what}".strip()


def read(name: str, *args: Any, prepare: Callable[[Any], Awaitable[Any]] | None = None, **details: Any) -> Verb:
    """A call of the arm that asks or sets something, and returns with the arm's answer."""
    return Verb(name, lambda arm, _: getattr(arm, name)(*args, **details), prepare=prepare)


def two(name: str, *args: Any, long: bool = True, hosted: bool = False, **details: Any) -> list[Verb]:
    """A verb on the arm, which returns when the arm has done it, and on the queue."""
    prepare, model = details.pop("prepare", None), details.pop("model", "")
    moments = LONG if long else SHORT
    return [
        Verb(name, lambda arm, _: getattr(arm, name)(*args, **details), moments, prepare, model=model),
        Verb(
            f"queue.{name}",
            lambda arm, _: getattr(arm.queue, name)(*args, **details),
            BEFORE if hosted else SHORT,
            prepare,
            at_once=hosted,
            model=model,
        ),
    ]


async def queued(arm: Any, far: tuple[float, ...]) -> Any:
    """Two motions that take long, queued; returns the first."""
    first = await arm.queue.move_joints(*far)
    await arm.queue.move_joints(*(0.5 * each for each in far))
    return first


async def jogging(arm: Any, direction: Any, seconds: float) -> None:
    """Jogs for some seconds."""
    async with arm.jogging(direction):
        await asyncio.sleep(seconds)


async def batch(arm: Any, far: tuple[float, ...]) -> None:
    """Queues four motions in a batch."""
    async with arm.queue.batch() as batched:
        for share in (1, 0.9, 0.8, 0.7):
            batched.move_joints(*(share * each for each in far))


async def download(arm: Any) -> None:
    """Stores forty motions in a Magician."""
    async with arm.queue.download() as program:
        for step in range(40):
            program.move_to(200 + step, 0, 40)


async def taught(arm: Any) -> None:
    """Waits for a taught point."""
    points = arm.taught_points()
    try:
        await anext(points)
    finally:
        await points.aclose()


async def gcode(arm: Any) -> None:
    """Runs a program."""
    await arm.run_gcode(["G0 X200 Y50 Z0 F5", "G0 X200 Y-50 Z0 F5"])


async def gcode_lines(arm: Any) -> None:
    """Runs a program line by line."""
    async for _ in arm.run_gcode(["G0 X200 Y50 Z0 F5", "G0 X200 Y-50 Z0 F5"]):
        pass


async def streamed(arm: Any, family: Family) -> None:
    """A stream of two motions."""
    await arm.queue.stream(arm.queue.move_joints(*joints) for joints in (family.far, family.near))


async def run_on(arm: Any, _: Any) -> None:
    """Awaits a coroutine of the arm that others make."""
    await asyncio.gather(arm.queue.join(), arm.queue.join())


def shared(family: Family) -> list[Verb]:
    """What all families have."""
    far = family.far
    hosted = family.name != "magician"  # its queue is on this side

    async def prepared(arm: Any) -> Any:
        return await queued(arm, far)

    async def paused(arm: Any) -> Any:
        await queued(arm, far)
        await arm.queue.pause()

    def core(name: str, call: Call, moments: Mapping[str, float] = SHORT, **details: Any) -> Verb:
        return Verb(name, call, moments, core=True, **details)

    return [
        *two("home", hosted=hosted, prepare=prepared),
        core("move_joints", lambda arm, _: arm.move_joints(*far), LONG),
        core("move_joints", lambda arm, _: arm.move_joints(*far, timeout=60), LONG, what="with a timeout"),
        Verb("queue.move_joints", lambda arm, _: arm.queue.move_joints(*far), SHORT, at_once=hosted, core=True),
        *two("wait", 60, hosted=hosted),
        core("jog", lambda arm, _: arm.jog(family.jog, 30), LONG),
        core("jogging", lambda arm, _: jogging(arm, family.jog, 30), LONG, what="inside"),
        core("jogging", lambda arm, _: jogging(arm, family.jog, 0.1), INSIDE, what="leaving"),
        core("stop", lambda arm, _: arm.stop(), prepare=prepared),
        core("stop", lambda arm, _: arm.stop(), what="of a jog", prepare=None),
        core("request", lambda arm, _: arm.request(family.row, None)),
        Verb("link.request", lambda arm, _: arm.link.request(family.row, None)),
        core("queue.join", lambda arm, _: arm.queue.join(), LONG, prepare=prepared),
        Verb("queue.join", lambda arm, _: arm.queue.join(timeout=60), LONG, prepare=prepared, what="with a timeout"),
        Verb("queue.join", run_on, LONG, prepare=prepared, what="twice at a time"),
        core("queue.stream", lambda arm, _: streamed(arm, family), LONG),
        core("queue.stop", lambda arm, _: arm.queue.stop(), prepare=prepared),
        Verb("queue.clear", lambda arm, _: arm.queue.clear(), SHORT, prepare=prepared, at_once=hosted),
        Verb("queue.pause", lambda arm, _: arm.queue.pause(), SHORT, prepare=prepared),
        Verb("queue.batch", lambda arm, _: batch(arm, far), SHORT, at_once=hosted, core=True, what="leaving"),
        Verb("motion.wait", lambda _, motion: motion.wait(), LONG, prepare=prepared, core=True),
        Verb("motion.wait", lambda _, motion: motion.wait(60), LONG, prepare=prepared, what="with a timeout"),
        Verb("motion.__await__", lambda _, motion: waited(motion), LONG, prepare=prepared, core=True),
        Verb("queue.resume", lambda arm, _: arm.queue.resume(), SHORT, prepare=paused),
    ]


async def waited(motion: Any) -> None:
    """Awaits a motion."""
    await motion


def magician() -> list[Verb]:
    """What a Magician has."""
    far = (220.0, 60.0, 40.0)

    def pin(function: m.IOFunction) -> Callable[[Any], Awaitable[Any]]:
        return lambda arm: arm.configure_io(5, function)

    async def alarmed(arm: Any) -> None:
        await arm.queue.move_to(*far)

    async def half_open(place: Any) -> None:
        await place.gripper_to(50)

    return [
        *(read(name) for name in ("get_pose", "get_info", "get_alarms", "get_joints")),
        read("get_rail", prepare=lambda arm: arm.set_rail()),
        read("get_input", 5, prepare=pin(m.IOFunction.DI)),
        read("get_output", 5, prepare=pin(m.IOFunction.DO)),
        read("get_adc", 5, prepare=pin(m.IOFunction.ADC)),
        read("get_color", prepare=lambda arm: arm.set_color_sensor(m.ColorPort.GP1)),
        read("get_infrared", m.InfraredPort.GP1, prepare=lambda arm: arm.set_infrared_sensor(m.InfraredPort.GP1)),
        read("wait_for_color", prepare=lambda arm: arm.set_color_sensor(m.ColorPort.GP1)),
        read("wait_for_infrared", m.InfraredPort.GP1, prepare=lambda arm: arm.set_infrared_sensor(m.InfraredPort.GP1)),
        read("set_color_sensor", m.ColorPort.GP1),
        read("set_infrared_sensor", m.InfraredPort.GP1),
        read("set_rail"),
        read("set_end_effector", m.EndEffectorParams(59.7)),
        Verb("clear_alarms", lambda arm, _: arm.clear_alarms(), SHORT, alarmed, core=True),
        Verb("recover", lambda arm, _: arm.recover(), SHORT, alarmed, core=True),
        Verb("pause", lambda arm, _: arm.pause(), SHORT, alarmed),
        Verb("resume", lambda arm, _: arm.resume()),
        Verb("taught_points", lambda arm, _: taught(arm), LONG),
        *two("move_to", *far),
        *two("move_by", -30, 30, 10),
        *two("arc", (250, 50, -8, 0), (230, 80, -8, 0)),
        *two("circle", (250, 50, -8, 0), (230, 80, -8, 0), count=5),
        *two("path_to", *far),
        *two("engrave_to", *far, 50),
        *two("wait_for_input", 5, prepare=pin(m.IOFunction.DI)),
        *two("wait_for_adc", 5, m.TriggerADCCondition.GREATER, 4000, prepare=pin(m.IOFunction.ADC)),
        *two("suction", True, long=False),
        *two("gripper", True, long=False),
        *two("laser", False, long=False),
        *two("configure_io", 5, m.IOFunction.DO, long=False),
        *two("set_output", 5, True, long=False, prepare=pin(m.IOFunction.DO)),
        *two("set_pwm", 5, 100, 50, long=False, prepare=pin(m.IOFunction.PWM)),
        *two("conveyor", 1000, long=False),
        *two("conveyor_mm", 10, pulses_per_mm=160, long=False),
        *two("set_home", 200, 0, 50, long=False),
        Verb("gripper_to", lambda arm, _: half_open(arm), refused=True),
        Verb("queue.gripper_to", lambda arm, _: half_open(arm.queue), refused=True),
        *two("set_speed", 50, long=False),
        Verb("queue.put", lambda arm, _: arm.queue.put(m.SET_PTP_CMD, m.PTPCmd(m.PTPMode.MOVJ_XYZ, *far, 0))),
        Verb("queue.download", lambda arm, _: download(arm), LONG, core=True, what="leaving"),
        Verb("wifi.get_settings", lambda arm, _: arm.wifi.get_settings()),
        Verb("wifi.connected", lambda arm, _: arm.wifi.connected()),
        Verb("wifi.wait_connected", lambda arm, _: arm.wifi.wait_connected(), LONG),
        Verb("wifi.configure", lambda arm, _: arm.wifi.configure("net", "password")),
    ]


def mycobot() -> list[Verb]:
    """What a myCobot has."""

    def both(name: str, *args: Any, **details: Any) -> list[Verb]:
        return two(name, *args, hosted=True, **details)

    async def moving(arm: Any) -> None:
        await arm.queue.move_joints(150, 0, 0, 0, 0, 0)

    return [
        *(
            read(name)
            for name in (
                "get_angles",
                "get_joints",
                "get_coords",
                "get_pose",
                "get_info",
                "get_versions",
                "get_alarms",
                "is_moving",
                "is_paused",
                "is_powered",
                "get_gripper",
                "get_encoders",
                "get_speeds",
                "get_voltages",
                "get_temperatures",
                "get_status",
                "get_tool",
                "get_world",
                "power_on",
                "power_off",
                "release",
                "focus",
            )
        ),
        read("is_in_position", (0, 0, 0, 0, 0, 0)),
        read("get_pin", 5),
        read("get_joint_limits", 1),
        read("set_joint_limits", 1, -100, 100),
        read("set_tool", 0, 0, 10, 0, 0, 0),
        read("set_world", 0, 0, 10, 0, 0, 0),
        read("set_reference_frame", y.ReferenceFrame.BASE),
        read("set_end_type", y.EndType.FLANGE),
        read("set_movement_type", y.MoveMode.ANGULAR),
        Verb("clear_alarms", lambda arm, _: arm.clear_alarms(), SHORT, moving, core=True),
        Verb("recover", lambda arm, _: arm.recover(), SHORT, moving, core=True),
        Verb("pause", lambda arm, _: arm.pause(), SHORT, moving),
        Verb("resume", lambda arm, _: arm.resume()),
        Verb("jog_stop", lambda arm, _: arm.jog_stop(), SHORT, moving),
        *both("move_to", 150, -60, 250, -90, 0, -90),
        *both("move_by", 0, 0, -10),
        *both("move_joint", 1, 150),
        *both("step_joint", 1, 100),
        *both("move_coord", "z", 250),
        *both("step_coord", "z", -20),
        *both("move_elbow", 20, model="myarm300"),
        *both("move_encoders", 3000, 2048, 2048, 2048, 2048, 2048),
        *both("gripper", True, long=False),
        *both("gripper_to", 50, long=False),
        Verb("suction", lambda arm, _: arm.suction(True), refused=True, at_once=True),
        Verb("queue.suction", lambda arm, _: arm.queue.suction(True), refused=True, at_once=True),
        *both("color", 1, 2, 3, long=False),
        *both("configure_pin", 5, y.PinMode.OUTPUT, long=False),
        *both("set_pin", 5, True, long=False, prepare=lambda arm: arm.configure_pin(5, y.PinMode.OUTPUT)),
        *both("set_pwm", 5, 100, 128, long=False, prepare=lambda arm: arm.configure_pin(5, y.PinMode.OUTPUT)),
        Verb(
            "queue.put",
            lambda arm, _: arm.queue.put(y.SEND_ANGLE, y.JointMove(1, 150, 50)),
            BEFORE,
            at_once=True,
        ),
    ]


def ultraarm() -> list[Verb]:
    """What an ultraArm has."""

    def both(name: str, *args: Any, **details: Any) -> list[Verb]:
        return two(name, *args, hosted=True, **details)

    async def moving(arm: Any) -> None:
        await arm.queue.move_joints(160, 10, 10)

    return [
        *(
            read(name)
            for name in (
                "get_angles",
                "get_joints",
                "get_coords",
                "get_pose",
                "get_info",
                "get_alarms",
                "get_endstops",
                "get_queue_size",
                "get_version",
                "is_moving",
                "release",
            )
        ),
        Verb("clear_alarms", lambda arm, _: arm.clear_alarms(), SHORT, moving, core=True),
        Verb("recover", lambda arm, _: arm.recover(), SHORT, moving, core=True),
        Verb("pause", lambda arm, _: arm.pause(), SHORT, moving),
        Verb("resume", lambda arm, _: arm.resume()),
        Verb("jog_stop", lambda arm, _: arm.jog_stop(), SHORT, moving),
        Verb("run_gcode", lambda arm, _: gcode(arm), LONG, core=True),
        Verb("run_gcode", lambda arm, _: gcode_lines(arm), LONG, what="line by line"),
        *both("move_to", 200, 50, 0, speed=5),
        *both("move_by", 0, 10, 0, speed=5),
        *both("move_joint", 1, 160),
        *both("set_position", 100, 0, 0, long=False),
        *both("absolute", long=False),
        *both("relative", long=False),
        *both("set_speed_mode", u.SpeedMode.RAMPED, long=False),
        *both("suction", True, long=False),
        *both("gripper", True, long=False),
        *both("gripper_to", 50, long=False),
        *both("release_gripper", long=False),
        *both("laser", False, long=False),
        *both("pwm", 0, long=False),
        *both("fan", True, long=False),
        *both("power_on", long=False),
        Verb("queue.put", lambda arm, _: arm.queue.put(u.MOVE_JOINT, u.JointMove(1, 160, 50)), BEFORE, at_once=True),
    ]


OWN: Mapping[str, Callable[[], list[Verb]]] = {"magician": magician, "mycobot": mycobot, "ultraarm": ultraarm}
MAY_BE_ABSENT = frozenset(
    {
        "clear_alarms",
        "get_alarms",
        "get_info",
        "get_joints",
        "get_pose",
        "gripper_to",
        "move_by",
        "pause",
        "queue.clear",
        "queue.gripper_to",
        "queue.move_by",
        "queue.pause",
        "queue.resume",
        "queue.suction",
        "recover",
        "resume",
        "suction",
    }
)
"""Of the protocol that all families keep; an arm that has no such thing may have no such verb."""


def verbs(family: Family, queue: Any) -> list[Verb]:
    """The table of a family; `queue` is the class of its queues."""
    places = {"": family.kind, "queue": queue}

    def there(verb: Verb) -> bool:
        place, _, name = verb.name.rpartition(".")
        return verb.name not in MAY_BE_ABSENT or hasattr(places[place], name)

    return [verb for verb in [*shared(family), *OWN[family.name]()] if there(verb)]


def public_calls(kind: Any) -> set[str]:
    """The public methods of a class that may have to be awaited."""
    return {
        name
        for name in dir(kind)
        if not name.startswith("_")
        and (callable(found := inspect.getattr_static(kind, name)) or isinstance(found, (classmethod, staticmethod)))
    }
