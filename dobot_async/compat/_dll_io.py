"""`DobotDllType`'s functions for tools, pins, steppers and sensors; see `_dll_motion` for isQueued."""

from __future__ import annotations

from dobot_async.arms.magician import commands as c
from dobot_async.compat._dll_api import Api

__all__ = [
    "GetColorSensor",
    "GetEndEffectorGripper",
    "GetEndEffectorLaser",
    "GetEndEffectorParams",
    "GetEndEffectorSuctionCup",
    "GetIOADC",
    "GetIODI",
    "GetIODO",
    "GetIOMultiplexing",
    "GetIOPWM",
    "GetInfraredSensor",
    "SetColorSensor",
    "SetEMotor",
    "SetEMotorS",
    "SetEndEffectorGripper",
    "SetEndEffectorLaser",
    "SetEndEffectorParams",
    "SetEndEffectorSuctionCup",
    "SetIODO",
    "SetIOMultiplexing",
    "SetIOPWM",
    "SetInfraredSensor",
]


def SetEndEffectorParams(api: Api, xBias: float, yBias: float, zBias: float, isQueued: int = 0) -> list[int]:
    """Say which tool is on the arm, by its offset from the flange, mm."""
    return api.tell(c.SET_END_EFFECTOR_PARAMS, c.EndEffectorParams(xBias, yBias, zBias), isQueued)


def GetEndEffectorParams(api: Api) -> list[float]:
    """Return the tool's offset from the flange, mm."""
    found = api.session.read(c.GET_END_EFFECTOR_PARAMS)
    return [found.x_bias, found.y_bias, found.z_bias]


def SetEndEffectorLaser(api: Api, enableCtrl: int, on: int, isQueued: int = 0) -> list[int]:
    """Switch the laser; it burns only when both are set."""
    return api.tell(c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(bool(enableCtrl), bool(on)), isQueued)


def GetEndEffectorLaser(api: Api) -> list[bool]:
    """Return whether the laser is enabled, and whether it is on."""
    found = api.session.read(c.GET_END_EFFECTOR_LASER)
    return [found.is_ctrl_enabled, found.is_on]


def SetEndEffectorSuctionCup(api: Api, enableCtrl: int, on: int, isQueued: int = 0) -> list[int]:
    """Switch the pump, and suck or let go; give the air some 0.3 s."""
    return api.tell(c.SET_END_EFFECTOR_SUCTION_CUP, c.EndEffectorSuctionCup(bool(enableCtrl), bool(on)), isQueued)


def GetEndEffectorSuctionCup(api: Api) -> list[bool]:
    """Return whether the cup sucks, in a list."""
    return [api.session.read(c.GET_END_EFFECTOR_SUCTION_CUP).is_sucked]


def SetEndEffectorGripper(api: Api, enableCtrl: int, on: int, isQueued: int = 0) -> list[int]:
    """Switch the pump, and close or open the gripper; give it some 0.5 s."""
    return api.tell(c.SET_END_EFFECTOR_GRIPPER, c.EndEffectorGripper(bool(enableCtrl), bool(on)), isQueued)


def GetEndEffectorGripper(api: Api) -> list[bool]:
    """Return whether the gripper is closed, in a list."""
    return [api.session.read(c.GET_END_EFFECTOR_GRIPPER).is_gripped]


def SetIOMultiplexing(api: Api, address: int, multiplex: int, isQueued: int = 0) -> list[int]:
    """Say what a pin (1 to 20) is used for (`GPIOType`)."""
    return api.tell(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(address, c.IOFunction(multiplex)), isQueued)


def GetIOMultiplexing(api: Api, addr: int) -> list[int]:
    """Return what a pin is used for, in a list."""
    return [api.session.read(c.GET_IO_MULTIPLEXING, addr).multiplex]


def SetIODO(api: Api, address: int, level: int, isQueued: int = 0) -> list[int]:
    """Set a digital output.

    Raises:
        ValueError: The pin is not configured as an output.
    """
    return api.tell(c.SET_IODO, c.IODO(address, level), isQueued)


def GetIODO(api: Api, addr: int) -> list[int]:
    """Return the level that a digital output was set to, in a list."""
    return [api.session.read(c.GET_IODO, addr).level]


def SetIOPWM(api: Api, address: int, frequency: float, dutyCycle: float, isQueued: int = 0) -> list[int]:
    """Set a PWM output: 10 Hz to 1 MHz, 0 to 100 percent.

    Raises:
        ValueError: The pin is not configured for PWM.
    """
    return api.tell(c.SET_IOPWM, c.IOPWM(address, frequency, dutyCycle), isQueued)


def GetIOPWM(api: Api, addr: int) -> list[float]:
    """Return frequency and duty cycle of a PWM output."""
    found = api.session.read(c.GET_IOPWM, addr)
    return [found.frequency, found.duty_cycle]


def GetIODI(api: Api, addr: int) -> list[int]:
    """Return the level of a digital input, in a list.

    Raises:
        ValueError: The pin is not configured as an input.
    """
    return [api.session.input(addr)]


def GetIOADC(api: Api, addr: int) -> list[int]:
    """Return an analog input, 0 to 4095, in a list.

    Raises:
        ValueError: The pin is not configured as an analog input.
    """
    return [api.session.analog(addr)]


def SetEMotor(api: Api, index: int, isEnabled: int, speed: int, isQueued: int = 0) -> list[int]:
    """Run stepper 0 or 1 at a speed in pulses/s, whose sign is the direction, until told otherwise."""
    return api.tell(c.SET_E_MOTOR, c.EMotor(index, bool(isEnabled), int(speed)), isQueued)


def SetEMotorS(api: Api, index: int, isEnabled: int, speed: int, distance: int, isQueued: int = 0) -> list[int]:
    """Run stepper 0 or 1 at a speed in pulses/s for a distance in pulses."""
    return api.tell(c.SET_E_MOTOR_S, c.EMotorS(index, bool(isEnabled), int(speed), int(distance)), isQueued)


def SetColorSensor(api: Api, isEnable: int, colorPort: int = 1, version: int = 0) -> None:
    """Switch the colour sensor at a socket (`ColorPort`); version 0 is V1, 1 is V2."""
    value = c.ColorSensor(bool(isEnable), c.ColorPort(colorPort), c.AccessoryVersion(version))
    api.session.write(c.SET_COLOR_SENSOR, value)


def GetColorSensor(api: Api) -> list[int]:
    """Return what the colour sensor sees: red, green and blue."""
    found = api.session.read(c.GET_COLOR_SENSOR)
    return [found.r, found.g, found.b]


def SetInfraredSensor(api: Api, isEnable: int, infraredPort: int, version: int = 0) -> None:
    """Switch the infrared sensor at a socket (`InfraredPort`); version 0 is V1, 1 is V2."""
    value = c.InfraredSensor(bool(isEnable), c.InfraredPort(infraredPort), c.AccessoryVersion(version))
    api.session.write(c.SET_INFRARED_SENSOR, value)


def GetInfraredSensor(api: Api, infraredPort: int) -> list[int]:
    """Return 1 if the infrared sensor at a socket sees something, else 0; in a list."""
    return [api.session.read(c.GET_INFRARED_SENSOR, c.InfraredPort(infraredPort))]
