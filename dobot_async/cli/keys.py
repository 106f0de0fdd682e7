"""The keys of a terminal, one by one, as they are pressed; and whether one is held.

    terminal --bytes--> Keys --names--> next()          "up", "pagedown", "space", "g", ...
                                 `----> released(key)   no repetition of it has come for a while

A terminal tells that a key is pressed, and repeats it while it is held; that it was released it does not tell. So a key
counts as held as long as its repetitions come, no longer than `HOLD` apart. The first repetition comes after half a
second or so on most systems: before it, a key that is held looks like one that was tapped.
"""

from __future__ import annotations

import asyncio
import os
import re
import sys
from collections import deque
from collections.abc import AsyncGenerator, Generator
from contextlib import asynccontextmanager, contextmanager, suppress
from typing import Any, NamedTuple

from dobot_async._core.util.tasks import cancel_and_join

__all__ = ["HOLD", "Key", "KeyReader", "keys_of", "until_a_key"]

HOLD = 0.15
"""Seconds: repetitions are 25 to 50 ms apart on most systems."""

SETTLES = 0.05  # seconds within which the rest of an escape sequence comes
LONGEST = 4096
NAMES = {
    "\x1b[A": "up",
    "\x1b[B": "down",
    "\x1b[C": "right",
    "\x1b[D": "left",
    "\x1b[5~": "pageup",
    "\x1b[6~": "pagedown",
    " ": "space",
    "\t": "tab",
    "\r": "enter",
    "\n": "enter",
    "\x1b": "escape",
}
SEQUENCE = re.compile(r"\x1b(?:\[[0-9;?]*[@-~]|O[@-~])|[^\x1b]|\x1b(?=\x1b)")
UNFINISHED = re.compile(r"\x1b(?:\[[0-9;?]*|O)?$")


class Key(NamedTuple):
    """A key that was pressed.

    Attributes:
        name: Which.
        time: When it was heard of, by the loop's clock.
    """

    name: str
    time: float


class KeyReader:
    """The keys of a terminal; made by `keys_of`."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._loop = asyncio.get_running_loop()
        self._waiting: deque[Key] = deque()
        self._news = asyncio.Event()
        self._text = ""
        self._timer: asyncio.TimerHandle | None = None
        self.closed: bool = False
        self._loop.add_reader(descriptor, self._readable)

    def close(self) -> None:
        """End the reading."""
        self._loop.remove_reader(self._descriptor)
        self.closed = True
        self._news.set()
        if self._timer:
            self._timer.cancel()

    async def next(self) -> Key | None:
        """Return the next key; None when the terminal is closed."""
        while not self._waiting:
            if self.closed:
                return None

            self._news.clear()
            await self._news.wait()

        return self._waiting.popleft()

    async def released(self, key: Key) -> None:
        """Return when a key is not held any more: no repetition has come in time, or another key, or the end."""
        last = key.time
        while not self.closed:
            while self._waiting and self._waiting[0].name == key.name:
                last = self._waiting.popleft().time

            left = last + HOLD - self._loop.time()
            if self._waiting or left <= 0:
                return

            self._news.clear()
            try:
                async with asyncio.timeout(left):
                    await self._news.wait()
            except TimeoutError:
                return

    def is_fresh(self, key: Key, seconds: float = HOLD) -> bool:
        """Return whether a key was pressed just now: what was typed ahead must not move an arm."""
        return self._loop.time() - key.time <= seconds

    def _readable(self) -> None:
        try:
            data = os.read(self._descriptor, LONGEST)
        except BlockingIOError:
            return
        except OSError:  # the terminal was closed
            data = b""

        if not data:
            self.close()
            return

        self._text += data.decode("utf-8", "replace")
        self._split()
        if self._timer:
            self._timer.cancel()
            self._timer = None

        if self._text:
            self._timer = self._loop.call_later(SETTLES, self._settle)

    def _split(self) -> None:
        """Take the keys from the text; what may be the beginning of one stays."""
        now, at = self._loop.time(), 0
        while at < len(self._text) and not UNFINISHED.match(self._text, at):
            found = SEQUENCE.match(self._text, at)
            written = found[0] if found else self._text[at]
            at += len(written)
            written = written.replace("\x1bO", "\x1b[")
            self._waiting.append(Key(NAMES.get(written, written), now))

        self._text = self._text[at:]
        self._news.set()

    def _settle(self) -> None:
        """What has begun like a sequence was none."""
        self._timer = None
        now = self._loop.time()
        self._waiting.extend(Key(NAMES.get(each, each), now) for each in self._text)
        self._text = ""
        self._news.set()


@contextmanager
def keys_of(stream: Any = None) -> Generator[KeyReader]:
    """Read the keys of a terminal for the length of a block, standard input's by default.

    Ctrl-C interrupts as ever. Ctrl-Z and Ctrl-S do nothing: a program that is suspended, or whose terminal stands,
    could not stop an arm.

    Raises:
        OSError: It is no terminal, or not one of POSIX.
    """
    try:
        import termios
        import tty
    except ImportError:
        raise OSError("keys need a POSIX terminal, which this system has not") from None

    descriptor = (stream or sys.stdin).fileno()
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        mode = termios.tcgetattr(descriptor)
        mode[0] &= ~(termios.IXON | termios.IXOFF)
        for name in ("VSUSP", "VDSUSP"):
            if hasattr(termios, name):
                mode[6][getattr(termios, name)] = os.fpathconf(descriptor, "PC_VDISABLE").to_bytes(1, "little")

        termios.tcsetattr(descriptor, termios.TCSANOW, mode)
        keys = KeyReader(descriptor)
        try:
            yield keys
        finally:
            keys.close()
    finally:
        with suppress(termios.error):  # it was closed
            termios.tcsetattr(descriptor, termios.TCSANOW, before)


@asynccontextmanager
async def until_a_key() -> AsyncGenerator[None]:
    """Leave the block, in good order, when a key is pressed on the terminal, if standard input is one."""
    if sys.stdin is None or not sys.stdin.isatty():
        yield
        return

    task = asyncio.current_task()
    assert task
    pressed = False

    async def wait() -> None:
        nonlocal pressed
        await keys.next()
        pressed = True
        task.cancel()

    with keys_of() as keys:
        waiting = asyncio.create_task(wait())
        try:
            yield
        except asyncio.CancelledError:
            if not pressed or task.uncancel() > 0:
                raise
        finally:
            await cancel_and_join(waiting)
