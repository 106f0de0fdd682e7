"""One program at a time: a lock on this computer for each arm that is connected over BLE.

BlueZ lets every program into a connection that one of them has made: each would get the other's answers, and the first
to disconnect would cut the other off. A lock is a name that only one socket on a computer can have, and that the
kernel frees when its program ends, however it ends. Only Linux has such names, and only BlueZ needs them.
"""

from __future__ import annotations

import hashlib
import os
import socket
import sys

__all__ = ["DeviceLock", "lock_device"]


class DeviceLock:
    """What nobody else has until it is dropped."""

    def __init__(self, held: socket.socket | None) -> None:
        self._held = held

    def drop(self) -> None:
        """Lets others have it; may be called again."""
        if self._held:
            self._held.close()


def lock_device(address: str) -> DeviceLock | None:
    """Claims the device with an address, on the system bus that this program uses; None if somebody else has it."""
    if sys.platform != "linux":
        return DeviceLock(None)

    world = os.environ.get("DBUS_SYSTEM_BUS_ADDRESS", "")
    name = hashlib.sha256(f"{world} {address}".encode()).hexdigest()
    held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        held.bind(f"\0dobot_async ble {name}")
    except OSError:
        held.close()
        return None

    return DeviceLock(held)
