"""What a bad line does to messages, from one seed: lose, corrupt, double, delay, reorder, split, noise before them."""

from __future__ import annotations

import asyncio
import heapq
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from random import Random

__all__ = ["Channel", "Faults"]


@dataclass(slots=True)
class Faults:
    """What happens to each message, in each direction; may be changed while the simulation runs.

    Attributes:
        loss: Probability that it is lost.
        corrupt: Probability that one of its bytes is changed.
        dup: Probability that it arrives twice.
        split: Probability that it arrives in two parts.
        noise: Probability that junk comes before it.
        latency: Seconds that it takes.
        jitter: Seconds that it may take on top, at random; messages may overtake each other on a datagram line.
        stalled: Nothing arrives at all while this is true.
    """

    loss: float = 0.0
    corrupt: float = 0.0
    dup: float = 0.0
    split: float = 0.0
    noise: float = 0.0
    latency: float = 0.0
    jitter: float = 0.0
    stalled: bool = False

    def __post_init__(self) -> None:
        for name in ("loss", "corrupt", "dup", "split", "noise"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name} is a probability, 0 to 1, not {getattr(self, name)!r}")

        for name in ("latency", "jitter"):
            if not 0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} is finite seconds, not negative, not {getattr(self, name)!r}")

    @property
    def any(self) -> bool:
        """Whether anything can happen to a message."""
        return any(getattr(self, field.name) for field in fields(self))

    def apply(self, data: bytes, random: Random) -> Iterator[tuple[float, bytes]]:
        """Yields what arrives of one message: seconds on the way, and the bytes."""
        if self.stalled or random.random() < self.loss:
            return

        for _ in range(1 + (random.random() < self.dup)):
            piece = bytearray(data)
            if random.random() < self.corrupt:
                piece[random.randrange(len(piece))] ^= random.randint(1, 255)

            if random.random() < self.noise:
                piece[:0] = random.randbytes(random.randint(1, 8))

            delay = self.latency + self.jitter * random.random()
            cut = random.randrange(1, len(piece)) if len(piece) > 1 and random.random() < self.split else len(piece)
            yield delay, bytes(piece[:cut])
            if cut < len(piece):
                yield delay, bytes(piece[cut:])


class Channel:
    """One direction of a line with faults: takes messages, hands over what arrives when it arrives."""

    def __init__(self, faults: Faults, random: Random, deliver: Callable[[bytes], None], *, ordered: bool) -> None:
        self._faults = faults
        self._random = random
        self._deliver = deliver
        self._ordered = ordered
        self._loop = asyncio.get_running_loop()
        self._due = 0.0
        self._numbers = itertools.count()
        self._on_the_way: list[tuple[float, int, bytes]] = []
        self._timers: set[asyncio.TimerHandle] = set()

    def send(self, data: bytes) -> None:
        """Puts a message on the line."""
        if not self._faults.any and not self._on_the_way:
            self._deliver(data)
            return

        for delay, piece in self._faults.apply(data, self._random):
            due = self._loop.time() + delay
            if self._ordered:
                due = self._due = max(due, self._due)

            self._later(due, piece)

    def close(self) -> None:
        """Forgets what is on the way."""
        for timer in self._timers:
            timer.cancel()

        self._timers.clear()
        self._on_the_way.clear()

    def _later(self, due: float, piece: bytes) -> None:
        def arrive() -> None:
            self._timers.discard(timer)
            _, _, first = heapq.heappop(self._on_the_way)
            if not self._faults.stalled:
                self._deliver(first)

        # The loop's timers for one moment fire in any order; each takes the message whose turn it is.
        heapq.heappush(self._on_the_way, (due, next(self._numbers), piece))
        timer = self._loop.call_at(due, arrive)
        self._timers.add(timer)
