"""`arm.wifi`: what is sent, in which order, and what waiting for the network tells."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from ipaddress import IPv4Address
from typing import Any

import pytest
from virtual import virtual

from dobot_async import Magician, ReplyTimeout
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame
from dobot_async.arms.magician.wifi import WiFiSettings
from dobot_async.simulator import Simulation, simulate

ANY = IPv4Address(0)


@asynccontextmanager
async def connected(**options: Any) -> AsyncIterator[tuple[Magician, Simulation]]:
    async with simulate() as sim, Magician.connect(sim.url, **options) as arm:
        yield arm, sim


def written(arm: Magician) -> list[tuple[str, bytes]]:
    """Lists what is written to the arm from now on: rows and parameters."""
    commands: list[tuple[str, bytes]] = []

    def note(outgoing: bool, frame: Frame) -> None:
        if outgoing and frame.write:
            commands.append((c.BY_KEY[frame.id, True].name, frame.params))

    arm.link.on_frame.add(note)
    return commands


@virtual
async def test_the_steps_of_a_network_with_dhcp() -> None:
    async with connected() as (arm, _):
        commands = written(arm)
        await arm.wifi.configure("Werkstatt 2", "geheim äß")
        assert commands == [
            ("SetWIFIConfigMode", b"\x01"),
            ("SetWIFISSID", b"Werkstatt 2\0"),
            ("SetWIFIPassword", "geheim äß\0".encode()),
            ("SetWIFIIPAddress", bytes((1, 0, 0, 0, 0))),
            ("SetWIFIConfigMode", b"\x00"),
        ]


@virtual
async def test_the_steps_of_an_address_of_its_own() -> None:
    async with connected() as (arm, _):
        commands = written(arm)
        await arm.wifi.configure(
            "cell", "", address="10.1.2.3", netmask="255.255.0.0", gateway="10.1.0.1", dns="9.9.9.9"
        )
        assert commands[3:] == [
            ("SetWIFIIPAddress", bytes((0, 10, 1, 2, 3))),
            ("SetWIFINetmask", bytes((255, 255, 0, 0))),
            ("SetWIFIGateway", bytes((10, 1, 0, 1))),
            ("SetWIFIDNS", bytes((9, 9, 9, 9))),
            ("SetWIFIConfigMode", b"\x00"),
        ]


@virtual
async def test_what_was_set_can_be_read_but_for_the_password() -> None:
    async with connected() as (arm, sim):
        await arm.wifi.configure("cell", "secret", address="192.168.7.20")
        assert await arm.wifi.get_settings() == WiFiSettings(
            "cell", False, IPv4Address("192.168.7.20"), IPv4Address("255.255.255.0"), ANY, ANY
        )
        assert sim.arm.state.get(c.SET_WIFI_PASSWORD) == "secret"
        await arm.wifi.configure("other", "secret")
        settings = await arm.wifi.get_settings()
        assert (settings.ssid, settings.dhcp) == ("other", True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"ssid": ""}, "SSID"),
        ({"ssid": "x" * 33}, "33 bytes"),
        ({"password": "hunter2hunter2" * 5}, "70 bytes"),
        ({"password": "hunter2\0"}, "NUL"),
        ({"address": "192.168.1.300"}, "192.168.1.300"),
        ({"address": "192.168.1.3", "netmask": "255.0.255.0"}, "255.0.255.0"),
        ({"address": "192.168.1.3", "gateway": "192.168.2.1"}, "192.168.1.0/24"),
        ({"address": "192.168.1.3", "dns": "router"}, "router"),
        ({"gateway": "192.168.1.1"}, "DHCP"),
        ({"dns": "192.168.1.1"}, "DHCP"),
    ],
)
def test_what_cannot_work_is_refused_before_anything_is_sent(options: dict[str, Any], message: str) -> None:
    @virtual
    async def check() -> None:
        async with connected() as (arm, _):
            commands = written(arm)
            with pytest.raises(ValueError, match=message) as caught:
                await arm.wifi.configure(**{"ssid": "cell", "password": "secret", **options})

            assert "hunter2" not in str(caught.value)
            assert commands == []

    check()


@virtual
async def test_an_observer_sets_nothing_up() -> None:
    async with connected(control=False) as (arm, sim):
        with pytest.raises(ValueError, match="control=False"):
            await arm.wifi.configure("cell", "secret")

        assert not await arm.wifi.connected()
        assert (await arm.wifi.get_settings()).ssid == ""
        assert sim.arm.state.get(c.SET_WIFI_SSID) == ""


@virtual
async def test_waiting_ends_when_the_arm_has_joined() -> None:
    async with connected() as (arm, _):
        assert not await arm.wifi.connected()
        await arm.wifi.configure("cell", "secret")
        assert not await arm.wifi.connected()
        await arm.wifi.wait_connected()
        assert await arm.wifi.connected()


@virtual
async def test_waiting_for_a_network_that_is_not_there_ends_too() -> None:
    async with connected() as (arm, sim):
        sim.arm.state.networks = {"cell": "right"}
        await arm.wifi.configure("cell", "wrong")
        with pytest.raises(ReplyTimeout, match="within 20 s; are name and password right"):
            await arm.wifi.wait_connected(20)

        await arm.wifi.configure("cell", "right")
        await arm.wifi.wait_connected(20)


@virtual
async def test_an_arm_that_answers_no_more_is_another_matter() -> None:
    async with connected() as (arm, sim):
        sim.faults.loss = 1.0
        with pytest.raises(ReplyTimeout, match="GetWIFIConnectStatus"):
            await arm.wifi.wait_connected(20)


@virtual
async def test_half_of_the_settings_do_not_take_effect() -> None:
    async with connected() as (arm, sim):

        def cut(outgoing: bool, frame: Frame) -> None:
            if frame.id == c.SET_WIFI_PASSWORD.id:
                sim.faults.loss = 1.0

        arm.link.on_frame.add(cut)
        with pytest.raises(ReplyTimeout):
            await arm.wifi.configure("cell", "secret")

        assert sim.arm.state.get(c.SET_WIFI_CONFIG_MODE)
        sim.faults.loss = 0.0
        arm.link.on_frame.remove(cut)
        await asyncio.sleep(60)
        assert not await arm.wifi.connected()
        await arm.wifi.configure("cell", "secret")
        await arm.wifi.wait_connected()
