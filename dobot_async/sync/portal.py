"""The thread in which the arms of blocking programs live, and the way into it.

1. There is one such thread, and one event loop in it, while something is open or called; the last one ends it.
2. What is still open when the interpreter ends is left as by an error: its arms stop.
3. A process that was forked has no such thread: it leaves the arms of its parent alone.
"""

from __future__ import annotations

import asyncio
import atexit
import contextvars
import logging
import os
import threading
from collections.abc import Awaitable, Callable, Generator
from contextlib import contextmanager
from typing import Protocol, TypeVar

from dobot_async.sync.calls import Call, Caller, Own, own
from dobot_async.sync.signals import Signals

__all__ = ["PORTAL", "Leavable", "Portal", "run"]

R = TypeVar("R")
logger: logging.Logger = logging.getLogger("dobot_async.sync")
LEAVING = 4.0  # seconds that the thread has to end at the end of the interpreter


class Leavable(Protocol):
    """A block that is open."""

    def leave(self, error: BaseException | None) -> object:
        """End it as if it were left by an error."""

    def leave_soon(self, error: BaseException) -> None:
        """Begin to end it, without waiting."""


class Portal:
    """The way into the arms' thread."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._holders = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._over: asyncio.Event | None = None
        self._thread: threading.Thread | None = None
        self._open: dict[Leavable, int] = {}
        self._begun: set[asyncio.Task[None]] = set()
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
        if self._thread is threading.current_thread():
            raise RuntimeError("a hook, or whatever else runs in the arms' thread, must not wait for an arm")

        if self._forked:
            raise RuntimeError("this process was forked from the one that the arms belong to: connect in this one")

        with self.held():
            assert self._loop
            caller, call = self._caller(self._loop), Call(make)
            self._loop.call_soon_threadsafe(caller.post, call)
            return call.wait(caller)

    def look(self, function: Callable[[], R]) -> R:
        """Call a function in the arms' thread, and return what it returns; raises as `run`."""

        async def called() -> R:
            return function()

        return self.run(called)

    def begin(self, make: Callable[[], Awaitable[object]]) -> None:
        """Begin something in the arms' thread, for nobody who waits; a signal's handler may call this."""
        loop = self._loop
        if loop:
            loop.call_soon_threadsafe(self._begin, loop, make)

    @contextmanager
    def held(self) -> Generator[None, None, None]:
        """While this is entered, there is a thread."""
        self.hold()
        try:
            yield
        finally:
            self.release()

    def hold(self) -> None:
        """Have the thread until `release`."""
        with self._lock:
            self._holders += 1
            try:
                if self._thread is None:
                    self._start()
            except BaseException:
                self.release()
                raise

    def release(self) -> None:
        """Need the thread no more; the last one ends it."""
        with self._lock:
            self._holders -= 1
            if self._holders == 0:
                self._stop()

    def opened(self, block: Leavable) -> None:
        """Note a block that is open."""
        self._forked = False  # what this process has opened itself, it may use
        self._open[block] = threading.get_ident()

    def closed(self, block: Leavable) -> None:
        """Note that it is not any more."""
        self._open.pop(block, None)

    def leave_all(self) -> None:
        """Leave what is still open, as by an error, and end the thread; for the end of the interpreter."""
        for block in reversed(list(self._open)):
            logger.warning("%s was still open at the end of the program: its arms are stopped", block)
            try:
                block.leave(SystemExit("the program has ended"))
            except BaseException as error:  # noqa: BLE001 - the others are to be left, too
                logger.warning("%s could not be left: %r", block, error)

        with self._lock:
            if self._thread:
                self._stop()

    def _caller(self, loop: asyncio.AbstractEventLoop) -> Caller:
        """What serves this thread."""
        mine: Own | None = getattr(own, "it", None)
        if mine is None or mine.caller.loop is not loop:
            own.it = mine = Own(Caller(loop))
            loop.call_soon_threadsafe(mine.caller.begin, contextvars.copy_context())

        return mine.caller

    def _begin(self, loop: asyncio.AbstractEventLoop, make: Callable[[], Awaitable[object]]) -> None:
        task = loop.create_task(Call(make).run())
        self._begun.add(task)
        task.add_done_callback(self._begun.discard)

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
        self._loop = self._thread = self._over = None
        self._signals.restore()
        if loop and over:
            loop.call_soon_threadsafe(over.set)

        if thread and thread is not threading.current_thread():
            thread.join(LEAVING)

    def _forget(self) -> None:
        """This process was forked: what is open belongs to its parent, and the thread is not here."""
        self._lock = threading.RLock()
        self._forked = self._forked or self._holders > 0
        self._holders = 0
        self._loop = self._thread = self._over = None
        self._open = {}
        own.it = None

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
