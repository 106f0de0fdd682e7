"""How an arm of the myCobot family does one motion: sent once, then watched until it is over.

execute --> goal --> send (an acknowledgement is welcome, no more) --> look, look, look --> done
                                                                        |  ArmAlarm         it tells errors
                                                                        |  MotionStopped    it rests elsewhere
                                                                        `  CommandRejected  it never moved
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, TypeVar

from dobot_async.contract import LinkState
from dobot_async.errors import ArmAlarm, CommandRejected, MotionStopped, MotionUnknown, ReplyTimeout
from dobot_async.executor import Entry
from dobot_async.layouts import NOTHING
from dobot_async.mycobot import commands as c
from dobot_async.mycobot.alarms import SERVO_LOSS, CobotAlarm, joint_alarms, motion_alarm
from dobot_async.mycobot.channel import Channel
from dobot_async.mycobot.goals import GOALS, Goals
from dobot_async.mycobot.watch import LOOKS, Goal, Verdict, Watch, cannot_read_servos
from dobot_async.wire import Command, Queueing

__all__ = ["WAIT", "CobotHand", "Tolerance"]

Q = TypeVar("Q")
R = TypeVar("R")
Tolerance = tuple[float, float]
"""How near a motion has to come: degrees, and mm."""

POLL = 0.05  # seconds between two looks; the Atom takes 20 ms for each reading
SILENCE = 5.0  # seconds without an answer after which the arm counts as lost
UNSURE = 0.3  # seconds to wait for an answer that older firmware does not give
SOON = 0.3  # seconds before the end of a motion from when on it is looked at without a pause
CHECK, CHECK_LATER = 1.0, 2.0  # seconds between two questions for errors; they cost looks where the end is near
STOP_PATIENCE, STOP_TIME = 0.1, 2.0
GRIPPER_LOOKS, GRIPPER_TIME = 3, 10.0


class Seconds:
    """A time, which is on no wire."""

    def encode(self, value: float) -> bytes:
        """Checks a time, and returns nothing."""
        if not (math.isfinite(value) and value >= 0):
            raise ValueError(f"seconds must be finite and not negative, not {value!r}")

        return b""

    def decode(self, data: bytes) -> float:  # noqa: ARG002 - it has nothing to read
        """Is never called."""
        return 0.0


WAIT: Command[float, None] = Command(
    "Wait", -1, Seconds(), NOTHING, "on this side", write=True, queueing=Queueing.ALWAYS, repeatable=False
)
"""Not a command of the arm: the queue on this side holds for so many seconds."""


class CobotHand:
    """What the queue on this side is served by."""

    def __init__(self, channel: Channel, tolerance: Tolerance) -> None:
        self._channel = channel
        self._goals = Goals(channel, *tolerance)
        self._paused = False
        self._watching: Watch | None = None
        self._lost = 0

    async def connected(self) -> None:
        """Returns when the link is open."""
        await self._channel.link.opened()

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Returns a checked and encoded command."""
        row = command if command is WAIT else self._channel.model.row(command)
        frame = self._channel.link.frame(row, value, queued=True)
        self._channel.model.check(command, value)
        return Entry(command, value, frame)

    async def execute(self, entry: Entry) -> None:
        """Does one command and returns when it is done."""
        command = entry.command
        if command is WAIT:
            await asyncio.sleep(entry.value)
        elif command.queueing is Queueing.ALLOWED:
            await self._channel.tell(command, entry.value)
            if command in GRIPPER:
                await self._gripper_rests()
        else:
            goal = await GOALS[command](self._goals, entry.value)
            await self._channel.send(entry.frame, command)
            await self._watch(goal, entry)

    async def halt(self) -> None:
        """Stops the arm, and returns when it says that it stands."""
        loop = asyncio.get_running_loop()
        row = self._channel.model.row(c.STOP)
        deadline = loop.time() + STOP_TIME
        still = 0
        while loop.time() < deadline:
            heard = False
            with suppress(ReplyTimeout):
                await self._channel.link.request(row, None, timeout=STOP_PATIENCE, urgent=True)
                heard = True

            # Where nothing is acknowledged, a command that was spoilt on its way may have left a motion to begin yet.
            moving = await self._channel.ask(c.IS_MOVING, None, timeout=SILENCE, urgent=True)
            still = 0 if moving else still + 1
            if still == LOOKS or (still and heard):
                return

        raise MotionUnknown("the arm was told to stop, and says that it still moves; switch it off")

    async def reset(self) -> None:
        """Lets go of an arm that was paused; nothing else is left in it, for it gets one motion at a time."""
        if self._paused:
            await self.resume()
            await self.halt()

    async def pause(self) -> None:
        """Lets the arm wait where it is, in the middle of a motion."""
        self._paused = True
        await self._channel.tell(c.PAUSE, None)

    async def resume(self) -> None:
        """Lets the arm go on."""
        await self._channel.tell(c.RESUME, None)
        self._paused = False
        if self._watching:
            self._watching.hold(asyncio.get_running_loop().time())

    async def alarms(self) -> tuple[CobotAlarm, ...]:
        """Returns what keeps the arm from moving, and what was wrong with its last motion."""
        code = await self._channel.ask_if_known(c.GET_ERROR_INFORMATION, UNSURE)
        return (*await self.joint_alarms(), *motion_alarm(code or 0))

    async def joint_alarms(self) -> tuple[CobotAlarm, ...]:
        """Returns what keeps the arm from moving."""
        codes = await self._channel.ask_if_known(c.READ_NEXT_ERROR, UNSURE)
        return joint_alarms(codes or (), self._channel.model.joints)

    async def _watch(self, goal: Goal, entry: Entry) -> None:
        """Returns when the arm stands where a motion leads, and raises when it never will."""
        loop = asyncio.get_running_loop()
        watch = self._watching = Watch(goal, loop.time())
        checked, self._lost = loop.time(), 0
        while True:
            moving = await self._read(c.IS_MOVING)
            if watch.settled and not moving:
                return

            here = await self._position(goal)
            now = loop.time()
            verdict = watch.look(now, here, moving=moving)
            soon = watch.ends_at - SOON < now
            if verdict is Verdict.ARRIVED and watch.moved:
                return

            if verdict is not Verdict.GOING or now > checked + (CHECK_LATER if soon else CHECK):
                checked = now
                await self._raise_alarms(everything=verdict in {Verdict.SHORT, Verdict.IDLE})

            if verdict is Verdict.ARRIVED:
                return

            if verdict in {Verdict.SHORT, Verdict.IDLE}:
                if await self._read(c.IS_PAUSED):
                    watch.hold(loop.time())
                elif watch.anchor:  # else it was let go on since
                    raise await self._why(verdict, entry, goal.missed(here))

            if not soon:
                await asyncio.sleep(POLL)

    async def _position(self, goal: Goal) -> Sequence[float]:
        """Returns where the arm is; raises ArmAlarm if it could not read its servos several times in a row."""
        here = numbers(await self._read(goal.read))
        self._lost = self._lost + 1 if goal.read is c.GET_ANGLES and cannot_read_servos(here) else 0
        if self._lost == LOOKS:
            raise ArmAlarm(f"the arm raised alarms: {SERVO_LOSS}", [SERVO_LOSS])

        return here

    async def _read(self, command: Command[None, R]) -> R:
        """Asks the arm, through an outage of the link if it is reopened."""
        while True:
            try:
                return await self._channel.ask(command, None, timeout=SILENCE)
            except ReplyTimeout:
                if self._channel.link.state.value is LinkState.OPEN:
                    raise

                await self._channel.link.opened()

    async def _raise_alarms(self, *, everything: bool) -> None:
        """Raises ArmAlarm if something keeps the arm from moving; the arm is stopped then.

        It is asked twice, for a frame has no checksum.
        """
        ask = self.alarms if everything else self.joint_alarms
        found = {alarm for alarm in await ask() if alarm.blocks}
        if found:
            found &= set(await ask())

        if found:
            await self.halt()
            alarms = sorted(found, key=lambda alarm: (alarm.joint or 0, alarm.code))
            raise ArmAlarm(f"the arm raised alarms: {'; '.join(map(str, alarms))}", alarms)

    async def _why(self, verdict: Verdict, entry: Entry, missed: float) -> MotionStopped | CommandRejected:
        """What to say of an arm that stands still elsewhere."""
        name = entry.command.name
        if verdict is Verdict.SHORT:
            return MotionStopped(f"{name}: the arm came to rest {missed:.1f} (mm or degrees) from where it was to go")

        if not await self._read(c.IS_POWER_ON):
            return CommandRejected(f"{name}: the arm is not powered; await arm.power_on(), then wait half a second")

        return CommandRejected(
            f"{name}: the arm answers but does not move, {missed:.1f} (mm or degrees) from where it was to go; is the "
            "target within reach, and are the servos on (power_on, focus)? It may be sent again"
        )

    async def _gripper_rests(self) -> None:
        """Returns when the gripper says that it does not move, or has said nothing."""
        still = 0
        with suppress(TimeoutError):
            async with asyncio.timeout(GRIPPER_TIME):
                while still < GRIPPER_LOOKS:
                    moving = await self._channel.ask_if_known(c.IS_GRIPPER_MOVING, UNSURE)
                    still = 0 if moving else still + 1
                    await asyncio.sleep(POLL)


GRIPPER = frozenset({c.SET_GRIPPER_STATE, c.SET_GRIPPER_VALUE})


def numbers(reading: Any) -> Sequence[float]:
    """A reading as a row of numbers."""
    return reading if isinstance(reading, tuple) else (reading,)
