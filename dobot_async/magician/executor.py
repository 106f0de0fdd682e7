"""How a Magician takes queued commands: each gets the next index, and that proves what became of it.

Books are kept of `last`, the index of the last command that the arm is known to have taken. They are opened with a
WAIT of 0 ms, whose index is the first entry. An acknowledgement with the index `last + 1` is the next command's own;
one with a smaller index is late or doubled and belongs to nobody. When none comes, another WAIT of 0 ms is queued: its
index tells how many commands the arm took since `last`, and so whether to go on or to send again. Manual 2.2.1, 2.19.7.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable, Collection, Sequence
from typing import Any, TypeVar

from dobot_async.errors import MotionUnknown, ProtocolError, ReplyTimeout
from dobot_async.executor import Accepted, Entry
from dobot_async.link import Link, Posted
from dobot_async.magician import commands as c
from dobot_async.magician.alarms import Alarm, decode, faults
from dobot_async.magician.frame import Frame
from dobot_async.magician.reach import destination
from dobot_async.wire import Command, Number, u64

__all__ = ["MagicianExecutor"]

Q = TypeVar("Q")
INDEX: Number[int] = Number(u64)
ACKNOWLEDGE = 0.5
ATTEMPTS = 4
ARRIVED = 0.5  # mm and degrees


class MagicianExecutor:
    """The arm's own queue, over a link."""

    def __init__(self, link: Link[Frame], window: int, check: Callable[[Any], None]) -> None:
        self._link = link
        self._check = check
        self._window = window
        self._last: int | None = None
        self._heard = -1
        self._completed: int | None = None
        self._under_way: deque[Entry] = deque()
        self._accepted: Accepted = lambda _entry, _ticket: None

    @property
    def under_way(self) -> Collection[Entry]:
        """The commands that were sent and not acknowledged."""
        return self._under_way

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Returns a checked and encoded command."""
        frame = self._link.frame(command, value, queued=True)
        self._check(value)
        return Entry(command, value, frame)

    async def left_space(self) -> int:
        """Returns how many commands the arm's queue can still take. Manual 2.19.8."""
        return await self._link.request(c.GET_QUEUED_CMD_LEFT_SPACE, None)

    async def push(self, entries: Sequence[Entry], accepted: Accepted) -> None:
        """Queues commands, each exactly once and in order; at most `window` are unacknowledged at a time."""
        await self.settle()
        self._accepted = accepted
        if self._last is None:
            self._last = await (await self._post(self._wait())).answer(ACKNOWLEDGE)

        todo = deque(entries)
        window = self._window
        for _ in range(ATTEMPTS):
            try:
                return await self._stream(todo, window)
            except ReplyTimeout:
                window = 1
                await self._count()
                todo.extendleft(reversed(self._under_way))
                self._under_way.clear()

        raise ReplyTimeout(f"the arm took none of {ATTEMPTS} attempts to queue {todo[0].command.name}")

    async def settle(self) -> None:
        """Finds out what became of the commands under way."""
        if self._under_way:
            await self._count()
            while self._under_way:
                self._accepted(self._under_way.popleft(), None)

    async def completed(self) -> int | None:
        """Returns the index of the last finished command. Manual 2.19.7.

        An index beyond the last one given out says nothing: some firmware shows one while it moves.
        """
        index = await self._link.request(c.GET_QUEUED_CMD_CURRENT_INDEX, None)
        if self._last is not None and index <= self._last:
            self._completed = index

        return self._completed

    async def faults(self) -> Sequence[Alarm]:
        """Returns the alarms that keep the arm from moving. Manual 2.5.1."""
        return faults(decode(await self._link.request(c.GET_ALARMS_STATE, None)))

    async def stands_at(self, entry: Entry) -> bool:
        """Returns whether the arm stands where an absolute motion leads."""
        target = destination(entry.value)
        if target is None:
            return False

        pose = await self._link.request(c.GET_POSE, None)
        here = (pose.j1, pose.j2, pose.j3, pose.j4) if target.joints else (pose.x, pose.y, pose.z, pose.r)
        return math.dist(here, target.numbers) < ARRIVED

    async def halt(self) -> None:
        """Stops the arm where it is, jogs included, ahead of everything else. Manual 2.19.3 and 2.10.4."""
        await asyncio.gather(
            self._link.request(c.SET_QUEUED_CMD_FORCE_STOP_EXEC, None, urgent=True),
            self._link.request(c.SET_JOG_CMD, c.JOGCmd(is_joint=False, cmd=c.JOGKey.IDLE), urgent=True),
        )

    async def reset(self) -> None:
        """Empties the arm's queue and lets it run again. Manual 2.19.6 and 2.19.1."""
        await self._link.request(c.SET_QUEUED_CMD_CLEAR, None, urgent=True)
        await self._link.request(c.SET_QUEUED_CMD_START_EXEC, None, urgent=True)
        if self._under_way:
            # Whether the arm took them before it was cleared no longer matters, but the books have to be opened anew.
            self._under_way.clear()
            self._last = None

    async def pause(self) -> None:
        """Lets the arm finish the command that it executes, and then wait. Manual 2.19.2."""
        await self._link.request(c.SET_QUEUED_CMD_STOP_EXEC, None)

    async def resume(self) -> None:
        """Lets the arm go on. Manual 2.19.1."""
        await self._link.request(c.SET_QUEUED_CMD_START_EXEC, None)

    async def download(self, entries: Sequence[Entry], loops: int) -> None:
        """Stores commands in the arm's flash as a program. Manual 2.19.4 and 2.19.5."""
        await self.push([], self._accepted)
        await self._link.request(c.SET_QUEUED_CMD_START_DOWNLOAD, c.QueuedCmdStartDownload(loops, len(entries)))
        try:
            await self.push(entries, lambda _entry, _ticket: None)
        finally:
            await self._link.request(c.SET_QUEUED_CMD_STOP_DOWNLOAD, None, urgent=True)

    async def _stream(self, todo: deque[Entry], window: int) -> None:
        """Sends commands ahead of their acknowledgements, as many as the window allows."""
        posted: deque[Posted[int]] = deque()
        try:
            while todo or posted:
                if todo and len(posted) < window:
                    entry = todo.popleft()
                    self._under_way.append(entry)
                    posted.append(await self._post(entry))
                else:
                    self._take(await posted.popleft().answer(ACKNOWLEDGE))
        finally:
            for each in posted:
                each.forget()

    async def _post(self, entry: Entry) -> Posted[int]:
        return await self._link.post(entry.frame, self._index_of, name=entry.command.name, timeout=ACKNOWLEDGE)

    def _index_of(self, frame: Frame) -> int:
        """The index in an acknowledgement; one that was heard already is late or doubled."""
        index = INDEX.decode(frame.params)
        if index <= self._heard:
            raise ProtocolError(f"index {index} was heard already")

        self._heard = index
        return index

    def _take(self, index: int) -> None:
        """Enters into the books that the arm took the first command under way."""
        if self._last is None or index != self._last + 1:
            raise MotionUnknown(
                f"{self._under_way[0].command.name} got the index {index} after {self._last}: another program queues "
                "commands on this arm, or the network delivered one twice"
            )

        self._last = index
        self._accepted(self._under_way.popleft(), index)

    async def _count(self) -> None:
        """Finds out how many of the commands under way the arm took, and enters them into the books."""
        last = self._last
        assert last is not None
        names = ", ".join(entry.command.name for entry in self._under_way)
        commands = list(self._under_way)
        for _ in range(ATTEMPTS):
            self._under_way.append(self._wait())
            try:
                index = await (await self._post(self._under_way[-1])).answer(ACKNOWLEDGE)
            except ReplyTimeout:
                continue

            if index == last + len(self._under_way):
                for taken in range(last + 1, index + 1):
                    self._take(taken)
            elif index == last + 1:
                self._last = index
                self._under_way = deque(commands)
            else:
                raise MotionUnknown(f"the arm took {index - last - 1} commands, and nothing tells which, of: {names}")

            return

        raise MotionUnknown(f"the arm does not tell which it took of: {names}")

    def _wait(self) -> Entry:
        """The harmless command whose index tells how many were taken before it."""
        return self.prepare(c.SET_WAIT_CMD, c.WAITCmd(0))
