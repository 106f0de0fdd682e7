"""One publisher, any number of readers, nobody held up: `async for event in events`.

Each reader sees what is published after it began to listen. A reader that falls behind loses the oldest events,
never the newest, so that memory is bounded; its `missed` counts them.
"""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Generic, Self, TypeVar
from weakref import WeakSet

__all__ = ["Events", "Listener", "Watched"]

T = TypeVar("T")
BACKLOG = 256


class Events(Generic[T]):
    """Where events are published; iterating listens from now on."""

    def __init__(self) -> None:
        self._listeners: WeakSet[Listener[T]] = WeakSet()
        self._closed = False

    def publish(self, event: T) -> None:
        """Hands an event to everybody who listens; never waits."""
        for listener in self._listeners:
            listener.put(event)

    def close(self) -> None:
        """Ends every reader's loop once it has read what was published."""
        self._closed = True
        for listener in self._listeners:
            listener.close()

    def add(self, listener: Listener[T]) -> None:
        """Lets somebody listen from now on, for as long as he is held by somebody else."""
        self._listeners.add(listener)

    def __aiter__(self) -> Listener[T]:
        listener: Listener[T] = Listener(closed=self._closed)
        self.add(listener)
        return listener


class Listener(Generic[T]):
    """One reader of events.

    Attributes:
        missed: How many events were dropped because this reader was too slow.
    """

    def __init__(self, *, closed: bool) -> None:
        self.missed: int = 0
        self._closed = closed
        self._backlog: deque[T] = deque()
        self._news = asyncio.Event()

    def put(self, event: T) -> None:
        """Adds an event, and drops the oldest one from a full backlog."""
        if len(self._backlog) == BACKLOG:
            self._backlog.popleft()
            self.missed += 1

        self._backlog.append(event)
        self._news.set()

    def close(self) -> None:
        """Lets the reader end."""
        self._closed = True
        self._news.set()

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> T:
        while not self._backlog:
            if self._closed:
                raise StopAsyncIteration

            self._news.clear()
            await self._news.wait()

        return self._backlog.popleft()


class Watched(Generic[T]):
    """A value that changes; iterating yields each new value from now on.

    Attributes:
        value: What it is now.
    """

    def __init__(self, value: T) -> None:
        self.value: T = value
        self._changes: Events[T] = Events()

    def change(self, value: T) -> None:
        """Sets another value and tells everybody who listens."""
        if value != self.value:
            self.value = value
            self._changes.publish(value)

    def add(self, listener: Listener[T]) -> None:
        """Lets somebody listen from now on, for as long as he is held by somebody else."""
        self._changes.add(listener)

    def close(self) -> None:
        """Ends every reader's loop once it has read the last change."""
        self._changes.close()

    def __aiter__(self) -> Listener[T]:
        return self._changes.__aiter__()

    def __repr__(self) -> str:
        return f"<Watched: {self.value}>"
