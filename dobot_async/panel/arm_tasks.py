"""The tasks of one arm of a panel: each command is a task, so that ending the task ends the motion.

    ArmTasks.start --> ArmTask --> the driver's verb, which stops the arm if it is cancelled
    ArmTasks.end   --> all of them cancelled and joined: the arm was told to stop before this returns

The driver's queue keeps the order in which they began. An exclusive task (a jog, a following, a drawing, a playback)
begins only when no other one runs, and only tasks marked `beside` begin while it runs.
"""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.panel.problems import PanelRefusal

__all__ = ["ArmTask", "ArmTasks"]

MOST = 64
numbers: itertools.count[int] = itertools.count(1)


@dataclass(eq=False)
class ArmTask:
    """One thing that goes on.

    Attributes:
        text: What it is, for people.
        by: Who has begun it.
        alone: It has the arm for itself.
        beside: It may go on beside what has the arm for itself.
        progress: How much of it is done, 0 to 1; None where nothing tells.
        seconds_left: How long it will still take; None where nothing tells.
        number: Its own.
    """

    text: str
    by: str
    alone: bool = False
    beside: bool = False
    progress: float | None = None
    seconds_left: float | None = None
    number: int = field(default_factory=lambda: next(numbers))
    task: asyncio.Task[Any] | None = None


class ArmTasks:
    """All that goes on at one arm.

    Args:
        changed: Called when one begins, ends or gets on.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._going: dict[int, ArmTask] = {}

    def __len__(self) -> int:
        return len(self._going)

    @property
    def alone(self) -> asyncio.Task[Any] | None:
        """What has the arm for itself, None if nothing does."""
        return next((work.task for work in self._going.values() if work.alone), None)

    def told(self) -> list[dict[str, Any]]:
        """Return them as a page is told of them."""
        found: list[dict[str, Any]] = []
        for work in self._going.values():
            waits = bool(found) and not work.beside and not work.alone
            found.append(
                {
                    "id": work.number,
                    "text": work.text,
                    "by": work.by,
                    "state": "waiting" if waits else "running",
                    "progress": work.progress,
                    "seconds_left": work.seconds_left,
                }
            )

        return found

    def check_room(self, work: ArmTask) -> None:
        """Raise Refusal if it cannot begin now."""
        if len(self._going) >= MOST:
            raise PanelRefusal("busy", f"{MOST} commands are under way: wait, or stop the arm")

        if work.beside:
            return

        other = next((each for each in self._going.values() if each.alone or (work.alone and not each.beside)), None)
        if other:
            raise PanelRefusal("busy", f"{other.text} is under way: wait until it is done, or stop the arm")

    def start(self, work: ArmTask, doing: Coroutine[Any, Any, Any]) -> asyncio.Task[Any]:
        """Begin something; raise Refusal, and do nothing, if it cannot begin now."""
        try:
            self.check_room(work)
        except PanelRefusal:
            doing.close()
            raise

        self._going[work.number] = work
        work.task = asyncio.create_task(doing, name=f"dobot_async panel {work.text}")
        work.task.add_done_callback(partial(self._done, work))
        self._changed()
        return work.task

    def get_on(self, work: ArmTask, progress: float | None, seconds_left: float | None = None) -> None:
        """Take note of how far something is."""
        work.progress, work.seconds_left = progress, seconds_left
        self._changed()

    def begin_to_end(self) -> None:
        """Cancel all of them, now; `end` waits for them."""
        for work in self._going.values():
            if work.task:
                work.task.cancel()

    async def end(self) -> None:
        """Cancel all of them, and return when they have ended: each has told the arm to stop."""
        tasks = [work.task for work in self._going.values() if work.task]
        await asyncio.gather(*map(cancel_and_join, tasks))

    def _done(self, work: ArmTask, task: asyncio.Task[Any]) -> None:
        if not task.cancelled():
            task.exception()  # who waits for it hears of it, and that may be nobody any more

        self._going.pop(work.number, None)
        self._changed()
