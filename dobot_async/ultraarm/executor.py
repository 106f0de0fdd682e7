r"""How an ultraArm takes commands, each exactly once. docs/ultraarm.md says what that rests on.

    push --> G0 ... \r M120 \r --ok, QUEUE SIZE--> taken
                 |
                 `--silence, or no ok from an arm that says it--> settle: QUEUE SIZE, then where the arm comes to rest
                                                                  --> taken | not taken | MotionUnknown

The arm has no command that ends a queued motion. M15 ends a jog, and with some firmware perhaps more; what it does not
end within a moment is ended by M17, which takes the power off the motors.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice
from types import MappingProxyType
from typing import Any, Literal, TypeVar, cast

from dobot_async.errors import CommandRejected, MotionUnknown, ProtocolError, ReplyTimeout
from dobot_async.executor import Accepted, Entry
from dobot_async.link import Link
from dobot_async.ultraarm import commands as c
from dobot_async.ultraarm.books import MODES, Books, Target, target_of
from dobot_async.ultraarm.frame import Frame, errors
from dobot_async.ultraarm.layouts import Answer, Receipt, Refusal, Status
from dobot_async.ultraarm.sight import PACE, RESTS, SILENCE, Sight
from dobot_async.wire import Command

__all__ = ["Missed", "UltraArmExecutor"]

Q = TypeVar("Q")
R = TypeVar("R")
SETTLED = 0.2  # seconds of rest elsewhere than it was told to, after which an arm has missed its target
GRAIN = 0.02  # mm and degrees; the arm tells hundredths
BRAKING = 5  # looks at an arm that was told to stop
GIVING_UP = 50  # looks at an arm without power, after which it counts as one that cannot be stopped


@dataclass(frozen=True, slots=True)
class Missed:
    """The arm came to rest elsewhere than it was told to, or said that something is wrong."""

    text: str

    def __str__(self) -> str:
        return self.text


class UltraArmExecutor:
    """The arm's own queue, over a link.

    Attributes:
        released: Whether the motors have no power, as far as this program knows.
        room: How many more commands may be given, as far as was counted down.
    """

    def __init__(
        self,
        link: Link[Frame],
        check: Callable[[Any], None],
        *,
        depth: int,
        tolerance: float | None,
        on_stop: Literal["release", "finish"],
    ) -> None:
        self.distress: Callable[[MotionUnknown], None] = lambda _: None
        self.released = False
        self.room = 0
        self._link = link
        self._check = check
        self._depth = depth
        self._tolerance = tolerance
        self._on_stop = on_stop
        self._books = Books()
        self._under_way: list[Entry] = []
        self._awaited: Answer[Any] = Answer(None)
        self._accepted: Accepted = lambda _entry, _ticket: None
        self._answers: dict[Command[Any, Any], Command[Any, Any]] = {}
        self._sight = Sight(self.ask, self._books)
        self._says_ok: bool | None = None
        self._draining = False
        self._mode_known = False
        self._slipped = False
        self._halts = 0
        self._fault: Missed | None = None
        self._outages = 0

    @property
    def under_way(self) -> Collection[Entry]:
        """The command that was sent and of which nobody knows yet whether the arm took it."""
        return self._under_way

    async def connected(self) -> None:
        """Returns when the link is open; after an outage only where a motion's end can still be looked at."""
        await self._link.opened()
        if self._outages != self._link.outages:
            self._outages = self._link.outages
            self._sight.size = None
            self._mode_known = False
            if self._books.open and (self._books.target is None or self._tolerance is None):
                raise MotionUnknown("the link was lost, and nothing tells whether the arm was switched off meanwhile")

    async def ask(self, command: Command[Q, R], value: Q, *, timeout: float | None = None, urgent: bool = False) -> R:
        """Sends one command, and returns the arm's answer.

        Raises:
            CommandRejected: The arm answered with an error.
            DobotError: As `Link.request`.
        """
        answer = await self._link.request(self._row(command), value, timeout=timeout, urgent=urgent)
        if isinstance(answer, Refusal):
            raise CommandRejected(f"the arm refused {command.name}: {answer.text}")

        self._note(command)
        if isinstance(answer, Receipt):
            self._sight.size = answer.queue_size

        return cast(R, answer)

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Returns a checked and encoded command; raises CommandRejected for motions while the motors have no power."""
        frame = self._link.frame(command, value, queued=True)
        self._check(value)
        if command.moves and self.released:
            raise CommandRejected(
                "the motors have no power, as after a stop in the middle of a motion: power_on(), then home()"
            )

        return Entry(command, value, frame)

    async def left_space(self) -> int:
        """Returns how many more commands are to lie in the arm's queue; none while it runs out."""
        status = await self._sight.look()
        if self._draining and not (status.at_rest and status.queue_size == 0):
            return 0

        self._draining = False
        self.room = max(0, self._depth - status.queue_size)
        return self.room

    async def push(self, entries: Iterator[Entry], accepted: Accepted) -> None:
        """Gives commands to the arm one by one; returns early if it did not take one."""
        self._accepted = accepted
        halts = self._halts
        await self.settle()
        if not self._mode_known:
            await self.ask(c.RELATIVE if self._books.relative else c.ABSOLUTE, None)

        for entry in islice(entries, self.room):
            if self._halts != halts:
                return

            self.room -= 1
            if not await self._give(entry):
                self.room = 0
                return

    async def settle(self) -> None:
        """Finds out what became of the command under way."""
        if self._under_way:
            entry = self._under_way[0]
            if not await self._resolve(entry):
                self._accepted(entry, None)

    async def completed(self) -> int | None:
        """Returns the ticket of the last command that is done."""
        status = await self._sight.next()
        if status.text and errors(status.text.encode()) and self._books.open:
            self._fault = Missed(status.text)

        if not self._sight.done:
            return self._books.waiting(status.queue_size)

        return self._books.waiting(0) if self._misses_target(status) else self._books.all_done()

    async def remaining(self, entry: Entry) -> None:
        """Returns None: it looks at its own pace."""

    async def faults(self) -> Sequence[Missed]:
        """Returns what went wrong without an answer to tell of it."""
        return [self._fault] if self._fault else []

    async def stands_at(self, entry: Entry) -> bool:
        """Returns whether the arm stands where an absolute motion leads."""
        target = target_of(entry, relative=self._books.relative)
        if target is None or self._tolerance is None:
            return False

        return target.miss(await self.place(joints=target.joints)) <= self._tolerance

    async def place(self, *, joints: bool) -> c.UltraArmAngles | c.UltraArmCoords:
        """Returns where the arm is."""
        if joints:
            return await self.ask(c.GET_ANGLES, None, timeout=SILENCE)

        return await self.ask(c.GET_COORDS, None, timeout=SILENCE)

    async def halt(self) -> None:
        """Stops the arm: M15, and M17 where that is not enough and may be done."""
        self._halts += 1
        with suppress(CommandRejected):  # an error that comes late may be of another command; what follows shows it
            await self.ask(c.JOG_STOP, None, timeout=SILENCE, urgent=True)

        if await self._sight.comes_to_rest(BRAKING) or self._on_stop == "finish":
            return

        with suppress(CommandRejected):
            await self.ask(c.RELEASE, None, timeout=SILENCE, urgent=True)

        self.released = True
        if not await self._sight.comes_to_rest(GIVING_UP):
            raise CommandRejected(
                f"the arm goes on, with {self._sight.size} more commands in its queue: its protocol has nothing that "
                "ends them; switch it off"
            )

    async def reset(self) -> None:
        """Waits, where a stop lets the arm finish, until it has; then it is ready for new commands."""
        if self._slipped:
            await self.halt()
            self._slipped = False

        while self._on_stop == "finish" and not await self._sight.comes_to_rest(GIVING_UP):
            pass

        self.room = 0
        self._draining = True
        if self._books.unfinished_mode or any(entry.command is c.MOVE_BY for entry in self._under_way):
            self._mode_known = self._books.relative = False

        self._under_way = []
        self._books.forget()
        self._fault = None

    async def pause(self) -> None:
        """Raises CommandRejected: the protocol has no pause."""
        raise CommandRejected("an ultraArm cannot pause: put commands later, or stop it")

    async def resume(self) -> None:
        """Raises CommandRejected: the protocol has no pause."""
        await self.pause()

    async def greet(self, timeout: float, *, fresh: bool) -> None:
        """Proves that an arm answers; with `fresh`, nothing is put until what it still has to do is done."""
        receipt = await self.ask(c.GET_QUEUE_SIZE, None, timeout=timeout)
        self._draining = fresh
        self._sight.size = receipt.queue_size

    async def _give(self, entry: Entry) -> bool:
        """Sends a command once; returns whether the arm took it."""
        self._under_way = [entry]
        reply: Any = Answer[Any](entry.command.reply)
        self._awaited = reply
        halts = self._halts
        try:
            answer = await self._link.request(replace(entry.command, reply=reply, repeatable=False), entry.value)
        except (ReplyTimeout, ProtocolError):  # what came instead was somebody else's
            return await self._resolve(entry)
        finally:
            self._slipped = self._slipped or self._halts != halts  # it may have been sent behind the stop

        if isinstance(answer, Refusal):
            self._under_way = []
            raise CommandRejected(f"the arm refused {entry.command.name}: {answer.text}")

        if not answer.text and self._says_ok:
            return await self._resolve(entry)

        self._says_ok = bool(answer.text)
        self._enter(entry, answer.queue_size)
        return True

    async def _resolve(self, entry: Entry) -> bool:
        """Finds out whether the arm took a command; enters it, or returns False.

        What waits can only become less by itself: if it has become more, it was taken. What may be done twice is not
        taken then, as far as anybody needs to know. Else the arm is left to run out, and where it comes to rest tells.
        """
        before, name = self._sight.size, entry.command.name
        try:
            while True:
                await self._link.opened()
                status = await self._sight.look()
                self._awaited.over = True  # asked behind it, answered before it
                if before is not None and status.queue_size > before:
                    return self._taken(entry, status.queue_size)

                if entry.command.repeatable:
                    return self._not_taken()

                if self._sight.rests >= RESTS:
                    break

                await asyncio.sleep(PACE)

            target = target_of(entry, relative=self._books.relative)
            if target and self._tolerance is not None:
                return self._taken(entry, 0) if await self._came_to(target) else self._not_taken()
        except ReplyTimeout:
            raise MotionUnknown(f"the arm fell silent, and nothing tells whether it took {name}") from None

        raise MotionUnknown(f"the arm did not acknowledge {name}, and nothing tells whether it took it")

    async def _came_to(self, target: Target) -> bool:
        """Whether the arm, at rest, has come to a target, and not only stands near it, where it stood before.

        If in doubt it has not: to be told once more where it stands moves an arm by no more than the tolerance.
        """
        here, before = await self.place(joints=target.joints), self._books.target
        miss = target.miss(here)
        nearer = before is not None and before.joints == target.joints and miss < before.miss(here)
        return miss <= GRAIN or (nearer and self._tolerance is not None and miss <= self._tolerance)

    def _row(self, command: Command[Q, Any]) -> Command[Q, Any]:
        """The row with answers that may be errors."""
        row = self._answers.get(command)
        if row is None:
            row = self._answers[command] = replace(command, reply=Answer(command.reply))

        return row

    def _taken(self, entry: Entry, size: int) -> bool:
        """The arm took a command, although it did not say so."""
        self._says_ok = None
        self._enter(entry, size)
        return True

    def _not_taken(self) -> bool:
        """The arm did not take the command under way; whether it says ok is to be learnt again."""
        self._says_ok = None
        self._under_way = []
        return False

    def _enter(self, entry: Entry, size: int) -> None:
        """The arm took a command."""
        self._under_way = []
        self._sight.size = size
        self._sight.given()
        self._note(entry.command)
        self._accepted(entry, self._books.take(entry))

    def _note(self, command: Command[Any, Any]) -> None:
        """The arm has taken a command; notes what that means."""
        self._books.note(command)
        self._mode_known = self._mode_known or command in MODES
        if command in POWERING:
            self.released = POWERING[command]

    def _misses_target(self, status: Status) -> bool:
        """Whether an arm at rest is not where the last motion leads, and may yet settle; a fault if that stays so."""
        target = self._books.target
        if target is None or self._tolerance is None or self._fault or self._books.verified:
            return False

        here = target.told(status)
        if here and target.miss(here) <= self._tolerance:
            return False

        if self._sight.now() < self._sight.rest_since + SETTLED:
            return True

        where = here or "somewhere that it does not tell"
        self._fault = Missed(f"it came to rest at {where} instead of {target}: out of reach, not homed, or obstructed")
        return False


POWERING: Mapping[Command[Any, Any], bool] = MappingProxyType({c.RELEASE: True, c.POWER_ON: False})
"""Whether the motors have no power after a command."""
