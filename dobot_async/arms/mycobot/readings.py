"""What can be asked of a myCobot, and set on it, apart from its motions."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.arguments import check_timeout
from dobot_async.arms.info import DeviceInfo
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.alarms import SERVO_LOSS, CobotAlarm
from dobot_async.arms.mycobot.channel import Channel
from dobot_async.arms.mycobot.executor import CobotRunner
from dobot_async.arms.mycobot.gripper import check_gripper
from dobot_async.arms.mycobot.pose import CobotPose
from dobot_async.arms.mycobot.standstill import cannot_read_servos
from dobot_async.errors import ArmAlarm, CommandRejected, DobotError, ReplyTimeout

__all__ = ["CobotInfo", "CobotPose", "Readings"]

Q = TypeVar("Q")
POLL = 0.05
POWER_TIME = 3.0


@dataclass(frozen=True, slots=True)
class CobotInfo:
    """Which arm it is, as it says itself; None for a version that its firmware does not tell.

    Attributes:
        model: What it was connected as.
        system_version: Of its firmware.
        basic_version: Of the M5 in its base.
    """

    model: str
    system_version: float | None
    basic_version: float | None


class Readings:
    """The part of `MyCobot` that is no motion; each `timeout` is in seconds.

    Raises:
        ReplyTimeout: The arm does not answer in time.
        CommandRejected: It does not do it.
        ConnectionLost: The link is gone.
        ValueError: An argument is out of range, or the model does not know the command; nothing was sent.
    """

    def __init__(self, channel: Channel, runner: CobotRunner) -> None:
        self._channel = channel
        self._runner = runner

    async def get_joints(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Return the joints, degrees; raise ArmAlarm if the arm cannot read its servos."""
        return await self.get_angles(timeout=timeout)

    async def get_angles(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Return the joints: `get_joints` under the vendor's name."""
        return believed(await self._channel.ask(c.GET_ANGLES, None, timeout=timeout))

    async def get_coords(self, *, timeout: float | None = None) -> c.Coords:
        """Return where the tool is, mm, and how it is turned, degrees, in the frames that are set."""
        return c.Coords(*await self._channel.ask(c.GET_COORDS, None, timeout=timeout))

    async def get_pose(self, *, timeout: float | None = None) -> CobotPose:
        """Return tool and joints; of one moment if the firmware knows GetAnglesCoords, else one after the other."""
        both = await self._channel.ask_if_known(c.GET_ANGLES_COORDS, None, timeout)
        if both is None:
            coords, joints = await self.get_coords(timeout=timeout), await self.get_angles(timeout=timeout)
        else:
            coords, joints = c.Coords(*both.coords), believed(both.angles)

        return CobotPose(coords.x, coords.y, coords.z, coords.rx, coords.ry, coords.rz, joints)

    async def get_info(self, *, timeout: float | None = None) -> DeviceInfo:
        """Return who the arm is: the version of its firmware, where that tells it, for it has no number or name."""
        version: float | None = await self._channel.ask_if_known(c.GET_SYSTEM_VERSION, None, timeout)
        return DeviceInfo(serial_number="", name="", version="" if version is None else f"{version:.1f}")

    async def get_versions(self, *, timeout: float | None = None) -> CobotInfo:
        """Return the model and the versions of its firmware."""
        system: float | None = await self._channel.ask_if_known(c.GET_SYSTEM_VERSION, None, timeout)
        basic: float | None = await self._channel.ask_if_known(c.GET_BASIC_VERSION, None, timeout)
        return CobotInfo(
            model=self._channel.model.title,
            system_version=system,
            basic_version=basic,
        )

    async def get_alarms(self, *, timeout: float | None = None) -> tuple[CobotAlarm, ...]:
        """Return what keeps the arm from moving, and what was wrong with its last motion, with cause and remedy."""
        return await self._runner.alarms(timeout)

    async def is_moving(self, *, timeout: float | None = None) -> bool:
        """Return whether the arm says that it moves."""
        return await self._channel.ask(c.IS_MOVING, None, timeout=timeout)

    async def is_paused(self, *, timeout: float | None = None) -> bool:
        """Return whether the arm is paused."""
        return await self._channel.ask(c.IS_PAUSED, None, timeout=timeout)

    async def is_in_position(
        self, values: Sequence[float], *, coords: bool = False, timeout: float | None = None
    ) -> bool:
        """Return whether the arm says that it is at these angles, or coordinates. The vendor calls it unstable.

        Args:
            values: Degrees of all joints, or mm and degrees of all axes.
            coords: Whether they are coordinates.
            timeout: Seconds.
        """
        position = c.Position.COORDS if coords else c.Position.ANGLES
        return await self._channel.ask(c.IS_IN_POSITION, c.InPosition(tuple(values), position), timeout=timeout)

    async def is_powered(self, *, timeout: float | None = None) -> bool:
        """Return whether the Atom is powered."""
        return await self._channel.ask(c.IS_POWER_ON, None, timeout=timeout)

    async def power_on(self, *, timeout: float | None = POWER_TIME) -> None:
        """Power the servos on, and return when the arm says that they are."""
        await self._switch(c.POWER_ON, None, lambda powered: powered, timeout)

    async def power_off(self, *, timeout: float | None = POWER_TIME) -> None:
        """Power the servos off: the arm falls. Returns when the arm says that they are."""
        await self._switch(c.POWER_OFF, None, lambda powered: not powered, timeout)

    async def release(self, joint: int | None = None, *, damping: bool = True, timeout: float | None = None) -> None:
        """Let one servo (from 1) go, or all: the arm falls, unless somebody holds it; damped, where the firmware can.

        Args:
            joint: Which one; None for all.
            damping: False lets it go without; older firmware knows no difference.
            timeout: Seconds.
        """
        undamped = None if damping else 1
        if joint is None:
            await self._channel.tell(c.RELEASE_ALL_SERVOS, undamped, timeout=timeout)
        else:
            await self._channel.tell(c.RELEASE_SERVO, c.Release(joint, undamped), timeout=timeout)

    async def focus(self, joint: int | None = None, *, timeout: float | None = None) -> None:
        """Let one servo (from 1) hold its place again, or all.

        Args:
            joint: Which one; None for all.
            timeout: Seconds.
        """
        await self._channel.tell(c.FOCUS_SERVO, joint or 0, timeout=timeout)

    async def get_pin(self, pin: int, *, base: bool = False, timeout: float | None = None) -> bool:
        """Return the level of a pin of the Atom, at the tool, or of the M5 in the base.

        Args:
            pin: Its number, on the Atom or the M5.
            base: Whether it is one of the M5.
            timeout: Seconds.
        """
        row = c.GET_BASIC_INPUT if base else c.GET_DIGITAL_INPUT
        return bool((await self._channel.ask(row, pin, timeout=timeout)).level)

    async def get_gripper(self, *, kind: c.GripperType | None = None, timeout: float | None = None) -> int:
        """Return how far the gripper is open, 0 to 100 percent; raise CommandRejected if no gripper answers the arm.

        Args:
            kind: Which gripper it is, where the firmware has to be told.
            timeout: Seconds.
        """
        return check_gripper(await self._channel.ask(c.GET_GRIPPER_VALUE, kind, timeout=timeout))

    async def get_encoders(self, *, timeout: float | None = None) -> tuple[int, ...]:
        """Return the positions of the servos, 0 to 4096."""
        return await self._channel.ask(c.GET_ENCODERS, None, timeout=timeout)

    async def get_speeds(self, *, timeout: float | None = None) -> tuple[int, ...]:
        """Return the speeds of the servos, steps/s."""
        return await self._channel.ask(c.GET_SERVO_SPEEDS, None, timeout=timeout)

    async def get_voltages(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Return the voltages of the servos."""
        return await self._channel.ask(c.GET_SERVO_VOLTAGES, None, timeout=timeout)

    async def get_temperatures(self, *, timeout: float | None = None) -> tuple[int, ...]:
        """Return the temperatures of the servos, degrees Celsius."""
        return await self._channel.ask(c.GET_SERVO_TEMPS, None, timeout=timeout)

    async def get_status(self, *, timeout: float | None = None) -> tuple[int, ...]:
        """Return a byte for each servo, 0 if all is well: bit 0 voltage, 1 sensor, 2 heat, 3 current, 5 overload."""
        return await self._channel.ask(c.GET_SERVO_STATUS, None, timeout=timeout)

    async def get_joint_limits(self, joint: int, *, timeout: float | None = None) -> tuple[float, float]:
        """Return the least and the greatest angle that the arm allows a joint (from 1).

        Args:
            joint: From 1.
            timeout: Seconds.
        """
        low = await self._channel.ask(c.GET_JOINT_MIN_ANGLE, joint, timeout=timeout)
        high = await self._channel.ask(c.GET_JOINT_MAX_ANGLE, joint, timeout=timeout)
        return low.angle, high.angle

    async def set_joint_limits(self, joint: int, low: float, high: float, *, timeout: float | None = None) -> None:
        """Set the least and the greatest angle that the arm allows a joint (from 1); in tenths of a degree.

        Args:
            joint: From 1.
            low: Degrees.
            high: Degrees.
            timeout: Seconds.

        Raises:
            ValueError: An argument is out of range; nothing was sent.
        """
        await self._channel.tell(c.SET_JOINT_MIN, c.JointLimit(joint, low), timeout=timeout)
        await self._channel.tell(c.SET_JOINT_MAX, c.JointLimit(joint, high), timeout=timeout)

    async def get_tool(self, *, timeout: float | None = None) -> c.Coords:
        """Return where the tool's end is, seen from the flange."""
        return c.Coords(*await self._channel.ask(c.GET_TOOL_REFERENCE, None, timeout=timeout))

    async def set_tool(self, *coords: float, timeout: float | None = None) -> None:
        """Say where the tool's end is, seen from the flange; it counts once `set_end_type(EndType.TOOL)` was said.

        Args:
            *coords: x, y, z in mm, rx, ry, rz in degrees.
            timeout: Seconds.

        Raises:
            ValueError: An argument is out of range; nothing was sent.
        """
        await self._channel.tell(c.SET_TOOL_REFERENCE, coords, timeout=timeout)

    async def get_world(self, *, timeout: float | None = None) -> c.Coords:
        """Return where the arm's base is in the world."""
        return c.Coords(*await self._channel.ask(c.GET_WORLD_REFERENCE, None, timeout=timeout))

    async def set_world(self, *coords: float, timeout: float | None = None) -> None:
        """Say where the arm's base is in the world; it counts once the reference frame is WORLD.

        Args:
            *coords: x, y, z in mm, rx, ry, rz in degrees.
            timeout: Seconds.

        Raises:
            ValueError: An argument is out of range; nothing was sent.
        """
        await self._channel.tell(c.SET_WORLD_REFERENCE, coords, timeout=timeout)

    async def set_reference_frame(self, frame: c.ReferenceFrame, *, timeout: float | None = None) -> None:
        """Say in which frame coordinates are.

        Args:
            frame: That of the arm's base, or the world's; see `set_world`.
            timeout: Seconds.
        """
        await self._channel.tell(c.SET_REFERENCE_FRAME, frame, timeout=timeout)

    async def set_end_type(self, end: c.EndType, *, timeout: float | None = None) -> None:
        """Say whether coordinates are the flange's or the tool's.

        Args:
            end: The flange, or the tool; see `set_tool`.
            timeout: Seconds.
        """
        await self._channel.tell(c.SET_END_TYPE, end, timeout=timeout)

    async def set_movement_type(self, mode: c.MoveMode, *, timeout: float | None = None) -> None:
        """Say how the arm moves to a point where the motion does not say it.

        Args:
            mode: ANGULAR moves the joints, LINEAR the tool along a straight line.
            timeout: Seconds.
        """
        await self._channel.tell(c.SET_MOVEMENT_TYPE, mode, timeout=timeout)

    async def _switch(
        self, command: Command[Q, None], value: Q, wanted: Callable[[Any], bool], timeout: float | None
    ) -> None:
        """Say something, and return when the arm's power is as wanted."""
        timeout, answered = check_timeout(timeout), False
        try:
            async with asyncio.timeout(timeout):
                await self._channel.tell(command, value, timeout=timeout)
                while True:
                    if wanted(await self._channel.ask(c.IS_POWER_ON, None, timeout=timeout)):
                        return

                    answered = True
                    await asyncio.sleep(POLL)
        except TimeoutError as error:
            if isinstance(error, DobotError):
                raise

            if not answered:
                raise ReplyTimeout(f"no answer to {command.name} within {timeout:.3g} s") from None

            raise CommandRejected(f"after {command.name} the arm's power stays as it was; is it plugged in?") from None


def believed(angles: tuple[float, ...]) -> tuple[float, ...]:
    """Return the angles; raise ArmAlarm if they are those of an arm that cannot read its servos."""
    if cannot_read_servos(angles):
        raise ArmAlarm(f"the arm raised alarms: {SERVO_LOSS}", [SERVO_LOSS])

    return angles
