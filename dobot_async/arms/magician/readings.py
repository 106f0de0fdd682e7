"""What can be asked of a Magician about itself, apart from its alarms."""

from __future__ import annotations

from dobot_async._core.link.link import Link
from dobot_async.arms.info import DeviceInfo
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.declared import told_rail
from dobot_async.arms.magician.frame import Frame

__all__ = ["Readings"]


class Readings:
    """The part of a Magician that is asked where and who it is.

    Raises:
        ReplyTimeout: The arm does not answer in time; each `timeout` is in seconds.
        ConnectionLost: The link is gone.
    """

    link: Link[Frame]

    async def get_pose(self, *, timeout: float | None = None) -> c.Pose:
        """Returns where the tool is (mm, degrees) and the joints (degrees). Manual 2.4.1."""
        return await self.link.request(c.GET_POSE, None, timeout=timeout)

    async def get_joints(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Returns the four joint angles, degrees. Manual 2.4.1."""
        return (await self.get_pose(timeout=timeout)).joints

    async def get_rail(self, *, timeout: float | None = None) -> float:
        """Returns where the arm stands on its rail, in mm.

        Raises:
            UnsupportedError: It has none, or was not told that it has; see `set_rail`.
        """
        return told_rail(await self.link.request(c.GET_POSE_L, None, timeout=timeout))

    async def get_info(self, *, timeout: float | None = None) -> DeviceInfo:
        """Returns serial number, name and firmware version. Manual 2.3."""
        version = await self.link.request(c.GET_DEVICE_VERSION, None, timeout=timeout)
        return DeviceInfo(
            serial_number=await self.link.request(c.GET_DEVICE_SN, None, timeout=timeout),
            name=await self.link.request(c.GET_DEVICE_NAME, None, timeout=timeout),
            version=f"{version.major_version}.{version.minor_version}.{version.revision}",
        )
