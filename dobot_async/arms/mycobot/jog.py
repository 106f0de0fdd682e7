"""Jogs of a myCobot: by which words, and whether the arm was seen to jog.

JOG ... [block] ... IS_MOVING, STOP, look, STOP, look        the question goes out right before the stop
                        `--> it moved                        done
                         `-> it stood still                  at a limit, or it never began: an error that says which
"""

from __future__ import annotations

import re
from collections.abc import AsyncGenerator, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Any

from dobot_async._core.link.correlator import Outcome, Request
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.queue import MotionQueue
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.channel import Channel
from dobot_async.arms.mycobot.executor import CobotRunner
from dobot_async.arms.mycobot.frame import Frame
from dobot_async.arms.mycobot.models import AXES, CobotModel
from dobot_async.arms.mycobot.standstill import STILL
from dobot_async.errors import CommandRejected, MotionStopped, ReplyTimeout

__all__ = ["jog_command", "jog_words", "jogging"]

JOG = re.compile(rf"(?:j(?P<joint>[1-9])|(?P<axis>{'|'.join(sorted(AXES, key=len, reverse=True))}))(?P<way>[+-])")
LITTLE = 0.1  # seconds for which the line may be busy before the stop
AT_LIMIT = 1.0  # degrees from a joint's limit within which it is taken to stand at it
Jog = tuple[Command[Any, None], c.JogJoint | c.JogAxis]


def jog_words(model: CobotModel) -> tuple[str, ...]:
    """Return all words for directions of a model."""
    return tuple(f"{word}{way}" for word in model.words for way in "+-")


def jog_command(model: CobotModel, direction: str, speed: int) -> Jog:
    """Return the command of a jog; raise ValueError that lists the words for one that the model does not have."""
    found = JOG.fullmatch(direction) if isinstance(direction, str) else None
    if not found or direction not in jog_words(model):
        raise ValueError(f"a direction of a {model.title} is {' '.join(jog_words(model))}, not {direction!r}")

    way = c.Direction.UP if found["way"] == "+" else c.Direction.DOWN
    if found["joint"]:
        return c.JOG_ANGLE, c.JogJoint(int(found["joint"]), way, speed)

    return c.JOG_COORD, c.JogAxis(AXES.index(found["axis"]) + 1, way, speed)


@dataclass(frozen=True, slots=True)
class Jogged:
    """A jog that goes on.

    Attributes:
        channel: The arm.
        runner: Tells its alarms.
        direction: The word.
        jog: The command.
        start: The joints before it.
    """

    channel: Channel
    runner: CobotRunner
    direction: str
    jog: Jog
    start: Sequence[float]

    async def ask(self) -> Request[Frame] | None:
        """Ask whether the arm moves, and wait for no answer; None if the line takes nothing."""
        flag = self.channel.model.row(c.IS_MOVING)
        frame = self.channel.link.frame(flag, None)
        with suppress(ReplyTimeout):
            return await self.channel.link.send(frame, lambda each: flag.reply.decode(each.params), timeout=LITTLE)

        return None

    async def judge(self, asked: Request[Frame] | None) -> None:
        """Raise if the arm stood still when it was to be stopped, or, where nothing tells, has not moved at all."""
        told = asked.value if asked and asked.outcome is Outcome.REPLY else None
        if told:
            return

        here = await self.channel.poll(c.GET_ANGLES, None)
        moved = max(abs(a - b) for a, b in zip(here, self.start, strict=True)) > STILL
        if moved and told is None:
            return

        await self.runner.raise_joint_alarms()
        if not await self.runner.is_powered():
            raise CommandRejected(f"{self.direction}: the arm is not powered; await arm.power_on()")

        limit = self.limit(here)
        if moved:
            raise MotionStopped(
                f"{self.direction}: the arm came to rest before the jog was to end"
                f"{limit or ', at the end of its reach'}"
            )

        raise CommandRejected(
            f"{self.direction}: the arm did not move{limit or '; is it at the end of its reach, are the servos on?'}"
        )

    def limit(self, here: Sequence[float]) -> str:
        """What to say of a joint that stands at its limit."""
        value = self.jog[1]
        if not isinstance(value, c.JogJoint):
            return ""

        end = self.channel.model.joint_limits[value.joint - 1][value.direction is c.Direction.UP]
        near = abs(here[value.joint - 1] - end) <= AT_LIMIT
        return f": joint {value.joint} is at its limit of {end:g} degrees" if near else ""


@asynccontextmanager
async def jogging(
    channel: Channel, runner: CobotRunner, direction: str, jog: Jog, queue: MotionQueue
) -> AsyncGenerator[None]:
    """Jog while the block lasts; see `MyCobot.jogging`."""
    (command, value), epoch = jog, queue.epoch
    await queue.update()
    if queue.pending:
        raise CommandRejected(
            f"{direction}: {queue.pending} motions are under way; await arm.queue.join(), or arm.stop(), before a jog"
        )

    start = await channel.ask(c.GET_ANGLES, None)
    jogged = Jogged(channel, runner, direction, jog, start)
    asked: Request[Frame] | None = None
    async with channel.link.cleanup.at_end(runner.stop, "the end of the jog"):
        await queue.beside(channel.tell(command, value), epoch)
        yield
        asked = await jogged.ask()

    await jogged.judge(asked)
