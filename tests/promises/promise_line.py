"""A line in memory, in virtual time, on which a test decides what becomes of each message in each direction.

    driver --send--> Direction --> simulated arm --> stamp --> Direction --receive--> driver

It may lose, corrupt, double and delay at random; be dead (all is lost, and the connection stays open); stand still for
any length of time (in order, nothing lost); be broken. No constant of the driver is known here, and no limit set.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from random import Random
from typing import Any

import anyio
from anyio.lowlevel import checkpoint

from dobot_async._core.protocol.transport import Transport
from dobot_async.transports import SCHEMES

TICK = 2e-6  # two timers for one moment fire in any order

__all__ = ["Direction", "Lines", "Manner", "PromiseLine", "promise_lines"]


@dataclass(slots=True)
class Manner:
    """What a line does to each message, in each direction.

    Attributes:
        latency: Seconds on the way.
        loss: Probability that a message is lost.
        corrupt: Probability that one of its bytes is changed.
        double: Probability that it arrives twice.
        stall: Probability that it finds the line at a standstill, which then lasts `stalled` seconds in the mean.
        stalled: See `stall`.
        spread: Seconds that each message may take on top, at random, and by which messages overtake one another: the
            line is one for datagrams, and loses them while it stands still.
    """

    latency: float = 0.0
    loss: float = 0.0
    corrupt: float = 0.0
    double: float = 0.0
    stall: float = 0.0
    stalled: float = 4.0
    spread: float = 0.0


class Direction:
    """One direction of a line.

    Attributes:
        dead: Whether all is lost, also what is on the way.
        messages: How many were put on it.
        late: Seconds that a message is delayed alone: those behind it overtake it.
        spoil: What becomes of a message before all else: None if it is lost.
    """

    def __init__(self, manner: Manner, random: Random, deliver: Callable[[bytes], None]) -> None:
        self.dead = False
        self.messages = 0
        self.late: Callable[[bytes], float] = lambda _: 0.0
        self.spoil: Callable[[bytes], bytes | None] = lambda data: data
        self._manner = manner
        self._random = random
        self._deliver = deliver
        self._loop = asyncio.get_running_loop()
        self._due = 0.0
        self._still = False
        self._held: list[bytes] = []

    def send(self, data: bytes) -> None:
        """Puts a message on the line."""
        self.messages += 1
        spoilt = None if self.dead else self.spoil(data)
        if spoilt is None or self._random.random() < self._manner.loss:
            return

        for _ in range(1 + (self._random.random() < self._manner.double)):
            self._set_out(spoilt)

    def stand_still(self) -> None:
        """From now on nothing arrives, and nothing is lost, until `go_on`."""
        self._still = True

    def go_on(self) -> None:
        """What was held back arrives, in its order."""
        self._still = False
        held, self._held = self._held, []
        for data in held:
            self._deliver(data)

    def forget(self) -> None:
        """What is on the way, or held back, arrives no more."""
        self.dead = True
        self._held.clear()

    def _set_out(self, data: bytes) -> None:
        now = self._loop.time()
        if self._random.random() < self._manner.corrupt:
            place = self._random.randrange(len(data))
            data = data[:place] + bytes([data[place] ^ self._random.randint(1, 255)]) + data[place + 1 :]

        at = now + self._manner.latency + self.late(data)
        if self._manner.spread:
            at += self._manner.spread * self._random.random()
        elif at == now + self._manner.latency:
            at = self._due = max(at, self._due + TICK)

        self._loop.call_at(at, self._arrive, data)

    def _arrive(self, data: bytes) -> None:
        if self.dead:
            return

        if not self._still:
            self._deliver(data)
        elif not self._manner.spread:
            self._held.append(data)


class PromiseLine:
    """The driver's end of a line.

    Attributes:
        up: To the arm.
        down: To the driver.
        stamp: What becomes of replies at the moment when the arm has made them.
        closed: Whether the driver has closed it.
    """

    def __init__(self, inner: Transport, manner: Manner, random: Random) -> None:
        datagrams = manner.spread > 0
        self.in_flight = 1 if datagrams else inner.in_flight
        self.window = 1 if datagrams else inner.window
        self.disorder = self.reorder_window = manner.spread
        self.stamp: Callable[[bytes], bytes] = lambda data: data
        self._inner = inner
        self._manner = manner
        self._random = random
        self._loop = asyncio.get_running_loop()
        self._stalled = False
        self._broken = self.closed = False
        self._to_arm: asyncio.Queue[bytes] = asyncio.Queue()
        self._arrived: asyncio.Queue[bytes | None] = asyncio.Queue()
        self.up = Direction(manner, random, self._to_arm.put_nowait)
        self.down = Direction(manner, random, self._arrived.put_nowait)
        self._tasks = [asyncio.create_task(self._feed()), asyncio.create_task(self._pump())]

    async def send(self, data: bytes) -> None:
        """Puts a message on the line; a checkpoint as anyio's is: who is cancelled in it has sent nothing."""
        await checkpoint()
        if self.closed:
            raise anyio.ClosedResourceError

        if self._broken:
            raise anyio.BrokenResourceError

        self._happen()
        self.up.send(bytes(data))

    async def receive(self) -> bytes:
        """Returns the next message that has arrived."""
        data = await self._arrived.get()
        if data is None:
            self._arrived.put_nowait(None)
            raise anyio.ClosedResourceError if self.closed else anyio.EndOfStream

        return data

    async def aclose(self) -> None:
        """Closes the line; what is on the way arrives no more."""
        self.closed = True
        self.up.forget()
        self.down.forget()
        self._arrived.put_nowait(None)
        for task in self._tasks:
            task.cancel()

        await asyncio.wait(self._tasks)
        await self._inner.aclose()

    def change(self, manner: Manner) -> None:
        """From now on it does something else to messages; it may become one for datagrams."""
        for name in Manner.__slots__:
            setattr(self._manner, name, getattr(manner, name))

        self.disorder = self.reorder_window = manner.spread

    def die(self) -> None:
        """From now on all is lost, also what is on the way; the connection stays open."""
        self.up.dead = self.down.dead = True

    def stand_still(self) -> None:
        """From now on nothing arrives in either direction, and nothing is lost."""
        self.up.stand_still()
        self.down.stand_still()

    def recover(self) -> None:
        """All is well again; what was held back arrives."""
        self.up.dead = self.down.dead = self.closed
        self.up.go_on()
        self.down.go_on()

    def break_off(self) -> None:
        """The connection ends, as when the cable is pulled."""
        self._broken = True
        self.up.forget()
        self.down.forget()
        self._arrived.put_nowait(None)

    def _happen(self) -> None:
        """Lets the line stand still now and then."""
        if self._stalled or not self._manner.stall or self._random.random() >= self._manner.stall:
            return

        self._stalled = True
        self.stand_still()
        self._loop.call_later(self._random.expovariate(1 / self._manner.stalled), self._end_stall)

    def _end_stall(self) -> None:
        self._stalled = False
        if not self.closed:
            self.up.go_on()
            self.down.go_on()

    async def _feed(self) -> None:
        """Hands what arrives at the arm to the arm."""
        while True:
            await self._inner.send(await self._to_arm.get())

    async def _pump(self) -> None:
        """Puts the arm's replies on the line."""
        try:
            while True:
                replies = await self._inner.receive()
                self._happen()
                self.down.send(self.stamp(replies))
        except (anyio.EndOfStream, anyio.BrokenResourceError, anyio.ClosedResourceError):
            self.break_off()


class Lines(list[PromiseLine]):
    """The lines that were opened, in their order.

    Attributes:
        manner: Of the lines that are opened from now on, each with a copy of it.
        refused: Whether nothing can be opened just now.
        born_dead: Whether lines that are opened from now on are dead from the beginning.
    """

    def __init__(self, manner: Manner, seed: int) -> None:
        super().__init__()
        self.manner = manner
        self.refused = self.born_dead = False
        self._random = Random(seed)

    def add(self, inner: Transport) -> PromiseLine:
        """Puts a line before a transport."""
        self.append(PromiseLine(inner, replace(self.manner), self._random))
        if self.born_dead:
            self[-1].die()

        return self[-1]


@contextmanager
def promise_lines(manner: Manner | None = None, *, seed: int = 0) -> Iterator[Lines]:
    """While this is entered, all that is opened with a `sim:` URL is behind a `PromiseLine`."""
    module = import_module(SCHEMES["sim"][0])
    real = module.open_url
    lines = Lines(manner or Manner(), seed)

    async def opened(*args: Any, **details: Any) -> Transport:
        if lines.refused:
            raise OSError("the cable is out")

        return lines.add(await real(*args, **details))

    module.open_url = opened  # type: ignore[attr-defined]
    try:
        yield lines
    finally:
        module.open_url = real  # type: ignore[attr-defined]
