"""The thread in which the arms of blocking programs live, and the calls that go there and back.

    any thread                          the arms' thread, "dobot_async.sync"
    run(make) --Call--> call_soon_threadsafe --> create_task(make()) --> done
        ^                                                                  |
        `-------------------- value, or error <----------------------------'

1. There is one such thread, and one event loop in it, while something is open; the last block that is left ends it.
2. Whatever interrupts who waits, Ctrl-C above all, cancels what he waits for, which stops the arm if it moves it, and
   comes out as itself once that is over.
3. What is still open when the interpreter ends is left as by an error: its arms stop.
4. A process that was forked has no such thread: it leaves the arms of its parent alone.
"""

from __future__ import annotations

import asyncio
import atexit
import contextvars
import logging
import os
import sys
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Generic, Protocol, TypeVar

from dobot_async.sync.signals import Signals

__all__ = ["PORTAL", "Call", "Leavable", "Portal", "run"]

R = TypeVar("R")
logger = logging.getLogger("dobot_async.sync")

PATIENCE = 4.0
"""Seconds that an interrupted call has to end: more than twice what a stop takes that nobody acknowledges."""

SLICE = 0.1 if sys.platform == "win32" else -1
"""Seconds after which who waits looks for signals, where the system does not wake him for them; -1 for never."""


class Leavable(Protocol):
    """A block that is open."""

    def leave(self, error: BaseException | None) -> object:
        """End it as if it were left by an error."""

    def leave_soon(self, error: BaseException) -> None:
        """Begin to end it, without waiting."""


class Call(Generic[R]):
    """One call from another thread.

    Args:
        loop: Where it is to run.
        make: Makes what is awaited; called there.
    """

    __slots__ = ("_context", "_done", "_loop", "_make", "_task", "error", "value")

    def __init__(self, loop: asyncio.AbstractEventLoop, make: Callable[[], Awaitable[R]]) -> None:
        self.error: BaseException | None = None
        self.value: R
        self._loop = loop
        self._make = make
        self._context = contextvars.copy_context()
        self._task: asyncio.Task[None] | None = None
        self._done = threading.Lock()
        self._done.acquire()
        loop.call_soon_threadsafe(self._start)

    def wait(self) -> R:
        """Return what came of it, or raise; whatever interrupts this cancels it."""
        try:
            while not self._done.acquire(timeout=SLICE):
                pass
        except BaseException as interruption:
            self.cancel()
            if not self._done.acquire(timeout=PATIENCE):
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
            del self  # the traceback holds this frame

    def cancel(self) -> None:
        """Cancel it, from any thread; it may take a while to end."""
        self._loop.call_soon_threadsafe(self._cancel)

    def _start(self) -> None:
        self._task = self._loop.create_task(self._run(), context=self._context)
        self._task.add_done_callback(self._ended)

    def _cancel(self) -> None:
        if self._task:
            self._task.cancel()

    async def _run(self) -> None:
        try:
            self.value = await self._make()
        except BaseException as error:  # noqa: BLE001 - KeyboardInterrupt and SystemExit too are his who waits
            self.error = error

    def _ended(self, task: asyncio.Task[None]) -> None:
        if task.cancelled():  # before it began
            self.error = asyncio.CancelledError()

        self._task = None
        self._done.release()


class Portal:
    """The way into the arms' thread."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._holders = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: threading.Thread | None = None
        self._over: asyncio.Event | None = None
        self._open: dict[Leavable, int] = {}
        self._signals = Signals(self._interrupt)
        self._registered = self._forked = False

    def run(self, make: Callable[[], Awaitable[R]]) -> R:
        """Await something in the arms' thread, and return what it returns.

        Args:
            make: Called there; returns what is to be awaited.

        Raises:
            RuntimeError: This is that thread itself, as in a hook; or this process was forked from the arms'.
            BaseException: What it raises; or what interrupted the waiting, when it has ended.
        """
        loop = self._loop
        if loop is None:
            with self.held():
                return self.run(make)

        if self._thread is threading.current_thread():
            raise RuntimeError("a hook, or whatever else runs in the arms' thread, must not wait for an arm")

        return Call(loop, make).wait()

    def look(self, function: Callable[[], R]) -> R:
        """Call a function in the arms' thread, and return what it returns; raises as `run`."""

        async def called() -> R:
            return function()

        return self.run(called)

    def begin(self, make: Callable[[], Awaitable[object]]) -> None:
        """Begin something in the arms' thread, for nobody who waits; may be called by a signal's handler."""
        if self._loop:
            Call(self._loop, make)

    @contextmanager
    def held(self) -> Iterator[None]:
        """While this is entered, there is a thread."""
        self.hold()
        try:
            yield
        finally:
            self.release()

    def hold(self) -> None:
        """Have the thread until `release`."""
        with self._lock:
            if self._holders == 0:
                if self._forked:
                    self._forked = False

                self._start()

            self._holders += 1

    def release(self) -> None:
        """Need the thread no more; the last one ends it."""
        with self._lock:
            self._holders -= 1
            if self._holders == 0:
                self._stop()

    def opened(self, block: Leavable) -> None:
        """Note a block that is open."""
        self._open[block] = threading.get_ident()

    def closed(self, block: Leavable) -> None:
        """Note that it is not any more."""
        self._open.pop(block, None)

    def leave_all(self) -> None:
        """Leave what is still open, as by an error; for the end of the interpreter."""
        for block in reversed(list(self._open)):
            logger.warning("%s was still open at the end of the program: its arms are stopped", block)
            try:
                block.leave(SystemExit("the program has ended"))
            except BaseException as error:  # noqa: BLE001 - the others are to be left, too
                if not isinstance(error, SystemExit):
                    logger.warning("%s could not be left: %s", block, error)

    def _start(self) -> None:
        """Start the thread, and return when its loop runs."""
        running = threading.Event()

        async def serve() -> None:
            self._over = asyncio.Event()
            self._loop = asyncio.get_running_loop()
            running.set()
            await self._over.wait()

        if not self._registered:
            self._registered = True
            atexit.register(self.leave_all)
            if hasattr(os, "register_at_fork"):
                os.register_at_fork(after_in_child=self._forget)

        self._thread = threading.Thread(target=asyncio.run, args=(serve(),), name="dobot_async.sync", daemon=True)
        self._thread.start()
        running.wait()
        self._signals.install()

    def _stop(self) -> None:
        """End the thread, and what is left in its loop, and join it."""
        loop, thread, over = self._loop, self._thread, self._over
        assert loop
        assert thread
        assert over
        self._signals.restore()
        self._loop = self._thread = self._over = None
        loop.call_soon_threadsafe(over.set)
        if thread is not threading.current_thread():
            thread.join()

    def _forget(self) -> None:
        """This process was forked: what is open belongs to its parent, and the thread is not here."""
        self._lock = threading.RLock()
        self._forked = self._forked or self._holders > 0
        self._holders = 0
        self._loop = self._thread = self._over = None
        self._open = {}

    def _interrupt(self, error: BaseException) -> None:
        """A signal ends the program: what other threads than this have open begins to be left."""
        for block, thread in list(self._open.items()):
            if thread != threading.get_ident():
                block.leave_soon(error)


PORTAL: Portal = Portal()
"""The one of this process: arms, simulated arms and fleets that belong together have to be in one loop."""


def run(make: Callable[[], Awaitable[R]]) -> R:
    """Await something in the thread in which the arms live, and return what it returns.

    For what has no blocking twin: `run(lambda: pick(arm.asynchronous, (220, 0, 10)))`.

    Args:
        make: Called there; returns what is to be awaited.

    Raises:
        RuntimeError: This is that thread itself, as in a hook; or this process was forked from the one of the arms.
        BaseException: What it raises; or what interrupted the waiting, such as KeyboardInterrupt, when it has ended.
    """
    return PORTAL.run(make)
