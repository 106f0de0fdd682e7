"""Where the motions of a simulated myCobot lead, from where it is when their turn comes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.simulator.device.path import Segment
from dobot_async.simulator.device.profile import SpeedLimits
from dobot_async.simulator.mycobot.kinematics import Palletizer, Transform

if TYPE_CHECKING:
    from dobot_async.simulator.mycobot.body import MyCobotBody

__all__ = ["CENTRE", "PLANS", "STEPS"]

CENTRE, STEPS = 2048, 4096 / 360


def to_joints(arm: MyCobotBody, joints: Mapping[int, float], speed: float) -> Segment:
    """Some joints, by their places, to angles."""
    target = list(arm.joints)
    for place, angle in joints.items():
        target[place] = angle

    return arm.ways.to_joints(arm.joints, target, speed)


def to_point(arm: MyCobotBody, coords: Mapping[int, float], speed: float, mode: c.MoveMode | None) -> Segment:
    """Some coordinates, by their places, to values."""
    target: Sequence[float] = [coords.get(place, here) for place, here in enumerate(arm.coords)]
    if not isinstance(arm.ways.solver, Palletizer):
        target = arm.world.inverse.then(Transform.of(target)).then(arm.tool.inverse).point

    way = arm.settings[c.SET_MOVEMENT_TYPE] if mode is None else mode
    straight = way is c.MoveMode.LINEAR and not arm.settings[c.SET_FRESH_MODE]
    return arm.ways.to_point(arm.joints, target, speed, straight=straight)


def drag(arm: MyCobotBody, value: c.SetEncodersDrag) -> Segment:
    """All servos to positions, each no faster than its own speed in steps/s; 0 is as fast as it can."""
    fastest = arm.ways.pace(100)
    speeds = tuple(
        min(speed / STEPS, most) if speed else most for speed, most in zip(value.speeds, fastest.velocity, strict=True)
    )
    target = [angle for _, angle in sorted(of_encoders(value.encoders).items())]
    return arm.ways.to_joints(arm.joints, target, 100, SpeedLimits(speeds, fastest.acceleration))


def of_encoders(encoders: Sequence[int]) -> dict[int, float]:
    """Angles, by the places of their joints."""
    return {place: (encoder - CENTRE) / STEPS for place, encoder in enumerate(encoders)}


def one_encoder(arm: MyCobotBody, value: c.SetEncoder) -> Segment:
    """The servo of one joint."""
    return to_joints(arm, {value.joint - 1: (value.encoder - CENTRE) / STEPS}, value.speed)


def joint_step(arm: MyCobotBody, value: c.JointMove) -> Segment:
    """One joint by an angle."""
    place = value.joint - 1
    return to_joints(arm, {place: arm.joints[place] + value.angle}, value.speed)


def coord_step(arm: MyCobotBody, value: c.CoordStep) -> Segment:
    """One coordinate by a distance or an angle."""
    place = value.axis - 1
    return to_point(arm, {place: arm.coords[place] + value.value}, value.speed, None)


def by_place(values: Sequence[float]) -> dict[int, float]:
    """Values, by the places of their joints or axes."""
    return dict(enumerate(values))


PLANS: Mapping[Command[Any, Any], Callable[[MyCobotBody, Any], Segment]] = {
    c.SEND_ANGLES: lambda arm, value: to_joints(arm, by_place(value.angles), value.speed),
    c.SEND_ANGLE: lambda arm, value: to_joints(arm, {value.joint - 1: value.angle}, value.speed),
    c.JOG_ABSOLUTE: lambda arm, value: to_joints(arm, {value.joint - 1: value.angle}, value.speed),
    c.JOG_INCREMENT: joint_step,
    c.SEND_COORDS: lambda arm, value: to_point(arm, by_place(value.coords), value.speed, value.mode),
    c.SEND_COORD: lambda arm, value: to_point(arm, {value.axis - 1: value.value}, value.speed, None),
    c.JOG_INCREMENT_COORD: coord_step,
    c.SET_SOLUTION_ANGLES: lambda arm, value: arm.ways.elbow(arm.joints, value.angle, value.speed),
    c.SET_ENCODER: one_encoder,
    c.SET_ENCODERS: lambda arm, value: to_joints(arm, of_encoders(value.encoders), value.speed),
    c.SET_ENCODERS_DRAG: drag,
}
"""The way of each motion."""
