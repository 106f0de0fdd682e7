r"""How an ultraArm takes commands, each exactly once. docs/ultraarm.md says what that rests on.

submit --> G0 ... \r M120 \r M114 \r --ok, QUEUE SIZE--> taken
              |
              `--lost, or no ok from an arm that says it--> reconcile: QUEUE SIZE, then where the arm comes to rest
                                                            --> taken | not taken: sent again | MotionUnknown
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any, Literal, TypeVar, cast

from dobot_async._core.link.link import Link
from dobot_async._core.queue.executor import Entry, Source, alarmed
from dobot_async._core.util.hooks import Hooks
from dobot_async.errors import CommandRejected, MotionUnknown, ProtocolError, ReplyTimeout
from dobot_async.ultraarm import commands as c
from dobot_async.ultraarm.answers import Receipt, Refusal, with_errors
from dobot_async.ultraarm.arrival import ArrivalChecker, Missed
from dobot_async.ultraarm.frame import Frame
from dobot_async.ultraarm.ledger import MODES, QueueLedger, UnackedCommand, target_of
from dobot_async.ultraarm.status import PACE, RESTS, SILENCE, StatusPoller
from dobot_async.ultraarm.stopper import Stopper
from dobot_async.wire import Command

__all__ = ["UltraArmExecutor"]

Q = TypeVar("Q")
R = TypeVar("R")
MOST_OPEN = 500  # commands of which it is not known whether the arm has done them


class UltraArmExecutor:
    """The arm's own queue, over a link; see `Executor`."""

    def __init__(
        self,
        link: Link[Frame],
        check: Callable[[Any], None],
        *,
        depth: int,
        tolerance: float | None,
        on_stop: Literal["release", "finish"],
    ) -> None:
        self.cleanup = link.cleanup
        self.on_unknown: Hooks[[MotionUnknown]] = Hooks()
        self._link = link
        self._check = check
        self._depth = depth
        self._ledger = QueueLedger()
        self._status = StatusPoller(self.read, self._ledger)
        self._arrival = ArrivalChecker(self.read, self._ledger, self._status, tolerance)
        self._stopper = Stopper(self._status, on_stop)
        self._room = 0  # how many more commands may be given, as far as was counted down
        self._says_ok: bool | None = None
        self._draining = False
        self._mode_known = False
        self._outages = 0

    @property
    def released(self) -> bool:
        """Whether the motors have no power, as far as this program knows."""
        return self._stopper.released

    async def ask(self, command: Command[Q, R], value: Q, *, timeout: float | None = None, urgent: bool = False) -> R:
        """Send one command, and return the arm's answer.

        Raises:
            CommandRejected: The arm answered with an error.
            DobotError: As `Link.request`.
        """
        if command.write:
            self._forget_size()  # each may make the queue longer, answered or not

        answer = await self._link.request(with_errors(command), value, timeout=timeout, urgent=urgent)
        if isinstance(answer, Refusal):
            raise CommandRejected(f"the arm refused {command.name}: {answer.text}")

        self._note(command)
        if isinstance(answer, Receipt):
            self._status.size = answer.queue_size

        return cast(R, answer)

    async def read(self, command: Command[None, R], *, timeout: float = SILENCE, urgent: bool = False) -> R:
        """Read something, through outages of a link that is reopened; raise ReplyTimeout if the arm is silent."""
        while True:
            await self._link.opened()
            outages = self._link.outages
            try:
                return await self.ask(command, None, timeout=timeout, urgent=urgent)
            except ReplyTimeout:
                if self._link.open and self._link.outages == outages:
                    raise

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Return a checked and encoded command; raise CommandRejected for motions while the motors have no power."""
        frame = self._link.frame(command, value, queued=True)
        self._check(value)
        if command.moves and self.released:
            raise CommandRejected(
                "the motors have no power, as after a stop in the middle of a motion: power_on(), then home()"
            )

        return Entry(command, value, frame)

    async def submit(self, source: Source) -> None:
        """Give commands to the arm one by one; see `Executor`."""
        while source:
            await self._reconcile(source)
            await self._await_room()
            await self._set_mode(source)
            if source:
                await self._submit_one(source)

    async def completed(self) -> int | None:
        """Return the ticket of the last command that is done."""
        await self._check_outage()
        status = await self._status.poll_paced()
        self._arrival.note(status)
        if self._ledger.unacked or not self._status.is_at_rest:
            return self._ledger.done_by_size(status.queue_size)

        return self._ledger.done_by_size(0) if self._arrival.misses(status) else self._ledger.all_done()

    async def earliest_end(self, entry: Entry) -> float | None:  # noqa: ARG002 - the status is polled at its own pace
        """Return None."""
        return None

    async def alarms(self) -> Sequence[Missed]:
        """Return what went wrong without an answer to tell of it."""
        return [self._arrival.fault] if self._arrival.fault else []

    async def is_at_target(self, entry: Entry) -> bool:
        """Return whether the arm stands where an absolute motion leads."""
        return await self._arrival.is_at(target_of(entry, relative=self._ledger.relative))

    async def stop(self) -> None:
        """Stop the arm until it is seen to stand; raise CommandRejected if it demonstrably goes on."""
        try:
            await self._stopper.stop()
        finally:
            if self.released:
                self._ledger.note(c.RELEASE)

    async def end_jog(self) -> None:
        """End a jog, until that is seen; what is in the arm's queue goes on."""
        await self._stopper.end_jog(lambda: bool(self._ledger.open or self._ledger.unacked))

    async def clear(self) -> None:
        """Forget what the arm was given: what it still has of it is done before it is given more."""
        self._room = 0
        self._draining = True
        if self._ledger.forget():
            self._mode_known = self._ledger.relative = False

        self._arrival.fault = None

    async def pause(self) -> None:
        """Raise CommandRejected: the protocol has no pause."""
        raise CommandRejected("an ultraArm cannot pause: put commands later, or stop it")

    async def resume(self) -> None:
        """Raise CommandRejected: the protocol has no pause."""
        await self.pause()

    async def greet(self, timeout: float, *, fresh: bool) -> None:
        """Prove that an arm answers; with `fresh`, nothing is put until what it still has to do is done."""
        await self.ask(c.GET_QUEUE_SIZE, None, timeout=timeout)
        self._draining = fresh

    async def _check_outage(self) -> None:
        """After an outage of the link, raise MotionUnknown where a motion's end cannot be looked at."""
        await self._link.opened()
        if self._outages == self._link.outages:
            return

        self._outages = self._link.outages
        self._forget_size()
        self._mode_known = False
        if self._ledger.open and not self._arrival.can_tell(self._ledger.target):
            raise MotionUnknown("the link was lost, and nothing tells whether the arm was switched off meanwhile")

    async def _await_room(self) -> None:
        """Return when the arm may be given more; raise ArmAlarm if something went wrong meanwhile."""
        await self._check_outage()
        while not self._room or len(self._ledger.open) >= MOST_OPEN:
            status = await self._status.poll()
            if not self._draining or (status.at_rest and not status.queue_size):
                self._draining = False
                self._room = max(0, self._depth - status.queue_size)

            if len(self._ledger.open) >= MOST_OPEN:  # nothing tells how far such a series is, until the arm rests
                self._room = 0

            if not self._room and self._arrival.fault:
                raise alarmed([self._arrival.fault])

            if not self._room:
                await asyncio.sleep(PACE)

    async def _set_mode(self, source: Source) -> None:
        """See to it that coordinates mean what they are taken for."""
        if source and not self._mode_known:
            try:
                await self.ask(c.RELATIVE if self._ledger.relative else c.ABSOLUTE, None, timeout=SILENCE)
            except CommandRejected:
                source.take()  # it is refused with it
                raise

    async def _submit_one(self, source: Source) -> None:
        """Send one command, and find out whether the arm took it."""
        entry = source.take()
        reply = with_errors(entry.command).reply

        def ready() -> None:
            self._ledger.unacked = self._ledger.unacked or UnackedCommand(entry, self._status.size)
            self._status.begin()

        self._room -= 1
        try:
            answer = await self._link.exchange(
                entry.frame,
                lambda frame: reply.decode(frame.params),
                name=entry.command.name,
                timeout=SILENCE,
                repeatable=entry.command.repeatable,
                ready=ready,
            )
        except (ReplyTimeout, ProtocolError):  # what came instead was somebody else's
            if self._ledger.unacked:
                await self._reconcile(source)
                return

            source.put_back([entry])
            raise

        if isinstance(answer, Refusal):
            self._ledger.unacked = None
            raise CommandRejected(f"the arm refused {entry.command.name}: {answer.text}")

        if not answer.text and self._says_ok:
            await self._reconcile(source)
        else:
            self._says_ok = bool(answer.text)
            self._enter(entry, answer.queue_size, source)

    async def _reconcile(self, source: Source) -> None:
        """Find out what became of the unacknowledged command: if the arm did not take it, it comes next again."""
        unacked = self._ledger.unacked
        if unacked is None:
            return

        try:
            size = await self._size_if_taken(unacked)
        except ReplyTimeout:
            name = unacked.entry.command.name
            raise MotionUnknown(f"the arm fell silent, and nothing tells whether it took {name}") from None

        self._says_ok = None  # whether it says ok is to be learnt again
        if size is None:
            self._ledger.unacked, self._room = None, 0
            source.put_back([unacked.entry])
        else:
            self._enter(unacked.entry, size, source)

    async def _size_if_taken(self, unacked: UnackedCommand) -> int | None:
        """Return how many commands wait if the arm took a command, None if it did not.

        What waits can only become less by itself: if it has become more, it was taken. What may be done twice is not
        taken then, as far as anybody needs to know. Else the arm is left to run out, and where it comes to rest tells.

        Raises:
            MotionUnknown: Nothing can tell.
            ReplyTimeout: The arm is silent.
        """
        entry, name = unacked.entry, unacked.entry.command.name
        while True:
            await self._check_outage()
            status = await self._status.poll()
            if unacked.size is not None and status.queue_size > unacked.size:
                return status.queue_size

            if entry.command.repeatable:
                return None

            if self._status.rests >= RESTS:
                break

            await asyncio.sleep(PACE)

        target = target_of(entry, relative=self._ledger.relative)
        if target and self._arrival.can_tell(target):
            return 0 if await self._arrival.came_to(target) else None

        raise MotionUnknown(f"the arm did not acknowledge {name}, and nothing tells whether it took it")

    def _forget_size(self) -> None:
        """Nothing tells any more by how much the arm's queue has grown."""
        self._status.size = None
        if self._ledger.unacked:
            self._ledger.unacked.size = None

    def _enter(self, entry: Entry, size: int, source: Source) -> None:
        """Enter a command that the arm has taken."""
        self._status.size = size
        self._status.begin()
        self._note(entry.command)
        source.accepted(entry, self._ledger.enter(entry))

    def _note(self, command: Command[Any, Any]) -> None:
        """Note what a command that the arm has taken means."""
        self._ledger.note(command)
        self._mode_known = self._mode_known or command in MODES
        self._stopper.note(command)
