"""What BlueZ, and the arm's BLE module, call their things on D-Bus, and what these consist of."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol

from dbus_fast import Message

from dobot_async.simulator.ble.system_bus import Objects

__all__ = [
    "ADAPTER",
    "CHARACTERISTIC",
    "DEVICE",
    "FAILED",
    "NOTIFIES_PATH",
    "SERVICE_UUID",
    "TYPES",
    "WRITES_PATH",
    "DBusRefusal",
    "Service",
    "device",
    "services",
]

ADAPTER = "org.bluez.Adapter1"
DEVICE = "org.bluez.Device1"
SERVICE = "org.bluez.GattService1"
CHARACTERISTIC = "org.bluez.GattCharacteristic1"
FAILED = "org.bluez.Error.Failed"
SERVICE_UUID = "0003cdd0-0000-1000-8000-00805f9b0131"
NOTIFIES = "0003cdd1-0000-1000-8000-00805f9b0131"
WRITES = "0003cdd2-0000-1000-8000-00805f9b0131"
NOTIFIES_PATH = "service000a/char000b"
WRITES_PATH = "service000a/char000e"
TYPES = {
    **dict.fromkeys(("Address", "AddressType", "Name", "Alias", "UUID"), "s"),
    **dict.fromkeys(("Powered", "Connected", "Paired", "ServicesResolved", "Notifying", "Primary"), "b"),
    **dict.fromkeys(("UUIDs", "Roles", "Flags"), "as"),
    **dict.fromkeys(("Adapter", "Device", "Service"), "o"),
    "RSSI": "n",
    "MTU": "q",
    "Value": "ay",
}


class DBusRefusal(Exception):
    """BlueZ answers a call with an error."""

    def __init__(self, name: str, text: str) -> None:
        super().__init__(name, text)
        self.name = name
        self.text = text


class Service(Protocol):
    """What a module needs of BlueZ."""

    objects: Objects

    @property
    def scanning(self) -> bool:
        """Whether anybody scans."""
        ...

    def answer(self, call: Message, signature: str = "", *body: Any) -> None:
        """Answers a call."""

    def refuse(self, call: Message, refused: DBusRefusal) -> None:
        """Answers a call with an error."""


def device(adapter: str, address: str) -> dict[str, Any]:
    """The properties of a device that is seen for the first time, and says no more than that it is there."""
    return {
        "Address": address,
        "AddressType": "public",
        "Alias": address.replace(":", "-"),
        "Adapter": adapter,
        "Connected": False,
        "Paired": False,
        "ServicesResolved": False,
    }


def services(path: str, writes: list[str]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yields path, interface and properties of what a device's services consist of."""
    service = f"{path}/service000a"
    yield service, SERVICE, {"UUID": SERVICE_UUID, "Device": path, "Primary": True}
    for below, uuid, flags in ((NOTIFIES_PATH, NOTIFIES, ["notify"]), (WRITES_PATH, WRITES, writes)):
        yield f"{path}/{below}", CHARACTERISTIC, {"UUID": uuid, "Service": service, "Flags": flags, "Notifying": False}
