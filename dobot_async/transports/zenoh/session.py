"""What both ends of an arm on Zenoh share: keys, the session, and the way from Zenoh's threads.

    dobot/NAME/@arm/MODEL/ID     liveliness: the arm is served by this session
    dobot/NAME/@link/ID          liveliness: a client; a query of this key asks to be let in
    dobot/NAME/@link/ID/up       what the client sends; see `zenoh_messages`
    dobot/NAME/@link/ID/down     what the arm answers
    dobot/NAME/pose, ...         readings in JSON, for anybody

A chunk that begins with @ is matched by no wildcard, so `dobot/**` is the readings alone.
"""

from __future__ import annotations

import asyncio
import threading
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from dobot_async._core.util.tasks import run_shielded, run_within
from dobot_async.errors import ConnectFailed
from dobot_async.transports.zenoh.config import ZenohConfig, library, reason
from dobot_async.transports.zenoh.typed import publishing

if TYPE_CHECKING:
    import zenoh

__all__ = ["VERSION", "KeyExpressions", "LoopBridge", "ZenohSession"]

T = TypeVar("T")
ROOT = "dobot"
VERSION = 1
ALL_ANSWER = 1.0  # seconds
CLOSED = 3.0  # seconds; Zenoh may take longer, by itself, to give up somebody who does not read
MOST = 65_536
"""Bytes that may be on their way from Zenoh's threads to the event loop; a peer that sends more is a flood."""


class KeyExpressions:
    """The keys of one arm."""

    def __init__(self, name: str) -> None:
        self.arm: str = f"{ROOT}/{name}/@arm"
        self.link: str = f"{ROOT}/{name}/@link"
        self._name = name

    def reading(self, topic: str) -> str:
        """Where a reading is published."""
        return f"{ROOT}/{self._name}/{topic}"


class ZenohSession:
    """A session of Zenoh's. It is opened and closed in threads, for that takes a while.

    Attributes:
        crossing: The way of what it hears into the event loop.
    """

    def __init__(self, place: ZenohConfig, *, serving: bool = False) -> None:
        self.crossing: LoopBridge = LoopBridge()
        self._place = place
        self._serving = serving
        self._zenoh: zenoh.Session | None = None

    @property
    def raw(self) -> zenoh.Session:
        """The session itself, from `open` on."""
        assert self._zenoh
        return self._zenoh

    @property
    def id(self) -> str:
        """What tells it from all others."""
        return str(self.raw.zid())

    async def open(self, begin: Callable[[zenoh.Session], None]) -> None:
        """Opens it, and calls `begin` with it, in a thread. After an error, too, it has to be closed.

        Raises:
            ValueError: The configuration is no good.
            ConnectFailed: Zenoh could not be started with it.
        """
        zenoh = library()
        config = self._place.configuration(serving=self._serving)

        def start() -> None:
            self._zenoh = session = zenoh.open(config)
            begin(session)

        try:
            await run_shielded(asyncio.to_thread(start))
        except zenoh.ZError as error:
            raise ConnectFailed(f"Zenoh cannot be started: {reason(error)}") from None

    def way(self, key: str, *, waits: bool) -> Callable[[bytes], None]:
        """Returns what hands messages to Zenoh, from any thread: reliably, ahead of all else.

        If Zenoh's queue is full it waits, or drops them. It raises ZError when the session is closed.
        """
        zenoh = library()
        control = zenoh.CongestionControl.BLOCK if waits else zenoh.CongestionControl.DROP
        put = publishing(self.raw).put
        return partial(put, key, congestion_control=control, priority=zenoh.Priority.REAL_TIME, express=True)

    async def tokens(self, key: str) -> list[str]:
        """Returns the keys of the liveliness tokens that match a key, as far as everybody answers in time."""
        told: asyncio.Queue[str | None] = asyncio.Queue()
        each = self.crossing.to(told.put_nowait, lambda reply: str(reply.ok.key_expr) if reply.ok else "")
        last = self.crossing.to(told.put_nowait, lambda _: None)
        handler = library().handlers.Callback(each.callback, lambda: last.callback(None), indirect=False)
        self.raw.liveliness().get(key, handler, timeout=ALL_ANSWER)
        found: list[str] = []
        while (token := await told.get()) is not None:
            found.append(token)

        return [token for token in found if token]

    async def aclose(self) -> None:
        """Closes it, as far as it is open, and with it takes back its tokens; may be called again."""
        self.crossing.close()
        session, self._zenoh = self._zenoh, None
        if session:
            with suppress(TimeoutError, library().ZError):
                await run_shielded(run_within(CLOSED, asyncio.to_thread(publishing(session).close)))


class LoopBridge:
    """The way from Zenoh's threads into the event loop: in order, and never in Zenoh's way.

    What one sender has under way above a bound is dropped; who counts messages notices.
    """

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        self._under_way: Counter[str] = Counter()
        self._closed = False

    def close(self) -> None:
        """Lets nothing arrive any more."""
        self._closed = True

    def to(
        self,
        take: Callable[[T], None],
        read: Callable[[Any], T],
        weigh: Callable[[T], tuple[str, int]] = lambda _: ("", 1),
    ) -> Any:
        """Returns a handler for Zenoh that reads what it is called with, and has the event loop take that.

        `weigh` tells the sender of what was read, and how much of the bound it takes.
        """

        def called(item: Any) -> None:
            if self._closed:
                return

            value = read(item)
            sender, weight = weigh(value)
            with self._lock:
                if self._under_way[sender] + weight > MOST:
                    return

                self._under_way[sender] += weight

            with suppress(RuntimeError):  # the loop has been closed
                self._loop.call_soon_threadsafe(arrived, value, sender, weight)

        def arrived(value: T, sender: str, weight: int) -> None:
            with self._lock:
                self._under_way[sender] -= weight
                if not self._under_way[sender]:
                    del self._under_way[sender]

            if not self._closed:
                take(value)

        return library().handlers.Callback(called, indirect=False)
