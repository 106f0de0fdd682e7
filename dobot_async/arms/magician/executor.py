"""A Magician as its queue sees it: what it has finished, its alarms, its stop. `submission` gives it commands."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.executor import Entry, MotionSource
from dobot_async._core.util.tasks import run_concurrently
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.arrival import Approach
from dobot_async.arms.magician.frame import Frame
from dobot_async.arms.magician.ledger import QueueLedger
from dobot_async.arms.magician.reach import destination
from dobot_async.arms.magician.status import SILENCE
from dobot_async.arms.magician.stopping import STILL, TOOLS
from dobot_async.arms.magician.submission import Submission, Surplus

__all__ = ["MagicianExecutor", "Surplus"]

Q = TypeVar("Q")
ARRIVED = 0.5  # mm and degrees


class MagicianExecutor(Submission):
    """The arm's own queue, over a link; see `Executor`.

    Attributes:
        tool_stops: How many stops were to end laser and steppers so far.
    """

    def __init__(self, link: Link[Frame], window: int, check: Callable[[Any], None]) -> None:
        super().__init__(link, window, check)
        self._approach = Approach(partial(self.status.ask, c.GET_POSE), asyncio.get_running_loop().time)
        self.tool_stops = 0
        self._tools_ended = 0
        self._downloading = False

    async def completed(self) -> int | None:
        """Return the index of the last finished command, None if the arm does not say. Manual 2.19.7."""
        await self.status.check_outage(self.ledger.highest)
        highest = self.ledger.highest
        index = await self.status.index(highest)
        if index is None or highest is None:
            return None

        if self._datagrams and index > self.status.completed and not await self._datagrams.confirm():
            return None

        self.status.completed = max(self.status.completed, index)
        if index == self.ledger.last and not self.ledger.unacked:
            self._relative, self.space.empty = None, True

        return index

    async def earliest_end(self, entry: Entry) -> float | None:
        """Return seconds within which a motion cannot end, as the arm's pose tells. Manual 2.3.1."""
        return await self._approach.remaining(entry)

    async def is_at_target(self, entry: Entry) -> bool:
        """Return whether the arm stands where an absolute motion leads."""
        target = destination(entry.value)
        return target is not None and target.distance(await self.status.ask(c.GET_POSE)) < ARRIVED

    async def stop(self) -> None:
        """Stop the arm where it is, jogs and a download included, and laser and steppers if that is wanted.

        Manual 2.19.3, 2.19.5, 2.10.4, 2.9.2 and 2.16.6.
        """
        wanted = self.tool_stops
        tools = TOOLS if wanted > self._tools_ended else ()
        commands: list[tuple[Command[Any, None], Any]] = [
            (c.SET_QUEUED_CMD_FORCE_STOP_EXEC, None),
            (c.SET_JOG_CMD, STILL),
        ]
        if self._downloading:
            commands.append((c.SET_QUEUED_CMD_STOP_DOWNLOAD, None))

        await run_concurrently(
            *(self._send_until_acknowledged(command, value) for command, value in (*commands, *tools))
        )
        self._downloading = False
        if tools:
            # Again: a queued command may have switched one on before the arm heard that it is to stop.
            await run_concurrently(*(self._send_until_acknowledged(command, value) for command, value in tools))
            self._tools_ended = max(self._tools_ended, wanted)

    async def clear(self) -> None:
        """Empty the arm's queue and let it run again. Manual 2.19.6 and 2.19.1."""
        await self._control(c.SET_QUEUED_CMD_CLEAR)
        await self._control(c.SET_QUEUED_CMD_START_EXEC)
        if self.ledger.unacked:
            # Whether the arm took them before it was cleared no longer matters, but the ledger has to be opened anew.
            self.ledger: QueueLedger = QueueLedger()

        self.space.was_cleared(self.ledger.last)
        self._relative = None

    async def pause(self) -> None:
        """Let the arm finish the command that it executes, and then wait. Manual 2.19.2."""
        await self._control(c.SET_QUEUED_CMD_STOP_EXEC, SILENCE)

    async def resume(self) -> None:
        """Let the arm go on. Manual 2.19.1."""
        await self._control(c.SET_QUEUED_CMD_START_EXEC, SILENCE)

    async def download(self, source: MotionSource, loops: int) -> None:
        """Store the commands of a source in the arm's flash as a program; see `end_download`. Manual 2.19.4."""
        await self._await_room()
        self._downloading = True
        await self._link.request(c.SET_QUEUED_CMD_START_DOWNLOAD, c.QueuedCmdStartDownload(loops, len(source)))
        while source:
            await self._reconcile(source)
            self.space.room = 1
            await self._submit_one(source)

    async def end_download(self) -> None:
        """Let the arm execute again what it is told; repeated until it has heard it. Manual 2.19.5."""
        if self._downloading:
            await self._send_until_acknowledged(c.SET_QUEUED_CMD_STOP_DOWNLOAD, None)
            self._downloading = False
            self.space.room = 0

    async def _send_until_acknowledged(self, command: Command[Q, None], value: Q) -> None:
        """Say what stops something until the arm has heard it."""
        await self._link.request(command, value, timeout=math.inf, urgent=True)

    async def _control(self, command: Command[None, None], timeout: float = math.inf) -> None:
        """Send a command that steers the queue."""
        if self._datagrams:
            await self._datagrams.before_control()

        await self._link.request(command, None, timeout=timeout, urgent=True)
        if self._datagrams:
            self._datagrams.controlled()
