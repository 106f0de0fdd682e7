"""The moves of a drawing as rows of each family's command table.

    Magician   pen     CP along a stroke, MOVL to it and away from it; CPParams once, and where the speed changes
               laser   CPLE for all of it, with power 0 between strokes, so that the look-ahead sees to its end
    ultraArm   pen     G1, F in mm/s
               laser   G1, M21 P where the power changes; M3 before, M5 behind
    myCobot    pen     SendCoords along straight lines; the hand keeps its rotation

No WAIT is among them: between two points of a continuous path it would be a halt.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as m
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.kinematics import Kinematics, Unreachable
from dobot_async.arms.mycobot import commands as b
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.ultraarm import commands as u
from dobot_async.arms.ultraarm.arm import UltraArm
from dobot_async.errors import DobotError, UnsupportedError
from dobot_async.toolpath.moves import MoveKind, Tool, ToolpathMove
from dobot_async.toolpath.plane import Place

__all__ = ["DrawingPace", "DrawingProgram", "Instruction", "back_to_ramps", "check_tool", "program_for"]

SLOWEST, FASTEST = 1.0, 200.0  # mm/s of an ultraArm
SAFE_PERCENT = 20
RAMPS = u.ModeOfSpeed(u.SpeedMode.RAMPED)


class Instruction(NamedTuple):
    """One command, and the move that it is of; None for settings."""

    row: Command[Any, Any]
    value: Any
    move: ToolpathMove | None


@dataclass(frozen=True, slots=True)
class DrawingPace:
    """How fast, beside the speed along strokes.

    Attributes:
        acceleration: Along a continuous path of a Magician, mm/s².
        percent: Of a myCobot's speed, for it knows no mm/s.
        constant_speed: Whether an ultraArm is to run without ramps.
    """

    acceleration: float = 100.0
    percent: int = SAFE_PERCENT
    constant_speed: bool = False


class DrawingProgram(Protocol):
    """A family's way to say moves."""

    def instructions(self, moves: Iterable[ToolpathMove]) -> Iterator[Instruction]:
        """Yield the commands of a whole drawing, in order."""
        ...


class MagicianProgram:
    """CP, CPLE and PTP.

    Args:
        kinematics: Of the arm with its tool.
        j4: Degrees at which joint 4 stands: it stays so, because r = j1 + j4 is asked for accordingly.
        tool: "pen" or "laser".
        pace: The acceleration.
    """

    def __init__(self, kinematics: Kinematics, j4: float, tool: Tool, pace: DrawingPace) -> None:
        self._kinematics = kinematics
        self._j4 = j4
        self._laser = tool == "laser"
        self._acceleration = pace.acceleration

    def instructions(self, moves: Iterable[ToolpathMove]) -> Iterator[Instruction]:
        """Yield the commands of a drawing."""
        speed = None
        for move in moves:
            if move.speed != speed:
                speed = move.speed
                yield Instruction(m.SET_CP_PARAMS, m.CPParams(self._acceleration, speed, self._acceleration), None)

            yield self._instruction(move)

        if self._laser:
            yield Instruction(m.SET_END_EFFECTOR_LASER, m.EndEffectorLaser(False, False), None)

    def _instruction(self, move: ToolpathMove) -> Instruction:
        if self._laser and move.kind in {MoveKind.DRAW, MoveKind.JUMP}:
            return Instruction(m.SET_CPLE_CMD, m.CPLECmd(m.CPMode.ABSOLUTE, *move.place, move.power), move)

        if move.kind is MoveKind.DRAW:
            return Instruction(m.SET_CP_CMD, m.CPCmd(m.CPMode.ABSOLUTE, *move.place), move)

        return Instruction(m.SET_PTP_CMD, m.PTPCmd(m.PTPMode.MOVL_XYZ, *move.place, self._rotation(move.place)), move)

    def _rotation(self, place: Place) -> float:
        """The r at which joint 4 stays as it is."""
        try:
            return self._kinematics.inverse(*place, 0.0).j1 + self._j4
        except Unreachable:  # whoever does not look at the reach leaves it to the arm
            return math.degrees(math.atan2(place[1], place[0])) + self._j4


class UltraArmProgram:
    """G1 and M21, without ramps between M16 S0 and M16 S2."""

    def __init__(self, tool: Tool, pace: DrawingPace) -> None:
        self._laser = tool == "laser"
        self._constant_speed = pace.constant_speed

    def instructions(self, moves: Iterable[ToolpathMove]) -> Iterator[Instruction]:
        """Yield the commands of a drawing."""
        duty = 0
        if self._constant_speed:
            yield Instruction(u.SET_SPEED_MODE, u.ModeOfSpeed(u.SpeedMode.CONSTANT), None)

        if self._laser:
            yield Instruction(u.SET_PWM, u.PWM(0), None)
            yield Instruction(u.LASER_ON, None, None)

        for move in moves:
            wanted = round(move.power * 2.55) if self._laser else 0
            if wanted != duty:
                duty = wanted
                yield Instruction(u.SET_PWM, u.PWM(duty), None)

            speed = max(SLOWEST, min(FASTEST, move.speed))
            x, y, z = (round(number, 2) for number in move.place)
            yield Instruction(u.MOVE_LINE, u.CoordsMove(x, y, z, f=round(speed, 2)), move)

        if self._laser:
            yield Instruction(u.SET_PWM, u.PWM(0), None)
            yield Instruction(u.LASER_OFF, None, None)

        if self._constant_speed:
            yield Instruction(u.SET_SPEED_MODE, RAMPS, None)


class CobotProgram:
    """SendCoords along straight lines."""

    def __init__(self, rotation: tuple[float, ...], pace: DrawingPace) -> None:
        self._rotation = rotation
        self._percent = pace.percent

    def instructions(self, moves: Iterable[ToolpathMove]) -> Iterator[Instruction]:
        """Yield the commands of a drawing."""
        for move in moves:
            coords = tuple(round(number, 1) for number in move.place) + self._rotation
            yield Instruction(b.SEND_COORDS, b.ToMove(coords, self._percent, b.MoveMode.LINEAR), move)


async def of_magician(arm: Magician, tool: Tool, pace: DrawingPace) -> tuple[Place, DrawingProgram]:
    """Where a Magician is, and how it is told."""
    pose = await arm.get_pose()
    return (pose.x, pose.y, pose.z), MagicianProgram(arm.kinematics, pose.j4, tool, pace)


async def of_ultraarm(arm: UltraArm, tool: Tool, pace: DrawingPace) -> tuple[Place, DrawingProgram]:
    """Where an ultraArm is, and how it is told."""
    coords = await arm.request(u.GET_COORDS, None)
    return (coords.x, coords.y, coords.z), UltraArmProgram(tool, pace)


async def of_cobot(arm: MyCobot, _: Tool, pace: DrawingPace) -> tuple[Place, DrawingProgram]:
    """Where a myCobot is, and how it is told."""
    coords = await arm.request(b.GET_COORDS, None)
    x, y, z, *rotation = (float(number) for number in coords)
    return (x, y, z), CobotProgram(tuple(rotation), pace)


FAMILIES: Mapping[type, Callable[[Any, Tool, DrawingPace], Any]] = {
    Magician: of_magician,
    UltraArm: of_ultraarm,
    MyCobot: of_cobot,
}


def check_tool(arm: object, tool: Tool) -> None:
    """Raise UnsupportedError for a tool that an arm does not have, and TypeError for what is no arm."""
    if not isinstance(arm, tuple(FAMILIES)):
        raise TypeError(f"expected a connected Magician, UltraArm or MyCobot, not {arm!r}")

    if tool == "laser" and isinstance(arm, MyCobot):
        raise UnsupportedError(f"a {arm.model.title} has no laser: its protocol has no command for one")


async def back_to_ramps(arm: object) -> None:
    """Let an ultraArm whose drawing was broken off use ramps again, behind the stop."""
    assert isinstance(arm, UltraArm)
    with suppress(DobotError):
        await (await arm.queue.put(u.SET_SPEED_MODE, RAMPS))


async def program_for(arm: object, tool: Tool, pace: DrawingPace) -> tuple[Place, DrawingProgram]:
    """Return where an arm is, and its way to say moves."""
    make = next(make for kind, make in FAMILIES.items() if isinstance(arm, kind))
    here, program = await make(arm, tool, pace)
    return here, program
