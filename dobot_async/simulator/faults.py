"""What a bad line does to messages, from one seed: lose, spoil, double, delay, reorder, split, merge, stall, silence.

    stall      a stream carries everything late and in order; datagrams sent meanwhile are lost
    silence    whatever is sent meanwhile, in either direction, is lost; the connection stays open
    late       one message of the arm is overtaken by all that it sends for a while

How long these last is bounded by nothing that a client does, so none of a client's clocks is safe from them.
"""

from __future__ import annotations

import asyncio
import heapq
import itertools
import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from random import Random

__all__ = ["LONGEST", "MEANS", "PROBABILITIES", "TIMES", "Faults", "FaultyChannel", "LineState"]

PROBABILITIES = ("loss", "corrupt", "dup", "split", "noise", "merge", "stall", "late", "silence")
TIMES = ("latency", "jitter", "reorder")
MEANS = ("stall_time", "late_time", "silence_time")
SWITCHES = ("silent", "stalled")
LONGEST = 60.0  # seconds that a stall, a silence or a delay that was drawn lasts at most
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
        stall: Probability that it finds the line at a standstill. A stream then carries it, and all that is behind it,
            late and in order, and loses nothing; datagrams that are sent meanwhile are lost.
        late: Probability that a message from the arm comes alone, behind later ones.
        silence: Probability that the line goes dead: what is sent meanwhile in either direction, this message included,
            is lost. The connection stays open.
        latency: Seconds that it takes.
        jitter: Seconds that it may take on top, at random; messages may overtake each other on a datagram line.
        reorder: Seconds that it may take on top, at random; messages may overtake each other on any line.
        stall_time: Mean seconds of a stall, exponentially distributed, 60 at most.
        late_time: Mean seconds that a late message takes on top, likewise.
        silence_time: Mean seconds of a silence, likewise.
        silent: A switch: nothing arrives while this is true, and is lost. The connection stays open.
        stalled: A switch: a stream keeps everything back, in order, until this is false again; datagrams are lost.
    """

    _released: dict[Callable[[], None], None] = field(
        default_factory=dict[Callable[[], None], None], init=False, repr=False, compare=False
    )
    loss: float = 0.0
    corrupt: float = 0.0
    dup: float = 0.0
    split: float = 0.0
    noise: float = 0.0
    merge: float = 0.0
    stall: float = 0.0
    late: float = 0.0
    silence: float = 0.0
    latency: float = 0.0
    jitter: float = 0.0
    reorder: float = 0.0
    stall_time: float = 4.0
    late_time: float = 1.0
    silence_time: float = 4.0
    silent: bool = False
    stalled: bool = False

    def __post_init__(self) -> None:
        for name in PROBABILITIES:
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name} is a probability, 0 to 1, not {getattr(self, name)!r}")

        for name in TIMES:
            if not 0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} is finite seconds, not negative, not {getattr(self, name)!r}")

        for name in MEANS:
            if not 0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} is finite seconds above 0, not {getattr(self, name)!r}")

    def __setattr__(self, name: str, value: object) -> None:
        """The end of a stall delivers what it has kept back."""
        object.__setattr__(self, name, value)
        if name == "stalled" and not value:
            for resume in list(self._released):
                resume()

    @property
    def any(self) -> bool:
        """Whether anything can happen to a message."""
        return any(getattr(self, name) for name in CHANCES)

    def call_when_released(self, resume: Callable[[], None]) -> None:
        """Calls a function whenever `stalled` is switched off, until `forget`."""
        self._released[resume] = None

    def forget(self, resume: Callable[[], None]) -> None:
        """Calls it no longer."""
        self._released.pop(resume, None)

    def apply(self, data: bytes, random: Random) -> Iterator[tuple[float, bytes]]:
        """Yields what arrives of one message: seconds on the way, and the bytes."""
        if self.silent or random.random() < self.loss:
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


CHANCES = (*PROBABILITIES, *TIMES, *SWITCHES)


@dataclass(slots=True)
class LineState:
    """What both directions of a line share.

    Attributes:
        outages: When a stall or a silence that was drawn began, and when it ends, in the loop's seconds.
        silent_until: When the silence ends.
    """

    outages: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    silent_until: float = -math.inf


class FaultyChannel:
    """One direction of a line with faults: takes messages, hands over what arrives when it arrives.

    Args:
        faults: What happens to messages.
        random: Where the chances come from.
        deliver: Called with what arrives.
        ordered: Whether it is a direction of a stream; else of a line for datagrams.
        state: What it shares with the other direction.
        from_arm: Whether it carries what the arm says, of which some may be late alone.
    """

    def __init__(
        self,
        faults: Faults,
        random: Random,
        deliver: Callable[[bytes], None],
        *,
        ordered: bool,
        state: LineState | None = None,
        from_arm: bool = False,
    ) -> None:
        self._faults = faults
        self._random = random
        self._deliver = deliver
        self._ordered = ordered
        self._state = state or LineState()
        self._from_arm = from_arm
        self._loop = asyncio.get_running_loop()
        self._due = self._still = -math.inf
        self._held = b""
        self._numbers = itertools.count()
        self._on_the_way: list[tuple[float, int, bytes, bool]] = []
        self._kept_back: deque[tuple[bytes, bool]] = deque()
        self._timers: set[asyncio.TimerHandle] = set()

    @property
    def carries(self) -> bool:
        """Whether something is on the way."""
        return bool(self._on_the_way or self._held or self._kept_back)

    def send(self, data: bytes) -> None:
        """Puts a message on the line."""
        faults = self._faults
        now = self._loop.time()
        if not (faults.any or self.carries or now < self._still or now < self._state.silent_until):
            self._deliver(data)
            return

        if self._lost(now):
            return

        late = self._drawn(faults.late_time) if self._from_arm and self._happens(faults.late) else 0.0
        in_order = self._ordered and not faults.reorder and not late
        for delay, piece in faults.apply(data, self._random):
            due = now + delay + late
            if self._ordered:
                due = max(due, self._still)

            if in_order:
                due = max(due, self._due)

            if not late:
                self._due = max(due, self._due)

            self._later(due, piece, merge=in_order and self._happens(faults.merge))

    def close(self) -> None:
        """Forgets what is on the way."""
        for timer in self._timers:
            timer.cancel()

        self._timers.clear()
        self._on_the_way.clear()
        self._kept_back.clear()
        self._faults.forget(self._resume)
        self._held = b""

    def _lost(self, now: float) -> bool:
        """Draws whether the line falls silent or stands still; returns whether that loses a message."""
        state, faults = self._state, self._faults
        if now >= state.silent_until and self._happens(faults.silence):
            state.silent_until = now + self._drawn(faults.silence_time)
            state.outages.append((now, state.silent_until))

        if now < state.silent_until:
            return True

        if now >= self._still and self._happens(faults.stall):
            self._still = now + self._drawn(faults.stall_time)
            state.outages.append((now, self._still))

        return not self._ordered and (now < self._still or faults.stalled)

    def _happens(self, probability: float) -> bool:
        """Draws only where there is a chance, so that a seed means the same whatever else there may be."""
        return probability > 0 and self._random.random() < probability

    def _drawn(self, mean: float) -> float:
        return min(self._random.expovariate(1 / mean), LONGEST)

    def _later(self, due: float, piece: bytes, *, merge: bool) -> None:
        # The loop's timers for one moment fire in any order; each takes the message whose turn it is.
        heapq.heappush(self._on_the_way, (due, next(self._numbers), piece, merge))
        self._at(due, self._arrive)

    def _arrive(self) -> None:
        _, _, piece, merge = heapq.heappop(self._on_the_way)
        if self._faults.silent or (self._faults.stalled and not self._ordered):
            return

        if self._faults.stalled or self._kept_back:
            self._kept_back.append((piece, merge))
            self._faults.call_when_released(self._resume)
        else:
            self._pass_on(piece, merge=merge)

    def _resume(self) -> None:
        """The switch `stalled` is off again: what was kept back arrives, unless it is on again meanwhile."""
        while self._kept_back and not self._faults.stalled:
            piece, merge = self._kept_back.popleft()
            self._pass_on(piece, merge=merge)

        if not self._faults.stalled:
            self._faults.forget(self._resume)
            self._release()

    def _pass_on(self, piece: bytes, *, merge: bool) -> None:
        self._held += piece
        if merge:
            self._at(self._loop.time() + MERGE, self._release)
        else:
            self._release()

    def _release(self) -> None:
        """Hands over what has arrived, unless it went with a later message already."""
        if self._faults.stalled:
            self._faults.call_when_released(self._resume)
            return

        held, self._held = self._held, b""
        if held:
            self._deliver(held)

    def _at(self, when: float, callback: Callable[[], None]) -> None:
        def fire() -> None:
            self._timers.discard(timer)
            callback()

        timer = self._loop.call_at(when, fire)
        self._timers.add(timer)
