"""The search for arms: what it finds, in which order, and that nothing that breaks hides the rest.

Questions go to the loopback's own broadcast address, or to networks in a namespace that a test makes for itself.
"""

from __future__ import annotations

import asyncio
import logging
import math
import os
import shutil
import subprocess
import sys
from collections.abc import AsyncGenerator, AsyncIterator, Sequence
from contextlib import AsyncExitStack, aclosing, asynccontextmanager
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from virtual import virtual

from dobot_async import ConnectFailed, DeviceInfo, DiscoveryProblem, Found, Magician, discover
from dobot_async.discovery import SOURCES, DiscoverySource, wifi
from dobot_async.discovery.families import FAMILIES, DiscoverableFamily
from dobot_async.discovery.found import natural, printable
from dobot_async.discovery.serial_ports import SerialPorts
from dobot_async.discovery.wifi import QUESTION, WiFiModules, understood
from dobot_async.simulator import MyCobotQuirks, Simulation, UltraArmQuirks, announced, simulate

LOOPBACK = "127.255.255.255"
OWN = f"127.{64 + (os.getpid() >> 8) % 190}.{os.getpid() & 255}"
"""Where this process's simulated arms are; others may test at the same time."""

linux = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has a whole network on its loopback")


def way(url: str, source: str = "one", **details: Any) -> Found:
    return Found(url, source, identity=details.pop("identity", url), families=("magician",), **details)


def urls(found: Sequence[Found]) -> list[str]:
    return [each.url for each in found]


async def everything(**options: Any) -> list[Found]:
    options.setdefault("on_problem", never)
    return [each async for each in discover(**options)]


def never(problem: DiscoveryProblem) -> None:
    raise AssertionError(problem)


@dataclass
class Listed:
    """A source that yields what it was given, once it may."""

    name: str
    found: Sequence[Found] = ()
    error: Exception | None = None
    may: asyncio.Event | None = None
    probes_at_once: int = 8
    ended: bool = field(default=False)

    async def search(self, timeout: float) -> AsyncGenerator[Found, None]:
        try:
            for each in self.found:
                yield each

            if self.may:
                await self.may.wait()

            if self.error:
                raise self.error
        finally:
            self.ended = True


# --- order, duplicates, problems ---


async def test_order_is_that_of_the_sources_and_of_the_urls() -> None:
    may = asyncio.Event()
    slow = Listed("slow", [way("serial:///dev/ttyUSB10"), way("serial:///dev/ttyUSB9"), way("serial://COM3")], may=may)
    fast = Listed("fast", [way("udp://10.0.0.10"), way("udp://10.0.0.9")])
    asyncio.get_running_loop().call_soon(may.set)
    found = await everything(sources=[slow, fast])
    assert urls(found) == [
        "serial:///dev/ttyUSB9",
        "serial:///dev/ttyUSB10",
        "serial://COM3",
        "udp://10.0.0.9",
        "udp://10.0.0.10",
    ]


async def test_an_early_source_tells_while_a_later_one_still_searches() -> None:
    source = Listed("late", [way("udp://10.0.0.1")], may=asyncio.Event())
    async with aclosing(discover(sources=[Listed("early", [way("serial://COM1")]), source])) as search:
        assert (await anext(search)).url == "serial://COM1"

    assert source.ended


async def test_the_same_one_is_told_once_with_the_last_word() -> None:
    twice = [way("ble://AA", identity="AA"), way("ble://AA", identity="AA", description="USR-BLE100")]
    (found,) = await everything(sources=[Listed("ble", twice)])
    assert found.description == "USR-BLE100"


async def test_what_breaks_hides_nothing() -> None:
    problems: list[DiscoveryProblem] = []
    broken = Listed("broken", [way("udp://10.0.0.1")], OSError("the network\nis down"))
    sources = [broken, Listed("whole", [way("serial://COM1")])]
    assert urls(await everything(sources=sources, on_problem=problems.append)) == ["udp://10.0.0.1", "serial://COM1"]
    assert problems == [DiscoveryProblem("broken", "the network is down", problems[0].error)]
    assert isinstance(problems[0].error, OSError)


async def test_a_problem_that_nobody_wants_to_hear_of_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "dobot_async"):
        assert await everything(sources=[Listed("broken", error=ValueError())], on_problem=None) == []

    assert "broken failed: ValueError" in caplog.text


@virtual
async def test_a_source_that_hangs_is_ended() -> None:
    problems: list[DiscoveryProblem] = []
    hanging = Listed("hanging", [way("udp://10.0.0.1")], may=asyncio.Event())
    sources = [hanging, Listed("whole", [way("serial://COM1")])]
    found = await everything(timeout=3, sources=sources, on_problem=problems.append)
    assert urls(found) == ["udp://10.0.0.1", "serial://COM1"]
    assert [(problem.source, problem.message) for problem in problems] == [("hanging", "it did not end within 8 s")]
    assert hanging.ended


@pytest.mark.parametrize("times", [{"timeout": math.nan}, {"timeout": -1}, {"probe_timeout": math.nan}])
async def test_a_time_that_is_none(times: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="seconds, not"):
        discover(sources=[], **times)


async def test_what_the_listener_raises_is_not_swallowed() -> None:
    with pytest.raises(AssertionError):
        await everything(sources=[Listed("broken", error=OSError())])


async def test_no_source_of_that_name() -> None:
    with pytest.raises(ValueError, match="serial, wifi, ble"):
        discover(sources=["usb"])


async def test_no_source_finds_nothing() -> None:
    assert await everything(sources=[]) == []


def test_the_sources_are_what_they_are_called() -> None:
    assert list(SOURCES) == ["serial", "wifi", "ble", "zenoh"]
    assert all(SOURCES[name].name == name for name in SOURCES)


# --- probes ---


async def test_a_probe_tells_who_it_is() -> None:
    async with simulate() as sim:
        (found,) = await everything(sources=[Listed("one", [way(sim.url)])], probe=True)
        assert found == replace(way(sim.url), info=DeviceInfo("DTSIM00000000001", "Dobot Magician", "3.7.0"))
        assert not sim.arm.executed


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
@pytest.mark.parametrize(
    ("model", "family", "version"),
    [
        ("mycobot280", "mycobot", "1.3"),
        ("myarm300", "mycobot", "1.3"),
        ("mypalletizer260", "mycobot", "1.3"),
        ("ultraarm", "ultraarm", "1.2"),
    ],
)
async def test_other_families_tell_the_version_of_their_firmware(model: str, family: str, version: str) -> None:
    async with simulate(model, listen="pty") as sim:
        port = replace(way(sim.url), families=(family,))
        (found,) = await everything(sources=[Listed("one", [port])], probe=True, probe_timeout=10)
        assert found == replace(port, info=DeviceInfo("", "", version))
        assert not sim.arm.executed


@pytest.mark.parametrize(
    ("model", "family", "quirks"),
    [
        ("mycobot280", "mycobot", MyCobotQuirks(later=False)),
        ("ultraarm", "ultraarm", UltraArmQuirks(later=False)),
    ],
)
async def test_older_firmware_tells_no_version(model: str, family: str, quirks: Any) -> None:
    async with simulate(model, quirks=quirks) as sim:
        port = replace(way(sim.url), families=(family,))
        (found,) = await everything(sources=[Listed("one", [port])], probe=True, probe_timeout=2)
        # An ultraArm's QUEUE SIZE is later firmware's, too, and the driver does not go without.
        assert found.info == (DeviceInfo("", "", "") if family == "mycobot" else None)
        assert (found.problem or "").startswith("" if family == "mycobot" else "no ultraArm answers")


async def test_two_ways_to_one_arm_are_one_result() -> None:
    async with simulate() as memory, simulate(listen="tcp://127.0.0.1:0") as tcp:
        sources = [Listed("one", [way(memory.url)]), Listed("two", [way(tcp.url)])]
        (found,) = await everything(sources=sources, probe=True)
        assert (found.url, found.also) == (memory.url, (tcp.url,))


async def test_two_arms_on_the_same_kind_of_line_are_two_whatever_they_say() -> None:
    async with simulate() as first, simulate() as second:
        found = await everything(sources=[Listed("one", [way(first.url), way(second.url)])], probe=True)
        assert [each.also for each in found] == [(), ()]
        assert urls(found) == [first.url, second.url]


async def test_arms_without_a_serial_number_are_not_taken_for_one() -> None:
    async def nameless(url: str, timeout: float) -> DeviceInfo:
        return DeviceInfo("", "", "1.0.0")

    families = [DiscoverableFamily("magician", frozenset(), nameless)]
    sources = [Listed("one", [way("serial://COM1")]), Listed("two", [way("udp://10.0.0.1")])]
    assert len(await everything(sources=sources, probe=True, families=families)) == 2


async def test_who_does_not_answer_is_told_all_the_same() -> None:
    found = await everything(sources=[Listed("one", [way("tcp://127.0.0.1:1"), way("nonsense:")])], probe=True)
    assert [each.info for each in found] == [None, None]
    assert "no scheme" in (found[0].problem or "")
    assert "cannot reach" in (found[1].problem or "")


async def test_families_are_asked_in_turn_until_one_answers() -> None:
    asked: list[tuple[str, float]] = []

    def family(name: str, answer: DeviceInfo | Exception) -> DiscoverableFamily:
        async def probe(url: str, timeout: float) -> DeviceInfo:
            asked.append((name, timeout))
            if isinstance(answer, Exception):
                raise answer

            return answer

        return DiscoverableFamily(name, frozenset(), probe)

    info = DeviceInfo("1", "myArm", "1.0")
    families = [
        DiscoverableFamily("mute", frozenset()),
        family("magician", ConnectFailed("no Magician")),
        family("mycobot", info),
        family("ultraarm", info),
    ]
    both = replace(way("serial://COM1"), families=("magician", "mycobot", "ultraarm"))
    none = replace(way("serial://COM2"), families=("mute",))
    sources = [Listed("one", [both, none])]
    first, second = await everything(sources=sources, probe=True, probe_timeout=7, families=families)
    assert asked == [("magician", 7), ("mycobot", 7)]
    assert (first.families, first.info) == (("mycobot",), info)
    assert second.problem == "it is of a family that cannot be asked who it is"


async def test_a_source_says_how_many_are_probed_at_a_time() -> None:
    at_once = most = 0

    async def probe(url: str, timeout: float) -> DeviceInfo:
        nonlocal at_once, most
        at_once += 1
        most = max(most, at_once)
        await asyncio.sleep(0)
        at_once -= 1
        return DeviceInfo(url, "", "")

    found = [way(f"ble://{number}") for number in range(5)]
    source = Listed("ble", found, probes_at_once=1)
    assert (
        len(
            await everything(
                sources=[source], probe=True, families=[DiscoverableFamily("magician", frozenset(), probe)]
            )
        )
        == 5
    )
    assert most == 1


async def test_leaving_in_the_middle_of_a_probe_leaves_nothing_behind() -> None:
    begun, ended = asyncio.Event(), asyncio.Event()

    async def probe(url: str, timeout: float) -> DeviceInfo:
        begun.set()
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()

        raise AssertionError

    sources = [Listed("one", [way("udp://10.0.0.1")])]
    families = [DiscoverableFamily("magician", frozenset(), probe)]
    search = asyncio.create_task(everything(sources=sources, probe=True, families=families))
    await begun.wait()
    search.cancel()
    with pytest.raises(asyncio.CancelledError):
        await search

    assert ended.is_set()


# --- serial ports ---


def port(device: str, usb: tuple[int, int] | None, location: str | None = None, description: str = "n/a") -> Any:
    vid, pid = usb or (None, None)
    return SimpleNamespace(device=device, vid=vid, pid=pid, location=location, description=description)


async def test_ports_are_known_by_the_usb_ids_of_arms() -> None:
    ports = [
        port("/dev/ttyUSB10", (0x10C4, 0xEA60), "1-1", "CP2102N USB to UART Bridge Controller"),
        port("/dev/ttyUSB2", (0x1A86, 0x7523), "1-2", "USB2.0-Serial"),
        port("/dev/ttyACM0", (0x1A86, 0x55D4), "1-3", "USB Single Serial\x1b[2J"),
        port("/dev/ttyACM1", (0x2341, 0x0043), "1-4"),
        port("/dev/ttyS0", None),
    ]
    found = await everything(sources=[SerialPorts(ports=lambda: ports)])
    assert [(each.url, each.families) for each in found] == [
        ("serial:///dev/ttyACM0", ("magician", "mycobot")),
        ("serial:///dev/ttyUSB2", ("magician", "ultraarm")),
        ("serial:///dev/ttyUSB10", ("magician", "mycobot")),
    ]
    assert found[0].description == "USB Single Serial?[2J"


async def test_one_adapter_that_two_drivers_show_is_one_port() -> None:
    ports = [port(f"/dev/cu.{name}-10", (0x1A86, 0x7523), "20-1") for name in ("wchusbserial", "usbserial")]
    assert urls(await everything(sources=[SerialPorts(ports=lambda: ports)])) == ["serial:///dev/cu.usbserial-10"]


async def test_adapters_without_a_place_are_known_by_their_names() -> None:
    ports = [port(name, (0x1A86, 0x7523)) for name in ("COM4", "COM3")]
    found = await everything(sources=[SerialPorts(ports=lambda: ports)])
    assert urls(found) == ["serial://COM3", "serial://COM4"]


async def test_the_ports_of_this_computer_can_be_listed() -> None:
    assert all(found.url.startswith("serial://") for found in await everything(sources=["serial"]))


async def test_another_family_brings_its_own_ids() -> None:
    families = (*FAMILIES, DiscoverableFamily("other", frozenset({(0x2341, 0x0043)})))
    ports = [port("COM1", (0x2341, 0x0043))]
    (found,) = await everything(sources=[SerialPorts(families, lambda: ports)])
    assert found.families == ("other",)


# --- Wi-Fi ---


def test_an_answer_as_the_module_gives_it() -> None:
    found = understood(b"192.168.137.128,D8B04CB33868,USR-C322,2.17.14", "192.168.137.128")
    assert found == Found("udp://192.168.137.128", "wifi", "D8B04CB33868", "USR-C322 2.17.14", families=("magician",))


@pytest.mark.parametrize(
    ("answer", "url"),
    [
        (b"10.0.0.7,d8b04cb33868\r\n", "udp://10.0.0.7"),
        (b"10.0.0.7,D8B04CB33868,USR-C322\0", "udp://10.0.0.7"),
        (b"0.0.0.0,D8B04CB33868,USR-C322,2", "udp://10.0.0.9"),
        (b"10.0.0.777,D8B04CB33868", None),
        (b"10.0.0.7,D8B04CB3386", None),
        (b"10.0.0.7", None),
        (QUESTION, None),
        (b"", None),
        (b"\xff" * 2000, None),
    ],
)
def test_answers_and_what_is_none(answer: bytes, url: str | None) -> None:
    found = understood(answer, "10.0.0.9")
    assert (found and found.url) == url


@given(st.binary(max_size=80))
def test_no_datagram_is_too_strange(data: bytes) -> None:
    for each in (data, b"10.0.0.7,D8B04CB33868," + data):
        found = understood(each, "10.0.0.9")
        assert found is None or found.description.isprintable()


@asynccontextmanager
async def arms(count: int) -> AsyncIterator[tuple[list[Simulation], list[tuple[str, int]]]]:
    """Simulated arms in the Wi-Fi, and where each is asked."""
    async with AsyncExitStack() as stack:
        sims, places = [], []
        for number in range(count):
            listen = f"udp://{OWN}.{number + 1}:8899"
            sims.append(await stack.enter_async_context(simulate(listen=listen)))
            places.append((LOOPBACK, await stack.enter_async_context(announced(listen, LOOPBACK, 0))))

        yield sims, places


async def first(source: DiscoverySource, count: int = 1) -> list[Found]:
    """The first that a source yields; there is time enough for the slowest machine."""
    found: list[Found] = []
    async with aclosing(source.search(60)) as search:
        async for each in search:
            if each not in found:
                found.append(each)

            if len(found) == count:
                return found

    return found


@linux
async def test_arms_in_the_wifi_answer_a_broadcast() -> None:
    async with arms(2) as (sims, places):
        found = await first(WiFiModules(places), 2)
        assert {f"{each.url}:8899" for each in found} == {sim.url for sim in sims}
        assert all(each.description == "USR-C322 2.17.14" for each in found)
        async with Magician.connect(found[0].url, control=False) as arm:
            await arm.get_pose()


@linux
async def test_an_address_that_this_computer_does_not_have_hinders_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    async with arms(1) as (sims, [(target, port)]):
        monkeypatch.setattr(wifi, "PORT", port)
        monkeypatch.setattr(wifi, "broadcast_targets", lambda: [("192.0.2.1", target), ("127.0.0.1", target)])
        (found,) = await first(WiFiModules())
        assert f"{found.url}:8899" == sims[0].url
        monkeypatch.setattr(wifi, "broadcast_targets", lambda: [("192.0.2.1", target)])
        with pytest.raises(OSError, match="Cannot assign"):
            await first(WiFiModules())


@linux
async def test_a_question_that_is_lost_is_asked_again() -> None:
    class Deaf(asyncio.DatagramProtocol):
        heard = 0

        def connection_made(self, transport: Any) -> None:
            self.transport = transport

        def datagram_received(self, data: bytes, addr: Any) -> None:
            self.heard += 1
            if self.heard == 3:
                self.transport.sendto(b"10.0.0.7,D8B04CB33868,USR-C322,2.17.14", addr)

    deaf = Deaf()
    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(lambda: deaf, local_addr=("127.0.0.1", 0))
    try:
        (found,) = await first(WiFiModules([transport.get_extra_info("sockname")], interval=0.01))
        assert found.url == "udp://10.0.0.7"
    finally:
        transport.close()


@linux
async def test_two_answers_of_one_arm_are_known_as_its_own() -> None:
    async with arms(1) as (_, places), aclosing(WiFiModules(places * 2).search(60)) as search:
        assert await anext(search) == await anext(search)


async def test_a_module_answers_nothing_else() -> None:
    async with announced("udp://127.0.0.1:8899", "127.0.0.1", 0) as there:
        heard: asyncio.Queue[bytes] = asyncio.Queue()

        class Asker(asyncio.DatagramProtocol):
            def datagram_received(self, data: bytes, addr: Any) -> None:
                heard.put_nowait(data)

        loop = asyncio.get_running_loop()
        transport, _ = await loop.create_datagram_endpoint(Asker, remote_addr=("127.0.0.1", there))
        try:
            for question in (b"Who is Dobot", b"WhoisDobotM1", b"", QUESTION):
                transport.sendto(question)

            assert await heard.get() == b"127.0.0.1,02D07F000001,USR-C322,2.17.14"
            assert heard.empty()
        finally:
            transport.close()


async def test_only_an_arm_in_the_wifi_answers() -> None:
    with pytest.raises(ValueError, match="udp"):
        async with announced("tcp://127.0.0.1:1"):
            pass


# --- in networks of its own ---

NETWORKS = """
set -e
ip link set lo up
ip link add v0 type veth peer name v1
ip address add 10.77.0.1/24 broadcast + dev v0
ip address add 10.77.1.1/24 broadcast + dev v1
ip link set v0 up
ip link set v1 up
"""
TWO_ARMS = """
import asyncio
from contextlib import AsyncExitStack
from dobot_async import discover
from dobot_async.discovery.interfaces import broadcast_targets
from dobot_async.simulator import announced, simulate

async def main():
    print([target for _, target in broadcast_targets()])
    async with AsyncExitStack() as stack:
        for network in (0, 1):
            listen = f"udp://10.77.{network}.1:8899"
            await stack.enter_async_context(simulate(listen=listen))
            await stack.enter_async_context(announced(listen, f"10.77.{network}.255"))

        print([found.url async for found in discover(sources=["wifi"], timeout=1.5)])

asyncio.run(main())
"""
NO_NETWORK = """
import asyncio
from dobot_async import discover
from dobot_async.discovery.wifi import WiFiModules

async def main():
    for source in ("wifi", WiFiModules([("10.77.0.255", 48899)])):
        problems = []
        print([found.url async for found in discover(sources=[source], timeout=0.1, on_problem=problems.append)])
        print(problems[0].message)

asyncio.run(main())
"""


def in_namespace(setup: str, program: str) -> list[str]:
    """Runs a program in a network namespace of its own; returns the lines of its output."""
    command = ["unshare", "--user", "--map-root-user", "--net"]
    may = shutil.which("unshare") and shutil.which("ip")
    if not may or subprocess.run([*command, "sh", "-c", NETWORKS], capture_output=True, check=False).returncode:
        pytest.skip("this system does not allow namespaces with networks of their own")

    ran = subprocess.run(
        [*command, "sh", "-c", f'{setup}\nexec "$@"', "sh", sys.executable, "-W", "error", "-c", program],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert ran.stderr == ""
    return ran.stdout.splitlines()


@pytest.mark.full
@linux
def test_each_network_of_the_computer_is_asked() -> None:
    assert in_namespace(NETWORKS, TWO_ARMS) == [
        "['10.77.0.255', '10.77.1.255']",
        "['udp://10.77.0.1', 'udp://10.77.1.1']",
    ]


@linux
def test_a_computer_without_a_network_says_so() -> None:
    _, nowhere, _, unreachable = in_namespace("true", NO_NETWORK)
    assert nowhere == "this computer is in no IPv4 network"
    assert "unreachable" in unreachable


# --- words ---


@given(st.lists(st.text()))
def test_any_names_can_be_sorted(names: list[str]) -> None:
    assert sorted(sorted(names), key=natural) == sorted(sorted(names, reverse=True), key=natural)


@given(st.text())
def test_what_devices_say_cannot_command_a_terminal(text: str) -> None:
    assert printable(text).isprintable()
