"""BLE as it is: bleak's own BlueZ backend, unchanged, against a BlueZ on a bus of its own; the simulated arm behind it.

Where the program dbus-daemon is missing all of it is skipped, unless `DOBOT_REQUIRE_DBUS` is set: then it fails.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import math
import os
import selectors
import shutil
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AsyncExitStack, aclosing, asynccontextmanager, suppress
from pathlib import Path
from random import Random
from typing import Any, cast

import anyio
import pytest

from dobot_async import ConnectFailed, ConnectionLost, Magician, MotionUnknown, PTPMode, SuctionCup
from dobot_async._core.protocol.contract import LinkState
from dobot_async._core.protocol.transport import Transport
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame, Parser, encode
from dobot_async.simulator import Simulation, simulate
from dobot_async.transports import open_transport

if sys.platform != "linux":
    pytest.skip("BlueZ is Linux's", allow_module_level=True)

from bleak import BleakClient
from bleak.backends.bluezdbus.version import BlueZFeatures
from bleak.backends.characteristic import BleakGATTCharacteristic
from bleak.backends.device import BLEDevice
from bleak.exc import (
    BleakBluetoothNotAvailableError,
    BleakBluetoothNotAvailableReason,
    BleakDBusError,
    BleakDeviceNotFoundError,
    BleakError,
    BleakGATTProtocolError,
)
from dbus_fast import Message
from dbus_fast.aio import MessageBus

from dobot_async._core.util.tasks import Ended, run_shielded, run_within
from dobot_async.simulator.ble import bluez
from dobot_async.simulator.ble.link_layer import RadioSettings, round_trip
from dobot_async.simulator.ble.module import BleModule
from dobot_async.simulator.ble.names import ADAPTER
from dobot_async.simulator.ble.testbed import BlueZTestbed, rig
from dobot_async.transports.ble import diagnostics as ble_advice
from dobot_async.transports.ble import lock as ble_claim
from dobot_async.transports.ble import opening
from dobot_async.transports.ble import scan as ble_scan
from dobot_async.transports.ble import transport as ble

DAEMON = shutil.which("dbus-daemon")
if not DAEMON and not os.environ.get("DOBOT_REQUIRE_DBUS"):
    pytest.skip("dbus-daemon is not installed (Debian: apt install dbus-daemon)", allow_module_level=True)

FAST = 0.0075
IN_TIME = 20.0
GET_POSE = encode(Frame(c.GET_POSE.id, 0, b""))
SLOW = 4
RESOLUTION = 1e-6
PARAMS = encode(
    Frame(
        c.SET_PTP_JOINT_PARAMS.id,
        1,
        c.SET_PTP_JOINT_PARAMS.request.encode(c.PTPJointParams((200.0,) * 4, (200.0,) * 4)),
    )
)
MOVE = encode(Frame(c.SET_PTP_CMD.id, 3, c.SET_PTP_CMD.request.encode(c.PTPCmd(PTPMode.MOVJ_XYZ, 220, 0, 40))))


@pytest.fixture
async def world() -> AsyncIterator[BlueZTestbed]:
    """A bus with BlueZ on it."""
    async with rig() as made:
        yield made


@pytest.fixture
async def sim() -> AsyncIterator[Simulation]:
    """An arm that is so fast that a test need not wait for it."""
    async with simulate(speed=50) as made:
        yield made


@pytest.fixture
async def module(world: BlueZTestbed, sim: Simulation) -> BleModule:
    """The arm's BLE module, on a good connection."""
    return world.add(sim, fast())


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """What waits for an arm that is not there waits less."""
    monkeypatch.setattr(opening, "SCAN", 0.3)
    monkeypatch.setattr(opening, "PAUSES", (0.01, 0.01))


def fast(**details: Any) -> RadioSettings:
    """A connection that costs a test little time."""
    return RadioSettings(interval=FAST, advertising=0.02, **details)


@asynccontextmanager
async def opened(url: str) -> AsyncIterator[Transport]:
    """An open transport; a test that hangs fails."""
    async with asyncio.timeout(IN_TIME):
        transport = await open_transport(url, arm="magician")
        async with aclosing(cast(Any, transport)):
            yield transport


async def frames(transport: Transport, count: int = 1) -> list[Frame]:
    """The next frames that arrive."""
    parser = Parser()
    found: list[Frame] = []
    while len(found) < count:
        found += parser.feed(await transport.receive())

    return found


async def ask(transport: Transport) -> int:
    """Asks for the pose; returns the ID of the answer."""
    await transport.send(GET_POSE)
    return (await frames(transport))[0].id


async def until(condition: Callable[[], bool]) -> None:
    """Lets the loop go on until something has come about."""
    async with asyncio.timeout(IN_TIME):
        while not condition():  # noqa: ASYNC110 - nobody tells when
            await asyncio.sleep(0.001)


def once(step: str, then: Callable[[], object], after: int = 0) -> Callable[[str], None]:
    """Does something when a step is taken, once."""
    left = [after]

    def watch(taken: str) -> None:
        if taken == step:
            left[0] -= 1
            if left[0] == -1:
                then()

    return watch


def writes_are_timed(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, float]]:
    """Returns where begin and end of each write from now on will be found."""
    times: list[tuple[float, float]] = []
    write = BleakClient.write_gatt_char

    async def timed(client: Any, *args: Any, **options: Any) -> None:
        loop = asyncio.get_running_loop()
        began = loop.time()
        await write(client, *args, **options)
        times.append((began, loop.time()))

    monkeypatch.setattr(BleakClient, "write_gatt_char", timed)
    return times


def descriptors() -> int:
    """How many descriptors are open."""
    return len(list(Path("/proc/self/fd").iterdir()))


# URLs.


@pytest.mark.parametrize(
    ("url", "wrong"),
    [
        ("ble://arm/1", "expected ble://NAME.*%2F"),
        ("ble:///dev/ttyUSB0", "expected ble://NAME"),
        ("ble://arm#1", "a # in a URL is written %23"),
        ("ble://arm?pace=fast", "pace='fast': expected seconds"),
        ("ble://arm?pace=-1", "pace=.*expected seconds between two chunks"),
        ("ble://arm?pace=nan", "pace=.*expected seconds between two chunks"),
        ("ble://arm?speed=1", "unknown option 'speed'; known: pace, adapter"),
        ("ble:?adapter=hci0&adapter=hci1", "option adapter is given twice"),
    ],
)
def test_a_bad_url_names_what_is_wrong(url: str, wrong: str) -> None:
    with pytest.raises(ValueError, match=wrong):
        open_transport(url, arm="magician").send(None)


def seen(name: str = "", address: str = "D8:B0:4C:B3:38:68", *services: str) -> ble_scan.SeenDevice:
    """What somebody advertises."""
    device = BLEDevice(address, name or None, {})
    return ble_scan.SeenDevice(device, name, frozenset(services), connected=False)


@pytest.mark.parametrize(
    ("text", "who", "fits"),
    [
        ("", seen("WH-BLE 102"), True),
        ("", seen("my USR-BLE100 3"), True),
        ("", seen("", "D8:B0:4C:B3:38:68", ble_scan.SERVICE), True),
        ("", seen("headphones"), False),
        ("", seen(), False),
        ("WH-BLE 102", seen("WH-BLE 102"), True),
        ("wh-ble 102 ", seen("WH-BLE 102"), True),
        ("WH-BLE 10", seen("WH-BLE 102"), False),
        ("bench 3", seen("bench 3"), True),
        ("D8:B0:4C:B3:38:68", seen("WH-BLE 102"), True),
        ("d8-b0-4c-b3-38-68", seen(), True),
        ("D8:B0:4C:B3:38:69", seen("WH-BLE 102"), False),
        ("0F3C1A55-7A4B-4C7A-9F2E-3F1B2C3D4E5F", seen("", "0f3c1a55-7a4b-4c7a-9f2e-3f1b2c3d4e5f"), True),
        ("0F3C1A55-7A4B-4C7A-9F2E-3F1B2C3D4E5F", seen("WH-BLE 102"), False),
    ],
)
def test_who_is_wanted(text: str, who: ble_scan.SeenDevice, fits: bool) -> None:
    assert ble_scan.Wanted(text).fits(who) is fits


# Finding the arm.


@pytest.mark.parametrize(
    "url", ["ble:", "ble://WH-BLE 102", "ble://WH-BLE%20102", "ble://D8:B0:4C:B3:38:68", "ble://d8-b0-4c-b3-38-68"]
)
async def test_an_arm_is_found(module: BleModule, url: str) -> None:
    async with opened(url) as transport:
        assert await ask(transport) == c.GET_POSE.id
        assert (transport.in_flight, transport.window, transport.reorder_window) == (1, 1, 0.0)


async def test_an_arm_is_found_by_its_service_alone(module: BleModule) -> None:
    module.name = "bench 3"
    module.advertises_service = True
    async with opened("ble:") as transport:
        assert await ask(transport) == c.GET_POSE.id


async def test_a_name_may_come_later_than_the_device(module: BleModule) -> None:
    module.late_name = 3
    async with opened("ble://WH-BLE 102") as transport:
        assert await ask(transport) == c.GET_POSE.id


async def test_the_arm_of_the_address_is_reached_among_others(world: BlueZTestbed, sim: Simulation) -> None:
    async with AsyncExitStack() as stack:
        others = [await stack.enter_async_context(simulate()) for _ in range(3)]
        modules = [world.add(each, fast()) for each in (*others[:2], sim, others[2])]
        async with opened(modules[2].url) as transport:
            await ask(transport)

        assert [each.connections for each in modules] == [0, 0, 1, 0]


async def test_two_arms_are_looked_for_at_once(world: BlueZTestbed, module: BleModule) -> None:
    async with simulate() as other:
        second = world.add(other, fast(), name="bench 3")
        async with opened(module.url) as one:
            pass

        async with AsyncExitStack() as stack:
            both = await asyncio.gather(*(stack.enter_async_context(opened(each.url)) for each in (module, second)))
            assert [await ask(each) for each in both] == [c.GET_POSE.id] * 2

        assert one is not both[0]


@pytest.mark.usefixtures("impatient")
async def test_nobody_in_range(world: BlueZTestbed) -> None:
    with pytest.raises(ConnectFailed, match=r"no arm was seen, nor any other BLE device; is the arm switched on"):
        await open_transport("ble:", arm="magician")


@pytest.mark.usefixtures("impatient")
async def test_others_in_range_are_named(world: BlueZTestbed, module: BleModule) -> None:
    module.name = "headphones"
    with pytest.raises(ConnectFailed, match=r"bench 3 was not seen, only 1 other BLE device, such as headphones"):
        await open_transport("ble://bench 3", arm="magician")


@pytest.mark.usefixtures("impatient")
async def test_an_arm_that_a_phone_has_taken_is_not_seen(module: BleModule) -> None:
    module.taken = True
    with pytest.raises(ConnectFailed, match="no phone, other computer or other program connected"):
        await open_transport(module.url, arm="magician")


async def test_a_short_timeout_gives_the_same_advice(module: BleModule) -> None:
    module.in_range = False
    with pytest.raises(ConnectFailed, match=r"could not be opened within 0.2 s; no arm was seen.*switched on and near"):
        async with Magician.connect("ble:", timeout=0.2):
            pass


async def connect_and_crash(module: BleModule) -> None:
    """Some program connects to the arm, and ends without a word."""
    async with ble_scan.listening() as heard:
        async with asyncio.timeout(IN_TIME):
            await heard.get()

        bus: Any = await MessageBus(bus_address=os.environ["DBUS_SYSTEM_BUS_ADDRESS"]).connect()
        interface = "org.bluez.Device1"
        await bus.call(Message(destination="org.bluez", path=module.path, interface=interface, member="Connect"))

    bus.disconnect()
    await bus.wait_for_disconnect()
    async with asyncio.timeout(IN_TIME):
        while not (await ble_scan.connected())[0]:  # noqa: ASYNC110 - nobody tells when
            await asyncio.sleep(0.001)


@pytest.mark.parametrize("url", ["ble:", "ble://WH-BLE 102", "ble://D8:B0:4C:B3:38:68"])
async def test_a_connection_that_a_crash_left_behind_is_taken_over(module: BleModule, url: str) -> None:
    await connect_and_crash(module)
    async with opened(url) as transport:
        assert await ask(transport) == c.GET_POSE.id
        assert module.connections == 1

    assert not module.connected


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("of_ours", [True, False])
async def test_an_arm_that_another_program_uses_is_left_alone(
    module: BleModule, of_ours: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with opened(module.url) as transport:
        if not of_ours:
            monkeypatch.setattr(opening, "lock_device", lambda _: ble_claim.DeviceLock(None))

        with pytest.raises(ConnectFailed, match="else on this computer uses D8:B0:4C:B3:38:68; end it first"):
            await open_transport("ble:", arm="magician")

        assert await ask(transport) == c.GET_POSE.id
        assert module.connections == 1


@pytest.mark.usefixtures("impatient")
async def test_of_two_at_once_one_gets_the_arm(module: BleModule) -> None:
    openings = (open_transport("ble:", arm="magician") for _ in range(3))
    results = await asyncio.gather(*openings, return_exceptions=True)
    [transport] = [result for result in results if not isinstance(result, BaseException)]
    refusals = [str(result) for result in results if isinstance(result, ConnectFailed)]
    assert len(refusals) == 2
    assert all("uses D8:B0:4C:B3:38:68" in refusal for refusal in refusals)
    assert await ask(transport) == c.GET_POSE.id
    await transport.aclose()
    assert module.connections == 1


def test_a_claim_is_of_one_alone() -> None:
    first = ble_claim.lock_device("D8:B0:4C:B3:38:68")
    assert first
    assert ble_claim.lock_device("D8:B0:4C:B3:38:68") is None
    other = ble_claim.lock_device("D8:B0:4C:B3:38:69")
    assert other
    other.drop()
    first.drop()
    first.drop()
    again = ble_claim.lock_device("D8:B0:4C:B3:38:68")
    assert again
    again.drop()


async def test_a_change_of_a_connection_is_no_advertisement(module: BleModule) -> None:
    async with ble_scan.listening() as heard:
        async with opened(module.url):
            module.lose()

        async with asyncio.timeout(IN_TIME):
            while not (await heard.get()).connected:
                pass


async def test_the_free_one_of_two_is_taken(world: BlueZTestbed, module: BleModule) -> None:
    async with simulate() as other:
        async with opened("ble:") as first:
            second = world.add(other, fast())
            async with opened("ble:") as transport:
                assert await ask(transport) == await ask(first) == c.GET_POSE.id

        assert (module.connections, second.connections) == (1, 1)


# Bytes, both ways.


@pytest.mark.parametrize(("mtu", "pieces"), [(23, [20, 18]), (40, [37, 1]), (41, [38]), (247, [38])])
async def test_a_pose_is_put_together_again(module: BleModule, mtu: int, pieces: list[int]) -> None:
    module.radio.mtu = mtu
    notified = 0

    def count(step: str) -> None:
        nonlocal notified
        notified += step == "notify"

    module.watch = count
    async with opened(module.url) as transport:
        assert await ask(transport) == c.GET_POSE.id
        assert notified == len(pieces)


@pytest.mark.parametrize("kind", ["write-without-response", "write"])
@pytest.mark.parametrize(("mtu", "sizes"), [(23, [20, 3]), (30, [23]), (247, [23])])
async def test_chunks_are_as_long_as_the_connection_takes(
    module: BleModule, sim: Simulation, kind: str, mtu: int, sizes: list[int]
) -> None:
    module.writes = [kind]
    module.radio.mtu = mtu
    async with opened(module.url) as transport:
        await transport.send(MOVE)
        assert (await frames(transport))[0].id == c.SET_PTP_CMD.id
        assert [len(chunk) for chunk in module.written] == sizes
        assert set(module.kinds) == {"request" if kind == "write" else "command"}
        await until(lambda: bool(sim.arm.executed))


async def test_writes_are_without_response_if_both_are_offered(module: BleModule) -> None:
    module.writes = ["write", "write-without-response"]
    async with opened(module.url) as transport:
        await ask(transport)
        assert module.kinds == ["command"]


async def test_the_length_of_a_chunk_is_asked_for_each_time(module: BleModule) -> None:
    module.radio.mtu = 247
    async with opened(module.url) as transport:
        await transport.send(MOVE)
        await frames(transport)
        module.change_mtu(23)
        await until(lambda: transport._output.max_write_without_response_size == 20)  # type: ignore[attr-defined]
        await transport.send(MOVE)
        await frames(transport)
        assert [len(chunk) for chunk in module.written] == [23, 20, 3]


@pytest.mark.parametrize("interval", [0.0075, 0.015, 0.03, 0.05])
@pytest.mark.parametrize("mtu", [23, 247])
async def test_every_interval(world: BlueZTestbed, sim: Simulation, interval: float, mtu: int) -> None:
    module = world.add(sim, RadioSettings(interval=interval, mtu=mtu, packets=1, advertising=0.02))
    async with opened(module.url) as transport:
        assert [await ask(transport) for _ in range(3)] == [c.GET_POSE.id] * 3


@pytest.mark.parametrize("pace", [0.0, 0.01, 0.02])
async def test_chunks_keep_their_distance(module: BleModule, pace: float, monkeypatch: pytest.MonkeyPatch) -> None:
    times = writes_are_timed(monkeypatch)
    async with opened(f"{module.url}?pace={pace}") as transport:
        for _ in range(3):
            await transport.send(MOVE)  # no answer is waited for, so the frames keep the distance, too

        assert len(times) == 6
        assert min(then - began for (began, _), (then, _) in itertools.pairwise(times)) >= pace - RESOLUTION


async def test_the_distance_is_kept_while_the_module_confirms(
    module: BleModule, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A machine that is busy is late with the next chunk, but not each time."""
    times = writes_are_timed(monkeypatch)
    module.writes = ["write"]
    module.radio.interval = 0.06
    async with opened(f"{module.url}?pace=0.02") as transport:
        while not any(
            then - confirmed < 0.01 for (_, confirmed), (then, _) in zip(times[::2], times[1::2], strict=True)
        ):
            await transport.send(MOVE)

        assert all(then >= confirmed for (_, confirmed), (then, _) in itertools.pairwise(times))


async def test_an_answer_says_that_there_is_room(module: BleModule, monkeypatch: pytest.MonkeyPatch) -> None:
    times = writes_are_timed(monkeypatch)
    async with opened(f"{module.url}?pace=1") as transport:
        while not any(then - began < 0.9 for (began, _), (then, _) in itertools.pairwise(times)):
            await ask(transport)


async def test_frames_that_are_sent_at_once_do_not_mix(module: BleModule, sim: Simulation) -> None:
    async with opened(module.url) as transport:
        answers = asyncio.create_task(frames(transport, 5))
        await asyncio.gather(*(transport.send(MOVE) for _ in range(5)))
        await answers
        assert b"".join(module.written) == MOVE * 5


async def test_a_frame_that_has_begun_is_sent_to_its_end(module: BleModule) -> None:
    async with opened(module.url) as transport:
        sending = asyncio.create_task(transport.send(MOVE))
        waiting = asyncio.create_task(transport.send(GET_POSE))
        module.watch = once("write", lambda: (sending.cancel(), waiting.cancel()))
        for task in (sending, waiting):
            with pytest.raises(asyncio.CancelledError):
                await task

        await transport.send(GET_POSE)
        assert [frame.id for frame in await frames(transport, 2)] == [c.SET_PTP_CMD.id, c.GET_POSE.id]
        assert b"".join(module.written) == MOVE + GET_POSE


async def test_a_send_on_a_connection_that_takes_nothing_can_be_cancelled(
    module: BleModule, monkeypatch: pytest.MonkeyPatch
) -> None:
    loop = asyncio.get_running_loop()

    async def hang(client: Any, *args: Any, **options: Any) -> None:
        await loop.create_future()

    async with opened(module.url) as transport:
        monkeypatch.setattr(BleakClient, "write_gatt_char", hang)
        monkeypatch.setattr(ble, "GATT", 1.0)
        for _ in range(2):
            sending = asyncio.create_task(transport.send(MOVE))
            await asyncio.sleep(0.05)
            begun = loop.time()
            sending.cancel()
            await asyncio.wait([sending])
            assert sending.cancelled()
            assert loop.time() - begun < 0.3

        await broken(transport.send(GET_POSE), "did not answer in time")
        assert module.written == []


async def test_a_burst_of_notifications_arrives_in_order(module: BleModule) -> None:
    module.radio.packets = 10_000
    async with opened(module.url) as transport:
        sent = b"".join(number.to_bytes(2, "big") * 10 for number in range(2000))
        module.say(sent)
        arrived = b""
        while len(arrived) < len(sent):
            arrived += await transport.receive()

        assert arrived == sent


async def test_equal_notifications_all_arrive(module: BleModule) -> None:
    async with opened(module.url) as transport:
        module.say(bytes(20 * 20))
        arrived = b""
        while len(arrived) < 400:
            arrived += await transport.receive()

        assert arrived == bytes(400)


# Breaking.


async def broken(call: Any, because: str) -> None:
    """A verb says that the connection is gone, and why."""
    with pytest.raises(anyio.BrokenResourceError) as caught:
        async with asyncio.timeout(IN_TIME):
            await call

    assert because in str(caught.value.__cause__)


@pytest.mark.parametrize("step", ["connect", "connected", "resolved", "start_notify"])
async def test_a_connection_that_breaks_while_it_is_made_is_made_again(module: BleModule, step: str) -> None:
    module.watch = once(step, module.lose)
    async with opened("ble:") as transport:
        assert await ask(transport) == c.GET_POSE.id


@pytest.mark.parametrize("step", ["connect", "connected", "resolved", "start_notify"])
@pytest.mark.usefixtures("impatient")
async def test_one_that_always_breaks_is_given_up(module: BleModule, step: str) -> None:
    module.watch = lambda taken: module.lose() if taken == step else None
    with pytest.raises(ConnectFailed, match="is the arm near"):
        await open_transport("ble:", arm="magician")

    assert not module.connected


@pytest.mark.parametrize("kind", ["write-without-response", "write"])
@pytest.mark.parametrize(("step", "number"), [("write", 0), ("write", 1), ("arrive", 0), ("arrive", 1)])
async def test_a_break_in_the_middle_of_a_frame(module: BleModule, kind: str, step: str, number: int) -> None:
    module.writes = [kind]
    async with opened(module.url) as transport:
        module.watch = once(step, module.lose, number)
        with suppress(anyio.BrokenResourceError):
            await transport.send(MOVE)

        await broken(transport.receive(), "")
        await broken(transport.send(GET_POSE), "")


async def test_a_break_in_the_middle_of_an_answer(module: BleModule) -> None:
    async with opened(module.url) as transport:
        module.watch = once("notify", module.lose, 1)
        await transport.send(GET_POSE)
        await broken(frames(transport), "the arm's BLE module has disconnected")
        await broken(transport.send(GET_POSE), "the arm's BLE module has disconnected")


async def test_a_break_in_idleness(module: BleModule) -> None:
    async with opened(module.url) as transport:
        waiting = asyncio.create_task(transport.receive())
        await asyncio.sleep(0)
        module.lose()
        await broken(waiting, "the arm's BLE module has disconnected")


async def test_what_has_arrived_before_the_break_is_not_lost(module: BleModule) -> None:
    async with opened(module.url) as transport:
        module.say(b"last words")
        await until(lambda: bool(transport._buffer))  # type: ignore[attr-defined]
        module.lose()
        await until(lambda: transport._lost.done())  # type: ignore[attr-defined]
        assert await transport.receive() == b"last words"
        await broken(transport.receive(), "")


async def test_closed_is_closed(module: BleModule) -> None:
    async with opened(module.url) as transport:
        waiting = asyncio.create_task(transport.receive())
        await asyncio.sleep(0)
        await transport.aclose()
        await transport.aclose()
        for call in (waiting, transport.receive(), transport.send(GET_POSE)):
            with pytest.raises(anyio.ClosedResourceError):
                await call

    assert not module.connected


@pytest.mark.parametrize("drop", [True, False])
async def test_ten_connections_leak_nothing(module: BleModule, drop: bool) -> None:
    counts = []
    for _ in range(10):
        async with opened(module.url) as transport:
            assert await ask(transport) == c.GET_POSE.id
            if drop:
                module.lose()
                await broken(transport.receive(), "")

        counts.append(descriptors())

    assert counts == counts[:1] * 10
    assert module.connections == 10


async def test_a_write_that_never_comes_back_ends_the_connection(
    module: BleModule, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with opened(module.url) as transport:
        monkeypatch.setattr(ble, "GATT", 0.1)
        module.stuck = True
        await broken(transport.send(GET_POSE), "did not answer in time")
        await broken(transport.receive(), "did not answer in time")


async def test_a_length_that_nobody_can_tell_any_more_ends_the_connection(
    module: BleModule, monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(_: BleakGATTCharacteristic) -> int:
        raise AttributeError("max_pdu_size")  # as on Windows, of a connection that has just ended

    async with opened(module.url) as transport:
        monkeypatch.setattr(BleakGATTCharacteristic, "max_write_without_response_size", property(gone))
        await broken(transport.send(GET_POSE), "max_pdu_size")
        await broken(transport.receive(), "max_pdu_size")


async def test_a_device_that_is_forgotten_ends_with_the_next_write(module: BleModule) -> None:
    async with opened(module.url) as transport:
        module.vanish()
        await broken(transport.send(GET_POSE), "UnknownObject")
        await broken(transport.receive(), "UnknownObject")


async def test_a_service_that_dies_ends_it_with_the_next_write(world: BlueZTestbed, module: BleModule) -> None:
    async with opened(module.url) as transport:
        assert await ask(transport) == c.GET_POSE.id
        await world.stop()
        await broken(transport.send(GET_POSE), "start it")
        await broken(transport.receive(), "start it")

    with pytest.raises(ConnectFailed, match="systemctl start bluetooth"):
        await open_transport(module.url, arm="magician")

    await world.start()
    async with opened(module.url) as transport:
        assert await ask(transport) == c.GET_POSE.id


async def test_a_bus_that_dies_ends_it(world: BlueZTestbed, module: BleModule) -> None:
    async with opened(module.url) as transport:
        assert await ask(transport) == c.GET_POSE.id
        await world.kill_bus()
        await broken(transport.receive(), "")
        await broken(transport.send(GET_POSE), "")

    with pytest.raises(ConnectFailed, match="no D-Bus system bus"):
        await open_transport(module.url, arm="magician")


async def test_an_adapter_that_is_switched_off(world: BlueZTestbed, module: BleModule) -> None:
    assert world.bluez
    async with opened(module.url) as transport:
        world.bluez.power(on=False)
        await broken(transport.receive(), "has disconnected")

    for url in ("ble:", "ble:?adapter=hci0"):
        with pytest.raises(ConnectFailed, match="Bluetooth is off; switch it on"):
            await open_transport(url, arm="magician")

    world.bluez.power(on=True)
    async with opened("ble:?adapter=hci0") as transport:
        assert await ask(transport) == c.GET_POSE.id
        assert transport.url == f"{module.url}?adapter=hci0"  # type: ignore[attr-defined]


@pytest.mark.parametrize("member", ["GetManagedObjects", "StartDiscovery", "StopDiscovery"])
async def test_a_service_that_hangs_is_not_waited_for(
    module: BleModule, monkeypatch: pytest.MonkeyPatch, member: str
) -> None:
    monkeypatch.setattr(ble_scan, "PATIENCE", 0.1)
    for called in [called for called in bluez.HANDLERS if called[1] == member]:
        monkeypatch.setitem(bluez.HANDLERS, called, lambda *_: None)

    module.in_range = member == "StopDiscovery"
    if module.in_range:  # what was to be stopped is not needed any more
        async with opened(module.url) as transport:
            assert await ask(transport) == c.GET_POSE.id
    else:
        with pytest.raises(ConnectFailed, match="service does not answer; restart it"):
            await open_transport(module.url, arm="magician")


async def test_an_adapter_that_is_not_there(module: BleModule) -> None:
    with pytest.raises(ConnectFailed, match="no such Bluetooth adapter"):
        await open_transport("ble:?adapter=hci7", arm="magician")


async def test_no_bus_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    for address in ("unix:path=/nowhere/bus", "nonsense:"):
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", address)
        with pytest.raises(ConnectFailed, match="no D-Bus system bus"):
            await open_transport("ble:", arm="magician")


@pytest.mark.usefixtures("impatient")
async def test_somebody_without_the_service_is_no_arm(module: BleModule) -> None:
    module.services = False
    with pytest.raises(ConnectFailed, match="has not the service of the arm's BLE module"):
        await open_transport(module.url, arm="magician")

    assert not module.connected


# Giving up, and closing slowly.


@pytest.mark.parametrize("step", ["connect", "connected", "resolved", "start_notify"])
@pytest.mark.parametrize("native", [True, False])
async def test_an_opening_that_is_cancelled_leaves_nothing(module: BleModule, step: str, native: bool) -> None:
    module.disconnecting = 0.02
    if native:
        opening = asyncio.create_task(open_transport(module.url, arm="magician"))
        module.watch = once(step, opening.cancel)
        with pytest.raises(asyncio.CancelledError):
            await opening
    else:
        with anyio.CancelScope() as scope:
            module.watch = once(step, scope.cancel)
            await open_transport(module.url, arm="magician")

        assert scope.cancelled_caught

    await until(lambda: not module.connected)
    module.watch = lambda _: None
    async with opened(module.url) as transport:
        assert await ask(transport) == c.GET_POSE.id


async def test_an_arm_that_is_found_when_nobody_wants_it_any_more_is_free(
    module: BleModule, monkeypatch: pytest.MonkeyPatch
) -> None:
    opening = asyncio.create_task(open_transport(module.url, arm="magician"))
    stop = bluez.HANDLERS[ADAPTER, "StopDiscovery"]

    def cancelling(service: bluez.BlueZ, call: Message) -> None:
        opening.cancel()
        stop(service, call)

    monkeypatch.setitem(bluez.HANDLERS, (ADAPTER, "StopDiscovery"), cancelling)
    with pytest.raises(asyncio.CancelledError) as caught:
        await opening

    taken = ble_claim.lock_device(module.address)
    assert taken, f"it is free only when nobody holds {caught} any more"
    taken.drop()
    assert module.connections == 0


async def test_a_question_for_the_version_that_is_cancelled_is_no_obstacle_later(
    module: BleModule, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = tmp_path / "asked"
    tool = tmp_path / "bluetoothctl"
    tool.write_text(f"#!/bin/sh\ntouch {asked}\nsleep 0.2\necho bluetoothctl: 5.66\n", encoding="ascii")
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setattr(BlueZFeatures, "checked_bluez_version", False)
    monkeypatch.setattr(BlueZFeatures, "_check_bluez_event", None)
    opening = asyncio.create_task(open_transport(module.url, arm="magician"))
    await until(asked.exists)
    opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening

    async with opened(module.url) as transport:
        assert await ask(transport) == c.GET_POSE.id


async def test_a_slow_end_is_waited_for(module: BleModule) -> None:
    module.disconnecting = 0.2
    async with opened(module.url):
        pass

    assert not module.connected


async def test_a_close_that_is_cancelled_goes_on(module: BleModule) -> None:
    module.disconnecting = 0.1
    async with opened(module.url) as transport:
        with anyio.move_on_after(0.01):
            await transport.aclose()

        assert module.connected
        await transport.aclose()
        assert not module.connected


async def test_a_service_that_hangs_does_not_hold_up_the_end(
    module: BleModule, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ble, "DISCONNECT", 0.1)
    async with opened(module.url):
        module.disconnecting = 3600.0


# What bleak says.


@pytest.mark.parametrize(
    ("error", "says", "passing"),
    [
        (BleakDBusError("org.bluez.Error.Failed", ["Not connected"]), "is the arm near", True),
        (BleakDBusError("org.bluez.Error.NotReady", ["Resource Not Ready"]), "switch it on", False),
        (BleakDBusError("org.freedesktop.DBus.Error.AccessDenied", ["no"]), "group bluetooth", False),
        (BleakDBusError("org.freedesktop.DBus.Error.ServiceUnknown", ["no"]), "systemctl start bluetooth", False),
        (BleakGATTProtocolError(0x0E), "is the arm near", True),
        (BleakDeviceNotFoundError("AA", "not found"), "is the arm near", True),
        (BleakError("Not connected"), "is the arm near", True),
        (BleakError("adapter 'hci3' not found"), "adapter=hci0", False),
        (BleakError("Bleak requires BlueZ >= 5.55."), "update bluez", False),
        (TimeoutError(), "did not answer in time", True),
        (EOFError(), "EOFError", True),
        (PermissionError(13, "denied"), "may not use Bluetooth", False),
        (FileNotFoundError(2, "none"), "D-Bus system bus", False),
        *(
            (BleakBluetoothNotAvailableError("no", reason), says, False)
            for reason, says in {
                BleakBluetoothNotAvailableReason.NO_BLUETOOTH: "plugged in",
                BleakBluetoothNotAvailableReason.NO_BLE_CENTRAL_ROLE: "4.0",
                BleakBluetoothNotAvailableReason.POWERED_OFF: "switch it on",
                BleakBluetoothNotAvailableReason.DENIED_BY_USER: "macOS: System Settings",
                BleakBluetoothNotAvailableReason.DENIED_BY_SYSTEM: "may not use Bluetooth",
                BleakBluetoothNotAvailableReason.DENIED_BY_UNKNOWN: "may not use Bluetooth",
                BleakBluetoothNotAvailableReason.UNKNOWN: "switch it on",
            }.items()
        ),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Exception) else "",
)
def test_every_error_says_what_to_do(error: Exception, says: str, passing: bool) -> None:
    trouble = ble_advice.trouble(error)
    assert says in trouble.text
    assert trouble.passing is passing


# Calls that are not left half done.


async def test_a_whole_call_comes_to_its_end() -> None:
    begun, may, done = asyncio.Event(), asyncio.Event(), asyncio.Event()

    async def work() -> str:
        begun.set()
        await may.wait()
        done.set()
        return "done"

    asyncio.get_running_loop().call_soon(may.set)
    assert await run_shielded(work()) == "done"
    for event in (begun, may, done):
        event.clear()

    task = asyncio.create_task(run_shielded(work()))
    await begun.wait()
    task.cancel()
    await asyncio.sleep(0)
    assert not task.done()
    may.set()
    with pytest.raises(asyncio.CancelledError):
        await task

    assert done.is_set()


async def test_a_call_ends_with_its_time_or_with_what_it_is_for() -> None:
    cleaned = []

    async def work() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            await asyncio.sleep(0)
            cleaned.append(True)

    with pytest.raises(TimeoutError):
        await run_within(0.001, work())

    over: asyncio.Future[None] = asyncio.get_running_loop().create_future()
    over.set_result(None)
    with pytest.raises(Ended):
        await run_within(IN_TIME, work(), until=over)

    with anyio.move_on_after(0.001):
        await run_within(IN_TIME, work())

    assert len(cleaned) == 3


# The radio's model.


@pytest.mark.parametrize(
    ("radio", "request_bytes", "reply_bytes", "pace", "events"),
    [
        (RadioSettings(interval=0.03), 6, 38, 0.02, 2),
        (RadioSettings(interval=0.03, packets=1), 6, 38, 0.02, 3),
        (RadioSettings(interval=0.03), 23, 14, 0.02, 2),
        (RadioSettings(interval=0.03, packets=1), 23, 14, 0.0, 3),
        (RadioSettings(interval=0.0075), 23, 14, 0.02, 4),
        (RadioSettings(interval=0.0075, mtu=247), 23, 14, 0.02, 2),
    ],
)
def test_the_least_round_trip(
    radio: RadioSettings, request_bytes: int, reply_bytes: int, pace: float, events: int
) -> None:
    assert round_trip(radio, request_bytes, reply_bytes, pace) == pytest.approx(events * radio.interval)


@pytest.mark.parametrize(
    "details", [{"interval": 0.001}, {"mtu": 22}, {"mtu": 600}, {"packets": 0}, {"advertising": 0}]
)
def test_a_radio_that_cannot_be(details: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"is 0.0075 to 4 s|expected an mtu"):
        RadioSettings(**details)


class SlowSelector(selectors.SelectSelector):
    """Waits longer."""

    def select(self, timeout: float | None = None) -> Any:
        """Waits."""
        return super().select(timeout and timeout * SLOW)


class SlowMotion(asyncio.SelectorEventLoop):
    """A loop on which everything takes longer, but for what the computer has to do, which so counts for less."""

    def __init__(self) -> None:
        super().__init__(SlowSelector())

    def time(self) -> float:
        """The time."""
        return time.monotonic() / SLOW


@pytest.mark.parametrize(
    ("request_", "mtu", "pace"),
    [(GET_POSE, 23, 0.02), (PARAMS, 23, 0.02), (PARAMS, 23, 0.0), (GET_POSE, 247, 0.02), (PARAMS, 247, 0.02)],
)
def test_round_trips_are_as_short_as_the_radio_lets_them_be(request_: bytes, mtu: int, pace: float) -> None:
    """However busy the machine is, some are; if the driver misses an event by itself, none is."""
    radio = RadioSettings(interval=FAST, mtu=mtu)

    async def measure() -> None:
        loop = asyncio.get_running_loop()
        async with simulate(listen=f"ble:?interval={FAST}&mtu={mtu}") as sim, opened(f"{sim.url}?pace={pace}") as air:
            await air.send(request_)
            answer = await frames(air)  # it comes with an event
            limit = round_trip(radio, len(request_), len(encode(answer[0])), pace)
            took = math.inf
            while took > 1.15 * limit:
                began = loop.time()
                await air.send(request_)
                await frames(air)
                took = loop.time() - began

    with asyncio.Runner(loop_factory=SlowMotion) as runner:
        runner.run(measure())


# A whole Magician.


async def pick_and_place(arm: Magician) -> None:
    """Two parts from here to there."""
    await arm.set_end_effector(SuctionCup())
    await arm.set_speed(100)
    await arm.move_to(200, 0, 60)
    for y in (-60, 60):
        async with arm.queue.batch() as batch:
            batch.move_to(200, y, 60)
            batch.move_to(200, y, 10, mode=PTPMode.MOVL_XYZ)
            batch.suction(True)
            batch.wait(0.2)
            batch.move_by(z=50)
            batch.move_to(240, y, 20, mode=PTPMode.JUMP_XYZ)
            batch.suction(False)
            placed = batch.wait(0.1)

        await placed

    await arm.queue.join()


def executed(sim: Simulation) -> list[tuple[str, Any]]:
    """What the arm has executed of its queue; without the WAITs of 0 ms with which the driver counts."""
    return [
        (each.outcome, each.value) for each in sim.arm.executed if each.index is not None and each.value != c.WAITCmd(0)
    ]


def targets(sim: Simulation) -> list[float]:
    """The x of the PTP commands that the arm has executed."""
    return [each.value.x for each in sim.arm.executed if each.outcome == "done" and each.name == "SetPTPCmd"]


async def test_a_whole_cycle_is_the_same_as_in_memory() -> None:
    async with (
        simulate(speed=100) as memory,
        simulate(listen="ble:?interval=0.03&mtu=23", speed=100) as air,
        Magician.connect(memory.url) as here,
        Magician.connect(air.url, window=8) as there,
    ):
        await pick_and_place(here)
        await pick_and_place(there)
        assert executed(air) == executed(memory)
        assert len(executed(air)) == 17
        assert air.arm.counters.unfit == air.arm.counters.unknown == air.arm.counters.overflowed == 0
        assert there.link.stats.repeated == 0 or there.link.stats.repeated < there.link.stats.sent / 2


async def test_a_program_that_fails_stops_the_arm(module: BleModule, sim: Simulation) -> None:
    with pytest.raises(RuntimeError, match="mine"):
        async with Magician.connect(module.url) as arm:
            await arm.set_speed(0.01)
            await arm.laser(True)
            await arm.queue.move_to(200, 0, 60)
            raise RuntimeError("mine")

    assert [outcome for outcome, _ in executed(sim)] == ["aborted"]
    assert sim.arm.device.idle
    assert not sim.arm.laser


async def test_without_reconnect_a_break_is_the_end(module: BleModule) -> None:
    with pytest.raises(ConnectionLost, match="the arm's BLE module has disconnected"):
        async with Magician.connect(module.url) as arm:
            module.lose()
            await arm.get_pose()


async def test_motions_resolve_after_an_outage(module: BleModule, sim: Simulation) -> None:
    async with Magician.connect(module.url, reconnect=True) as arm:
        motions = [await arm.queue.move_to(200 + step, 40 * (-1) ** step, 40) for step in range(6)]
        module.lose()
        async with asyncio.timeout(IN_TIME):
            await asyncio.gather(*(motion.wait() for motion in motions))
            await arm.move_to(220, 0, 40)

        assert targets(sim) == [200, 201, 202, 203, 204, 205, 220]
        assert arm.link.outages == 1


@pytest.mark.parametrize(("step", "number"), [("write", 0), ("write", 1), ("arrive", 0), ("arrive", 1), ("notify", 0)])
async def test_no_motion_is_lost_or_doubled_wherever_the_link_breaks(
    module: BleModule, sim: Simulation, step: str, number: int
) -> None:
    async with asyncio.timeout(IN_TIME), Magician.connect(module.url, reconnect=True) as arm:
        await arm.move_to(210, 0, 40)
        module.watch = once(step, module.lose, number)
        await arm.move_to(220, 0, 40)
        await arm.move_to(230, 0, 40)
        assert targets(sim) == [210, 220, 230]
        assert arm.link.outages == 1


@pytest.mark.full
@pytest.mark.parametrize("seed", range(2))
async def test_a_link_that_breaks_again_and_again(module: BleModule, sim: Simulation, seed: int) -> None:
    """Forty motions, and a break after every few steps on the way, whatever they are."""
    random = Random(seed)
    left = [20]

    def watch(_: str) -> None:
        left[0] -= 1
        if not left[0]:
            left[0] = random.randint(20, 60)
            module.lose()

    async with asyncio.timeout(3 * IN_TIME), Magician.connect(module.url, reconnect=True, timeout=IN_TIME) as arm:
        module.watch = watch
        for step in range(40):
            await arm.queue.move_to(200 + step, 40 * (-1) ** step, 40)

        await arm.queue.join()
        module.watch = lambda _: None
        assert targets(sim) == [200 + step for step in range(40)]
        assert arm.link.outages > 2


async def test_ten_outages(module: BleModule, sim: Simulation) -> None:
    async with asyncio.timeout(IN_TIME), Magician.connect(module.url, reconnect=True) as arm:
        motion = await arm.queue.move_to(220, 60, 40)
        for _ in range(10):
            module.lose()
            assert math.isfinite((await arm.get_pose(timeout=IN_TIME)).x)

        await motion
        assert targets(sim) == [220]
        assert arm.link.outages == 10


async def test_an_arm_that_was_switched_off_is_recognised(world: BlueZTestbed) -> None:
    loop, jumped = asyncio.get_running_loop(), [0.0]
    async with simulate(clock=lambda: loop.time() + jumped[0]) as sim:
        module = world.add(sim, fast())
        jumped[0] = 100.0  # seconds that it has been on
        async with asyncio.timeout(IN_TIME), Magician.connect(module.url, reconnect=True) as arm:
            motion = await arm.queue.move_to(200, 0, 40)
            module.lose()
            sim.arm.power_cycle()
            with pytest.raises(MotionUnknown, match="switched off and on"):
                await motion

            await arm.wait(0)
            assert [outcome for outcome, _ in executed(sim)] == ["aborted"]


async def test_the_arm_goes_on_when_the_service_comes_back(
    world: BlueZTestbed, module: BleModule, sim: Simulation
) -> None:
    async with asyncio.timeout(IN_TIME), Magician.connect(module.url, reconnect=True) as arm:
        motion = await arm.queue.move_to(220, 60, 40)
        await world.stop()
        reading = asyncio.create_task(arm.get_pose(timeout=IN_TIME))
        await until(lambda: arm.link.state.value is LinkState.REOPENING)
        await world.start()
        assert math.isfinite((await reading).x)
        await motion
        assert targets(sim) == [220]


async def test_the_same_arm_is_reached_again_and_no_other_one(
    world: BlueZTestbed, module: BleModule, sim: Simulation
) -> None:
    service = world.bluez
    assert service
    async with simulate() as other, asyncio.timeout(IN_TIME):
        stranger = world.add(other, fast())
        stranger.in_range = False
        async with Magician.connect("ble:", reconnect=True) as arm:
            stranger.in_range = True
            module.in_range = False
            module.lose()
            reading = asyncio.create_task(arm.get_pose(timeout=IN_TIME))
            await until(lambda: service.scanning)
            async with ble_scan.listening() as heard:  # the same scan as that of the driver, which hears all this, too
                strangers = 0
                while strangers < 3:
                    strangers += (await heard.get()).device.address == stranger.address

            assert not reading.done()
            module.in_range = True
            await reading

        assert stranger.connections == 0
        assert module.connections == 2


# The rig for everybody.


async def test_two_simulations_share_the_world() -> None:
    before = os.environ.get("DBUS_SYSTEM_BUS_ADDRESS")
    async with simulate(listen="ble", speed=50) as one, simulate(listen="ble:?name=bench 3", speed=50) as two:
        assert one.environment == two.environment
        assert one.environment["DBUS_SYSTEM_BUS_ADDRESS"] == os.environ["DBUS_SYSTEM_BUS_ADDRESS"]
        async with Magician.connect(one.url) as first, Magician.connect("ble://bench 3") as second:
            await asyncio.gather(first.move_to(210, 0, 40), second.move_to(220, 0, 40))

        assert (targets(one), targets(two)) == ([210], [220])

    assert os.environ.get("DBUS_SYSTEM_BUS_ADDRESS") == before


async def test_unplugging_is_a_break() -> None:
    async with simulate(listen="ble:?interval=0.0075") as sim, Magician.connect(sim.url, reconnect=True) as arm:
        sim.unplug()
        assert math.isfinite((await arm.get_pose(timeout=IN_TIME)).x)
        assert arm.link.outages == 1


@pytest.mark.parametrize("listen", ["ble:?mtu=1", "ble:?interval=x", "ble:?sped=1", "ble://arm", "ble:arm"])
async def test_a_rig_that_cannot_be_is_named(listen: str) -> None:
    with pytest.raises(ValueError, match=r"mtu|interval|sped|cannot listen"):
        await simulate(listen=listen).__aenter__()


async def test_without_a_daemon_the_rig_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(FileNotFoundError, match="apt install dbus-daemon"):
        await simulate(listen="ble").__aenter__()


@pytest.mark.full
async def test_the_command_line_offers_the_rig() -> None:
    program = [sys.executable, "-m", "dobot_async"]
    simulator = await asyncio.create_subprocess_exec(
        *program, "simulate", "--listen", "ble:?interval=0.0075", stdout=asyncio.subprocess.PIPE
    )
    try:
        assert simulator.stdout
        async with asyncio.timeout(IN_TIME):
            url = (await simulator.stdout.readline()).decode().strip()
            name, _, address = (await simulator.stdout.readline()).decode().strip().partition("=")
            assert url.startswith("ble://")
            assert name == "DBUS_SYSTEM_BUS_ADDRESS"
            client = await asyncio.create_subprocess_exec(
                *program,
                "--json",
                "--url",
                url,
                "pose",
                env=os.environ | {name: address},
                stdout=asyncio.subprocess.PIPE,
            )
            output, _ = await client.communicate()

        assert client.returncode == 0
        assert json.loads(output)["x"] == pytest.approx(259.1, abs=0.1)
    finally:
        simulator.terminate()
        await simulator.wait()


@pytest.fixture(autouse=True)
def the_environment_is_as_before() -> Iterator[None]:
    """No test leaves a bus of its own to the others."""
    before = os.environ.get("DBUS_SYSTEM_BUS_ADDRESS")
    yield
    assert os.environ.get("DBUS_SYSTEM_BUS_ADDRESS") == before
