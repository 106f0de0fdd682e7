"""The running actions of a site: one at a time for each arm; an action ends when its caller goes.

do --> busy? refused --> task --> done, or what went wrong
|                 `-- cancelled, or its caller is gone: the arm is stopped before this returns
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.errors import CommandRejected, DobotError, MotionStopped
from dobot_async.remote.actions import Action
from dobot_async.remote.site import RemoteArm, Site

__all__ = ["Busy", "Tell", "Works"]

logger: logging.Logger = logging.getLogger("dobot_async.remote")
BEAT = 0.5
"""Seconds between two reports of progress."""

Tell = Callable[[float, str], Awaitable[None]]
"""Called with the seconds since the beginning, and with what is being done."""


class Busy(CommandRejected):
    """The arm does something for somebody else."""


async def tell_nobody(_seconds: float, _words: str) -> None:
    """Tell nobody."""


class Works:
    """What goes on with the arms of a site.

    Attributes:
        site: The arms.
    """

    def __init__(self, site: Site) -> None:
        self.site = site
        self._going_on: dict[str, tuple[str, asyncio.Task[dict[str, Any]]]] = {}
        self._closed = False

    def doing(self, name: str) -> str | None:
        """Return what is being done with an arm, None for nothing."""
        found = self._going_on.get(name)
        return found[0] if found else None

    async def do(
        self, on: RemoteArm, action: Action, *, tell: Tell = tell_nobody, gone: asyncio.Event | None = None
    ) -> dict[str, Any]:
        """Do something with an arm, and return what is to be said of it when the arm has done it.

        Cancelled, or when its caller is gone, the arm is stopped before this returns.

        Args:
            on: The arm.
            action: What is to be done.
            tell: Called now and then while it goes on.
            gone: Set when who asked for it has gone.

        Raises:
            ValueError: It cannot be done, or may not; nothing was sent.
            Busy: The arm does something else.
            MotionStopped: The caller is gone, or the arm was stopped.
            DobotError: As the verbs of the arm.
        """
        if not self.site.moves:
            raise CommandRejected("the arms are only looked at here: it was started without --allow-motion")

        action.check(on)
        if self._closed or (gone and gone.is_set()):
            raise MotionStopped("nobody waits for it any more; nothing was sent")

        if found := self.doing(on.name):
            raise Busy(f"{on.name} is busy ({found}): wait for it, or stop it")

        words = [action.do]
        task = asyncio.create_task(self._done(on, action, words), name=f"dobot_async {action.do} of {on.name}")
        self._going_on[on.name] = action.do, task
        try:
            return await self._followed(task, words, tell, gone)
        finally:
            try:
                if not task.done():
                    await cancel_and_join(task)
            finally:
                del self._going_on[on.name]

    async def stop(self, on: RemoteArm) -> None:
        """Stop an arm now, and end what is being done with it.

        Raises:
            DobotError: The arm has not acknowledged it yet; it is told again until it does.
        """
        try:
            await on.arm.stop()
        finally:
            if found := self._going_on.get(on.name):
                found[1].cancel()

    def close(self) -> None:
        """End everything that goes on, and begin nothing more; who waits for it sees to it that the arms stop."""
        self._closed = True
        for _, task in self._going_on.values():
            task.cancel()

    async def _done(self, on: RemoteArm, action: Action, words: list[str]) -> dict[str, Any]:
        """Do it; note in `words` how far it is."""

        def note(text: str) -> None:
            words[0] = text

        try:
            return await action.run(on, note)
        except DobotError as error:
            logger.info("%s of %s: %s", action.do, on.name, error)
            raise

    async def _followed(
        self, task: asyncio.Task[dict[str, Any]], words: list[str], tell: Tell, gone: asyncio.Event | None
    ) -> dict[str, Any]:
        """Wait for it, and tell now and then how far it is, until its caller is gone."""
        begun, now = asyncio.get_running_loop().time(), asyncio.get_running_loop().time
        leaving = asyncio.create_task(gone.wait(), name="dobot_async caller") if gone else None
        waited: set[asyncio.Task[Any]] = {task, leaving} if leaving else {task}
        try:
            while not task.done():
                await asyncio.wait(waited, timeout=BEAT, return_when=asyncio.FIRST_COMPLETED)
                if leaving and leaving.done() and not task.done():
                    await cancel_and_join(task)
                    break

                if not task.done():
                    with suppress(TimeoutError):  # who reads slowly holds up nothing
                        async with asyncio.timeout(BEAT):
                            await tell(now() - begun, words[0])
        finally:
            if leaving:
                await cancel_and_join(leaving)

        if task.cancelled():
            raise MotionStopped("it was stopped, or whoever asked for it is gone")

        return task.result()
