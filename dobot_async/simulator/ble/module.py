"""The simulated arm's BLE module: how it advertises, is connected to, written to, and notifies; as BlueZ's objects.

    advertise --> connect --> resolved --> start_notify --> write ... notify --> lose
       ^                                                                          |
       '--------------------------------------------------------------------------'

A step is announced to `watch` before it is taken, so that a test can break the connection in the middle of anything.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial

from dbus_fast import Message

from dobot_async.simulator.ble.connection import CONNECT, SUBSCRIBE, WRITE, GattConnection
from dobot_async.simulator.ble.link_layer import RadioSettings
from dobot_async.simulator.ble.names import (
    CHARACTERISTIC,
    DEVICE,
    FAILED,
    NOTIFIES_PATH,
    SERVICE_UUID,
    WRITES_PATH,
    DBusRefusal,
    Service,
    device,
    services,
)
from dobot_async.simulator.simulation import Simulation

__all__ = ["BleModule"]

CONNECTING, RESOLVING, SUBSCRIBING = 2, 4, 2  # connection events that these take
NOBODY = 2.0  # seconds after which BlueZ gives up to connect to somebody who is not there


class BleModule:
    """One arm's BLE module.

    Attributes:
        address: Of the radio.
        url: What leads to it.
        name: What it advertises.
        late_name: Advertisements without the name before the first one that has it.
        advertises_service: Whether the service's UUID is advertised.
        writes: Which kinds of writes its input takes: "write-without-response", "write".
        in_range: Whether it can be heard.
        taken: Whether another computer or a phone is connected to it.
        stuck: BlueZ does not come back from writes.
        services: Whether it has the service at all.
        disconnecting: Seconds that BlueZ takes to disconnect.
        watch: Called with the name of each step before it is taken: connect, connected, resolved, start_notify, write,
            arrive, notify.
        written: The chunks of all connections, as they were written.
        kinds: How each of them was written: "command" is without response, "request" with one.
        connections: How many there have been.
    """

    def __init__(self, simulation: Simulation, radio: RadioSettings, *, name: str, address: str) -> None:
        self.radio = radio
        self.name = name
        self.address = address
        self.url: str = f"ble://{address}"
        self.path: str = ""
        self.late_name = 0
        self.advertises_service = False
        self.writes: list[str] = ["write-without-response"]
        self.in_range = True
        self.taken = False
        self.stuck = False
        self.services = True
        self.disconnecting: float = 0.0
        self.watch: Callable[[str], None] = lambda _: None
        self.written: list[bytes] = []
        self.kinds: list[str] = []
        self.connections: int = 0
        self._simulation = simulation
        self._loop = asyncio.get_running_loop()
        self._bluez: Service | None = None
        self._connection: GattConnection | None = None
        self._listeners: set[str] = set()
        self._heard = 0
        self._timers: set[asyncio.TimerHandle] = set()
        self._advertising = False

    @property
    def connected(self) -> bool:
        """Whether BlueZ is connected to it."""
        return bool(self._connection and self._connection.line)

    @property
    def resolved(self) -> bool:
        """Whether BlueZ knows its services."""
        return bool(self._bluez and self._bluez.objects.get(self.path, DEVICE).get("ServicesResolved"))

    def join(self, bluez: Service, adapter: str) -> None:
        """Comes into the range of an adapter."""
        self._bluez = bluez
        self._adapter = adapter
        self._heard = 0
        self.path = f"{adapter}/dev_{self.address.replace(':', '_')}"

    def forget(self) -> None:
        """Nobody is there any more to be told of anything."""
        self._break()
        for timer in self._timers:
            timer.cancel()

        self._timers.clear()
        self._listeners.clear()
        self._advertising = False
        self._bluez = None

    def lose(self) -> None:
        """The connection breaks, as it does when somebody walks away with the phone."""
        bluez = self._bluez
        if bluez and self._connection:
            calls = self._break()
            bluez.objects.change(self.path, DEVICE, Connected=False, ServicesResolved=False)
            for call, text in calls:
                bluez.refuse(call, DBusRefusal(FAILED, text))

            self.advertise()

    def vanish(self) -> None:
        """BlueZ forgets the device, without a word of a connection that ends."""
        if self._bluez:
            self._break()
            self._bluez.objects.remove(self.path)

    def advertise(self) -> None:
        """Advertises while somebody scans and nobody is connected."""
        if not self._advertising and self._bluez:
            self._advertising = True
            self._later(self.radio.advertising, self._advertise)

    def say(self, data: bytes) -> None:
        """Notifies of bytes as if the arm had said them."""
        size = self.radio.payload
        if self._connection:
            for at in range(0, len(data), size):
                self._connection.link_layer.back(partial(self._notify, data[at : at + size]))

    def change_mtu(self, mtu: int) -> None:
        """Both sides agree on another length of packets."""
        self.radio.mtu = mtu
        if self._bluez:
            for path in (NOTIFIES_PATH, WRITES_PATH):
                self._bluez.objects.change(f"{self.path}/{path}", CHARACTERISTIC, MTU=mtu)

    def connect(self, call: Message) -> None:
        """Device1.Connect."""
        assert self._bluez
        if self.connected:
            self._bluez.answer(call)
        elif self._connection:
            raise DBusRefusal("org.bluez.Error.InProgress", "In Progress")
        else:
            connection = self._connection = GattConnection(self.radio)
            connection.wait(CONNECT, call)
            self.watch("connect")
            if self._connection is connection and self.in_range and not self.taken:
                connection.in_events(CONNECTING, self._up)
            elif self._connection is connection:
                connection.later(NOBODY, self.lose)

    def disconnect(self, call: Message) -> None:
        """Device1.Disconnect."""
        assert self._bluez
        bluez = self._bluez
        connection = self._connection
        if not connection:
            raise DBusRefusal("org.bluez.Error.NotConnected", "Not Connected")

        def done() -> None:
            if self._connection is connection:
                self.lose()

            bluez.answer(call)

        if self.disconnecting:
            self._later(self.disconnecting, done)
        else:
            done()

    def write(self, call: Message) -> None:
        """GattCharacteristic1.WriteValue."""
        data, options = call.body
        kind = options["type"].value
        flag = {"command": "write-without-response", "request": "write"}[kind]
        if self._connection and self._connection.waits(WRITE):
            raise DBusRefusal("org.bluez.Error.InProgress", "In Progress")

        connection = self._ready("write")
        assert self._bluez
        if flag not in self.writes or not (call.path or "").endswith(WRITES_PATH):
            raise DBusRefusal("org.bluez.Error.NotSupported", "Operation is not supported")

        if kind == "command" and len(data) > self.radio.payload:
            raise DBusRefusal(FAILED, "Failed to initiate write")

        self.written.append(bytes(data))
        self.kinds.append(kind)
        if kind == "request" or self.stuck:
            connection.wait(WRITE, call)
        else:
            self._bluez.answer(call)

        if not self.stuck:
            connection.link_layer.there(lambda: self._arrive(data, confirm=kind == "request"))

    def start_notify(self, call: Message) -> None:
        """GattCharacteristic1.StartNotify."""
        connection = self._ready("start_notify")
        if call.sender in self._listeners or connection.waits(SUBSCRIBE):
            raise DBusRefusal("org.bluez.Error.InProgress", "In Progress")

        connection.wait(SUBSCRIBE, call)
        connection.in_events(SUBSCRIBING, partial(self._subscribed, call.sender or ""))

    def stop_notify(self, client: str) -> None:
        """A client wants no notifications any more, or has left the bus."""
        if client in self._listeners:
            self._listeners.discard(client)
            if self._bluez and not self._listeners:
                self._bluez.objects.change(f"{self.path}/{NOTIFIES_PATH}", CHARACTERISTIC, Notifying=False)

    def _ready(self, step: str) -> GattConnection:
        """Announces a step, and returns the connection, without which it cannot be taken."""
        self.watch(step)
        if not self._connection or not self._connection.line:
            raise DBusRefusal(FAILED, "Not connected")

        return self._connection

    def _advertise(self) -> None:
        bluez = self._bluez
        self._advertising = False
        if not bluez or not bluez.scanning or self._connection:
            return

        if self.in_range and not self.taken:
            self._heard += 1
            named = {"Name": self.name, "Alias": self.name} if self._heard > self.late_name else {}
            rssi = -50 - self._heard % 2
            if self.path in bluez.objects:
                bluez.objects.change(self.path, DEVICE, RSSI=rssi, **named)
            else:
                services = [SERVICE_UUID] if self.advertises_service else []
                known = device(self._adapter, self.address) | {"RSSI": rssi, "UUIDs": services} | named
                bluez.objects.add(self.path, DEVICE, **known)

        self.advertise()

    def _up(self) -> None:
        """The connection is there; its services are not known yet."""
        self.watch("connected")
        connection = self._connection
        if not connection or not self._bluez:
            return

        connection.plug_in(self._simulation, self.say, self.lose)
        self.connections += 1
        self._bluez.objects.change(self.path, DEVICE, Connected=True)
        self._answer(CONNECT)
        connection.in_events(RESOLVING, self._resolved)

    def _resolved(self) -> None:
        """The services are known."""
        self.watch("resolved")
        if not self.connected or not self._bluez:
            return

        objects = self._bluez.objects
        for path, interface, properties in services(self.path, self.writes) if self.services else ():
            if path not in objects:
                objects.add(path, interface, **properties)

        self.change_mtu(self.radio.mtu)
        objects.change(self.path, DEVICE, ServicesResolved=True, UUIDs=[SERVICE_UUID] if self.services else [])

    def _subscribed(self, client: str) -> None:
        if self._bluez:
            self._listeners.add(client)
            self._bluez.objects.change(f"{self.path}/{NOTIFIES_PATH}", CHARACTERISTIC, Notifying=True)
            self._answer(SUBSCRIBE)

    def _arrive(self, data: bytes, *, confirm: bool = False) -> None:
        """A chunk reaches the module, which hands it on; a write that wants it is confirmed."""
        self.watch("arrive")
        if self._connection and self._connection.line:
            self._connection.line.send(data)
            if confirm:
                self._connection.link_layer.back(partial(self._answer, WRITE))

    def _notify(self, chunk: bytes) -> None:
        self.watch("notify")
        if self.connected and self._bluez and self._listeners:
            self._bluez.objects.change(f"{self.path}/{NOTIFIES_PATH}", CHARACTERISTIC, Value=chunk)

    def _break(self) -> list[tuple[Message, str]]:
        """Ends the connection; returns the calls that fail by that, with what BlueZ says."""
        connection, self._connection = self._connection, None
        return connection.end() if connection else []

    def _answer(self, what: str) -> None:
        """Answers the call of a kind that waits."""
        call = self._connection and self._connection.waited(what)
        if call and self._bluez:
            self._bluez.answer(call)

    def _later(self, seconds: float, then: Callable[[], None]) -> None:
        self._keep(self._loop.call_later(seconds, then))

    def _keep(self, timer: asyncio.TimerHandle) -> None:
        now = self._loop.time()
        self._timers = {each for each in self._timers if each.when() >= now and not each.cancelled()} | {timer}
