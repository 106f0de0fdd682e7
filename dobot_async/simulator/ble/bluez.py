"""BlueZ, as far as a BLE client sees it, on a bus of its own: the simulated arm over Bluetooth with no radio.

    client --> bleak, unchanged --> D-Bus --> BlueZ (here) --> BleModule --> LinkLayer --> Uart --> simulated arm

What the real one does is done as it does it: one scan for each client, writes without response that are answered at
once and queued, InProgress while another is under way, connections that outlive the program that made them, the four
ways of saying "not connected". `dobot_async.simulator.ble.link_layer` says how good the connection is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from dbus_fast import Message, MessageType

from dobot_async.simulator.ble.module import BleModule
from dobot_async.simulator.ble.names import ADAPTER, CHARACTERISTIC, DEVICE, TYPES, DBusRefusal
from dobot_async.simulator.ble.system_bus import OBJECT_MANAGER, PROPERTIES, Objects, PatientBus

__all__ = ["BlueZ"]

NAME = "org.bluez"
HCI = "/org/bluez/hci0"
NAME_LOST = "type='signal',sender='org.freedesktop.DBus',member='NameOwnerChanged'"
OWN_ADDRESS = "00:1A:7D:DA:71:13"
UNKNOWN = "org.freedesktop.DBus.Error.UnknownObject"


class BlueZ:
    """The service: one adapter, and the modules in its world. Answers each call at once or later, as it takes."""

    def __init__(self, bus: PatientBus) -> None:
        self._bus = bus
        self._scanning: set[str] = set()
        self._modules: dict[str, BleModule] = {}
        self.objects: Objects = Objects(bus, TYPES)

    async def start(self) -> None:
        """Appears on the bus."""
        await self._bus.connect()
        self._bus.add_message_handler(self._handle)
        await self._bus.call(
            Message(
                destination="org.freedesktop.DBus",
                path="/org/freedesktop/DBus",
                interface="org.freedesktop.DBus",
                member="AddMatch",
                signature="s",
                body=[NAME_LOST],
            )
        )
        await self._bus.request_name(NAME)
        self.objects.add(
            HCI, ADAPTER, Address=OWN_ADDRESS, Name="simulated", Alias="simulated", Powered=True, Roles=["central"]
        )

    async def stop(self) -> None:
        """Vanishes as it does when it crashes: without a word to anybody."""
        for module in self._modules.values():
            module.forget()

        self._modules.clear()
        await self._bus.close()

    def add(self, module: BleModule) -> None:
        """Brings a module into the world."""
        module.join(self, HCI)
        self._modules[module.path] = module

    def remove(self, module: BleModule) -> None:
        """Takes a module out of the world."""
        if self._modules.pop(module.path, None):
            module.lose()
            module.forget()

    def power(self, *, on: bool) -> None:
        """Switches the adapter."""
        if not on:
            self._scanning.clear()
            for module in self._modules.values():
                module.lose()

        self.objects.change(HCI, ADAPTER, Powered=on)

    @property
    def powered(self) -> bool:
        """Whether the adapter is on."""
        return bool(self.objects.get(HCI, ADAPTER)["Powered"])

    @property
    def scanning(self) -> bool:
        """Whether anybody scans."""
        return bool(self._scanning)

    def answer(self, call: Message, signature: str = "", *body: Any) -> None:
        """Answers a call."""
        if self._bus.connected:
            self._bus.say(Message.new_method_return(call, signature, list(body)))

    def refuse(self, call: Message, refused: DBusRefusal) -> None:
        """Answers a call with an error."""
        if self._bus.connected:
            self._bus.say(Message.new_error(call, refused.name, refused.text))

    def get_managed_objects(self, call: Message) -> None:
        """ObjectManager.GetManagedObjects."""
        self.answer(call, "a{oa{sa{sv}}}", self.objects.managed())

    def get(self, call: Message) -> None:
        """Properties.Get."""
        interface, name = call.body
        self.answer(call, "v", self.objects.all_of(call.path or "", interface)[name])

    def get_all(self, call: Message) -> None:
        """Properties.GetAll."""
        self.answer(call, "a{sv}", self.objects.all_of(call.path or "", call.body[0]))

    def set(self, call: Message) -> None:
        """Properties.Set: the adapter can be switched."""
        interface, name, value = call.body
        if (interface, name) != (ADAPTER, "Powered"):
            raise DBusRefusal("org.freedesktop.DBus.Error.PropertyReadOnly", name)

        self.power(on=value.value)
        self.answer(call)

    def set_discovery_filter(self, call: Message) -> None:
        """Adapter1.SetDiscoveryFilter; everything is reported, whatever the filter."""
        self._ready()
        self.answer(call)

    def start_discovery(self, call: Message) -> None:
        """Adapter1.StartDiscovery."""
        self._ready()
        if call.sender in self._scanning:
            raise DBusRefusal("org.bluez.Error.InProgress", "Operation already in progress")

        self._scanning.add(call.sender or "")
        for module in self._modules.values():
            module.advertise()

        self.answer(call)

    def stop_discovery(self, call: Message) -> None:
        """Adapter1.StopDiscovery."""
        self._ready()
        if call.sender not in self._scanning:
            raise DBusRefusal("org.bluez.Error.Failed", "No discovery started")

        self._scanning.discard(call.sender or "")
        self.answer(call)

    def connect(self, call: Message) -> None:
        """Device1.Connect."""
        self._ready()
        self._module(call).connect(call)

    def disconnect(self, call: Message) -> None:
        """Device1.Disconnect."""
        self._module(call).disconnect(call)

    def write_value(self, call: Message) -> None:
        """GattCharacteristic1.WriteValue."""
        self._module(call).write(call)

    def start_notify(self, call: Message) -> None:
        """GattCharacteristic1.StartNotify."""
        self._module(call).start_notify(call)

    def stop_notify(self, call: Message) -> None:
        """GattCharacteristic1.StopNotify."""
        self._module(call).stop_notify(call.sender or "")
        self.answer(call)

    def _handle(self, message: Message) -> bool:
        """Answers calls, and hears of clients that have gone."""
        if message.message_type is MessageType.SIGNAL:
            if message.member == "NameOwnerChanged" and not message.body[2]:
                self._gone(message.body[0])

            return False

        handler = HANDLERS.get((message.interface, message.member))
        if message.message_type is not MessageType.METHOD_CALL or handler is None:
            return False

        try:
            handler(self, message)
        except DBusRefusal as refused:
            self.refuse(message, refused)

        return True

    def _gone(self, client: str) -> None:
        """A client has left the bus: its scan and its notifications end, its connections do not."""
        self._scanning.discard(client)
        for module in self._modules.values():
            module.stop_notify(client)

    def _module(self, call: Message) -> BleModule:
        """The module whose object is called."""
        for path, module in self._modules.items():
            if call.path and f"{call.path}/".startswith(f"{path}/") and call.path in self.objects:
                return module

        raise DBusRefusal(UNKNOWN, f"Method {call.member} does not exist at {call.path}")

    def _ready(self) -> None:
        if not self.powered:
            raise DBusRefusal("org.bluez.Error.NotReady", "Resource Not Ready")


HANDLERS: dict[tuple[str | None, str | None], Callable[[BlueZ, Message], None]] = {
    (OBJECT_MANAGER, "GetManagedObjects"): BlueZ.get_managed_objects,
    (PROPERTIES, "Get"): BlueZ.get,
    (PROPERTIES, "GetAll"): BlueZ.get_all,
    (PROPERTIES, "Set"): BlueZ.set,
    (ADAPTER, "SetDiscoveryFilter"): BlueZ.set_discovery_filter,
    (ADAPTER, "StartDiscovery"): BlueZ.start_discovery,
    (ADAPTER, "StopDiscovery"): BlueZ.stop_discovery,
    (DEVICE, "Connect"): BlueZ.connect,
    (DEVICE, "Disconnect"): BlueZ.disconnect,
    (CHARACTERISTIC, "WriteValue"): BlueZ.write_value,
    (CHARACTERISTIC, "StartNotify"): BlueZ.start_notify,
    (CHARACTERISTIC, "StopNotify"): BlueZ.stop_notify,
}
"""What clients may call."""
