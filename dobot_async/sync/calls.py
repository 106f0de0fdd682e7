"""Calls from another thread into an event loop: each thread has a task there, and what it calls runs in that task.

    thread: Call.wait()                     the loop: Caller.serve()
        post --call_soon_threadsafe-->  next call --> await make() --> value, or error
        ^                                                                    |
        `------------------------- a lock is released <----------------------'

1. A thread is to the driver what a task is: a zone that it holds, or a program that it runs, is known by that task.
2. Who is interrupted while he waits, by Ctrl-C above all, cancels his call, and waits until it has ended.
3. If the task is cancelled from elsewhere, as a fleet does, the thread gets the CancelledError: out of the call that it
   waits for, or out of the next one. After that it may call on, to clean up.
"""

from __future__ import annotations

import asyncio
import contextvars
import logging
import sys
import threading
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any, Generic, TypeVar

__all__ = ["Call", "Caller", "Own", "in_thread"]

R = TypeVar("R")
logger: logging.Logger = logging.getLogger("dobot_async.sync")

PATIENCE = 4.0
"""Seconds that an interrupted call has to end: more than twice what a stop takes that nobody acknowledges."""

GRACE = 1.5
"""Seconds that a function in its thread has, once it is cancelled, to call something or to end."""

SLICE = 0.1 if sys.platform == "win32" else -1
"""Seconds after which who waits looks for signals, where the system does not wake him for them; -1 for never."""

own: threading.local = threading.local()
"""The `Own` of each thread."""


class Call(Generic[R]):
    """One call.

    Args:
        make: Makes what is awaited; called in the loop.

    Attributes:
        begun: Whether it runs, or has ended.
        ended: Whether it has ended.
        error: What it raised.
    """

    __slots__ = ("_done", "_interrupted", "_make", "_task", "begun", "ended", "error", "value")

    def __init__(self, make: Callable[[], Awaitable[R]]) -> None:
        self.begun: bool = False
        self.ended: bool = False
        self.error: BaseException | None = None
        self.value: R
        self._make = make
        self._task: asyncio.Task[Any] | None = None
        self._interrupted = False
        self._done = threading.Lock()
        self._done.acquire()

    def wait(self, caller: Caller) -> R:
        """Return what came of it, or raise; whatever interrupts this cancels it."""
        try:
            while not self._done.acquire(timeout=SLICE):
                pass
        except BaseException as interruption:
            caller.loop.call_soon_threadsafe(caller.cancel, self)
            if not (self.ended or self._done.acquire(timeout=PATIENCE)):
                interruption.add_note("it is not known whether the arm stands: what it was told to do has not ended")
            elif self.error:
                for note in getattr(self.error, "__notes__", ()):
                    interruption.add_note(note)

            raise

        if self.error is None:
            return self.value

        try:
            raise self.error
        finally:
            del self  # the error's traceback holds this frame

    async def run(self) -> None:
        """Do it, and tell who waits; raises CancelledError if it was cancelled by others than him."""
        self.begun = True
        self._task = asyncio.current_task()
        try:
            self.value = await self._make()
        except asyncio.CancelledError as error:
            self.error = error
            if not self._interrupted:
                raise
        except BaseException as error:  # noqa: BLE001 - KeyboardInterrupt and SystemExit are his, not the loop's
            self.error = error
        finally:
            if self._interrupted and self._task:
                self._task.uncancel()

            self._task = None
            self._end()

    def cancel(self) -> None:
        """Cancel it for who waits, in the loop."""
        if self._task:
            self._interrupted = True
            self._task.cancel()

    def refuse(self, error: BaseException) -> None:
        """End it without having begun."""
        self.begun = True
        self.error = error
        self._end()

    def _end(self) -> None:
        self.ended = True
        self._done.release()


class Caller:
    """The task of a thread, in the loop.

    Args:
        loop: The loop.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.loop = loop
        self._waiting: deque[Call[Any]] = deque()
        self._beside: set[asyncio.Task[None]] = set()
        self._news = asyncio.Event()
        self._busy = self._over = False
        self._pending_cancel: asyncio.CancelledError | None = None

    def begin(self, context: contextvars.Context) -> None:
        """Serve, in a task of its own, until `end` or the end of the loop."""
        self.loop.create_task(self._serve_alone(), name="dobot_async.sync caller", context=context)

    def post(self, call: Call[Any]) -> None:
        """Take a call, in the loop."""
        if self._over:
            call.refuse(asyncio.CancelledError())
        elif self._busy:  # who was interrupted does not wait any more for a call that does not end
            task = self.loop.create_task(call.run())
            self._beside.add(task)
            task.add_done_callback(self._beside.discard)
        else:
            self._waiting.append(call)
            self._news.set()

    def cancel(self, call: Call[Any]) -> None:
        """Cancel a call for who waits for it, in the loop."""
        if call in self._waiting:
            self._waiting.remove(call)
            call.refuse(asyncio.CancelledError())
        else:
            call.cancel()

    def end(self) -> None:
        """Take no more calls, and let `serve` return."""
        self._over = True
        self._news.set()

    async def serve(self) -> None:
        """Do what the thread calls, until `end`.

        Raises:
            CancelledError: This was cancelled from elsewhere, and the thread has made no call that could tell it.
        """
        while self._waiting or not self._over:
            if not self._waiting:
                self._news.clear()
                try:
                    await self._news.wait()
                except asyncio.CancelledError as error:
                    self._pending_cancel = error
                    self.loop.call_later(GRACE, self._give_up, error)

                continue

            call = self._waiting.popleft()
            pending, self._pending_cancel = self._pending_cancel, None
            if pending:
                call.refuse(pending)
                continue

            self._busy = True
            try:
                await call.run()
            except asyncio.CancelledError:
                logger.debug("a call was cancelled, and its thread was told")
            finally:
                self._busy = False

        if self._pending_cancel:
            raise self._pending_cancel

    async def _serve_alone(self) -> None:
        """Serve; a cancellation is the loop's end."""
        while self._waiting or not self._over:
            if not self._waiting:
                self._news.clear()
                await self._news.wait()
                continue

            self._busy = True
            try:
                await self._waiting.popleft().run()
            finally:
                self._busy = False

    def _give_up(self, error: asyncio.CancelledError) -> None:
        """A thread that was to be told of a cancellation has called nothing."""
        if self._pending_cancel is error:
            self.end()


class Own:
    """What a thread has: its Caller, which ends with the thread."""

    def __init__(self, caller: Caller) -> None:
        self.caller = caller

    def __del__(self) -> None:
        try:  # noqa: SIM105 - at the end of the interpreter there is no contextlib any more
            self.caller.loop.call_soon_threadsafe(self.caller.end)
        except RuntimeError:
            pass  # the loop has ended before


async def in_thread(function: Callable[[], R]) -> R:
    """Run a function in a thread of its own; what it calls of this package runs in the task that awaits this.

    Cancelled, its call, or its next one, raises CancelledError. If it calls nothing for `GRACE` seconds, this ends
    without it, and each later call of it raises CancelledError.
    """
    loop = asyncio.get_running_loop()
    caller = Caller(loop)
    result: list[R] = []
    failure: list[BaseException] = []

    def work() -> None:
        own.it = Own(caller)
        try:
            result.append(function())
        except BaseException as error:  # noqa: BLE001 - it is raised where it is awaited
            failure.append(error)
        finally:
            own.it = None

    thread = threading.Thread(
        target=contextvars.copy_context().run, args=(work,), name="dobot_async.sync function", daemon=True
    )
    thread.start()
    try:
        await caller.serve()
    finally:
        if not result and not failure:
            logger.warning("a function that was cancelled goes on in its thread: it can command no arm any more")
        else:
            thread.join()

    if failure:
        raise failure[0]

    return result[0]
