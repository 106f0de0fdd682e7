"""The BLE devices in range: one scan shared by all searches, and connected devices, which do not advertise.

BlueZ allows each program one scan at a time, so all searches on one loop and adapter share it;
it runs while there is a listener.
"""

from __future__ import annotations

import asyncio
import re
import sys
from collections.abc import AsyncGenerator, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Any, TypeVar, cast
from weakref import WeakKeyDictionary

import bleak
from bleak import BleakScanner
from bleak.args.bluez import BlueZScannerArgs
from bleak.backends.device import BLEDevice
from bleak.backends.scanner import AdvertisementData

from dobot_async._core.util.tasks import run_shielded, run_within
from dobot_async.transports.ble.diagnostics import ServiceHangs

__all__ = ["INPUT", "OUTPUT", "SERVICE", "SeenDevice", "Wanted", "connected", "listening"]

SERVICE = "0003cdd0-0000-1000-8000-00805f9b0131"
INPUT = "0003cdd1-0000-1000-8000-00805f9b0131"
OUTPUT = "0003cdd2-0000-1000-8000-00805f9b0131"
MODULES = ("usr-ble100", "wh-ble 102", "wh-ble102")
"""What the names of the arm's BLE modules contain; few advertise their service as well."""

T = TypeVar("T")
PATIENCE = 5.0
"""Seconds in which the computer's own Bluetooth service answers, if it ever does; bleak would wait for ever."""

ADDRESS = re.compile(r"[0-9a-f]{2}([:_-][0-9a-f]{2}){5}|[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", re.IGNORECASE)
"""Of the radio; of this computer's own making on macOS."""


@dataclass(frozen=True, slots=True)
class SeenDevice:
    """A device that was seen, with what is known of it so far.

    Attributes:
        device: Bleak's handle, which is connected to.
        name: "" while it is not known: it may come with a later answer than the device itself.
        services: The UUIDs that it advertises, in lower case.
        connected: Whether this computer is connected to it already.
    """

    device: BLEDevice
    name: str
    services: frozenset[str]
    connected: bool

    @property
    def is_arm(self) -> bool:
        """Whether it has the service, or the name, of an arm's BLE module."""
        return SERVICE in self.services or any(module in self.name.lower() for module in MODULES)


@dataclass(frozen=True, slots=True)
class Wanted:
    """Which arm is looked for: by address, by its whole name, or the first one if `text` is empty."""

    text: str

    def fits(self, seen: SeenDevice) -> bool:
        """Whether this is it."""
        if not self.text:
            return seen.is_arm

        if ADDRESS.fullmatch(self.text):
            return same(self.text) == same(seen.device.address)

        return self.text.strip().lower() == seen.name.strip().lower()


def same(address: str) -> str:
    """An address without the ways in which it may be written."""
    return re.sub("[:_-]", "", address).lower()


class Scan:
    """The one scan of a loop on an adapter."""

    def __init__(self, adapter: str | None) -> None:
        self._adapter = adapter
        self._changing = asyncio.Lock()
        self._listeners: set[Callable[[SeenDevice], None]] = set()
        self._scanner: BleakScanner | None = None

    async def join(self, listener: Callable[[SeenDevice], None]) -> None:
        """Tells a listener of everything that is seen from now on, and was seen by this scan before."""
        async with self._changing:
            if self._scanner is None:
                scanner = BleakScanner(
                    self._tell, bluez=BlueZScannerArgs(adapter=self._adapter) if self._adapter else BlueZScannerArgs()
                )
                await answered(scanner.start())
                self._scanner = scanner

            for device, advertisement in self._scanner.discovered_devices_and_advertisement_data.values():
                listener(seen_as(device, advertisement))

            self._listeners.add(listener)

    async def leave(self, listener: Callable[[SeenDevice], None]) -> None:
        """The last one to leave ends the scan."""
        async with self._changing:
            self._listeners.discard(listener)
            scanner = self._scanner
            if scanner and not self._listeners:
                self._scanner = None
                with suppress(Exception):  # an adapter that was switched off, or a service that died, scans no more
                    await answered(scanner.stop())

    def _tell(self, device: BLEDevice, advertisement: AdvertisementData) -> None:
        for listener in list(self._listeners):
            listener(seen_as(device, advertisement))


scans: WeakKeyDictionary[asyncio.AbstractEventLoop, dict[str | None, Scan]] = WeakKeyDictionary()


@asynccontextmanager
async def listening(adapter: str | None = None) -> AsyncGenerator[asyncio.Queue[SeenDevice]]:
    """Scans for the length of a block, and yields where everything that is seen arrives, again and again.

    Raises:
        Exception: What bleak says; `trouble` tells what it means.
    """
    scan = scans.setdefault(asyncio.get_running_loop(), {}).setdefault(adapter, Scan(adapter))
    heard: asyncio.Queue[SeenDevice] = asyncio.Queue()
    listener = heard.put_nowait
    try:
        await run_shielded(scan.join(listener))  # a start that is given up half-way would leave BlueZ scanning
        yield heard
    finally:
        await run_shielded(scan.leave(listener))


def seen_as(device: BLEDevice, advertisement: AdvertisementData) -> SeenDevice:
    """What a device says of itself."""
    return SeenDevice(
        device,
        advertisement.local_name or device.name or "",
        frozenset(uuid.lower() for uuid in advertisement.service_uuids),
        connected=is_connected(advertisement),
    )


def is_connected(advertisement: AdvertisementData) -> bool:
    """Whether BlueZ says of a device that it is connected; a `BLEDevice` keeps what was said when it was new."""
    said = advertisement.platform_data[-1] if advertisement.platform_data else None
    return isinstance(said, dict) and bool(cast("dict[str, Any]", said).get("Connected"))


async def connected(adapter: str | None = None) -> tuple[list[SeenDevice], list[SeenDevice]]:
    """Returns the arms that this computer is connected to: those that nobody here uses, and those that somebody does.

    A program that crashed leaves its connection behind on Linux, and such an arm is found by no scan. One that
    another program listens to must be left alone: to close a connection to it would close that program's as well.

    Raises:
        Exception: What bleak says; `trouble` tells what it means.
    """
    return await answered(connections(adapter))


async def connections(adapter: str | None) -> tuple[list[SeenDevice], list[SeenDevice]]:
    """The same, as long as it takes."""
    adapters: Any = getattr(bleak, "BleakAdapter", None)  # bleak has it from 3.1 on
    if adapters is None:
        return [], []

    try:
        adapter_of_ours = await adapters.get(bluez={"adapter": adapter} if adapter else {})
        devices = await adapter_of_ours.get_connected_devices([SERVICE])
    except NotImplementedError:
        return [], []

    found = [SeenDevice(device, device.name or "", frozenset({SERVICE}), connected=True) for device in devices]
    if not found or sys.platform != "linux":
        return found, []

    used = await listened_to()
    taken = [seen for seen in found if seen.device.details["path"] in used]
    return [seen for seen in found if seen not in taken], taken


async def answered(work: Coroutine[Any, Any, T]) -> T:
    """Awaits what the Bluetooth service does at once, unless it hangs."""
    try:
        return await run_within(PATIENCE, work)
    except TimeoutError:
        raise ServiceHangs("the computer's Bluetooth service does not answer") from None


async def listened_to() -> set[str]:
    """The paths of the devices that a program on this computer gets notifications of. BlueZ only."""
    from dbus_fast import BusType, Message, unpack_variants  # noqa: PLC0415 - there is none on other systems
    from dbus_fast.aio import MessageBus  # noqa: PLC0415

    bus: Any = MessageBus(bus_type=BusType.SYSTEM)
    await bus.connect()
    try:
        reply = await bus.call(
            Message(
                destination="org.bluez",
                path="/",
                interface="org.freedesktop.DBus.ObjectManager",
                member="GetManagedObjects",
            )
        )
        objects: dict[str, dict[str, dict[str, Any]]] = (
            unpack_variants(reply.body[0]) if reply and reply.signature == "a{oa{sa{sv}}}" else {}
        )
    finally:
        bus.disconnect()
        with suppress(Exception):
            await bus.wait_for_disconnect()

    return {
        path.rpartition("/service")[0]
        for path, interfaces in objects.items()
        if interfaces.get("org.bluez.GattCharacteristic1", {}).get("Notifying")
    }
