"""What the commands need to know of each family: how one asks an arm of it, and in which words it answers.

A family is one entry of `FAMILIES`, by its word of `--arm`; each is imported when it is asked for.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import click

from dobot_async.cli.family import Family, Reading, Told
from dobot_async.cli.output import joint_words, tool_words
from dobot_async.cli.pieces import magician_pieces, ultraarm_pieces
from dobot_async.cli.trace import described
from dobot_async.families import Parts
from dobot_async.magician import commands as magician
from dobot_async.magician.alarms import Alarm
from dobot_async.magician.arm import Jog, Magician
from dobot_async.magician.params import Pose, PTPMode
from dobot_async.ultraarm.arm import UltraArm, UltraArmJog
from dobot_async.ultraarm.frame import Frame as Line
from dobot_async.ultraarm.params import UltraArmAngles, UltraArmCoords

__all__ = ["FAMILIES", "MAGICIAN", "MODES", "ULTRAARM", "Family", "Reading", "Told"]

NO_INDEX = 1 << 63
"""From here on a Magician's index means that it has none to tell: it has executed nothing yet, or it moves."""

MODES = {mode.name.lower().removesuffix("_xyz").replace("_", "-"): mode for mode in PTPMode}
"""The ways a Magician moves, by the words for them: movj, movl, jump, ..., movj-angle, movl-inc, ..."""


def directions(kind: type[Jog | UltraArmJog]) -> dict[str, Any]:
    """The directions by the words for them: x+, x-, ..., j1+, j1-, ..."""
    return {each.name.lower().replace("_plus", "+").replace("_minus", "-"): each for each in kind}


# The Magician.


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


async def magician_info(arm: Magician) -> Told:
    """Serial number, name and firmware."""
    found = await arm.get_info()
    text = f"serial number  {found.serial_number}\nname           {found.name}\nfirmware       {found.version}"
    return Told(found, text)


async def magician_pose(arm: Magician) -> Told:
    """Tool and joints."""
    found = await arm.get_pose()
    return Told(found, f"{tool_words(found)}  |  {joint_words(found)}")


async def magician_reading(arm: Magician) -> MagicianReading:
    """Asks a Magician for everything."""
    index = await arm.request(magician.GET_QUEUED_CMD_CURRENT_INDEX, None)
    return MagicianReading(
        time=time.time(),
        pose=await arm.get_pose(),
        alarms=await arm.get_alarms(),
        left_space=await arm.request(magician.GET_QUEUED_CMD_LEFT_SPACE, None),
        index=index if index < NO_INDEX else None,
    )


async def magician_move(arm: Magician, numbers: Sequence[float], mode: str) -> None:
    """R is 0 unless given."""
    x, y, z, r = (*numbers, 0.0)[:4]
    await arm.move_to(x, y, z, r, mode=MODES[mode])


# The ultraArm.


@dataclass(frozen=True, slots=True)
class UltraArmReading:
    """What an ultraArm told at one time.

    Attributes:
        time: Seconds since 1970.
        coords: Where the tool is.
        angles: The joints.
        queue_size: How many commands wait.
        moving: Whether it moves.
    """

    time: float
    coords: UltraArmCoords
    angles: UltraArmAngles
    queue_size: int
    moving: bool

    @property
    def rows(self) -> dict[str, str]:
        """What a person wants to see of it."""
        return {
            "tool": axis_words(self.coords),
            "joints": axis_words(self.angles),
            "queue": f"{self.queue_size} waiting, {'moving' if self.moving else 'at rest'}",
        }


def axis_words(found: UltraArmCoords | UltraArmAngles) -> str:
    """Numbers with their names."""
    return "  ".join(f"{name} {getattr(found, name):7.2f}" for name in type(found).__dataclass_fields__)


async def ultraarm_info(arm: UltraArm) -> Told:
    """The firmware's version, and the home switches."""
    version, switches = await arm.get_version(), await arm.get_endstops()
    text = f"firmware       {version}\nhome switches  {switches.j1} {switches.j2} {switches.j3}"
    return Told({"version": version, "endstops": switches}, text)


async def ultraarm_pose(arm: UltraArm) -> Told:
    """Tool and joints."""
    coords, angles = await arm.get_coords(), await arm.get_angles()
    return Told({"coords": coords, "angles": angles}, f"{axis_words(coords)}  |  {axis_words(angles)}")


async def ultraarm_reading(arm: UltraArm) -> UltraArmReading:
    """Asks an ultraArm for everything."""
    return UltraArmReading(
        time=time.time(),
        coords=await arm.get_coords(),
        angles=await arm.get_angles(),
        queue_size=await arm.get_queue_size(),
        moving=await arm.is_moving(),
    )


async def ultraarm_move(arm: UltraArm, numbers: Sequence[float], mode: str) -> None:
    """A fourth number is the fourth joint, which stays unless it is given."""
    if mode == "joints":
        await arm.move_joints(*numbers)
    elif mode == "by":
        await arm.move_by(*numbers)
    else:
        await arm.move_to(*numbers)


def described_line(frame: Line, *, outgoing: bool) -> dict[str, Any]:
    """What a trace says of a line, or of the lines of an answer."""
    return {
        "time": time.time(),
        "direction": "out" if outgoing else "in",
        "command": frame.word.decode("ascii") or None,
        "value": frame.params.decode("ascii", "replace").strip(),
        "raw": bytes(frame).hex(" "),
    }


MAGICIAN = Family(
    kind=Magician,
    info=magician_info,
    pose=magician_pose,
    read=magician_reading,
    move=magician_move,
    modes=("movj", *(each for each in MODES if each != "movj")),
    jog=Magician.jog,
    directions=directions(Jog),
    suction=lambda arm, on: arm.suction(on, pump=on),
    describe=described,
    pieces=magician_pieces,
    alarms=True,
)

ULTRAARM = Family(
    kind=UltraArm,
    info=ultraarm_info,
    pose=ultraarm_pose,
    read=ultraarm_reading,
    move=ultraarm_move,
    modes=("to", "by", "joints"),
    jog=UltraArm.jog,
    directions=directions(UltraArmJog),
    suction=UltraArm.suction,
    describe=described_line,
    pieces=ultraarm_pieces,
)

FAMILIES: Parts[Family] = Parts("cli")
"""All of them."""


def chosen(value: str | None, choices: Sequence[str], what: str) -> str:
    """The choice that was made, the first one without any; raises UsageError for one that there is not."""
    found = choices[0] if value is None else value.lower()
    if found not in choices:
        raise click.UsageError(f"{what} is one of {', '.join(choices)}, not {value!r}")

    return found
