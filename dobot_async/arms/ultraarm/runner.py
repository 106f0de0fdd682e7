r"""How an ultraArm does commands: one at a time, each sent again until the arm has it, and none done that was not seen.

run --> resolve --> G0 ... \r M120 \r M114 \r --> taken --> at rest --> at its goal: done
                          ^       |                           `--> elsewhere: ArmAlarm, and nothing behind it is sent
                          |       `--lost--> busy: taken | at its goal: done | at rest elsewhere: not taken
                          `------------------------------------------------------------'

1. The arm rests, with nothing in its queue, before each command, so that what it does then is this command's doing.
2. Increments are added up on this side: what is sent is a place, which does no harm twice and can be looked at.
3. What moves nothing is done when nothing waits in the arm's queue any more.

docs/ultraarm.md says what that rests on.
"""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any, Literal, TypeVar

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.executor import Entry, alarmed
from dobot_async._core.util.workspace import OutsideWorkspace, Workspace
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.acknowledged import TRIES, Acknowledged
from dobot_async.arms.ultraarm.channel import Channel
from dobot_async.arms.ultraarm.frame import Frame
from dobot_async.arms.ultraarm.goals import INCREMENTS, goal_of, summed
from dobot_async.arms.ultraarm.keeping import Stand, UltraArmKeeper
from dobot_async.arms.ultraarm.state import ArmState
from dobot_async.arms.ultraarm.status import RESTS, STATUS_AND_ANGLES, UltraArmPoller
from dobot_async.arms.ultraarm.stopper import UltraArmStopper
from dobot_async.arms.ultraarm.tools import darken, wait_for_gripper
from dobot_async.errors import CommandRejected, MotionUnknown

__all__ = ["UltraArmRunner"]

Q = TypeVar("Q")
R = TypeVar("R")


class UltraArmRunner:
    """See the module, and `MotionRunner`.

    Args:
        link: The way to the arm.
        limits: What the arm may be told.
        tolerance: By how many mm or degrees it may miss a goal.
        home_switches: What its home switches read at home; None does not look.
        on_stop: What to do where M15 does not end a motion.
        workspace: Where the tool may be.

    Attributes:
        channel: How it is asked.
        limits: What it may be told.
        state: What is known of it.
        status: What it shows.
        stopper: What stops it.
        busy: Whether a command is being done.
        jogging: Whether a jog goes on.
        keeper: What keeps the arm in its workspace.
    """

    def __init__(
        self,
        link: Link[Frame],
        limits: c.UltraArmLimits,
        *,
        tolerance: float,
        home_switches: tuple[int, ...] | None,
        on_stop: Literal["release", "finish"],
        workspace: Workspace | None = None,
    ) -> None:
        self.channel: Channel = Channel(link)
        self.keeper: UltraArmKeeper | None = UltraArmKeeper(workspace, self._stand) if workspace else None
        self.state: ArmState = ArmState()
        self.status: UltraArmPoller = UltraArmPoller(self.channel.read, lambda: link.stats)
        self.stopper: UltraArmStopper = UltraArmStopper(self.status, self.state, on_stop)
        self.busy: bool = False
        self.jogging: bool = False
        self._commands = Acknowledged(self.channel, self.status)
        self._link = link
        self.limits = limits
        self._tolerance = tolerance
        self._home_switches = home_switches
        self._planned = replace(self.state)  # what it will be once all is done that was prepared
        self._idle = False  # whether it is known to rest with nothing in its queue
        self._absolute = False  # whether it is known to take coordinates for places

    async def ask(self, command: Command[Q, R], value: Q, *, timeout: float | None = None, urgent: bool = False) -> R:
        """Send one command at once, and return the arm's answer; see `Channel.ask`."""
        if command.write:
            self.disturbed()
            if command in {c.ABSOLUTE, c.RELATIVE}:
                self._absolute = False

            if command is not c.POWER_ON:  # what it takes away counts as gone, answered or not
                self.note(command, value)

        answer = await self.channel.ask(command, value, timeout=timeout, urgent=urgent)
        if command is c.POWER_ON:
            self.note(command, value)

        return answer

    def note(self, command: Command[Any, Any], value: Any) -> None:
        """Note what a command means that does not go through the queue."""
        for state in (self.state, self._planned):
            state.note(command, value)

    def disturbed(self) -> None:
        """The arm may stand elsewhere than it was last seen, or have something to do."""
        self._idle = False
        self.status.last = None

    def check_increments(self, command: Command[Any, Any], value: Any) -> None:
        """Raise ValueError for increments that lead beyond the limits, where it is known from where.

        That is the case if nothing else is to be done before them, and the arm has not been touched since it was seen.
        """
        here = self.status.last
        if self._idle and not self.busy and here and self._planned.increments(command):
            try:
                self.limits.check(summed(value, here))
            except ValueError as error:
                raise ValueError(f"the increments lead beyond the limits: {error}") from None

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Return a checked entry; raise CommandRejected for motions that the arm cannot do as it will be then."""
        frame = self._link.frame(command, value, queued=True)
        if not self._planned.increments(command):
            self.limits.check(value)

        if self.keeper:
            self.keeper.lead(command, value, Stand(relative=self._planned.relative))

        self._planned.check(command)
        if self.jogging and command.moves:
            raise CommandRejected("a jog goes on: a motion can be put when it has ended")

        self._planned.note(command, value)
        return Entry(command, value, frame)

    async def run(self, entry: Entry) -> None:
        """Do one command, and return when it is done.

        Raises:
            ArmAlarm: The arm came to rest elsewhere than at its goal.
            CommandRejected: The arm refused it, or it leads beyond the limits; it was not sent then.
            MotionUnknown: Nothing can tell whether it is done.
            ReplyTimeout: The arm is silent.
        """
        command, value = entry.command, entry.value
        self.busy = True
        try:
            self.state.check(command)
            if not (self.jogging and not command.moves):
                await self._rest()

            if command.moves:
                await self._move(command, value)
            elif command in {c.ABSOLUTE, c.RELATIVE}:
                await self._set(c.ABSOLUTE, None)
                self._absolute = True
            elif command is c.WAIT:
                await self._wait(value.seconds)
            else:
                await self._set(command, value)

            self.state.note(command, value)
        finally:
            self.busy = False

    async def stop(self) -> None:
        """Stop the arm until it is seen to stand, and its laser; raise CommandRejected if it demonstrably goes on."""
        self.disturbed()
        laser = self.state.laser
        stopping = [self.stopper.stop(), *([darken(self.channel)] if laser else [])]
        results = await asyncio.gather(*stopping, return_exceptions=True)
        if laser:
            await darken(self.channel)  # what the stop has thrown away may have been this
            self.state.laser = False

        for failure in filter(None, results):
            raise failure

    async def reset(self) -> None:
        """Forget what was prepared. Coordinates are places after that."""
        self.disturbed()
        self._absolute = self.state.relative = False
        self._planned = replace(self.state)

    async def pause(self) -> None:
        """Return if the arm is there: it finishes what it does, and is given nothing more."""
        await self.channel.read(c.GET_QUEUE_SIZE)

    async def resume(self) -> None:
        """Return if the arm is there."""
        await self.channel.read(c.GET_QUEUE_SIZE)

    async def _rest(self) -> None:
        """Return when the arm rests with nothing in its queue."""
        if self._idle:
            return

        self.status.begin()
        while self.status.rests < RESTS:
            await self.status.poll_paced()

        self._idle = True

    async def _move(self, command: Command[Any, Any], value: Any) -> None:
        """Do a motion, and return when the arm was seen at its goal."""
        if command in INCREMENTS or command is c.MOVE_BY:
            command, value = await self._resolved(command, value)
            await self._keep(command, value)

        if command is c.HOME:
            await self.status.poll(STATUS_AND_ANGLES)  # to see by it whether something moves

        goal = goal_of(command, value, self._home_switches)
        outages, fault = self._link.outages, None
        self._idle = False
        for _ in range(TRIES):
            self.status.begin(goal)
            before = self.status.last
            receipt = await self.channel.send(command, value)
            acknowledged = self._commands.acknowledged(command, receipt)
            if acknowledged or await self.status.has_begun(goal, before, self._tolerance):
                fault = await self.status.arrive(goal, self._tolerance)
                if fault is None:
                    break

                if self.status.set_out or self.status.is_in_order:
                    raise alarmed([fault])  # else what acknowledged it may have been an answer to another one
        else:
            raise (
                alarmed([fault])
                if fault
                else MotionUnknown(
                    f"the arm does not acknowledge {command.name}, sent {TRIES} times, and does not move"
                )
            )

        if command is c.HOME and outages != self._link.outages:
            raise MotionUnknown("the link was lost, and nothing tells whether the arm was switched off meanwhile")

        self._idle = True

    async def _resolved(
        self, command: Command[Any, Any], value: c.CoordsMove
    ) -> tuple[Command[Any, Any], c.CoordsMove]:
        """Return a motion whose coordinates are places; let the arm take them for places."""
        if not self._absolute:
            await self._set(c.ABSOLUTE, None)
            self._absolute = True

        if not self.state.increments(command):
            return command, value

        try:
            target = summed(value, await self.status.poll(c.GET_STATUS))
            self.limits.check(target)
        except KeyError:
            raise MotionUnknown("the arm does not tell where it is, from where increments are added up") from None
        except ValueError as error:
            raise CommandRejected(f"the increments were not sent, for they lead beyond the limits: {error}") from None

        return (c.MOVE_LINE if command is c.MOVE_LINE else c.MOVE_COORDS), target

    async def _keep(self, command: Command[Any, Any], value: c.CoordsMove) -> None:
        """Raise CommandRejected for a motion that leads out of the workspace from where the arm stands."""
        if self.keeper:
            here = await self._stand()
            try:
                self.keeper.lead(command, value, replace(here, relative=False))
            except OutsideWorkspace as error:
                raise CommandRejected(f"the motion was not sent: {error}") from None

    async def _stand(self) -> Stand:
        """Where the arm stands, and what coordinates mean to what is done next."""
        coords = await self.channel.read(c.GET_COORDS)
        return Stand((coords.x, coords.y, coords.z), self.state.relative)

    async def _set(self, command: Command[Any, Any], value: Any) -> None:
        """Do what moves nothing, and return when it is done."""
        if command is not c.POWER_ON:  # what it takes away counts as gone, acknowledged or not
            self.state.note(command, value)

        receipt = await self._commands.taken(command, value)
        while receipt.queue_size and self.status.size:
            await self.status.poll_paced()

        if command is c.SET_POSITION:
            self.status.last = None
        elif command is c.RELEASE:
            self.disturbed()
        elif command is c.SET_GRIPPER:
            await wait_for_gripper(self.channel, value)

    async def _wait(self, seconds: float) -> None:
        """Hold the queue: the arm knows whole seconds, the rest passes here."""
        whole = int(seconds)
        if whole or not seconds:
            self.status.begin()
            outages = self._link.outages
            taken_at = self.status.now()
            await self._commands.taken(c.WAIT, c.Dwell(whole))
            # Firmware may look idle while it waits: then the time has to pass here.
            while self.status.rests < RESTS or not (self.status.busy or self.status.now() >= taken_at + whole):
                await self.status.poll_paced()

            if outages != self._link.outages:
                raise MotionUnknown("the link was lost, and nothing tells whether the arm was switched off meanwhile")

        await asyncio.sleep(seconds - whole)
