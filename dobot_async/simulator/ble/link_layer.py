"""A BLE connection's link layer between a computer and the simulated module, by connection events; and the serial port.

    computer --> packets that wait --> connection event --> module --> 115200 baud --> arm
             <-- packets that wait <--    (each interval)    <-- module <--             <--

At each event up to `packets` packets go each way, of those that waited before it began: what an event brings is
answered in the next one at the earliest. There are no tasks: timers run only while something waits.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["LinkLayer", "RadioSettings", "SerialBridge", "Uart", "round_trip"]

BAUD_PER_BYTE = 10 / 115200
LEAST_MTU, MOST_MTU = 23, 517
ATT_HEADER = 3


@dataclass(slots=True)
class RadioSettings:
    """How good a connection is; may be changed while the simulation runs.

    Attributes:
        interval: Seconds between connection events, 0.0075 to 4.
        mtu: The longest packet in bytes, 3 of which are the header.
        packets: Packets that one event carries each way.
        advertising: Seconds between two advertisements.
    """

    interval: float = 0.03
    mtu: int = LEAST_MTU
    packets: int = 4
    advertising: float = 0.05

    def __post_init__(self) -> None:
        if not 0.0075 <= self.interval <= 4 or not 0 < self.advertising < math.inf:
            raise ValueError(f"a connection's interval is 0.0075 to 4 s, not {self.interval!r}")

        if not LEAST_MTU <= self.mtu <= MOST_MTU or self.packets < 1:
            raise ValueError(
                f"expected an mtu of {LEAST_MTU} to {MOST_MTU}, not {self.mtu!r}, and packets of at least 1"
            )

    @property
    def payload(self) -> int:
        """Bytes that a packet carries."""
        return self.mtu - ATT_HEADER


class LinkLayer:
    """One connection: what waits for its next event, each way."""

    def __init__(self, radio: RadioSettings) -> None:
        self._radio = radio
        self._loop = asyncio.get_running_loop()
        self._began = self._loop.time()
        self._there: deque[Callable[[], None]] = deque()
        self._back: deque[Callable[[], None]] = deque()
        self._timer: asyncio.TimerHandle | None = None

    def there(self, arrive: Callable[[], None]) -> None:
        """Sends a packet to the module; what is given is called when it arrives."""
        self._wait(self._there, arrive)

    def back(self, arrive: Callable[[], None]) -> None:
        """Sends a packet to the computer."""
        self._wait(self._back, arrive)

    def after(self, events: int, then: Callable[[], None]) -> asyncio.TimerHandle:
        """Calls something at a later event, as what takes several round trips does."""
        return self._loop.call_at(self._event() + (events - 1) * self._radio.interval, then)

    def close(self) -> None:
        """Loses what waits."""
        self._there.clear()
        self._back.clear()
        if self._timer:
            self._timer.cancel()
            self._timer = None

    def _wait(self, line: deque[Callable[[], None]], arrive: Callable[[], None]) -> None:
        line.append(arrive)
        self._schedule()

    def _schedule(self) -> None:
        if self._timer is None and (self._there or self._back):
            self._timer = self._loop.call_at(self._event(), self._happen)

    def _event(self) -> float:
        """When the next event is."""
        passed = self._loop.time() - self._began
        return self._began + (math.floor(passed / self._radio.interval) + 1) * self._radio.interval

    def _happen(self) -> None:
        """An event: takes what waits now, both ways, before any of it arrives and can be answered."""
        self._timer = None
        lines = self._back, self._there
        packets = [line.popleft() for line in lines for _ in range(min(len(line), self._radio.packets))]
        for arrive in packets:
            arrive()

        self._schedule()


class Uart:
    """One direction of the line between the module and the arm, at the arm's 115200 baud."""

    def __init__(self, deliver: Callable[[bytes], None]) -> None:
        self._deliver = deliver
        self._loop = asyncio.get_running_loop()
        self._free = 0.0
        self._timers: dict[int, asyncio.TimerHandle] = {}
        self._sent = 0

    @property
    def empty(self) -> bool:
        """Whether nothing is on the way."""
        return not self._timers

    def send(self, data: bytes) -> None:
        """Carries bytes; they arrive together when the last one has."""
        self._sent += 1
        number = self._sent

        def arrive() -> None:
            del self._timers[number]
            self._deliver(data)

        self._free = max(self._free, self._loop.time()) + len(data) * BAUD_PER_BYTE
        self._timers[number] = self._loop.call_at(self._free, arrive)

    def close(self) -> None:
        """Loses what is on the way."""
        for timer in self._timers.values():
            timer.cancel()

        self._timers.clear()


class SerialBridge:
    """The serial line of one connection to the arm: what reached the module is sent even if the connection is gone.

    Args:
        deliver: Takes what has reached the arm.
        reply: Takes what has come back to the module.
        leave: Called once nothing is on the way to the arm any more, after `end`.
    """

    def __init__(
        self, deliver: Callable[[bytes], None], reply: Callable[[bytes], None], leave: Callable[[], None]
    ) -> None:
        self._deliver = deliver
        self._leave = leave
        self._back = Uart(reply)
        self._there = Uart(self._arrive)
        self._ending = False

    def send(self, data: bytes) -> None:
        """Hands a chunk on to the arm."""
        self._there.send(data)

    def answer(self, data: bytes) -> None:
        """The arm says something."""
        if not self._ending:
            self._back.send(data)

    def end(self) -> None:
        """Nobody hears the arm any more."""
        self._ending = True
        self._back.close()
        if self._there.empty:
            self._leave()

    def cut(self) -> None:
        """The arm hears nobody any more, either."""
        self._there.close()

    def _arrive(self, data: bytes) -> None:
        self._deliver(data)
        if self._ending and self._there.empty:
            self._leave()


def round_trip(radio: RadioSettings, request: int, reply: int, pace: float) -> float:
    """Returns the least seconds from a request that is sent right after an event to the last packet of its answer.

    Args:
        radio: The connection.
        request: Bytes of the request.
        reply: Bytes of the answer.
        pace: Seconds between two chunks of the request.
    """
    chunks = math.ceil(request / radio.payload)
    events: list[int] = []
    for number in range(chunks):
        event = math.floor(number * pace / radio.interval + 1e-9) + 1
        while events.count(event) == radio.packets:
            event += 1

        events.append(event)

    before = sum(event < events[-1] for event in events) * radio.payload
    serial = (request - before + reply) * BAUD_PER_BYTE
    first_answer = math.floor(events[-1] + serial / radio.interval + 1e-9) + 1
    return (first_answer + math.ceil(math.ceil(reply / radio.payload) / radio.packets) - 1) * radio.interval
