"""`DobotDllType`'s functions that jog the arm, and their parameters; see `_dll_motion` for isQueued."""

from __future__ import annotations

from dobot_async.arms.magician import commands as c
from dobot_async.compat._dll_api import Api

__all__ = [
    "GetJOGCommonParams",
    "GetJOGCoordinateParams",
    "GetJOGJointParams",
    "GetJOGLParams",
    "SetJOGCmd",
    "SetJOGCommonParams",
    "SetJOGCoordinateParams",
    "SetJOGJointParams",
    "SetJOGLParams",
]


def SetJOGJointParams(
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
    """Set the jog velocities and accelerations of the joints, degrees/s and degrees/s²."""
    velocity = j1Velocity, j2Velocity, j3Velocity, j4Velocity
    acceleration = j1Acceleration, j2Acceleration, j3Acceleration, j4Acceleration
    return api.tell(c.SET_JOG_JOINT_PARAMS, c.JOGJointParams(velocity, acceleration), isQueued)


def GetJOGJointParams(api: Api) -> list[float]:
    """Return velocity and acceleration of each joint, as SetJOGJointParams takes them."""
    return by_axis(api.session.read(c.GET_JOG_JOINT_PARAMS))


def SetJOGCoordinateParams(
    api: Api,
    xVelocity: float,
    xAcceleration: float,
    yVelocity: float,
    yAcceleration: float,
    zVelocity: float,
    zAcceleration: float,
    rVelocity: float,
    rAcceleration: float,
    isQueued: int = 0,
) -> list[int]:
    """Set the jog velocities and accelerations along x, y, z (mm/s, mm/s²) and r (degrees/s, degrees/s²)."""
    velocity = xVelocity, yVelocity, zVelocity, rVelocity
    acceleration = xAcceleration, yAcceleration, zAcceleration, rAcceleration
    return api.tell(c.SET_JOG_COORDINATE_PARAMS, c.JOGCoordinateParams(velocity, acceleration), isQueued)


def GetJOGCoordinateParams(api: Api) -> list[float]:
    """Return velocity and acceleration along each axis, as SetJOGCoordinateParams takes them."""
    return by_axis(api.session.read(c.GET_JOG_COORDINATE_PARAMS))


def SetJOGLParams(api: Api, velocity: float, acceleration: float, isQueued: int = 0) -> list[int]:
    """Set the jog velocity and acceleration of the rail, mm/s and mm/s²."""
    return api.tell(c.SET_JOGL_PARAMS, c.JOGLParams(velocity, acceleration), isQueued)


def GetJOGLParams(api: Api) -> list[float]:
    """Return the jog velocity and acceleration of the rail, mm/s and mm/s²."""
    found = api.session.read(c.GET_JOGL_PARAMS)
    return [found.velocity, found.acceleration]


def SetJOGCommonParams(
    api: Api, value_velocityratio: float, value_accelerationratio: float, isQueued: int = 0
) -> list[int]:
    """Set the percentages of jog velocity and acceleration that are used."""
    return api.tell(c.SET_JOG_COMMON_PARAMS, c.JOGCommonParams(value_velocityratio, value_accelerationratio), isQueued)


def GetJOGCommonParams(api: Api) -> list[float]:
    """Return the percentages of jog velocity and acceleration that are used."""
    return ratios(api.session.read(c.GET_JOG_COMMON_PARAMS))


def SetJOGCmd(api: Api, isJoint: int, cmd: int, isQueued: int = 0) -> list[int]:
    """Begin to jog (`JC`), once what is queued is done, or end it (0), at once; return `[0]`."""
    api.session.jog(joint=bool(isJoint), key=c.JOGKey(cmd))
    return [0]


def by_axis(found: c.JOGJointParams | c.JOGCoordinateParams | c.PTPJointParams) -> list[float]:
    """Velocity and acceleration of each axis in turn."""
    return [number for pair in zip(found.velocity, found.acceleration, strict=True) for number in pair]


def ratios(found: c.JOGCommonParams | c.PTPCommonParams | c.ARCCommonParams) -> list[float]:
    """Both percentages."""
    return [found.velocity_ratio, found.acceleration_ratio]
