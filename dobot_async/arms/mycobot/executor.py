"""How an arm of the myCobot family does one motion.

A motion is sent once, and watched until it is over; an acknowledgement is welcome, no more:

    run  --> goal --> send --> look, look, look --> done
                                  |  ArmAlarm          it tells errors, and did not before the motion
                                  |  MotionStopped     it rests elsewhere
                                  `  CommandRejected   it never moved
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar, cast

from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async._core.queue.executor import Entry
from dobot_async._core.util.workspace import OutsideWorkspace
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.alarms import SERVO_LOSS, CobotAlarm, joint_alarms, motion_alarm
from dobot_async.arms.mycobot.channel import SILENCE, Channel
from dobot_async.arms.mycobot.goals import GOALS, Goals
from dobot_async.arms.mycobot.gripper import GRIPPER, run_gripper
from dobot_async.arms.mycobot.keeping import CobotKeeper
from dobot_async.arms.mycobot.standstill import LOOKS, Goal, StandstillDetector, Verdict, cannot_read_servos
from dobot_async.arms.mycobot.stopping import stop_until_still
from dobot_async.arms.mycobot.targets import MOVE_PARTLY, SUCTION, WAIT
from dobot_async.errors import ArmAlarm, CommandRejected, MotionStopped, ReplyTimeout

__all__ = ["CobotRunner", "Tolerance"]

Q = TypeVar("Q")
Tolerance = tuple[float, float]
"""How near a motion has to come: degrees, and mm."""

POLL = 0.05  # seconds between two looks; the Atom takes 20 ms for each reading
SOON = 0.3  # seconds before the end of a motion from when on it is looked at without a pause
CHECK, CHECK_LATER = 1.0, 2.0  # seconds between two questions for errors; they cost looks where the end is near
PAUSE_TIME = 1.0  # seconds within which an arm says that it is paused, or that it is not any more
ON_THIS_SIDE = frozenset({WAIT, MOVE_PARTLY, SUCTION})


@dataclass(frozen=True, slots=True)
class Reached:
    """Where the last motion has led.

    Attributes:
        worker: The task that did it: there is another one as soon as the queue was empty in between.
        frames: What coordinates were of when it began; see `Channel`.
        coords: All of its target.
    """

    worker: asyncio.Task[Any] | None
    frames: int
    coords: tuple[float, ...]


class CobotRunner:
    """What does one command after the other; see `MotionRunner`."""

    def __init__(self, channel: Channel, tolerance: Tolerance, keeper: CobotKeeper | None = None) -> None:
        self._channel = channel
        self._keeper = keeper
        self._goals = Goals(channel, *tolerance)
        self._loop = asyncio.get_running_loop()
        self._paused = False
        self._watching: StandstillDetector | None = None
        self._lost = 0
        self._reached: Reached | None = None

    def prepare(self, command: Command[Q, Any], value: Any) -> Entry:
        """Return a checked and encoded command."""
        model = self._channel.model
        row = command if command in ON_THIS_SIDE else model.row(command)
        frame = self._channel.link.frame(row, value, queued=True)
        if command is MOVE_PARTLY:
            whole = c.ToMove(tuple(each or 0.0 for each in value.coords), value.speed, value.mode)
            self._channel.link.frame(model.row(c.SEND_COORDS), whole, queued=True)

        model.check(command, value)
        entry = Entry(command, value, frame)
        if self._keeper:
            self._keeper.check(entry)

        return entry

    async def run(self, entry: Entry) -> None:
        """Do one command, and return when it is done; see `MotionRunner`."""
        command = entry.command
        await self._channel.link.opened()
        if command is WAIT:
            await asyncio.sleep(float(entry.value))
        elif command.queueing is Queueing.ALLOWED:
            if command in GRIPPER:
                await run_gripper(self._channel, command, entry.value)
            else:
                await self._channel.through_outages(partial(self._channel.tell, command, entry.value, timeout=SILENCE))
        else:
            await self._move(entry)

    async def stop(self) -> None:
        """Stop the arm, and return when it stands; see `stop_until_still`."""
        await stop_until_still(self._channel)

    async def reset(self) -> None:
        """Let go of an arm that was paused; nothing else is left in it, for it gets one motion at a time."""
        while self._paused:
            with suppress(ReplyTimeout):
                await self.resume()
                await self.stop()

    async def pause(self) -> None:
        """Let the arm wait where it is, in the middle of a motion; return when it has said that it does."""
        self._paused = True
        await self._until_paused(c.PAUSE, paused=True)

    async def resume(self) -> None:
        """Let the arm go on; return when it has said that it does."""
        await self._until_paused(c.RESUME, paused=False)
        self._paused = False
        if self._watching:
            self._watching.hold(self._loop.time())

    async def _until_paused(self, command: Command[None, None], *, paused: bool) -> None:
        """Tell an arm to pause, or to go on, until it says that it does; raise CommandRejected if it never does."""
        channel, ends_by = self._channel, self._loop.time() + PAUSE_TIME
        while True:
            await channel.tell(command, None)
            if await channel.ask(c.IS_PAUSED, None) == paused:
                return

            if paused and not await channel.ask(c.IS_MOVING, None):
                return  # an arm that stands need not say that it is paused

            if self._loop.time() > ends_by:
                raise CommandRejected(f"{command.name}: the arm answers, and does not do it")

    async def alarms(self, timeout: float | None = None) -> tuple[CobotAlarm, ...]:
        """Return what keeps the arm from moving, and what was wrong with its last motion."""
        code = await self._channel.ask_if_known(c.GET_ERROR_INFORMATION, None, timeout)
        return (*await self.joint_alarms(timeout), *motion_alarm(code or 0))

    async def joint_alarms(self, timeout: float | None = None) -> tuple[CobotAlarm, ...]:
        """Return what keeps the arm from moving."""
        codes = await self._channel.ask_if_known(c.READ_NEXT_ERROR, None, timeout)
        return joint_alarms(codes or (), self._channel.model.joints)

    async def raise_joint_alarms(self) -> None:
        """Raise ArmAlarm if a joint keeps the arm from moving."""
        await self._raise_alarms(self.joint_alarms)

    async def is_powered(self) -> bool:
        """Return whether the arm has power."""
        return await self._channel.poll(c.IS_POWER_ON, None)

    async def _move(self, entry: Entry) -> None:
        """Do a motion."""
        reached, self._reached = self._reached, None
        frames = self._channel.frames
        if entry.command is MOVE_PARTLY:
            entry = await self._whole(entry, reached)

        if self._keeper:
            try:
                await self._keeper.check_here(entry)
            except OutsideWorkspace as error:
                raise CommandRejected(f"the motion was not sent: {error}") from None

        try:
            goal = await GOALS[entry.command](self._goals, entry.value)
        except ValueError as error:
            raise CommandRejected(f"{entry.command.name}: the step was not sent, for where it leads: {error}") from None

        if getattr(entry.value, "mode", None) is c.MoveMode.LINEAR:
            await self._follow_lines()

        # An arm keeps what was wrong with an earlier motion until it is cleared: that is no reason for what comes now.
        before = None
        if self._channel.likely_knows(c.GET_ERROR_INFORMATION):
            before = await self._channel.poll_if_known(c.GET_ERROR_INFORMATION, None)

        await self._channel.send(entry.frame, entry.command)
        await self._watch(goal, entry, before)
        if entry.command is c.SEND_COORDS:
            self._reached = Reached(asyncio.current_task(), frames, entry.value.coords)

    async def _whole(self, entry: Entry, reached: Reached | None) -> Entry:
        """The motion to a target of which a part was given; raise CommandRejected where the whole is out of range."""
        part = entry.value
        if reached and (reached.worker, reached.frames) == (asyncio.current_task(), self._channel.frames):
            start = reached.coords
        else:
            found = await self._channel.poll(c.GET_COORDS, None)
            start = tuple(found)

        coords = part.filled(start)
        try:
            return self.prepare(c.SEND_COORDS, c.ToMove(coords, part.speed, part.mode))
        except ValueError as error:
            whole = ", ".join(f"{coord:g}" for coord in coords)
            raise CommandRejected(f"the motion would lead to ({whole}), and was not sent: {error}") from None

    async def _follow_lines(self) -> None:
        """See to it that the arm goes along straight lines: it does not in fresh mode 1."""
        if await self._channel.poll_if_known(c.GET_FRESH_MODE, None) is not False:
            tell = partial(self._channel.tell, c.SET_FRESH_MODE, False, timeout=SILENCE)
            await self._channel.through_outages(tell)

    async def _watch(self, goal: Goal, entry: Entry, before: int | None) -> None:
        """Return when the arm stands where a motion leads, and raise when it never will."""
        now = self._loop.time
        watch = self._watching = StandstillDetector(goal, now())
        checked, self._lost = now(), 0
        while True:
            moving = await self._channel.poll(c.IS_MOVING, None)
            if watch.settled and not moving:
                return

            here = await self._position(goal)
            verdict = watch.look(now(), here, moving=moving)
            soon = watch.ends_at - SOON < now()
            if verdict is Verdict.ARRIVED and watch.moved:
                return

            if verdict is not Verdict.GOING or now() > checked + (CHECK_LATER if soon else CHECK):
                checked = now()
                await self.raise_joint_alarms()

            if verdict is Verdict.ARRIVED:
                return

            if verdict in {Verdict.SHORT, Verdict.IDLE}:
                if await self._channel.poll(c.IS_PAUSED, None):
                    watch.hold(now())
                elif watch.anchor:  # else it was let go on since
                    await self._raise_alarms(partial(self._new_alarms, before))
                    raise await self._why(verdict, entry, goal.missed(here))

            if not soon:
                await asyncio.sleep(POLL)

    async def _position(self, goal: Goal) -> Sequence[float]:
        """Return where the arm is; raise ArmAlarm if it could not read its servos several times in a row."""
        here = numbers(await self._channel.poll(goal.read, goal.of))
        self._lost = self._lost + 1 if goal.read is c.GET_ANGLES and cannot_read_servos(here) else 0
        if self._lost == LOOKS:
            raise ArmAlarm(f"the arm raised alarms: {SERVO_LOSS}", [SERVO_LOSS])

        return here

    async def _new_alarms(self, before: int | None) -> tuple[CobotAlarm, ...]:
        """What was wrong with the motion, if the arm tells it and did not tell the same before."""
        code = await self._channel.ask_if_known(c.GET_ERROR_INFORMATION, None)
        return motion_alarm(code) if code and before is not None and code != before else ()

    async def _raise_alarms(self, ask: Callable[[], Awaitable[tuple[CobotAlarm, ...]]]) -> None:
        """Raise ArmAlarm if something keeps the arm from moving. It is asked twice, for a frame has no checksum."""
        found = {alarm for alarm in await self._channel.through_outages(ask) if alarm.blocks}
        if found:
            found &= set(await self._channel.through_outages(ask))

        if found:
            alarms = sorted(found, key=lambda alarm: (alarm.joint or 0, alarm.code))
            raise ArmAlarm(f"the arm raised alarms: {'; '.join(map(str, alarms))}", alarms)

    async def _why(self, verdict: Verdict, entry: Entry, missed: float) -> MotionStopped | CommandRejected:
        """What to say of an arm that stands still elsewhere."""
        name = entry.command.name
        powered = await self.is_powered()
        far = f"{missed:.1f} (mm or degrees) from where it was to go"
        stale = motion_alarm(await self._channel.ask_if_known(c.GET_ERROR_INFORMATION, None) or 0)
        earlier = f"; it tells {stale[0].name}, maybe of an earlier motion (clear_alarms)" if stale else ""
        far += earlier
        wider = "connect(tolerance=(degrees, mm)) says how near counts as there"
        if verdict is Verdict.SHORT:
            power = "" if powered else "; it has no power any more"
            return MotionStopped(f"{name}: the arm came to rest {far}{power}; {wider}")

        if not powered:
            return CommandRejected(f"{name}: the arm is not powered; await arm.power_on(), then wait half a second")

        return CommandRejected(
            f"{name}: the arm answers but does not move, {far}; is the target within reach, and are the servos on "
            f"(power_on, focus)? It may be sent again. {wider}"
        )


def numbers(reading: Any) -> Sequence[float]:
    """A reading as a row of numbers."""
    return cast("tuple[float, ...]", reading) if isinstance(reading, tuple) else (reading,)
