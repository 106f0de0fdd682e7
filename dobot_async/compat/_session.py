"""One arm of an old program: calls from any thread, and an end that fits how the program ends.

close()                        waits for what was queued, raises what failed, leaves the arm
close() in except or finally   an error is being handled: the arm stops
Ctrl-C in a call               the arm stops, KeyboardInterrupt comes out
the program ends, not closed   as close(); after an error that nobody caught the arm stops
"""

from __future__ import annotations

import atexit
import logging
import sys
import threading
from collections.abc import Awaitable, Callable, Generator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar, overload

from dobot_async import sync
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.compat._commands import Commands
from dobot_async.compat._ports import url_of
from dobot_async.compat._signals import StopSignals
from dobot_async.errors import ConnectionLost, DobotError
from dobot_async.sync.portal import PORTAL

__all__ = ["CompatSession"]

Q = TypeVar("Q")
R = TypeVar("R")
logger = logging.getLogger("dobot_async.compat")
STOP = 2.0  # seconds that a stop after Ctrl-C may take


class CompatSession:
    """A connection, as the old names use it.

    Attributes:
        url: Where the arm is.
        arm: The arm of `dobot_async.sync`, for what the old names do not have.

    Args:
        port: A port's name, an address or a URL; nothing for the first arm that there is.

    Raises:
        ConnectFailed: No arm answered.
    """

    def __init__(self, port: str | None = None) -> None:
        self.url: str = url_of(port)
        self._block = sync.Magician.connect(self.url)
        SIGNALS.install()  # first, so that sync leaves them to this
        try:
            self.arm: sync.Magician = self._block.__enter__()
        except BaseException:
            handle_signals_while_open()
            raise

        self._commands = Commands(self.arm.asynchronous)
        self._open = True
        self._lock = threading.Lock()
        OPEN.add(self)
        watch_the_end()

    @property
    def is_open(self) -> bool:
        """Whether it was not closed yet."""
        return self._open

    def waiting(self) -> int:
        """Return how many commands are not known to be executed."""
        return self.call(self._commands.waiting, quiet=True)

    @overload
    def read(self, row: Command[None, R]) -> R: ...

    @overload
    def read(self, row: Command[Q, R], value: Q) -> R: ...

    def read(self, row: Command[Any, R], value: Any = None) -> R:
        """Ask the arm."""
        return self.call(lambda: self._commands.read(row, value))

    def input(self, address: int) -> int:
        """Return the level of a digital input; raise ValueError if the pin is not configured as one."""
        return int(self.call(lambda: self.arm.asynchronous.get_input(address)))

    def analog(self, address: int) -> int:
        """Return an analog input; raise ValueError if the pin is not configured as one."""
        return self.call(lambda: self.arm.asynchronous.get_adc(address))

    def write(self, row: Command[Q, Any], value: Q) -> int:
        """Tell the arm something that it does at once; return 0."""
        return self.call(lambda: self._commands.write(row, value))

    def put(self, row: Command[Q, Any], value: Q) -> int:
        """Queue a command; return its index once the arm has accepted it."""
        return self.call(lambda: self._commands.put(row, value))

    def run(self, row: Command[Q, Any], value: Q) -> int:
        """Queue a command; return its index once the arm has executed it."""
        return self.call(lambda: self._commands.run(row, value))

    def wait_for(self, index: int) -> None:
        """Return when the command of an index has been executed."""
        self.call(lambda: self._commands.wait_for(index))

    def current_index(self) -> int:
        """Return the index up to which everything is executed."""
        return self.call(self._commands.current_index)

    def start(self) -> None:
        """Let the queue run."""
        self.call(self._commands.start)

    def halt(self) -> None:
        """Let the queue not run any further."""
        self.call(self._commands.halt)

    def clear(self) -> None:
        """Empty the queue."""
        self.call(self._commands.clear)

    def stop(self) -> None:
        """Stop the arm now; see `Commands.stop`."""
        self.call(self._commands.stop, quiet=True)

    def jog(self, *, joint: bool, key: c.JOGKey) -> None:
        """Begin a jog, or end it with the idle key."""
        ends = key is c.JOGKey.IDLE
        self.call(lambda: self._commands.jog(c.JOGCmd(joint, key)), quiet=ends)

    def alarms(self) -> bytes:
        """Return the arm's 16 bytes of alarms."""
        return self.call(self._commands.alarms, quiet=True)

    def clear_alarms(self) -> None:
        """Clear the alarms; raise a failure that nobody was told of yet."""
        self.call(self._commands.clear_alarms, quiet=True)
        self.call(nothing)

    def home(self) -> None:
        """Home the arm, from an alarm as well; return when it is there."""
        self.call(self._commands.home)

    def call(self, make: Callable[[], Awaitable[R]], *, quiet: bool = False) -> R:
        """Run something in the arms' thread; return what it returns.

        Args:
            make: Makes what is awaited.
            quiet: Raise no failure of what was queued before.

        Raises:
            ConnectionLost: It was closed.
            DobotError: What was queued before has failed, or this has.
        """
        if not self._open:
            raise ConnectionLost(f"{self.url} was closed by this program")

        thread = threading.get_ident()

        async def told() -> R:
            if not quiet:
                self._commands.tell(thread)

            try:
                return await make()
            except DobotError:
                self._commands.mark_told(thread)
                raise

        try:
            return sync.run(told)
        except Exception:
            raise
        except BaseException:  # what else interrupts a call: a program that catches it must not go on with a moving arm
            with suppress(DobotError):
                self.arm.stop(timeout=STOP)

            raise

    def close(self) -> None:
        """Wait for what was queued, and leave the arm; while an error is being handled, stop it instead.

        Raises:
            DobotError: What was queued has failed.
        """
        self._close(sys.exc_info()[1])

    def leave(self, error: BaseException | None) -> None:
        """Close it, as `close` does; after an error stop the arm instead."""
        self._close(error)

    @contextmanager
    def opening(self) -> Generator[None]:
        """Leave the arm if what is done in this block fails."""
        try:
            yield
        except BaseException as error:
            self._close(error)
            raise

    def _close(self, error: BaseException | None) -> None:
        """Wait for what was queued unless there is an error, and leave the arm."""
        if not self._open:
            return

        try:
            if error is None:
                self.call(self._commands.finish)
                if left := self.waiting():
                    logger.warning("%s: %d commands are left in a queue that was told not to run", self.url, left)
        except BaseException as failure:
            error = failure
            raise
        finally:
            self._leave(error)

    def _leave(self, error: BaseException | None) -> None:
        """End the connection, unless somebody else does; after an error the arm is stopped."""
        with self._lock:
            left, self._open = not self._open, False

        if left:
            return

        OPEN.discard(self)
        try:
            if error is None:
                self._block.__exit__(None, None, None)
            else:
                self._block.__exit__(type(error), error, error.__traceback__)
        finally:
            handle_signals_while_open()

    def begin_stop(self) -> None:
        """Begin to stop the arm, without waiting; for a signal's handler."""
        PORTAL.begin(self._commands.interrupt)


OPEN: set[CompatSession] = set()
"""What was not closed yet."""


def stop_all() -> None:
    """Begin to stop all arms."""
    for session in list(OPEN):
        session.begin_stop()


SIGNALS = StopSignals(stop_all)


def handle_signals_while_open() -> None:
    """Leave the signals to the system when no arm is connected any more."""
    if not OPEN:
        SIGNALS.restore()


class ExitWatch:
    """Whether the end of the program is watched; see `watch_the_end`."""

    begun = False


def watch_the_end() -> None:
    """Have what is open closed when the program ends.

    Called after a connection is made, so that this comes before the connections' own end. Python waits for threads
    before that: where the main thread ended by an error, their arms stop first.
    """
    if not ExitWatch.begun:
        ExitWatch.begun = True
        atexit.register(end)
        before_threads = getattr(threading, "_register_atexit", None)  # what concurrent.futures uses
        if before_threads:
            before_threads(end, only_by_error=True)


def end(*, only_by_error: bool = False) -> None:
    """The program ends: stop the arms if that was by an error that nobody caught, else wait for what they do."""
    error = getattr(sys, "last_value", None)
    if only_by_error and error is None:
        return

    for session in list(OPEN):
        try:
            session.leave(error)
        except DobotError as failure:
            logger.error("%s: %s", session.url, failure)  # noqa: TRY400 - its traceback is that of the program's end


async def nothing() -> None:
    """What is called to hear of failures alone."""
