"""What an ultraArm tells when it is asked."""

from __future__ import annotations

from dobot_async.arms.info import DeviceInfo
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.goals import MotionFault, pose_of
from dobot_async.arms.ultraarm.runner import UltraArmRunner
from dobot_async.arms.ultraarm.status import STATUS_AND_ANGLES
from dobot_async.errors import CommandRejected

__all__ = ["Readings"]


class Readings:
    """The part of an arm that asks; each `timeout` is in seconds, repetitions included.

    Raises:
        ReplyTimeout: The arm does not answer in time.
        ConnectionLost: The link is gone.
    """

    def __init__(self, runner: UltraArmRunner) -> None:
        self._asked = runner

    async def get_pose(self, *, timeout: float | None = None) -> c.UltraArmPose:
        """Return where the arm is: the tool, mm, and the joints, degrees, read at one time. Manual 5, M12 and M114."""
        return pose_of(await self._asked.ask(STATUS_AND_ANGLES, None, timeout=timeout))

    async def get_joints(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Return the four joints, degrees; the fourth is 0 where nothing is mounted on it. Manual 5, M12."""
        found = await self.get_angles(timeout=timeout)
        return (found.j1, found.j2, found.j3, found.j4)

    async def get_angles(self, *, timeout: float | None = None) -> c.UltraArmAngles:
        """Return the joints, degrees. Manual 5, M12."""
        return await self._asked.ask(c.GET_ANGLES, None, timeout=timeout)

    async def get_coords(self, *, timeout: float | None = None) -> c.UltraArmCoords:
        """Return where the tool is, mm, and the fourth joint, degrees. Manual 5, M114."""
        return await self._asked.ask(c.GET_COORDS, None, timeout=timeout)

    async def get_endstops(self, *, timeout: float | None = None) -> c.Endstops:
        """Return the home switches. Manual 5, M119."""
        return await self._asked.ask(c.GET_ENDSTOPS, None, timeout=timeout)

    async def get_queue_size(self, *, timeout: float | None = None) -> int:
        """Return how many commands wait in the arm's queue."""
        return (await self._asked.ask(c.GET_QUEUE_SIZE, None, timeout=timeout)).queue_size

    async def is_moving(self, *, timeout: float | None = None) -> bool:
        """Return whether the arm moves."""
        return not (await self._asked.ask(c.GET_STATUS, None, timeout=timeout)).at_rest

    async def get_version(self, *, timeout: float | None = None) -> str:
        """Return the firmware's version, "1.2"; CommandRejected from firmware that does not tell it."""
        version = await self._asked.ask(c.GET_SYSTEM_VERSION, None, timeout=timeout)
        return f"{version:g}"

    async def get_info(self, *, timeout: float | None = None) -> DeviceInfo:
        """Return who the arm is: it tells the version of its firmware alone, and older firmware not even that."""
        try:
            version = await self.get_version(timeout=timeout)
        except CommandRejected:
            version = ""

        return DeviceInfo(serial_number="", name="", version=version)

    async def get_alarms(self, *, timeout: float | None = None) -> tuple[MotionFault, ...]:
        """Return what is known to keep the arm from moving: no power, or no place since it had none.

        The protocol has no alarms. This is what the program itself has done to the arm; what others did shows when a
        motion misses its goal.
        """
        await self.get_queue_size(timeout=timeout)
        return self._asked.state.faults()

    async def clear_alarms(self, *, timeout: float | None = None) -> None:
        """Return if the arm is there: what `get_alarms` tells ends with `power_on` and `home` alone."""
        await self.get_queue_size(timeout=timeout)
