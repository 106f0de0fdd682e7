"""How an arm of the myCobot family does one motion, and how it is stopped.

A motion is sent once, and watched until it is over; an acknowledgement is welcome, no more:

    run  --> goal --> send --> look, look, look --> done
                                  |  ArmAlarm          it tells errors
                                  |  MotionStopped     it rests elsewhere
                                  `  CommandRejected   it never moved
    stop --> STOP, look, STOP, look, ... until it has said several times in a row that it stands
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import Any, SupportsFloat, TypeVar

from dobot_async._core.link.correlator import Outcome
from dobot_async._core.queue.executor import Entry
from dobot_async._core.util.arguments import check_duration
from dobot_async.errors import (
    ArmAlarm,
    CommandRejected,
    MotionStopped,
    MotionUnknown,
    ReplyTimeout,
)
from dobot_async.layouts import NOTHING
from dobot_async.mycobot import commands as c
from dobot_async.mycobot.alarms import SERVO_LOSS, CobotAlarm, joint_alarms, motion_alarm
from dobot_async.mycobot.channel import SILENCE, Channel
from dobot_async.mycobot.goals import GOALS, Goals
from dobot_async.mycobot.watch import LOOKS, Goal, Verdict, Watch, cannot_read_servos
from dobot_async.wire import Command, Queueing

__all__ = ["WAIT", "CobotRunner", "Tolerance"]

Q = TypeVar("Q")
Tolerance = tuple[float, float]
"""How near a motion has to come: degrees, and mm."""

POLL = 0.05  # seconds between two looks; the Atom takes 20 ms for each reading
SOON = 0.3  # seconds before the end of a motion from when on it is looked at without a pause
CHECK, CHECK_LATER = 1.0, 2.0  # seconds between two questions for errors; they cost looks where the end is near
STOP_TIME = 2.0  # seconds within which an arm stands that has heard that it is to stop
INSIST = 0.4  # seconds after which an arm that does not answer is told again to stop, at the most
UNHEARD = 2 * LOOKS  # looks in a row, all of them still, of an arm that has not acknowledged that it is to stop
GRIPPER_LOOKS, GRIPPER_TIME = 3, 10.0  # seconds for the whole way at full speed


class Seconds:
    """A time, which is on no wire."""

    def encode(self, value: SupportsFloat) -> bytes:
        """Check a time, and return nothing."""
        check_duration(value)
        return b""

    def decode(self, data: bytes) -> float:  # noqa: ARG002 - it has nothing to read
        """Is never called."""
        return 0.0


WAIT: Command[float, None] = Command(
    "Wait", -1, Seconds(), NOTHING, "on this side", write=True, queueing=Queueing.ALWAYS, repeatable=False
)
"""Not a command of the arm: the queue on this side holds for so many seconds."""


class CobotRunner:
    """What does one command after the other; see `MotionRunner`."""

    def __init__(self, channel: Channel, tolerance: Tolerance) -> None:
        self._channel = channel
        self._goals = Goals(channel, *tolerance)
        self._loop = asyncio.get_running_loop()
        self._paused = False
        self._watching: Watch | None = None
        self._lost = 0

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Return a checked and encoded command."""
        row = command if command is WAIT else self._channel.model.row(command)
        frame = self._channel.link.frame(row, value, queued=True)
        self._channel.model.check(command, value)
        return Entry(command, value, frame)

    async def run(self, entry: Entry) -> None:
        """Do one command, and return when it is done; see `MotionRunner`."""
        command = entry.command
        await self._channel.link.opened()
        if command is WAIT:
            await asyncio.sleep(float(entry.value))
        elif command.queueing is Queueing.ALLOWED:
            tell = partial(self._channel.tell, command, entry.value, timeout=SILENCE)
            await self._channel.through_outages(tell)
            if command in GRIPPER:
                await self._gripper_rests(entry.value.speed)
        else:
            goal = await GOALS[command](self._goals, entry.value)
            await self._channel.send(entry.frame, command)
            await self._watch(goal, entry)

    async def stop(self) -> None:
        """Stop the arm, and return when it has said several times in a row that it stands.

        It is told before each look: where nothing is acknowledged, a stop that was lost may have left a motion to begin
        yet. An arm that is silent is told again and again, for as long as the link lives.

        Raises:
            MotionUnknown: It answers that it still moves, 2 s after it was told.
            ConnectionLost: The link is gone.
        """
        link, model = self._channel.link, self._channel.model
        stop, look = (link.frame(model.row(row), None) for row in (c.STOP, c.IS_MOVING))
        flag = model.row(c.IS_MOVING).reply
        heard = silent = False
        still, moving_since = 0, math.inf
        while still < (LOOKS if heard else UNHEARD):
            await link.opened()
            try:
                told = await link.send(stop, lambda _: None, timeout=INSIST)
                last = await link.send(look, lambda each: flag.decode(each.params), timeout=INSIST)
                if silent:  # a barrier each time would keep the first answers from those who ask next
                    await asyncio.sleep(INSIST)
                    silent = link.heard_at < told.sent_at
                    continue

                answered = await link.settle(last, INSIST)
            except TimeoutError:
                silent, still, moving_since = True, 0, math.inf
                continue

            heard = heard or told.outcome is Outcome.REPLY
            if not answered:
                continue

            moving = last.value
            still = 0 if moving else still + 1
            moving_since = min(moving_since, self._loop.time()) if moving else math.inf
            if self._loop.time() > moving_since + STOP_TIME:
                raise MotionUnknown("the arm was told to stop, and says that it still moves; switch it off")

    async def reset(self) -> None:
        """Let go of an arm that was paused; nothing else is left in it, for it gets one motion at a time."""
        while self._paused:
            with suppress(ReplyTimeout):
                await self.resume()
                await self.stop()

    async def pause(self) -> None:
        """Let the arm wait where it is, in the middle of a motion."""
        self._paused = True
        await self._channel.tell(c.PAUSE, None)

    async def resume(self) -> None:
        """Let the arm go on."""
        await self._channel.tell(c.RESUME, None)
        self._paused = False
        if self._watching:
            self._watching.hold(self._loop.time())

    async def alarms(self, timeout: float | None = None) -> tuple[CobotAlarm, ...]:
        """Return what keeps the arm from moving, and what was wrong with its last motion."""
        code = await self._channel.ask_if_known(c.GET_ERROR_INFORMATION, timeout)
        return (*await self.joint_alarms(timeout), *motion_alarm(code or 0))

    async def joint_alarms(self, timeout: float | None = None) -> tuple[CobotAlarm, ...]:
        """Return what keeps the arm from moving."""
        codes = await self._channel.ask_if_known(c.READ_NEXT_ERROR, timeout)
        return joint_alarms(codes or (), self._channel.model.joints)

    async def _watch(self, goal: Goal, entry: Entry) -> None:
        """Return when the arm stands where a motion leads, and raise when it never will."""
        now = self._loop.time
        watch = self._watching = Watch(goal, now())
        checked, self._lost = now(), 0
        while True:
            moving = await self._channel.poll(c.IS_MOVING)
            if watch.settled and not moving:
                return

            here = await self._position(goal)
            verdict = watch.look(now(), here, moving=moving)
            soon = watch.ends_at - SOON < now()
            if verdict is Verdict.ARRIVED and watch.moved:
                return

            if verdict is not Verdict.GOING or now() > checked + (CHECK_LATER if soon else CHECK):
                checked = now()
                await self._raise_alarms(everything=verdict in {Verdict.SHORT, Verdict.IDLE})

            if verdict is Verdict.ARRIVED:
                return

            if verdict in {Verdict.SHORT, Verdict.IDLE}:
                if await self._channel.poll(c.IS_PAUSED):
                    watch.hold(now())
                elif watch.anchor:  # else it was let go on since
                    raise await self._why(verdict, entry, goal.missed(here))

            if not soon:
                await asyncio.sleep(POLL)

    async def _position(self, goal: Goal) -> Sequence[float]:
        """Return where the arm is; raise ArmAlarm if it could not read its servos several times in a row."""
        here = numbers(await self._channel.poll(goal.read))
        self._lost = self._lost + 1 if goal.read is c.GET_ANGLES and cannot_read_servos(here) else 0
        if self._lost == LOOKS:
            raise ArmAlarm(f"the arm raised alarms: {SERVO_LOSS}", [SERVO_LOSS])

        return here

    async def _raise_alarms(self, *, everything: bool) -> None:
        """Raise ArmAlarm if something keeps the arm from moving. It is asked twice, for a frame has no checksum."""
        ask = self.alarms if everything else self.joint_alarms
        found = {alarm for alarm in await self._channel.through_outages(ask) if alarm.blocks}
        if found:
            found &= set(await self._channel.through_outages(ask))

        if found:
            alarms = sorted(found, key=lambda alarm: (alarm.joint or 0, alarm.code))
            raise ArmAlarm(f"the arm raised alarms: {'; '.join(map(str, alarms))}", alarms)

    async def _why(self, verdict: Verdict, entry: Entry, missed: float) -> MotionStopped | CommandRejected:
        """What to say of an arm that stands still elsewhere."""
        name = entry.command.name
        if verdict is Verdict.SHORT:
            return MotionStopped(f"{name}: the arm came to rest {missed:.1f} (mm or degrees) from where it was to go")

        if not await self._channel.poll(c.IS_POWER_ON):
            return CommandRejected(f"{name}: the arm is not powered; await arm.power_on(), then wait half a second")

        return CommandRejected(
            f"{name}: the arm answers but does not move, {missed:.1f} (mm or degrees) from where it was to go; is the "
            "target within reach, and are the servos on (power_on, focus)? It may be sent again"
        )

    async def _gripper_rests(self, speed: int) -> None:
        """Return when the gripper says several times in a row that it rests, or the firmware cannot tell."""
        still, ends_by = 0, self._loop.time() + GRIPPER_TIME * 100 / speed
        ask = partial(self._channel.ask_if_known, c.IS_GRIPPER_MOVING)
        while still < GRIPPER_LOOKS:
            still = 0 if await self._channel.through_outages(ask) else still + 1
            if self._loop.time() > ends_by:
                raise MotionUnknown("the gripper says that it still moves, although it should have come to rest by now")

            await asyncio.sleep(POLL)


GRIPPER = frozenset({c.SET_GRIPPER_STATE, c.SET_GRIPPER_VALUE})


def numbers(reading: Any) -> Sequence[float]:
    """A reading as a row of numbers."""
    return reading if isinstance(reading, tuple) else (reading,)
