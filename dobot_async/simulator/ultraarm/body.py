"""A simulated ultraArm P340 without its lines: registers, and what each command does in time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.simulator.device.curve import LineSegment, between
from dobot_async.simulator.device.device import Device
from dobot_async.simulator.device.path import Segment, curve_segment, joint_segment, travel
from dobot_async.simulator.device.profile import SpeedLimits, trapezoid
from dobot_async.simulator.device.work import Activity, DeviceFault, Vector, Work
from dobot_async.simulator.ultraarm.kinematics import REACH, checked, forward, inverse

__all__ = ["CommandEffects", "Registers"]

ACCELERATION = 400.0  # mm/s² and degrees/s²
DEFAULT_SPEED = 50.0
SLOWEST = 1  # of the gripper
PERCENT_PER_SPEED = 0.5  # how fast the gripper opens: fully in a second at F200
HOMING = 3.0  # seconds that the switches take at the end of the way home
FAR = 1000.0


@dataclass(slots=True)
class Registers:
    """What the arm remembers beside its joints.

    Attributes:
        relative: Whether coordinates are increments (G91).
        speed: F of the last motion that had one.
        origin: What is added to the arm's own coordinates (G92).
        powered: Whether the motors hold.
        homed: Whether it knows where it is: it has been home, and its motors have had power since.
        told: The joints that it tells while it does not know where it is; its motors count steps, and sense nothing.
        laser: Whether the laser is on.
        pwm: The laser's duty cycle, 0 to 255.
        pump: Whether M23, as the manual has it, has started the pump.
        fan: Whether the fan runs.
        gripper: How far the gripper is to be open, 0 to 100; None while it is released.
        stroke: From where the gripper came, when it set out (simulated seconds), and its percent per second.
        speed_mode: How the arm runs through a series of motions.
        servo: Registers of the servos, by servo and address.
        closed: Where the force gripper is closed.
        constant_speed: Whether M16 S0 takes the ramps away.
    """

    relative: bool = False
    speed: float = DEFAULT_SPEED
    origin: Vector = (0.0, 0.0, 0.0, 0.0)
    powered: bool = True
    homed: bool = False
    told: Vector = (0.0, 0.0, 0.0, 0.0)
    laser: bool = False
    pwm: int = 0
    pump: bool = False
    fan: bool = True
    gripper: int | None = 0
    speed_mode: int = 2
    servo: dict[tuple[int, int], int] = field(default_factory=dict[tuple[int, int], int])
    closed: int = 20
    stroke: tuple[float, float, float] = (0.0, 0.0, 1.0)
    constant_speed: bool = False

    @property
    def acceleration(self) -> float:
        """mm/s² and degrees/s² of motions; infinite without ramps."""
        return math.inf if self.constant_speed and self.speed_mode == c.SpeedMode.CONSTANT else ACCELERATION

    def release(self, joints: Vector) -> None:
        """Takes the power off the motors, where the joints are: it forgets where that is."""
        if self.homed:
            self.told = joints

        self.powered = self.homed = False

    def believed(self, joints: Vector) -> Vector:
        """The joints that the arm takes itself to be at."""
        return joints if self.homed else self.told

    def opening(self, now: float) -> float:
        """How far the gripper is open."""
        came_from, set_out, speed = self.stroke
        target = float(self.gripper or 0)
        way = target - came_from
        return (
            target if abs(way) <= speed * (now - set_out) else came_from + math.copysign(speed * (now - set_out), way)
        )


Move = Callable[[Registers, Vector, Any], Activity]
"""How a motion is planned, from where the joints are."""


class CommandEffects:
    """Makes of each command the work that it is."""

    def __init__(self, registers: Registers) -> None:
        self.registers = registers
        self.missed: int = 0

    def make(self, row: Command[Any, Any], value: Any) -> Work:
        """Returns what the command does when its turn comes."""
        move = MOTIONS.get(row.name)
        if move:
            return Work(row.name, lambda device: self._moving(move, device, value), True, row, value)

        return Work(row.name, lambda device: self._setting(row, device, value), False, row, value)

    def jog(self, row: Command[Any, Any], value: c.JogMove) -> Work:
        """Returns a jog, which goes on to its limit."""
        plan = joint_jog if row is c.JOG_JOINT else tool_jog
        return Work(row.name, lambda device: self._moving(plan, device, value), True, row, value)

    def _moving(
        self, move: Callable[[Registers, Vector, Any], Activity], device: Device, value: Any
    ) -> Activity | None:
        """A motion; the real arm says nothing of one that leads nowhere, and stays."""
        if not self.registers.powered or not (self.registers.homed or move is home):
            self.missed += 1
            return None

        try:
            return move(self.registers, device.joints, value)
        except DeviceFault:
            self.missed += 1
            return None

    def _setting(self, row: Command[Any, Any], device: Device, value: Any) -> Activity | None:
        """What takes no time, and the dwell."""
        if row is c.WAIT:
            return Activity(float(value.seconds))

        if row is c.SET_POSITION:
            set_position(self.registers, value, device.joints)
        elif row is c.RELEASE:
            self.registers.release(device.joints)
        elif row is c.SET_GRIPPER:
            came_from = self.registers.opening(device.now)
            self.registers.gripper = value.opening
            self.registers.stroke = (came_from, device.now, max(value.speed, SLOWEST) * PERCENT_PER_SPEED)
        else:
            SETTINGS[row.name](self.registers, value)

        return None


def pose(registers: Registers, joints: Vector) -> Vector:
    """The coordinates that the arm tells."""
    return plus(forward(registers.believed(joints)), registers.origin)


def plus(a: Vector, b: Vector) -> Vector:
    """The sum of two vectors."""
    return tuple(p + q for p, q in zip(a, b, strict=True))


class Geometry:
    """The arm's kinematics, as ways in space need them."""

    def forward(self, joints: Vector) -> Vector:
        """The point of these joints."""
        return forward(joints)

    def inverse(self, point: Vector) -> Vector:
        """The joints of this point; raises DeviceFault where there are none."""
        return inverse(point)


def move_coords(registers: Registers, joints: Vector, value: c.CoordsMove) -> Activity:
    """G0 and G1: straight; not begun if the way leaves the reach."""
    registers.speed = value.f or registers.speed
    here = pose(registers, joints)
    given = (value.x, value.y, value.z, value.e)
    if registers.relative:
        target = plus(here, tuple(each or 0.0 for each in given))
    else:
        target = tuple(old if each is None else each for each, old in zip(given, here, strict=True))

    own = plus(target, tuple(-each for each in registers.origin))
    pace = SpeedLimits((registers.speed,) * 2, (registers.acceleration,) * 2)
    segment = curve_segment(LineSegment(forward(joints), own), joints, Geometry(), pace)
    if segment.fault:
        raise segment.fault

    return travel([segment])


def move_joints(registers: Registers, joints: Vector, value: c.JointsMove) -> Activity:
    """M11."""
    registers.speed = value.f or registers.speed
    return turn(registers, joints, (value.j1, value.j2, value.j3, joints[3] if value.j4 is None else value.j4))


def move_joint(registers: Registers, joints: Vector, value: c.JointMove) -> Activity:
    """M10."""
    registers.speed = value.f or registers.speed
    place = value.joint - 1
    return turn(registers, joints, (*joints[:place], value.angle, *joints[place + 1 :]))


def turn(registers: Registers, joints: Vector, end: Vector) -> Activity:
    """The joints to angles."""
    checked(end)
    return travel([joint_segment(joints, end, SpeedLimits((registers.speed,) * 4, (registers.acceleration,) * 4))])


def home(registers: Registers, joints: Vector, _: None) -> Activity:
    """G28: to the switches, where all joints are 0 and the coordinates the arm's own."""

    def arrived() -> None:
        registers.homed = True
        registers.origin = (0.0,) * 4

    way = joint_segment(joints, (0.0,) * 4, SpeedLimits((60.0,) * 4, (ACCELERATION,) * 4))
    switches = Segment(lambda _: (0.0,) * 4, trapezoid(1.0, 1 / HOMING, math.inf))
    return travel([way, switches], arrived)


def joint_jog(registers: Registers, joints: Vector, value: c.JogMove) -> Activity:
    """M13, to the limit of the joint."""
    speed = value.f or registers.speed
    place = value.axis - 1
    limit = (REACH.j1, REACH.j2, REACH.j3)[place][value.direction == c.JogDirection.POSITIVE]
    end = (*joints[:place], limit, *joints[place + 1 :])
    return travel([joint_segment(joints, end, SpeedLimits((speed,) * 4, (ACCELERATION,) * 4))])


def tool_jog(registers: Registers, joints: Vector, value: c.JogMove) -> Activity:
    """M14, as far as the arm reaches, looked at every mm."""
    speed = value.f or registers.speed
    place = value.axis - 1
    sign = 1 if value.direction == c.JogDirection.POSITIVE else -1
    start = forward(joints)
    ways = [joints]
    for step in range(1, int(FAR)):
        try:
            ways.append(inverse((*start[:place], start[place] + sign * step, *start[place + 1 :])))
        except DeviceFault:
            break

    last = len(ways) - 1
    if not last:
        return travel([joint_segment(joints, joints, SpeedLimits((speed,) * 4, (ACCELERATION,) * 4))])

    def at(share: float) -> Vector:
        place = min(int(share * last), last - 1)
        return between(ways[place], ways[place + 1], share * last - place)

    return travel([Segment(at, trapezoid(1.0, speed / last, ACCELERATION / last))])


def set_position(registers: Registers, value: c.Position, joints: Vector) -> None:
    """G92."""
    own = forward(joints)
    here = pose(registers, joints)
    given = (value.x, value.y, value.z, value.e)
    wanted = tuple(old if each is None else each for each, old in zip(given, here, strict=True))
    registers.origin = tuple(a - b for a, b in zip(wanted, own, strict=True))


def setter(name: str, value: Any) -> Callable[[Registers, Any], None]:
    """What sets a register to what never changes."""
    return lambda registers, _: setattr(registers, name, value)


def register(registers: Registers, value: c.ServoValue) -> None:
    """M51."""
    registers.servo[value.servo, value.address] = value.value


MOTIONS: Mapping[str, Move] = {
    c.MOVE_COORDS.name: move_coords,
    c.MOVE_LINE.name: move_coords,
    c.MOVE_JOINTS.name: move_joints,
    c.MOVE_JOINT.name: move_joint,
    c.HOME.name: home,
}

SETTINGS: Mapping[str, Callable[[Registers, Any], None]] = {
    c.ABSOLUTE.name: setter("relative", value=False),
    c.RELATIVE.name: setter("relative", value=True),
    c.LASER_ON.name: setter("laser", value=True),
    c.LASER_OFF.name: setter("laser", value=False),
    c.SET_SPEED_MODE.name: lambda registers, value: setattr(registers, "speed_mode", int(value.mode)),
    c.POWER_ON.name: setter("powered", value=True),
    c.SET_PWM.name: lambda registers, value: setattr(registers, "pwm", value.duty),
    c.PUMP_OFF.name: setter("pump", value=False),
    c.PUMP_ON.name: setter("pump", value=True),
    c.SET_GRIPPER_ZERO.name: setter("gripper", 0),
    c.RELEASE_GRIPPER.name: setter("gripper", None),
    c.FAN_ON.name: setter("fan", value=True),
    c.FAN_OFF.name: setter("fan", value=False),
    c.SET_GRIPPER_CLOSE_POSITION.name: lambda registers, value: setattr(registers, "closed", value.position),
    c.SET_SERVO_REGISTER.name: register,
}
