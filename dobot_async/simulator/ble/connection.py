"""One connection of BlueZ to an arm's BLE module, from the call that makes it to its end, however it comes."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from dbus_fast import Message

from dobot_async.simulator.ble.link_layer import LinkLayer, RadioSettings, SerialBridge
from dobot_async.simulator.simulation import SimulatedClient, Simulation

__all__ = ["CONNECT", "SUBSCRIBE", "WRITE", "GattConnection"]

CONNECT, WRITE, SUBSCRIBE = "connect", "write", "subscribe"
BROKEN = {
    CONNECT: "le-connection-abort-by-local",
    WRITE: "Operation failed with ATT error: 0x0e",
    SUBSCRIBE: "Not connected",
}
"""What BlueZ says of the calls that wait when it breaks."""


class GattConnection:
    """One connection: what is on its way, the calls that wait for it, and what happens later if it lasts.

    Attributes:
        link_layer: What is on its way.
        line: To the arm, once the connection is there.
    """

    def __init__(self, radio: RadioSettings) -> None:
        self.link_layer: LinkLayer = LinkLayer(radio)
        self.line: SerialBridge | None = None
        self._loop = asyncio.get_running_loop()
        self._waiting: dict[str, Message] = {}
        self._timers: list[asyncio.TimerHandle] = []

    def plug_in(self, simulation: Simulation, say: Callable[[bytes], None], unplugged: Callable[[], None]) -> None:
        """Makes the line to the arm; the arm may have itself unplugged."""

        def deliver(data: bytes) -> None:
            client.send(data)

        def unplug() -> None:
            line.cut()
            unplugged()

        line = self.line = SerialBridge(deliver, say, lambda: simulation.leave(client))
        client: SimulatedClient = simulation.client(line.answer, unplug, ordered=True)

    def waits(self, what: str) -> bool:
        """Whether a call of a kind waits."""
        return what in self._waiting

    def wait(self, what: str, call: Message) -> None:
        """Keeps a call that is answered later."""
        self._waiting[what] = call

    def waited(self, what: str) -> Message | None:
        """Returns the call of a kind, which waits no longer."""
        return self._waiting.pop(what, None)

    def in_events(self, events: int, then: Callable[[], None]) -> None:
        """Does something after some connection events."""
        self._timers.append(self.link_layer.after(events, then))

    def later(self, seconds: float, then: Callable[[], None]) -> None:
        """Does something after a time."""
        self._timers.append(self._loop.call_later(seconds, then))

    def end(self) -> list[tuple[Message, str]]:
        """Ends it; returns the calls that fail by that, with what BlueZ says."""
        for timer in self._timers:
            timer.cancel()

        self.link_layer.close()
        if self.line:
            self.line.end()

        return [(self._waiting[what], text) for what, text in BROKEN.items() if what in self._waiting]
