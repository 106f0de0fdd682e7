"""A simulated myCobot without its line: what can be seen of it, what the world does to it, what commands do to it.

Knows the rows of the command table and their parameters, but no frames.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.models import SENTINEL, CobotModel
from dobot_async.simulator.device.device import Device
from dobot_async.simulator.device.path import Segment, travel
from dobot_async.simulator.device.work import DeviceFault, DeviceOptions, Executed, Vector, Work
from dobot_async.simulator.mycobot.elbow import elbow_angle
from dobot_async.simulator.mycobot.gripper import SimulatedGripper
from dobot_async.simulator.mycobot.kinematics import Chain, Palletizer, Transform
from dobot_async.simulator.mycobot.plans import CENTRE, PLANS, STEPS
from dobot_async.simulator.mycobot.segments import SegmentPlanner

__all__ = ["MYCOBOT", "MyCobotBody"]

MYCOBOT = DeviceOptions(
    capacity=64, first_index=1, initial_index=0, on_fault="continue", power_up_alarms=frozenset(), keep=20_000
)
"""The options of a myCobot: nobody knows how deep its queue is."""

IN_POSITION = 1.0, 5.0  # degrees, mm
HEAT, VOLTAGE = 30, 7.2


class MyCobotBody:
    """One arm, powered, with all joints at 0.

    Attributes:
        model: What it is.
        device: Its queue and its joints in time.
        ways: How it moves, within which limits.
        gripper: Its gripper.
        powered: Whether its servos have power.
        released: The joints (from 1) that hang loose.
        errors: What is wrong with each joint, as ReadNextError tells it.
        error: What was wrong with the last motion, as GetErrorInformation tells it.
        color: The light of its Atom.
        settings: What commands have set, by their rows.
        outputs: Levels of the pins that were set: (row, pin).
    """

    def __init__(
        self,
        clock: Callable[[], float],
        model: CobotModel,
        options: DeviceOptions | None = None,
        *,
        play: float = 0.0,
        gripper: bool = True,
    ) -> None:
        self.model = model
        self.device: Device = Device(clock, (0.0,) * model.joints, options or MYCOBOT)
        self.ways: SegmentPlanner = SegmentPlanner(model, play)
        self.gripper: SimulatedGripper = SimulatedGripper(lambda: self.device.now, plugged_in=gripper)
        self.powered: bool = True
        self.released: set[int] = set()
        self.errors: dict[int, int] = {}
        self.error: int = 0
        self.servos_lost = False
        self.color: c.RGB = c.RGB(0, 0, 0)
        origin = (0.0,) * len(model.reach)
        self.settings: dict[Command[Any, Any], Any] = {
            c.SET_FRESH_MODE: False,
            c.SET_FREE_MODE: False,
            c.SET_SPEED: 50,
            c.SET_ACCELERATION: 50,
            c.SET_TOOL_REFERENCE: origin,
            c.SET_WORLD_REFERENCE: origin,
            c.SET_REFERENCE_FRAME: c.ReferenceFrame.BASE,
            c.SET_MOVEMENT_TYPE: c.MoveMode.ANGULAR,
            c.SET_END_TYPE: c.EndType.FLANGE,
            c.SET_TRANSPONDER_MODE: c.TransponderMode.OFF,
            c.SET_HTS_GRIPPER_TORQUE: 300,
            c.SET_GRIPPER_PROTECT_CURRENT: 250,
        }
        self.outputs: dict[tuple[Command[Any, Any], int], int] = {}
        self.servo_data: dict[tuple[int, int], int] = {}
        self._paused = False

    # What can be seen of the arm.

    @property
    def joints(self) -> Vector:
        """The joints, degrees."""
        return self.device.joints

    @property
    def angles(self) -> Vector:
        """The joints as the arm tells them."""
        return (SENTINEL,) * self.model.joints if self.servos_lost else self.joints

    @property
    def coords(self) -> Vector:
        """Where the flange is, or the tool, in the frame that is set: mm and degrees."""
        joints = self.joints
        if isinstance(self.ways.solver, Palletizer):
            return self.ways.solver.forward(joints)

        return self.world.then(self.ways.frame(joints)).then(self.tool).point

    @property
    def tool(self) -> Transform:
        """What coordinates are of, seen from the flange."""
        used = self.settings[c.SET_END_TYPE] is c.EndType.TOOL
        return Transform.of(self.settings[c.SET_TOOL_REFERENCE] if used else (0.0,) * 6)

    @property
    def world(self) -> Transform:
        """The base, seen from where coordinates count from."""
        used = self.settings[c.SET_REFERENCE_FRAME] is c.ReferenceFrame.WORLD
        return Transform.of(self.settings[c.SET_WORLD_REFERENCE] if used else (0.0,) * 6)

    @property
    def moving(self) -> bool:
        """Whether it moves."""
        return self.device.moving and not self._paused

    @property
    def paused(self) -> bool:
        """Whether it was told to pause."""
        return self._paused

    @property
    def encoders(self) -> tuple[int, ...]:
        """The positions of the servos."""
        return tuple(min(max(round(CENTRE + joint * STEPS), 0), 4096) for joint in self.joints)

    @property
    def servo_speeds(self) -> tuple[int, ...]:
        """How fast the servos turn, steps/s."""
        return tuple(round(speed * STEPS) for speed in self.device.joint_speeds)

    @property
    def elbow(self) -> float:
        """The angle of the elbow about the line from shoulder to wrist, degrees; 0 for an arm that is stretched out."""
        solver = self.ways.solver
        return (elbow_angle(solver, self.joints) if isinstance(solver, Chain) else None) or 0.0

    @property
    def executed(self) -> list[Executed]:
        """What has been executed so far, in the order of finishing: each with row, parameters, times and outcome."""
        return self.device.executed

    def in_position(self, value: c.InPosition) -> bool:
        """Whether it is at a position."""
        near, here = (
            (IN_POSITION[0], self.joints) if value.position is c.Position.ANGLES else (IN_POSITION[1], self.coords)
        )
        return not self.moving and all(abs(a - b) <= near for a, b in zip(value.values, here, strict=True))

    # What the world does to the arm.

    def set_input(self, pin: int, level: int, *, base: bool = False) -> None:
        """Sets the level at a pin of the Atom, or of the M5 in the base."""
        self.device.set_input((c.GET_BASIC_INPUT if base else c.GET_DIGITAL_INPUT, pin), int(bool(level)))

    def raise_error(self, joint: int, code: int) -> None:
        """Something happens to a joint (from 1), which ends what the arm does; with 0 it is well again."""
        self.device.advance()
        self.errors[joint] = code
        if code and joint <= self.model.joints:
            self._end_all()

    def guide_to(self, *joints: float) -> None:
        """Puts the joints elsewhere, as a hand does; degrees, one for each joint."""
        if len(joints) != self.model.joints or not all(map(math.isfinite, joints)):
            raise ValueError(f"a {self.model.title} has {self.model.joints} joints, not {joints}")

        self.device.place(tuple(map(float, joints)))

    place = guide_to

    def halt(self) -> None:
        """Stops it as somebody else does, at the arm."""
        self._end_all()

    # What commands do.

    def move(self, row: Command[Any, Any], value: Any) -> None:
        """Begins a motion, or queues it behind the others; an arm that cannot obey does nothing."""
        if not self.obeys:
            return

        if self.settings[c.SET_FRESH_MODE]:
            self.device.clear()

        self.device.put(
            Work(row.name, lambda _: travel([self._planned(row, value)]), moves=True, command=row, value=value)
        )

    def jog(self, row: Command[Any, Any], value: Any) -> None:
        """Begins a jog, unless motions go on."""
        if not self.obeys:
            return

        self.device.end_aside()
        work = Work(row.name, lambda _: travel([self._jogged(value)]), moves=True, command=row, value=value)
        self.device.begin_aside(work)

    @property
    def obeys(self) -> bool:
        """Whether it moves at all."""
        self.device.advance()
        return (
            self.powered
            and not self.released
            and not any(code for joint, code in self.errors.items() if joint <= self.model.joints)
        )

    def grip(self, value: float, speed: float) -> None:
        """Sends the gripper to how far it is to be open, if it has power."""
        if self.powered:
            self.gripper.go(value, speed)

    def pause(self) -> None:
        """Holds in the middle of whatever goes on."""
        self._paused = True
        self.device.freeze()

    def resume(self) -> None:
        """Goes on."""
        self._paused = False
        self.device.thaw()

    def power(self, *, on: bool) -> None:
        """Powers the servos, or lets them fall limp where they are."""
        self.powered = on
        self.released.clear()
        if not on:
            self._end_all()
            self.gripper.halt()

    def release(self, joint: int | None) -> None:
        """Lets a servo go, or all."""
        self._end_all()
        self.released |= set(range(1, self.model.joints + 1)) if joint is None else {joint}

    def focus(self, joint: int) -> None:
        """Lets a servo hold again, or (0) all."""
        self.released = self.released - {joint} if joint else set()

    def set_limit(self, value: c.JointLimit, *, upper: bool) -> None:
        """Sets a joint's limit."""
        low, high = self.ways.limits[value.joint - 1]
        self.ways.limits[value.joint - 1] = (low, value.angle) if upper else (value.angle, high)

    def _end_all(self) -> None:
        """Ends all that goes on and all that waits, where the arm is."""
        self.device.force_stop()
        self.device.clear()
        self._paused = False
        self.device.thaw()
        self.device.start()

    def _planned(self, row: Command[Any, Any], value: Any) -> Segment:
        """The way of a motion, from where the arm is now."""
        try:
            return PLANS[row](self, value)
        except DeviceFault as fault:
            self.error = fault.code
            raise

    def _jogged(self, value: Any) -> Segment:
        start, up = self.joints, value.direction is c.Direction.UP
        if isinstance(value, c.JogJoint):
            return self.ways.jog_joint(start, value.joint - 1, up=up, speed=value.speed)

        axis = value.axis + 2 if isinstance(value, c.JogRotation) else value.axis - 1
        return self.ways.jog_axis(start, axis, up=up, speed=value.speed)
