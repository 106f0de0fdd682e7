"""What the commands need to know of the myCobot family: an entry for each model, and "mycobot" for the 280."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractAsyncContextManager, suppress
from dataclasses import dataclass
from typing import Any

import click

from dobot_async._core.util.plain import plain
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.alarms import CobotAlarm
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.frame import Frame, Parser
from dobot_async.arms.mycobot.models import AXES, DEFAULT, MODELS, CobotModel
from dobot_async.arms.mycobot.pose import CobotPose
from dobot_async.cli.family import CommandAnswer, FamilyCommands, Pieces
from dobot_async.errors import ProtocolError
from dobot_async.traces.words import REPLY, REQUEST

__all__ = ["COBOTS"]

WAYS = {"to": c.MoveMode.ANGULAR, "linear": c.MoveMode.LINEAR}
JOINTS = "joints"
HEADER = b"\xfe\xfe"


@dataclass(frozen=True, slots=True)
class CobotReading:
    """What an arm told at one time.

    Attributes:
        time: Seconds since 1970.
        pose: Where it is.
        alarms: What is wrong.
        moving: Whether it moves.
    """

    time: float
    pose: CobotPose
    alarms: tuple[CobotAlarm, ...]
    moving: bool

    @property
    def rows(self) -> dict[str, str]:
        """What a person wants to see of it."""
        return {
            "tool": tool_words(self.pose),
            "joints": joint_words(self.pose),
            "state": "moving" if self.moving else "at rest",
            "alarms": ", ".join(alarm.name for alarm in self.alarms) or "none",
        }


def tool_words(pose: CobotPose) -> str:
    """Where the tool is, mm and degrees."""
    return "  ".join(f"{axis} {getattr(pose, axis):7.2f}" for axis in AXES)


def joint_words(pose: CobotPose) -> str:
    """The joints, degrees."""
    return "  ".join(f"j{number} {angle:7.2f}" for number, angle in enumerate(pose.joints, 1))


async def info(arm: MyCobot) -> CommandAnswer:
    """The model, and the versions of its firmware."""
    found = await arm.get_versions()
    versions = [each or "unknown" for each in (found.system_version, found.basic_version)]
    return CommandAnswer(
        found, f"model          {found.model}\nfirmware       {versions[0]}\nM5             {versions[1]}"
    )


async def pose(arm: MyCobot) -> CommandAnswer:
    """Tool and joints."""
    found = await arm.get_pose()
    return CommandAnswer(found, f"{tool_words(found)}  |  {joint_words(found)}")


async def read(arm: MyCobot) -> CobotReading:
    """Asks an arm for everything."""
    return CobotReading(time.time(), await arm.get_pose(), await arm.get_alarms(), await arm.is_moving())


async def move(arm: MyCobot, numbers: Sequence[float], mode: str) -> None:
    """One number for each joint, or each coordinate."""
    if mode == JOINTS:
        arm.model.check(c.SEND_ANGLES, c.JointsMove(tuple(numbers), 1))  # in the words of who typed them
        await arm.move_joints(*numbers)
    else:
        arm.model.check(c.SEND_COORDS, c.ToMove(tuple(numbers), 1, WAYS[mode]))
        x, y, z, *rotation = numbers
        await arm.move_to(x, y, z, *rotation, mode=WAYS[mode])


async def jog(arm: MyCobot, direction: str, seconds: float) -> None:
    """Jogs."""
    await arm.jog(direction, seconds)


async def suction(_arm: MyCobot, _on: bool) -> None:
    """There is no pump."""
    raise click.UsageError("this arm has no pump of its own")


def cobot_pieces(model: CobotModel) -> Pieces:
    """What finds the pieces of a myCobot's bytes; which frames there are depends on the model."""

    def pieces(data: bytes) -> Iterator[dict[str, Any]]:
        parser = Parser(model.known)
        at = 0
        for frame in [*parser.feed(data), *parser.resync()]:
            start = data.index(bytes(frame), at)
            yield from cobot_junk(data, at, start)
            yield {"offset": start, **described_cobot(model, frame)}
            at = start + len(bytes(frame))

        yield from cobot_junk(data, at, len(data))

    return pieces


def cobot_junk(data: bytes, at: int, end: int) -> Iterator[dict[str, Any]]:
    """Yields the junk in a range as one piece."""
    junk = data[at:end]
    if junk:
        reason = "incomplete, or its length, its footer and its command do not agree" if HEADER in junk else "no header"
        yield {"offset": at, "raw": junk, "junk": reason}


def described_cobot(model: CobotModel, frame: Frame) -> dict[str, Any]:
    """What is to be said of a frame; "request" and "reply" are there if it can be one."""
    row = model.row(model.by_id[frame.id])
    piece = {"raw": bytes(frame), "id": frame.id, "write": row.write, "command": row.name, "section": row.section}
    for role, layout in ((REQUEST, row.request), (REPLY, row.reply)):
        with suppress(ProtocolError):
            if len(frame.params) in getattr(layout, "lengths", {0}):
                piece[role] = plain(layout.decode(frame.params))

    return piece


def of_model(name: str) -> type[MyCobot]:
    """The class that connects to this model without being told which."""

    class Model(MyCobot):
        @classmethod
        def connect(  # type: ignore[override] # what the command line gives is checked there
            cls, url: str, **options: Any
        ) -> AbstractAsyncContextManager[Any]:
            merged: dict[str, Any] = {"model": name, **options}
            return super().connect(url, **merged)

    return Model


def family(name: str) -> FamilyCommands:
    """The entry of a model."""
    model = MODELS[name]
    words = [f"j{joint}" for joint in range(1, model.joints + 1)] + list(AXES[: len(model.reach)])
    return FamilyCommands(
        kind=of_model(name),
        info=info,
        pose=pose,
        read=read,
        move=move,
        modes=("to", "linear", JOINTS),
        jog=jog,
        directions={f"{word}{way}": f"{word}{way}" for word in words for way in "+-"},
        suction=suction,
        pieces=cobot_pieces(model),
        numbers=max(model.joints, len(model.reach)),
        alarms=True,
        pump=False,
    )


COBOTS = {"mycobot": family(DEFAULT), **{name: family(name) for name in MODELS}}
"""The entries, by the words of `--arm`."""
