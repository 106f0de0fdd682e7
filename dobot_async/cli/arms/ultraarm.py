r"""What the commands need to know of the ultraArm: how one asks it, and what its lines say.

G0 X200 F50 \r | QUEUE SIZE[3] \r\n          a request and an answer
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from dobot_async._core.util.plain import plain
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.arm import UltraArm, UltraArmJog
from dobot_async.arms.ultraarm.frame import errors, split_words
from dobot_async.arms.ultraarm.params import UltraArmAngles, UltraArmCoords
from dobot_async.cli.family import CommandAnswer, FamilyCommands
from dobot_async.errors import ProtocolError
from dobot_async.traces.words import REPLY, REQUEST

__all__ = ["ULTRAARM"]

LINE = re.compile(rb"[^\r\n]+[\r\n]*|[\r\n]+")


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


async def ultraarm_info(arm: UltraArm) -> CommandAnswer:
    """The firmware's version, and the home switches."""
    version, switches = await arm.get_version(), await arm.get_endstops()
    text = f"firmware       {version}\nhome switches  {switches.j1} {switches.j2} {switches.j3}"
    return CommandAnswer({"version": version, "endstops": switches}, text)


async def ultraarm_pose(arm: UltraArm) -> CommandAnswer:
    """Tool and joints."""
    coords, angles = await arm.get_coords(), await arm.get_angles()
    return CommandAnswer({"coords": coords, "angles": angles}, f"{axis_words(coords)}  |  {axis_words(angles)}")


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


def ultraarm_pieces(data: bytes) -> Iterator[dict[str, Any]]:
    """The pieces of an ultraArm's bytes: its lines."""
    for found in LINE.finditer(data):
        if text := found[0].strip():
            yield {"offset": found.start(), "raw": found[0], **described_line(text)}


def described_line(text: bytes) -> dict[str, Any]:
    """What is to be said of a line: a request, an answer, or an error of the arm."""
    with suppress(ValueError, LookupError, ProtocolError):
        letter, number = split_words(text)[0]
        row = c.BY_WORD[letter + number]
        rest = bytes(text.translate(None, b" \t")).upper().removeprefix((letter + number).encode())
        return {**named(row), REQUEST: plain(row.request.decode(rest))}

    if refused := errors(text):
        return {"command": None, "section": None, REPLY: refused[0]}

    for row in c.ALL:
        if not row.write:
            with suppress(ProtocolError):
                return {**named(row), REPLY: plain(row.reply.decode(text))}

    return {"junk": "no line that an ultraArm reads or says"}


def named(row: Any) -> dict[str, Any]:
    """The name of a row."""
    return {"command": row.name, "section": row.section}


ULTRAARM = FamilyCommands(
    kind=UltraArm,
    info=ultraarm_info,
    pose=ultraarm_pose,
    read=ultraarm_reading,
    move=ultraarm_move,
    modes=("to", "by", "joints"),
    jog=UltraArm.jog,
    directions={each.name.lower().replace("_plus", "+").replace("_minus", "-"): each for each in UltraArmJog},
    suction=UltraArm.suction,
    pieces=ultraarm_pieces,
    text=True,
)
