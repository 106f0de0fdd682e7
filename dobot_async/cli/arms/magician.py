"""What the commands need to know of the Magician: how one asks it, and in which words it answers."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import Alarm
from dobot_async.arms.magician.arm import Jog, Magician
from dobot_async.arms.magician.params import Pose
from dobot_async.arms.magician.vocabulary import MODES
from dobot_async.cli.arms.magician_frames import pieces
from dobot_async.cli.family import CommandAnswer, FamilyCommands

__all__ = ["MAGICIAN", "joint_words", "tool_words"]

NO_INDEX = 1 << 63
"""From here on a Magician's index means that it has none to tell: it has executed nothing yet, or it moves."""


@dataclass(frozen=True, slots=True)
class MagicianReading:
    """What a Magician told at one time.

    Attributes:
        time: Seconds since 1970.
        pose: Where it is.
        alarms: What is set.
        left_space: How many commands its queue can still take.
        index: The last command that it has executed; None if it tells none.
    """

    time: float
    pose: Pose
    alarms: tuple[Alarm, ...]
    left_space: int
    index: int | None

    @property
    def rows(self) -> dict[str, str]:
        """What a person wants to see of it."""
        return {
            "tool": tool_words(self.pose),
            "joints": joint_words(self.pose),
            "queue": f"room {self.left_space}, index {'-' if self.index is None else self.index}",
            "alarms": ", ".join(f"0x{alarm.code:02X} {alarm.name}" for alarm in self.alarms) or "none",
        }


async def magician_info(arm: Magician) -> CommandAnswer:
    """Serial number, name and firmware."""
    found = await arm.get_info()
    text = f"serial number  {found.serial_number}\nname           {found.name}\nfirmware       {found.version}"
    return CommandAnswer(found, text)


async def magician_pose(arm: Magician) -> CommandAnswer:
    """Tool and joints."""
    found = await arm.get_pose()
    return CommandAnswer(found, f"{tool_words(found)}  |  {joint_words(found)}")


async def magician_reading(arm: Magician) -> MagicianReading:
    """Asks a Magician for everything."""
    index = await arm.request(c.GET_QUEUED_CMD_CURRENT_INDEX, None)
    return MagicianReading(
        time=time.time(),
        pose=await arm.get_pose(),
        alarms=await arm.get_alarms(),
        left_space=await arm.request(c.GET_QUEUED_CMD_LEFT_SPACE, None),
        index=index if index < NO_INDEX else None,
    )


async def magician_move(arm: Magician, numbers: Sequence[float], mode: str) -> None:
    """R is 0 unless given."""
    x, y, z, r = (*numbers, 0.0)[:4]
    await arm.move_to(x, y, z, r, mode=MODES[mode])


def tool_words(pose: Pose) -> str:
    """Returns where the tool is, mm and degrees."""
    return "  ".join(f"{axis} {getattr(pose, axis):7.2f}" for axis in "xyzr")


def joint_words(pose: Pose) -> str:
    """Returns the joints, degrees."""
    return "  ".join(f"{joint} {getattr(pose, joint):7.2f}" for joint in ("j1", "j2", "j3", "j4"))


MAGICIAN = FamilyCommands(
    kind=Magician,
    info=magician_info,
    pose=magician_pose,
    read=magician_reading,
    move=magician_move,
    modes=("movj", *(each for each in MODES if each != "movj")),
    jog=Magician.jog,
    directions={each.name.lower().replace("_plus", "+").replace("_minus", "-"): each for each in Jog},
    suction=lambda arm, on: arm.suction(on, pump=on),
    pieces=pieces,
    alarms=True,
)
