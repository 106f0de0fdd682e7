"""What a bad line does to messages, from one seed: lose, spoil, double, delay, reorder, split, merge, stall, noise."""

from __future__ import annotations

import asyncio
import heapq
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from random import Random

__all__ = ["PROBABILITIES", "STALL", "TIMES", "Channel", "Faults"]

PROBABILITIES = ("loss", "corrupt", "dup", "split", "noise", "merge", "stall")
TIMES = ("latency", "jitter", "reorder")
STALL = 1.0  # seconds at most
MERGE = 0.002  # seconds that a message waits for another one


@dataclass(slots=True)
class Faults:
    """What happens to each message, in each direction; may be changed while the simulation runs.

    Attributes:
        loss: Probability that it is lost.
        corrupt: Probability that one of its bytes is changed.
        dup: Probability that it arrives twice.
        split: Probability that it arrives in two parts.
        noise: Probability that junk comes before it.
        merge: Probability that it is held back until the next one comes, and arrives with it as one (streams only).
        stall: Probability that it finds the line at a standstill for up to `STALL` seconds: a stream then carries it,
            and all that is behind it, late; datagrams are lost.
        latency: Seconds that it takes.
        jitter: Seconds that it may take on top, at random; messages may overtake each other on a datagram line.
        reorder: Seconds that it may take on top, at random; messages may overtake each other on any line.
        stalled: Nothing arrives at all while this is true.
    """

    loss: float = 0.0
    corrupt: float = 0.0
    dup: float = 0.0
    split: float = 0.0
    noise: float = 0.0
    merge: float = 0.0
    stall: float = 0.0
    latency: float = 0.0
    jitter: float = 0.0
    reorder: float = 0.0
    stalled: bool = False

    def __post_init__(self) -> None:
        for name in PROBABILITIES:
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name} is a probability, 0 to 1, not {getattr(self, name)!r}")

        for name in TIMES:
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
            if self.reorder:
                delay += self.reorder * random.random()

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
        self._due = self._still = 0.0
        self._held = b""
        self._numbers = itertools.count()
        self._on_the_way: list[tuple[float, int, bytes, bool]] = []
        self._timers: set[asyncio.TimerHandle] = set()

    def send(self, data: bytes) -> None:
        """Puts a message on the line."""
        if not (self._faults.any or self._on_the_way or self._held):
            self._deliver(data)
            return

        ordered = self._ordered and not self._faults.reorder
        now = self._loop.time()
        if self._happens(self._faults.stall):
            self._still = now + STALL * self._random.random()

        if not ordered and now < self._still:
            return

        for delay, piece in self._faults.apply(data, self._random):
            due = now + delay
            if ordered:
                due = max(due, self._due, self._still)

            self._due = max(due, self._due)
            self._later(due, piece, merge=ordered and self._happens(self._faults.merge))

    def close(self) -> None:
        """Forgets what is on the way."""
        for timer in self._timers:
            timer.cancel()

        self._timers.clear()
        self._on_the_way.clear()
        self._held = b""

    def _happens(self, probability: float) -> bool:
        """Draws only where there is a chance, so that a seed means the same whatever else there may be."""
        return probability > 0 and self._random.random() < probability

    def _later(self, due: float, piece: bytes, *, merge: bool) -> None:
        # The loop's timers for one moment fire in any order; each takes the message whose turn it is.
        heapq.heappush(self._on_the_way, (due, next(self._numbers), piece, merge))
        self._at(due, self._arrive)

    def _arrive(self) -> None:
        _, _, piece, merge = heapq.heappop(self._on_the_way)
        if self._faults.stalled:
            return

        self._held += piece
        if merge:
            self._at(self._loop.time() + MERGE, self._release)
        else:
            self._release()

    def _release(self) -> None:
        """Hands over what has arrived, unless it went with a later message already."""
        held, self._held = self._held, b""
        if held:
            self._deliver(held)

    def _at(self, when: float, callback: Callable[[], None]) -> None:
        def fire() -> None:
            self._timers.discard(timer)
            callback()

        timer = self._loop.call_at(when, fire)
        self._timers.add(timer)
