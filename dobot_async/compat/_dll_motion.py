"""`DobotDllType`'s functions that move the arm, and the parameters of motions.

`isQueued=1` queues a command, and returns its index at once, in a list. `isQueued=0` does it now: a setting is made and
has no index (0); a motion is done when the function returns. Lengths are mm, angles degrees, ratios percent.
"""

from __future__ import annotations

from collections.abc import Sequence

from dobot_async.arms.magician import commands as c
from dobot_async.compat._dll_api import Api
from dobot_async.compat._dll_jog import by_axis, ratios

__all__ = [
    "GetARCCommonParams",
    "GetARCParams",
    "GetCPParams",
    "GetCPRHoldEnable",
    "GetHOMEParams",
    "GetPTPCommonParams",
    "GetPTPCoordinateParams",
    "GetPTPJointParams",
    "GetPTPJumpParams",
    "GetPTPLParams",
    "SetARCCmd",
    "SetARCCommonParams",
    "SetARCParams",
    "SetAutoLevelingCmd",
    "SetCPCmd",
    "SetCPLECmd",
    "SetCPParams",
    "SetCPRHoldEnable",
    "SetCircleCmd",
    "SetHOMECmd",
    "SetHOMEParams",
    "SetPTPCmd",
    "SetPTPCommonParams",
    "SetPTPCoordinateParams",
    "SetPTPJointParams",
    "SetPTPJumpParams",
    "SetPTPLParams",
    "SetPTPWithLCmd",
    "SetTRIGCmd",
    "SetWAITCmd",
]


def SetHOMEParams(api: Api, x: float, y: float, z: float, r: float, isQueued: int = 0) -> list[int]:
    """Set where the arm stands after homing."""
    return api.tell(c.SET_HOME_PARAMS, c.HOMEParams(x, y, z, r), isQueued)


def GetHOMEParams(api: Api) -> list[float]:
    """Return x, y, z and r of where the arm stands after homing."""
    home = api.session.read(c.GET_HOME_PARAMS)
    return [home.x, home.y, home.z, home.r]


def SetHOMECmd(api: Api, temp: int = 0, isQueued: int = 0) -> list[int]:
    """Home the arm."""
    return api.tell(c.SET_HOME_CMD, c.HOMECmd(), isQueued)


def SetAutoLevelingCmd(api: Api, controlFlag: int, precision: float, isQueued: int = 0) -> list[int]:
    """Level the arm with the levelling tool."""
    return api.tell(c.SET_AUTO_LEVELING_CMD, c.AutoLevelingCmd(bool(controlFlag), precision), isQueued)


def SetPTPJointParams(
    api: Api,
    j1Velocity: float,
    j1Acceleration: float,
    j2Velocity: float,
    j2Acceleration: float,
    j3Velocity: float,
    j3Acceleration: float,
    j4Velocity: float,
    j4Acceleration: float,
    isQueued: int = 0,
) -> list[int]:
    """Set the velocities and accelerations of the joints, degrees/s and degrees/s²."""
    velocity = j1Velocity, j2Velocity, j3Velocity, j4Velocity
    acceleration = j1Acceleration, j2Acceleration, j3Acceleration, j4Acceleration
    return api.tell(c.SET_PTP_JOINT_PARAMS, c.PTPJointParams(velocity, acceleration), isQueued)


def GetPTPJointParams(api: Api) -> list[float]:
    """Return velocity and acceleration of each joint, as SetPTPJointParams takes them."""
    return by_axis(api.session.read(c.GET_PTP_JOINT_PARAMS))


def SetPTPCoordinateParams(
    api: Api, xyzVelocity: float, xyzAcceleration: float, rVelocity: float, rAcceleration: float, isQueued: int = 0
) -> list[int]:
    """Set velocity and acceleration of the tool, along x, y and z (mm/s, mm/s²) and of r (degrees/s, degrees/s²)."""
    value = c.PTPCoordinateParams(xyzVelocity, rVelocity, xyzAcceleration, rAcceleration)
    return api.tell(c.SET_PTP_COORDINATE_PARAMS, value, isQueued)


def GetPTPCoordinateParams(api: Api) -> list[float]:
    """Return velocity along x, y and z, that of r, acceleration along x, y and z, that of r: in this order."""
    found = api.session.read(c.GET_PTP_COORDINATE_PARAMS)
    return [found.xyz_velocity, found.r_velocity, found.xyz_acceleration, found.r_acceleration]


def SetPTPLParams(api: Api, velocity: float, acceleration: float, isQueued: int = 0) -> list[int]:
    """Set velocity and acceleration of the rail, mm/s and mm/s²."""
    return api.tell(c.SET_PTPL_PARAMS, c.PTPLParams(velocity, acceleration), isQueued)


def GetPTPLParams(api: Api) -> list[float]:
    """Return velocity and acceleration of the rail, mm/s and mm/s²."""
    found = api.session.read(c.GET_PTPL_PARAMS)
    return [found.velocity, found.acceleration]


def SetPTPJumpParams(api: Api, jumpHeight: float, zLimit: float, isQueued: int = 0) -> list[int]:
    """Set how far a jump lifts, and the z that it never exceeds, mm."""
    return api.tell(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(jumpHeight, zLimit), isQueued)


def GetPTPJumpParams(api: Api) -> list[float]:
    """Return how far a jump lifts, and the z that it never exceeds, mm."""
    found = api.session.read(c.GET_PTP_JUMP_PARAMS)
    return [found.jump_height, found.z_limit]


def SetPTPCommonParams(api: Api, velocityRatio: float, accelerationRatio: float, isQueued: int = 0) -> list[int]:
    """Set the percentages of velocity and acceleration that are used; more than 100 is 100."""
    return api.tell(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(velocityRatio, accelerationRatio), isQueued)


def GetPTPCommonParams(api: Api) -> list[float]:
    """Return the percentages of velocity and acceleration that are used."""
    return ratios(api.session.read(c.GET_PTP_COMMON_PARAMS))


def SetPTPCmd(api: Api, ptpMode: int, x: float, y: float, z: float, rHead: float, isQueued: int = 0) -> list[int]:
    """Move to a point (`PTPMode`)."""
    return api.tell(c.SET_PTP_CMD, c.PTPCmd(c.PTPMode(ptpMode), x, y, z, rHead), isQueued)


def SetPTPWithLCmd(
    api: Api,
    ptpMode: int,
    x: float,
    y: float,
    z: float,
    rHead: float,
    l: float,  # noqa: E741 - the vendor's name
    isQueued: int = 0,
) -> list[int]:
    """Move to a point while the rail moves to `l` mm."""
    return api.tell(c.SET_PTP_WITH_L_CMD, c.PTPWithLCmd(c.PTPMode(ptpMode), x, y, z, rHead, l), isQueued)


def SetCPRHoldEnable(api: Api, isEnable: int) -> None:
    """Say whether a continuous path holds r."""
    api.session.write(c.SET_CPR_HOLD_ENABLE, bool(isEnable))


def GetCPRHoldEnable(api: Api) -> list[bool]:
    """Return whether a continuous path holds r, in a list."""
    return [api.session.read(c.GET_CPR_HOLD_ENABLE)]


def SetCPParams(
    api: Api, planAcc: float, juncitionVel: float, acc: float, realTimeTrack: int = 0, isQueued: int = 0
) -> list[int]:
    """Set the limits of a continuous path, mm/s² and mm/s."""
    return api.tell(c.SET_CP_PARAMS, c.CPParams(planAcc, juncitionVel, acc, bool(realTimeTrack)), isQueued)


def GetCPParams(api: Api) -> list[float]:
    """Return the limits of a continuous path, as SetCPParams takes them."""
    found = api.session.read(c.GET_CP_PARAMS)
    return [found.plan_acc, found.junction_vel, found.acc, found.real_time_track]


def SetCPCmd(api: Api, cpMode: int, x: float, y: float, z: float, velocity: float, isQueued: int = 0) -> list[int]:
    """Move on along a continuous path (`ContinuousPathMode`)."""
    return api.tell(c.SET_CP_CMD, c.CPCmd(c.CPMode(cpMode), x, y, z, velocity), isQueued)


def SetCPLECmd(api: Api, cpMode: int, x: float, y: float, z: float, power: float, isQueued: int = 0) -> list[int]:
    """Move on along a continuous path with the laser at 0 to 100 percent."""
    return api.tell(c.SET_CPLE_CMD, c.CPLECmd(c.CPMode(cpMode), x, y, z, power), isQueued)


def SetARCParams(
    api: Api,
    xyzVelocity: float,
    rVelocity: float,
    xyzAcceleration: float,
    rAcceleration: float,
    isQueued: int = 0,
) -> list[int]:
    """Set velocities and accelerations of an arc."""
    value = c.ARCParams(xyzVelocity, rVelocity, xyzAcceleration, rAcceleration)
    return api.tell(c.SET_ARC_PARAMS, value, isQueued)


def GetARCParams(api: Api) -> list[float]:
    """Return velocities and accelerations of an arc, as SetARCParams takes them."""
    found = api.session.read(c.GET_ARC_PARAMS)
    return [found.xyz_velocity, found.r_velocity, found.xyz_acceleration, found.r_acceleration]


def SetARCCmd(api: Api, cirPoint: Sequence[float], toPoint: Sequence[float], isQueued: int = 0) -> list[int]:
    """Move along the arc through one point to another, each x, y, z, r."""
    return api.tell(c.SET_ARC_CMD, c.ARCCmd(point("cirPoint", cirPoint), point("toPoint", toPoint)), isQueued)


def SetCircleCmd(api: Api, cirPoint: Sequence[float], toPoint: Sequence[float], isQueued: int = 0) -> list[int]:
    """Move once around the circle through two points, each x, y, z, r."""
    return api.tell(c.SET_CIRCLE_CMD, c.CircleCmd(point("cirPoint", cirPoint), point("toPoint", toPoint)), isQueued)


def SetARCCommonParams(api: Api, velocityRatio: float, accelerationRatio: float, isQueued: int = 0) -> list[int]:
    """Set the percentages of an arc's velocity and acceleration that are used."""
    return api.tell(c.SET_ARC_COMMON_PARAMS, c.ARCCommonParams(velocityRatio, accelerationRatio), isQueued)


def GetARCCommonParams(api: Api) -> list[float]:
    """Return the percentages of an arc's velocity and acceleration that are used."""
    return ratios(api.session.read(c.GET_ARC_COMMON_PARAMS))


def SetWAITCmd(api: Api, waitTime: float, isQueued: int = 0) -> list[int]:
    """Let the arm wait, in ms, or in s after `load(wait="s")`.

    Raises:
        ValueError: The number is most likely meant in the other unit.
    """
    return api.tell(c.SET_WAIT_CMD, c.WAITCmd(api.milliseconds(waitTime)), isQueued)


def SetTRIGCmd(api: Api, address: int, mode: int, condition: int, threshold: int, isQueued: int = 0) -> list[int]:
    """Hold the queue until an input meets a condition (`TRIGMode`, `TRIGInputIOCondition`, `TRIGADCCondition`)."""
    return api.tell(c.SET_TRIG_CMD, c.TRIGCmd(address, c.TriggerMode(mode), condition, threshold), isQueued)


def point(name: str, numbers: Sequence[float]) -> c.ARCPoint:
    """A point of an arc."""
    if len(numbers) != 4:
        raise ValueError(f"{name} is x, y, z and r, not {numbers!r}")

    return c.ARCPoint(*numbers)
