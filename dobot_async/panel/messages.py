"""What goes to pages: JSON, the newest of each kind where only that counts, to everybody or to one.

    Hub.publish --JSON, once--> each Outlet --pump--> WebSocket
                `--> what a page that comes later is shown first

A page that does not read costs a bounded number of messages, and is then sent away.
"""

from __future__ import annotations

import asyncio
import json
import math
from collections import deque
from collections.abc import Hashable, Mapping, Sequence
from typing import Any, cast

from dobot_async._core.util.events import Events

__all__ = ["Hub", "Outlet", "as_json"]

MOST = 500  # messages that wait for one page
LOG = 50  # lines that a page that comes later is shown


def finite(value: Any) -> Any:
    """Return a value as JSON can hold it: what is not finite is null, and numbers have so many digits as count."""
    if isinstance(value, float):
        return round(value, 4) if math.isfinite(value) else None

    if isinstance(value, Mapping):
        return {name: finite(each) for name, each in cast("Mapping[str, Any]", value).items()}

    if isinstance(value, (list, tuple)):
        return [finite(each) for each in cast("Sequence[Any]", value)]

    return value


def as_json(message: Mapping[str, Any]) -> str:
    """Return a message as text."""
    return json.dumps(finite(message), separators=(",", ":"), allow_nan=False)


class Outlet:
    """What waits for one page.

    Attributes:
        closed: Nothing more is taken, and the page is to be left.
    """

    def __init__(self) -> None:
        self.closed: bool = False
        self._in_order: deque[str] = deque()
        self._newest: dict[Hashable, str] = {}
        self._news = asyncio.Event()

    def put(self, text: str, key: Hashable = None) -> None:
        """Take a message; with a key it takes the place of the one with the same key that still waits."""
        if self.closed:
            return

        if key is None:
            self._in_order.append(text)
        else:
            self._newest[key] = text

        if len(self._in_order) > MOST:
            self.close()

        self._news.set()

    def close(self) -> None:
        """Leave the page when it has what waits; at once if that is too much."""
        self.closed = True
        if len(self._in_order) > MOST:
            self._in_order.clear()
            self._newest.clear()

        self._news.set()

    async def get(self) -> str | None:
        """Return the next message, None when there will be none."""
        while not (self._in_order or self._newest):
            if self.closed:
                return None

            self._news.clear()
            await self._news.wait()

        if self._in_order:
            return self._in_order.popleft()

        return self._newest.pop(next(iter(self._newest)))


class Hub:
    """All pages that look.

    Attributes:
        watched: Set while there is one: nothing is read from an arm while there is none.
        lines: The lines of the log, for the program.
    """

    def __init__(self) -> None:
        self.watched: asyncio.Event = asyncio.Event()
        self.lines: Events[Mapping[str, Any]] = Events()
        self._outlets: set[Outlet] = set()
        self._shown: dict[Hashable, str] = {}
        self._log: deque[str] = deque(maxlen=LOG)

    def add(self, outlet: Outlet) -> None:
        """Let somebody look, beginning with what is known."""
        for key, text in self._shown.items():
            outlet.put(text, key)

        for text in self._log:
            outlet.put(text)

        self._outlets.add(outlet)
        self.watched.set()

    def remove(self, outlet: Outlet) -> None:
        """Somebody looks no more."""
        self._outlets.discard(outlet)
        if not self._outlets:
            self.watched.clear()

    def publish(self, kind: str, arm: str = "", **more: Any) -> None:
        """Tell everybody the newest of a kind; nothing is sent if it is what was told before."""
        key, message = (kind, arm), {"type": kind, **({"arm": arm} if arm else {}), **more}
        text = as_json(message)
        if self._shown.get(key) != text:
            self._shown[key] = text
            self._send(text, key)

    def stream(self, kind: str, **more: Any) -> None:
        """Tell everybody something of which each message counts, and which is not shown to who comes later."""
        self._send(as_json({"type": kind, **more}))

    def log(self, **line: Any) -> None:
        """Tell everybody a line of the log."""
        self.lines.publish(line)
        text = as_json({"type": "log", **line})
        self._log.append(text)
        self._send(text)

    def _send(self, text: str, key: Hashable = None) -> None:
        for outlet in self._outlets:
            outlet.put(text, key)
