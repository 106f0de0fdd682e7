"""A D-Bus system bus of one's own, and objects on it: what a service such as BlueZ is to its clients.

It needs the program dbus-daemon, no rights and no configuration of the system. Programs whose environment variable
`DBUS_SYSTEM_BUS_ADDRESS` leads to it take it for the system's.
"""

from __future__ import annotations

import asyncio
import socket
import tempfile
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

from dbus_fast import Message, Variant
from dbus_fast.aio import MessageBus

__all__ = ["ADDRESS", "Objects", "PatientBus", "dbus_daemon"]

ADDRESS = "DBUS_SYSTEM_BUS_ADDRESS"
DAEMON = "dbus-daemon"
PROPERTIES = "org.freedesktop.DBus.Properties"
OBJECT_MANAGER = "org.freedesktop.DBus.ObjectManager"
CONFIGURATION = """<!DOCTYPE busconfig PUBLIC "-//freedesktop//DTD D-Bus Bus Configuration 1.0//EN"
 "http://www.freedesktop.org/standards/dbus/1.0/busconfig.dtd">
<busconfig>
  <listen>unix:path={path}</listen>
  <auth>EXTERNAL</auth>
  <policy context="default">
    <allow own="*"/>
    <allow send_destination="*"/>
    <allow receive_sender="*"/>
  </policy>
</busconfig>
"""


@asynccontextmanager
async def dbus_daemon() -> AsyncGenerator[tuple[str, asyncio.subprocess.Process]]:
    """Runs a bus for the length of a block; yields its address and its process.

    Raises:
        OSError: There is no dbus-daemon, or it does not start.
    """
    # A socket's path has 107 bytes at most, so it stands in the shortest place there is.
    with tempfile.TemporaryDirectory(prefix="dobot-") as directory:
        configuration = configured(directory)
        try:
            daemon = await asyncio.create_subprocess_exec(
                DAEMON,
                f"--config-file={configuration}",
                "--nofork",
                "--print-address",
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.DEVNULL,  # it complains of limits that it may not raise, and goes on
                start_new_session=True,  # Ctrl-C is for this program, which then ends the daemon
            )
        except FileNotFoundError:
            raise FileNotFoundError(f"{DAEMON} is not installed; on Debian: apt install {DAEMON}") from None

        try:
            assert daemon.stdout
            address = (await daemon.stdout.readline()).decode().strip()
            if not address:
                raise OSError(f"{DAEMON} did not start")

            yield address, daemon
        finally:
            with suppress(ProcessLookupError):
                daemon.terminate()

            await daemon.wait()


def configured(directory: str) -> Path:
    """Writes the configuration of a bus in a directory."""
    configuration = Path(directory, "conf")
    configuration.write_text(CONFIGURATION.format(path=Path(directory, "bus")), encoding="ascii")
    return configuration


class PatientSocket:
    """A socket that takes nothing while it is full, for a writer that expects an error to be the end."""

    def __init__(self, inner: socket.socket) -> None:
        self._inner = inner

    def send(self, data: bytes) -> int:
        """Sends what there is room for."""
        try:
            return self._inner.send(data)
        except BlockingIOError:
            return 0


class PatientBus(MessageBus):
    """A connection to a bus that waits while the bus is slow, where dbus-fast's own breaks off."""

    async def connect(self) -> MessageBus:
        """Connects."""
        await super().connect()
        writer: Any = self._writer
        writer.sock = PatientSocket(writer.sock)
        return self

    def say(self, message: Message) -> None:
        """Send a message; nobody waits for it."""
        self.send(message)  # pyright: ignore[reportUnknownMemberType] - dbus-fast says nothing of what its Future has

    async def close(self) -> None:
        """Disconnects, and frees what that leaves."""
        self.disconnect()
        gone: Any = self.wait_for_disconnect
        with suppress(Exception):
            await gone()


class Objects:
    """The objects of a service: their interfaces, and the properties of each; tells everybody of changes.

    Args:
        bus: The connection of the service.
        types: The D-Bus signature of each property.
    """

    def __init__(self, bus: PatientBus, types: dict[str, str]) -> None:
        self._bus = bus
        self._types = types
        self._all: dict[str, dict[str, dict[str, Any]]] = {}

    def __contains__(self, path: str) -> bool:
        return path in self._all

    def get(self, path: str, interface: str) -> dict[str, Any]:
        """The properties of an interface of an object; empty if there is none."""
        return self._all.get(path, {}).get(interface, {})

    def add(self, path: str, interface: str, **properties: Any) -> None:
        """An object appears."""
        self._all[path] = {interface: properties}
        self._signal("/", OBJECT_MANAGER, "InterfacesAdded", "oa{sa{sv}}", path, self._variants(path))

    def remove(self, path: str) -> None:
        """An object disappears, with all that is below it."""
        for each in [each for each in self._all if each == path or each.startswith(f"{path}/")]:
            interfaces = self._all.pop(each)
            self._signal("/", OBJECT_MANAGER, "InterfacesRemoved", "oas", each, list(interfaces))

    def change(self, path: str, interface: str, **properties: Any) -> None:
        """Properties of an object have new values, or the same ones again."""
        if path in self._all:
            self._all[path][interface].update(properties)
            changed = {name: Variant(self._types[name], value) for name, value in properties.items()}
            self._signal(path, PROPERTIES, "PropertiesChanged", "sa{sv}as", interface, changed, [])

    def managed(self) -> dict[str, Any]:
        """What GetManagedObjects answers."""
        return {path: self._variants(path) for path in self._all}

    def all_of(self, path: str, interface: str) -> dict[str, Variant]:
        """What Properties.GetAll answers."""
        return self._variants(path).get(interface, {})

    def _variants(self, path: str) -> dict[str, dict[str, Variant]]:
        return {
            interface: {name: Variant(self._types[name], value) for name, value in properties.items()}
            for interface, properties in self._all.get(path, {}).items()
        }

    def _signal(self, path: str, interface: str, member: str, signature: str, *body: Any) -> None:
        if self._bus.connected:
            self._bus.say(Message.new_signal(path, interface, member, signature, list(body)))
