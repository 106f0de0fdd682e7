"""The messages of one direction between a program and an arm on Zenoh: they are numbered, and their sender never waits.

    number (8 bytes, big-endian) | kind (1 byte): DATA, END | bytes, or why it ends

    event loop --bytes--> SendQueue --thread of its own--> Zenoh, which may let it wait

Zenoh keeps the order of what one session sends another, and loses nothing while they are connected; the numbers are
there to notice where it does.
"""

from __future__ import annotations

import asyncio
import struct
import threading
from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue

from dobot_async.transports.zenoh.config import library, reason

__all__ = ["DATA", "END", "HEADER", "VERSION", "Lost", "Numbered", "SendQueue"]

VERSION = 1
DATA, END = 0, 1
HEADER = struct.Struct("!QB")
MOST = 65_536
"""Bytes that may wait for a peer; one that leaves more unread is cut off."""
MESSAGE = 8192
"""Bytes from which on a message is long enough: what else waits goes as the next one."""
LAST_WORDS = 2.0
"""Seconds that the last messages have; a peer that is gone without a word is given up by Zenoh before that."""


class Lost(Exception):
    """Messages are missing in front of one that came."""


class Numbered:
    """Numbers the messages of one direction, or takes the numbers off again."""

    def __init__(self) -> None:
        self._next = 0

    def pack(self, data: bytes, kind: int = DATA) -> bytes:
        """Returns the next message."""
        message = HEADER.pack(self._next, kind) + data
        self._next += 1
        return message

    def unpack(self, message: bytes) -> tuple[int, bytes] | None:
        """Returns kind and bytes of a message, None if it came before; an end is an end whatever its number.

        Raises:
            Lost: Others should have come before it, or it is no message.
        """
        if len(message) < HEADER.size:
            raise Lost("what came is no message")

        number, kind = HEADER.unpack_from(message)
        if kind != END:
            if number < self._next:
                return None

            if number > self._next:
                raise Lost(f"{number - self._next} messages were lost on the way")

        self._next = number + 1
        return kind, message[HEADER.size :]


class SendQueue:
    """The way of one peer's messages out to Zenoh: in order, and nothing is lost before the end.

    What gathers while a message is on its way goes as the next one, so that a burst is a few messages. Each peer has a
    thread of its own: one that does not read holds up nobody else.

    Args:
        put: Hands a message to Zenoh, and may wait; called in the thread.
        failed: Called in the event loop, with the reason, when nothing more is sent; `end` should follow.
        name: Whose it is, for people.
    """

    def __init__(self, put: Callable[[bytes], None], failed: Callable[[str], None], name: str) -> None:
        self._put = put
        self._failed = failed
        self._loop = asyncio.get_running_loop()
        self._waiting: SimpleQueue[bytes] = SimpleQueue()
        self._taken = 0  # bytes; written by the event loop alone, as `_sent` is by the thread
        self._sent = 0
        self._full = False
        self._ended = False
        self._last_word: str | None = None
        self._done = self._loop.create_future()
        self._thread = threading.Thread(target=self._work, name=f"dobot_async send queue {name}", daemon=True)
        self._thread.start()

    def send(self, data: bytes) -> None:
        """Takes what is to be sent; after a failure, or the end, it is lost."""
        if self._full or self._ended:
            return

        self._taken += len(data)
        if self._taken - self._sent > MOST:
            self._full = True
            self._loop.call_soon(self._failed, f"it does not read: more than {MOST} bytes wait for it")
        else:
            self._waiting.put(data)

    def end(self, last_word: str | None = None) -> None:
        """Takes no more; what waits still goes, and then the last word, if there is one."""
        if not self._ended:
            self._last_word = last_word
            self._ended = True
            self._waiting.put(b"")

    async def aclose(self) -> None:
        """Ends it, and waits until all has gone; what has not within two seconds is given up."""
        self.end()
        await asyncio.wait([self._done], timeout=LAST_WORDS)
        if self._done.done():
            self._thread.join()

    def _work(self) -> None:
        """Sends, in the thread, until the end."""
        numbered = Numbered()
        broken = "the thread that sends has failed"  # unless something better is known, or nothing is wrong
        try:
            while not (self._ended and self._waiting.empty()):
                data = self._gathered()
                if data:
                    self._put(numbered.pack(data))
                    self._sent += len(data)

            if self._last_word is not None:
                self._put(numbered.pack(self._last_word.encode(), END))

            broken = ""
        except library().ZError as error:
            broken = reason(error)
        finally:
            if broken:
                self._tell(self._failed, broken)

            self._tell(self._done.set_result, None)

    def _gathered(self) -> bytes:
        """Returns what there is to send, as soon as there is something."""
        data = self._waiting.get()
        while len(data) < MESSAGE and not self._waiting.empty():
            data += self._waiting.get()

        return data

    def _tell(self, call: Callable[..., None], news: str | None) -> None:
        """Calls something in the event loop."""
        with suppress(RuntimeError):  # the loop has been closed
            self._loop.call_soon_threadsafe(call, news)
