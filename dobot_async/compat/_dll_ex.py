"""`DobotDllType`'s functions that end in Ex: they return when the arm has done it. DobotStudio's programs use these.

`isQueued` makes no difference: all of them wait.
"""

from __future__ import annotations

from collections.abc import Sequence

from dobot_async.compat import _dll_device as device
from dobot_async.compat import _dll_io as io
from dobot_async.compat import _dll_motion as motion
from dobot_async.compat._dll_api import Api

__all__ = [
    "GetColorSensorEx",
    "GetPoseEx",
    "SetARCCmdEx",
    "SetEMotorEx",
    "SetEMotorSEx",
    "SetEndEffectorGripperEx",
    "SetEndEffectorLaserEx",
    "SetEndEffectorParamsEx",
    "SetEndEffectorSuctionCupEx",
    "SetHOMECmdEx",
    "SetIODOEx",
    "SetIOMultiplexingEx",
    "SetIOPWMEx",
    "SetLostStepCmdEx",
    "SetPTPCmdEx",
    "SetPTPCommonParamsEx",
    "SetPTPCoordinateParamsEx",
    "SetPTPJointParamsEx",
    "SetPTPJumpParamsEx",
    "SetPTPLParamsEx",
    "SetPTPWithLCmdEx",
    "SetTRIGCmdEx",
    "SetWAITCmdEx",
]

LASER_SWITCH, LASER_POWER = 2, 4  # pins
LASER_FREQUENCY = 10_000  # Hz
DO, PWM = 1, 2


def GetPoseEx(api: Api, index: int) -> float:
    """Return one number: 1 to 8 of x, y, z, r and the joints; 0 is the place on the rail."""
    return round(device.GetPoseL(api)[0] if index == 0 else device.GetPose(api)[index - 1], 4)


def GetColorSensorEx(api: Api, index: int) -> int:
    """Return what the colour sensor sees of red (0), green (1) or blue (2)."""
    return io.GetColorSensor(api)[index]


def SetHOMECmdEx(api: Api, temp: int = 0, isQueued: int = 0) -> None:
    """Home the arm."""
    motion.SetHOMECmd(api, temp)


def SetWAITCmdEx(api: Api, waitTime: float, isQueued: int = 0) -> None:
    """Let the arm wait; the unit is that of SetWAITCmd."""
    motion.SetWAITCmd(api, waitTime)


def SetEndEffectorParamsEx(api: Api, xBias: float, yBias: float, zBias: float, isQueued: int = 0) -> None:
    """Say which tool is on the arm, by its offset from the flange, mm."""
    in_turn(api, io.SetEndEffectorParams(api, xBias, yBias, zBias, 1))


def SetPTPJointParamsEx(
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
) -> None:
    """Set the velocities and accelerations of the joints, degrees/s and degrees/s²."""
    numbers = (j1Velocity, j1Acceleration, j2Velocity, j2Acceleration)
    others = (j3Velocity, j3Acceleration, j4Velocity, j4Acceleration)
    in_turn(api, motion.SetPTPJointParams(api, *numbers, *others, isQueued=1))


def SetPTPCoordinateParamsEx(
    api: Api, xyzVelocity: float, xyzAcceleration: float, rVelocity: float, rAcceleration: float, isQueued: int = 0
) -> None:
    """Set velocity and acceleration of the tool."""
    in_turn(api, motion.SetPTPCoordinateParams(api, xyzVelocity, xyzAcceleration, rVelocity, rAcceleration, 1))


def SetPTPLParamsEx(api: Api, lVelocity: float, lAcceleration: float, isQueued: int = 0) -> None:
    """Set velocity and acceleration of the rail, mm/s and mm/s²."""
    in_turn(api, motion.SetPTPLParams(api, lVelocity, lAcceleration, 1))


def SetPTPCommonParamsEx(api: Api, velocityRatio: float, accelerationRatio: float, isQueued: int = 0) -> None:
    """Set the percentages of velocity and acceleration that are used."""
    in_turn(api, motion.SetPTPCommonParams(api, velocityRatio, accelerationRatio, 1))


def SetPTPJumpParamsEx(api: Api, jumpHeight: float, maxJumpHeight: float, isQueued: int = 0) -> None:
    """Set how far a jump lifts, and the z that it never exceeds, mm."""
    in_turn(api, motion.SetPTPJumpParams(api, jumpHeight, maxJumpHeight, 1))


def SetPTPCmdEx(api: Api, ptpMode: int, x: float, y: float, z: float, rHead: float, isQueued: int = 0) -> None:
    """Move to a point (`PTPMode`)."""
    motion.SetPTPCmd(api, ptpMode, x, y, z, rHead)


def SetPTPWithLCmdEx(
    api: Api,
    ptpMode: int,
    x: float,
    y: float,
    z: float,
    rHead: float,
    l: float,  # noqa: E741 - the vendor's name
    isQueued: int = 0,
) -> None:
    """Move to a point while the rail moves to `l` mm."""
    motion.SetPTPWithLCmd(api, ptpMode, x, y, z, rHead, l)


def SetARCCmdEx(api: Api, cirPoint: Sequence[float], toPoint: Sequence[float], isQueued: int = 1) -> None:
    """Move along the arc through one point to another, each x, y, z, r."""
    motion.SetARCCmd(api, cirPoint, toPoint)


def SetTRIGCmdEx(api: Api, address: int, mode: int, condition: int, threshold: int, isQueued: int = 1) -> None:
    """Wait until an input meets a condition."""
    motion.SetTRIGCmd(api, address, mode, condition, threshold)


def SetLostStepCmdEx(api: Api, isQueued: int = 1) -> None:
    """Check for lost steps; if there are any, that is an alarm."""
    device.SetLostStepCmd(api)


def SetIOMultiplexingEx(api: Api, address: int, multiplex: int, isQueued: int = 0) -> None:
    """Say what a pin (1 to 20) is used for (`GPIOType`)."""
    in_turn(api, io.SetIOMultiplexing(api, address, multiplex, 1))


def SetIODOEx(api: Api, address: int, level: int, isQueued: int = 0) -> None:
    """Set a digital output."""
    in_turn(api, io.SetIODO(api, address, level, 1))


def SetIOPWMEx(api: Api, address: int, frequency: float, dutyCycle: float, isQueued: int = 0) -> None:
    """Set a PWM output: 10 Hz to 1 MHz, 0 to 100 percent."""
    in_turn(api, io.SetIOPWM(api, address, frequency, dutyCycle, 1))


def SetEndEffectorSuctionCupEx(api: Api, enableCtrl: int, on: int, isQueued: int = 0) -> None:
    """Switch the pump, and suck or let go; give the air some 0.3 s."""
    in_turn(api, io.SetEndEffectorSuctionCup(api, enableCtrl, on, 1))


def SetEndEffectorGripperEx(api: Api, enableCtrl: int, on: int, isQueued: int = 0) -> None:
    """Switch the pump, and close or open the gripper; give it some 0.5 s."""
    in_turn(api, io.SetEndEffectorGripper(api, enableCtrl, on, 1))


def SetEndEffectorLaserEx(api: Api, enableCtrl: int, power: float, isQueued: int = 0) -> None:
    """Switch the laser at the pins 2 (on) and 4 (PWM), with 0 to 100 percent of its power."""
    SetIOMultiplexingEx(api, LASER_SWITCH, DO)
    SetIOMultiplexingEx(api, LASER_POWER, PWM)
    SetIODOEx(api, LASER_SWITCH, enableCtrl)
    SetIOPWMEx(api, LASER_POWER, LASER_FREQUENCY, power)


def SetEMotorEx(api: Api, index: int, isEnabled: int, speed: int, isQueued: int = 0) -> None:
    """Run stepper 0 or 1 at a speed in pulses/s until told otherwise."""
    in_turn(api, io.SetEMotor(api, index, isEnabled, speed, 1))


def SetEMotorSEx(api: Api, index: int, isEnabled: int, speed: int, distance: int, isQueued: int = 0) -> None:
    """Run stepper 0 or 1 at a speed in pulses/s for a distance in pulses."""
    io.SetEMotorS(api, index, isEnabled, speed, distance)


def in_turn(api: Api, index: list[int]) -> None:
    """Wait until what was queued is executed."""
    api.session.wait_for(index[0])
