"""The meaning of bleak's errors for a user, and what to do about each.

Bleak speaks with four operating systems and raises what each of them says; on Linux there are four
for "not connected" alone. Here each gets a sentence, and whether another attempt can help.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from bleak.exc import (
    BleakBluetoothNotAvailableError,
    BleakCharacteristicNotFoundError,
    BleakDBusError,
    BleakError,
)
from bleak.exc import BleakBluetoothNotAvailableReason as Reason

__all__ = ["NEAR", "NOT_FOUND", "ServiceHangs", "Trouble", "trouble"]


class ServiceHangs(Exception):
    """The computer's own Bluetooth service is there, and does not answer."""


OFF = "Bluetooth is off; switch it on (Linux: rfkill unblock bluetooth, then bluetoothctl power on)"
DENIED = (
    "this program may not use Bluetooth; allow it (macOS: System Settings, Privacy & Security, Bluetooth; Windows: "
    "Settings, Privacy, Radios; Linux: add this user to the group bluetooth, then log in again)"
)
NO_DAEMON = "the Bluetooth service does not answer; start it (Linux: install bluez, then systemctl start bluetooth)"
HANGS = "restart it (Linux: systemctl restart bluetooth; macOS: it may wait for a permission that it asks for)"
NO_BUS = "there is no D-Bus system bus, which bleak needs on Linux; in a container, share /run/dbus with it"
NO_ADAPTER = "this computer has no such Bluetooth adapter; is it plugged in, and is its name right (adapter=hci0)?"
OLD = "update bluez; it is older than bleak can use"
NO_CENTRAL = "this computer's Bluetooth adapter cannot connect to BLE devices; it takes one of version 4.0 or later"
NO_MODULE = "what was reached there has not the service of the arm's BLE module; is it the arm?"
NEAR = "is the arm near, is its BLE module plugged in, and is no phone or other computer connected to it?"
NOT_FOUND = (
    "is the arm switched on and near, is its BLE module plugged in, and is no phone, other computer or other program "
    "connected to it? It serves one at a time, and cannot be seen while it does"
)


REASONS: Mapping[Reason, str] = {
    Reason.NO_BLUETOOTH: NO_ADAPTER,
    Reason.NO_BLE_CENTRAL_ROLE: NO_CENTRAL,
    Reason.POWERED_OFF: OFF,
    Reason.DENIED_BY_USER: DENIED,
    Reason.DENIED_BY_SYSTEM: DENIED,
    Reason.DENIED_BY_UNKNOWN: DENIED,
}
DBUS_ERRORS = {
    "org.freedesktop.DBus.Error.ServiceUnknown": NO_DAEMON,
    "org.freedesktop.DBus.Error.NameHasNoOwner": NO_DAEMON,
    "org.freedesktop.DBus.Error.Spawn.ServiceNotFound": NO_DAEMON,
    "org.freedesktop.DBus.Error.AccessDenied": DENIED,
    "org.bluez.Error.NotAuthorized": DENIED,
    "org.bluez.Error.NotReady": OFF,
}
TEXTS = {"adapter ": NO_ADAPTER, "Bleak requires": OLD}
"""Errors without a type of their own, by how they begin."""

BUS_ERRORS = {"AuthError": DENIED, "AuthTimeoutError": NO_BUS, "InvalidAddressError": NO_BUS}
"""dbus-fast's own, by name: it is there on Linux only."""

KINDS: tuple[tuple[type[BaseException], Callable[[Any], str | None]], ...] = (
    (BleakBluetoothNotAvailableError, lambda error: REASONS.get(error.reason, OFF)),
    (BleakDBusError, lambda error: DBUS_ERRORS.get(error.dbus_error)),
    (BleakCharacteristicNotFoundError, lambda _: NO_MODULE),
    (BleakError, lambda error: next((TEXTS[text] for text in TEXTS if str(error).startswith(text)), None)),
    (ServiceHangs, lambda _: HANGS),
    (PermissionError, lambda _: DENIED),
    (FileNotFoundError, lambda _: NO_BUS),
    (ConnectionRefusedError, lambda _: NO_BUS),
)
"""The advice by the type of the error, special ones first."""


@dataclass(frozen=True, slots=True)
class Trouble:
    """What an error says.

    Attributes:
        text: What it is, and what to do next.
        passing: Whether it may be gone in a moment, as radio interference is.
    """

    text: str
    passing: bool


def trouble(error: BaseException) -> Trouble:
    """Says what an error of bleak's, or of what it builds on, means."""
    advice = lasting(error)
    text = str(error) or type(error).__name__
    if isinstance(error, BleakError) and not isinstance(error, BleakDBusError):
        text = next((word for word in error.args if isinstance(word, str)), text)  # the others are not for reading

    if isinstance(error, TimeoutError):
        text = "the arm's BLE module did not answer in time"

    return Trouble(f"{text}; {advice or NEAR}", passing=advice is None)


def lasting(error: BaseException) -> str | None:
    """What to do about an error that stays until somebody does it; None if it may pass."""
    for kind, advice in KINDS:
        if isinstance(error, kind):
            return advice(error)

    return BUS_ERRORS.get(type(error).__name__)
