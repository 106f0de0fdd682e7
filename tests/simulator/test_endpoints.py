"""The simulated arm where it can be reached, and the line to it: every kind of place, every fault, every bad argument.

What works the same everywhere is tested with each place; what only time decides in memory, on a virtual clock.
"""

from __future__ import annotations

import asyncio
import gc
import re
import socket
import struct
import threading
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from random import Random
from typing import Any
from urllib.parse import urlsplit

import anyio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quick_suite import examples
from virtual import run_virtual, virtual

from dobot_async import ConnectFailed, IOFunction, Magician
from dobot_async._core.protocol.transport import Transport
from dobot_async.simulator import Faults, Simulation, simulate, simulation
from dobot_async.simulator.faults import FaultyChannel
from dobot_async.simulator.url import open_url
from dobot_async.transports import open_transport

GET_POSE = bytes.fromhex("AAAA020A00F6")
GET_NAME = bytes.fromhex("AAAA020100FF")
NAME_REPLY = bytes.fromhex("AAAA110100") + b"Dobot Magician\0" + b"\xce"
POSE_REPLY = 38
PTP = bytes.fromhex("AAAA135403") + struct.pack("<B4f", 1, 220, 0, 40, 0)

PLACES = ["memory", "pty", "tcp://127.0.0.1:0", "udp://127.0.0.1:0"]
SHARED = ["memory", "tcp://127.0.0.1:0", "udp://127.0.0.1:0"]
IN_TIME = 3.0
ENDLESS = 1e12  # mean seconds, cut at 60

everywhere = pytest.mark.parametrize("listen", PLACES)
at_odd_times = pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
"""For jitter on a virtual clock, which counts in microseconds."""


@asynccontextmanager
async def client(url: str) -> AsyncIterator[Transport]:
    """A client that knows no frames."""
    transport = await open_transport(url, arm="magician")
    try:
        yield transport
    finally:
        await transport.aclose()


async def receive(transport: Transport, count: int) -> bytes:
    """Exactly so many bytes."""
    data = b""
    async with asyncio.timeout(IN_TIME):
        while len(data) < count:
            data += await transport.receive()

    assert len(data) == count
    return data


async def ask(transport: Transport, request: bytes = GET_NAME, reply: int = len(NAME_REPLY)) -> bytes:
    await transport.send(request)
    return await receive(transport, reply)


async def ask_again(transport: Transport, reply: bytes = NAME_REPLY) -> None:
    """Asks until the answer comes, as one does after garbage: a false header may have swallowed the first requests."""
    heard = b""
    async with asyncio.timeout(IN_TIME):
        while not heard.endswith(reply):
            await transport.send(GET_NAME)
            with anyio.move_on_after(0.01):
                heard += await transport.receive()


async def is_hung_up(transport: Transport) -> bool:
    """Whether the line ends, and not because this end closed it."""
    with suppress(anyio.EndOfStream, anyio.BrokenResourceError):
        async with asyncio.timeout(IN_TIME):
            while True:
                await transport.receive()

    return True


async def until(condition: Callable[[], object]) -> None:
    """Lets the loop go on until something has come about."""
    async with asyncio.timeout(IN_TIME):
        while not condition():  # noqa: ASYNC110 - nobody tells when
            await asyncio.sleep(0.001)


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> bytearray:
    """All that reaches simulated arms, before the faults of their lines."""
    arrived = bytearray()
    send = simulation.SimulatedClient.send

    def noted(client: simulation.SimulatedClient, data: bytes) -> None:
        arrived.extend(data)
        send(client, data)

    monkeypatch.setattr(simulation.SimulatedClient, "send", noted)
    return arrived


# Every place.


@everywhere
async def test_a_request_is_answered(listen: str) -> None:
    async with simulate(listen=listen) as sim, client(sim.url) as transport:
        assert await ask(transport) == NAME_REPLY
        pose = struct.unpack("<8f", (await ask(transport, GET_POSE, POSE_REPLY))[5:37])
        assert pose == pytest.approx((259.104, 0, -8.485, 0, 0, 45, 45, 0), abs=1e-2)
        assert (sim.arm.counters.requests, sim.arm.counters.replies) == (2, 2)


@everywhere
async def test_a_request_may_come_byte_by_byte(listen: str) -> None:
    async with simulate(listen=listen) as sim, client(sim.url) as transport:
        for byte in GET_NAME:
            await transport.send(bytes((byte,)))
            await asyncio.sleep(0)

        assert await receive(transport, len(NAME_REPLY)) == NAME_REPLY


@everywhere
async def test_several_requests_may_come_at_once(listen: str) -> None:
    async with simulate(listen=listen) as sim, client(sim.url) as transport:
        assert await ask(transport, GET_NAME * 50, 50 * len(NAME_REPLY)) == NAME_REPLY * 50
        assert sim.arm.counters.requests == 50


@everywhere
async def test_several_clients_in_turn(listen: str) -> None:
    async with simulate(listen=listen) as sim:
        for _ in range(4):
            async with client(sim.url) as transport:
                assert await ask(transport) == NAME_REPLY

        assert sim.arm.counters.bad_frames == sim.arm.counters.junk_bytes == 0


@pytest.mark.parametrize("listen", SHARED)
async def test_half_a_frame_of_one_client_never_touches_another(listen: str) -> None:
    async with simulate(listen=listen) as sim, client(sim.url) as one, client(sim.url) as other:
        for cut in range(1, len(GET_NAME)):
            await one.send(GET_NAME[:cut])
            assert await ask(other, GET_POSE, POSE_REPLY)
            await one.send(GET_NAME[cut:])
            assert await receive(one, len(NAME_REPLY)) == NAME_REPLY

        assert sim.arm.counters.bad_frames == sim.arm.counters.junk_bytes == 0


@pytest.mark.parametrize("listen", SHARED)
async def test_each_client_gets_its_own_answers(listen: str) -> None:
    async with simulate(listen=listen) as sim, client(sim.url) as one, client(sim.url) as other:

        async def repeat(transport: Transport, request: bytes, size: int) -> None:
            for _ in range(50):
                assert (await ask(transport, request, size))[3] == request[3]

        await asyncio.gather(repeat(one, GET_NAME, len(NAME_REPLY)), repeat(other, GET_POSE, POSE_REPLY))


@everywhere
async def test_clients_share_one_arm(listen: str) -> None:
    async with simulate(listen=listen, speed=100) as sim:
        for x in (200, 210):
            async with Magician.connect(sim.url) as arm:
                await arm.move_to(x, 0, 40)

        assert [each.value.x for each in sim.arm.executed if each.name == "SetPTPCmd"] == [200, 210]


@everywhere
@pytest.mark.parametrize(
    "garbage",
    [
        bytes(1000),
        b"\xaa" * 1000,
        b"G28 X0 Y0\r\nM105\r\n" * 20,
        PTP + b"\x00",
        bytes.fromhex("AAAAFA0A00"),
        Random(1).randbytes(4000),
    ],
    ids=["zeros", "headers", "gcode", "bad sum", "long frame", "random"],
)
async def test_garbage_does_no_harm(listen: str, garbage: bytes) -> None:
    async with simulate(listen=listen) as sim, client(sim.url) as transport:
        await transport.send(garbage)
        await ask_again(transport)
        assert sim.arm.executed == []
        assert sim.arm.counters.junk_bytes + sim.arm.counters.bad_frames > 0


@everywhere
@pytest.mark.parametrize("cut", [1, 2, 3, 5, 12, len(PTP)])
async def test_a_client_that_vanishes_in_mid_frame(listen: str, cut: int) -> None:
    async with simulate(listen=listen) as sim:
        async with client(sim.url) as transport:
            await transport.send(PTP[:cut])

        async with client(sim.url) as transport:
            await ask_again(transport)

        assert sim.arm.executed == []
        assert sim.arm.device.accepted == 0


async def test_a_tcp_client_that_vanishes_without_a_word(heard: bytearray) -> None:
    async with simulate(listen="tcp://127.0.0.1:0") as sim:
        loop = asyncio.get_running_loop()
        with connected(sim) as peer:
            await loop.sock_sendall(peer, PTP[:9])
            await until(lambda: heard == PTP[:9])
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # close by a reset

        async with client(sim.url) as transport:
            assert await ask(transport) == NAME_REPLY


async def test_a_serial_line_forgets_half_a_frame_after_a_silence(
    heard: bytearray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A port does not show who has opened it; after a second of silence, here any, it counts as somebody else."""
    async with simulate(listen="pty") as sim, client(sim.url) as transport:
        await transport.send(PTP[:9])
        await until(lambda: heard == PTP[:9])
        monkeypatch.setattr(simulation, "SILENCE", 0.0)
        assert await ask(transport) == NAME_REPLY


@pytest.mark.parametrize("listen", ["memory", "pty", "tcp://127.0.0.1:0"])
async def test_unplug_breaks_the_line_of_every_client(listen: str) -> None:
    async with simulate(listen=listen) as sim, client(sim.url) as one:
        assert await ask(one) == NAME_REPLY
        sim.unplug()
        assert await is_hung_up(one)
        with pytest.raises(anyio.BrokenResourceError):
            for _ in range(1000):
                await one.send(GET_NAME)
                await asyncio.sleep(0.001)

        sim.unplug()


@pytest.mark.parametrize("listen", SHARED)
async def test_after_unplug_clients_may_come_again(listen: str, heard: bytearray) -> None:
    async with simulate(listen=listen) as sim:
        for _ in range(3):
            async with client(sim.url) as transport:
                assert await ask(transport) == NAME_REPLY
                await transport.send(GET_NAME[:3])
                await until(lambda: heard.endswith(GET_NAME[:3]))
                sim.unplug()


async def test_an_unplugged_port_is_gone() -> None:
    async with simulate(listen="pty") as sim:
        sim.unplug()
        with pytest.raises(ConnectFailed, match="cannot open"):
            await open_transport(sim.url, arm="magician")


async def test_unplug_forgets_half_a_datagram_stream_and_what_is_on_the_way(heard: bytearray) -> None:
    """Nobody hangs up on UDP: what is under way is lost, and the next datagram is somebody new."""
    async with simulate(listen="udp://127.0.0.1:0") as sim, client(sim.url) as transport:
        await transport.send(PTP[:9])
        await until(lambda: heard == PTP[:9])
        sim.faults.latency = 0.02
        await transport.send(GET_NAME)
        await until(lambda: heard == PTP[:9] + GET_NAME)
        sim.unplug()
        sim.faults.latency = 0.04  # the answer to what was under way would come before the next one
        assert (await ask(transport, GET_POSE, POSE_REPLY))[3] == GET_POSE[3]


@pytest.mark.cases(1)
@everywhere
async def test_nothing_is_left(listen: str, heard: bytearray) -> None:
    """Neither by a simulation that nobody used, nor with clients and messages on the way."""
    gc.collect()
    before = left_behind()
    async with simulate(listen=listen):
        pass

    async with simulate(listen=listen, faults=Faults(latency=3600.0)) as sim:
        transport = await open_transport(sim.url, arm="magician")
        for _ in range(3):
            await transport.send(GET_NAME)

        await until(lambda: heard == 3 * GET_NAME)

    with suppress(anyio.BrokenResourceError):
        await transport.send(GET_NAME)

    await transport.aclose()
    await until(lambda: left_behind() == before)


@everywhere
async def test_nothing_is_left_by_an_error(listen: str) -> None:
    before = left_behind()
    with pytest.raises(RuntimeError, match="mine"):
        async with simulate(listen=listen):
            raise RuntimeError("mine")

    await until(lambda: left_behind() == before)


async def test_an_address_that_is_taken_leaves_nothing() -> None:
    async with simulate(listen="tcp://127.0.0.1:0") as sim:
        before = left_behind()
        with pytest.raises(OSError, match="in use"):
            async with simulate(listen=sim.url):
                pass

        assert left_behind() == before


@pytest.mark.parametrize("steps", [0, 1, 3, 4, 5])
async def test_a_tcp_client_that_comes_at_the_end_is_not_left_alone(steps: int) -> None:
    """However far its connection has come when the simulation ends; with two steps asyncio itself forgets it."""
    loop = asyncio.get_running_loop()
    async with simulate(listen="tcp://127.0.0.1:0") as sim:
        peer = connected(sim)
        for _ in range(steps):
            await asyncio.sleep(0)

    with peer, suppress(ConnectionResetError):
        async with asyncio.timeout(IN_TIME):
            assert await loop.sock_recv(peer, 100) == b""


@pytest.mark.parametrize("listen", ["pty", "tcp://127.0.0.1:0"])
async def test_a_stream_stays_in_order_on_a_bad_line(listen: str) -> None:
    bad = Faults(latency=0.001, jitter=0.02, split=0.5)
    async with simulate(listen=listen, faults=bad, seed=1) as sim, client(sim.url) as transport:
        for _ in range(20):
            await transport.send(GET_NAME)
            await transport.send(GET_POSE)

        heard = await receive(transport, 20 * (len(NAME_REPLY) + POSE_REPLY))
        assert heard[: len(NAME_REPLY)] == NAME_REPLY
        assert heard == heard[: len(NAME_REPLY) + POSE_REPLY] * 20


async def test_more_udp_clients_than_are_remembered() -> None:
    async with simulate(listen="udp://127.0.0.1:0") as sim, client(sim.url) as first:
        assert await ask(first) == NAME_REPLY
        for _ in range(20):
            async with client(sim.url) as other:
                assert await ask(other) == NAME_REPLY

        assert await ask(first) == NAME_REPLY


# Clients that do not read.


@pytest.mark.full
async def test_a_tcp_client_that_does_not_read_waits_with_its_requests() -> None:
    """Its replies would fill the memory; and none of them may be lost."""
    total = 60_000
    loop = asyncio.get_running_loop()
    async with simulate(listen="tcp://127.0.0.1:0") as sim, client(sim.url) as other:
        await ask(other, set_name("n" * 160), 6)
        size = len(GET_NAME) + 161
        with connected(sim, receive_buffer=4096) as peer:
            sending = asyncio.create_task(loop.sock_sendall(peer, GET_NAME * total))
            grown = total
            while grown:
                before = sim.arm.counters.requests
                for _ in range(20):
                    await ask(other, GET_POSE, POSE_REPLY)

                grown = sim.arm.counters.requests - before - 20

            assert sim.arm.counters.requests < total
            left = total * size
            while left:
                left -= len(await loop.sock_recv(peer, 1 << 20))

            await sending


async def test_a_serial_client_that_does_not_read_loses_replies_and_nobody_waits() -> None:
    async with simulate(listen="pty") as sim, client(sim.url) as transport:
        for number in range(1, 21):
            await transport.send(GET_NAME * 500)
            await until(lambda: sim.arm.counters.requests == 500 * number)  # noqa: B023 - it is done in this round

        heard = b""
        with anyio.move_on_after(0.3):
            while True:
                heard += await transport.receive()

        assert len(heard) < 10_000 * len(NAME_REPLY)
        await ask_again(transport)


@pytest.mark.full
@virtual
async def test_a_client_in_memory_that_does_not_read_loses_replies_and_nobody_else_does() -> None:
    async with simulate() as sim, client(sim.url) as deaf, client(sim.url) as other:
        for _ in range(70_000):
            await deaf.send(GET_NAME)

        assert await ask(other) == NAME_REPLY


@virtual
async def test_a_closed_line_in_memory_says_so() -> None:
    async with simulate() as sim, client(sim.url) as transport:
        await transport.aclose()
        with pytest.raises(anyio.ClosedResourceError):
            await transport.send(GET_NAME)

        with pytest.raises(anyio.ClosedResourceError):
            await transport.receive()


# Faults, on a virtual clock.


async def heard_in(transport: Transport, seconds: float) -> list[tuple[float, bytes]]:
    """What comes within some time, and when."""
    loop = asyncio.get_running_loop()
    start = loop.time()
    heard = []
    with suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            while True:
                data = await transport.receive()
                heard.append((loop.time() - start, data))

    return heard


def conversation(seed: int, faults: Faults, count: int = 60) -> list[tuple[float, bytes]]:
    """Everything that a client hears on a bad line, and when; the same questions each time."""
    heard: list[tuple[float, bytes]] = []

    async def talk() -> None:
        async with simulate(seed=seed, faults=faults) as sim, client(sim.url) as transport:
            for _ in range(count):
                await transport.send(GET_NAME)
                heard.extend(await heard_in(transport, 0.01))

            heard.extend(await heard_in(transport, 1.0))

    run_virtual(talk())
    return heard


BAD_LINE: dict[str, Any] = {
    "loss": 0.1,
    "corrupt": 0.1,
    "dup": 0.1,
    "split": 0.1,
    "noise": 0.1,
    "latency": 0.005,
    "jitter": 0.02,
}


@at_odd_times
def test_a_seed_makes_the_same_faults_again() -> None:
    first = conversation(7, Faults(**BAD_LINE))
    assert conversation(7, Faults(**BAD_LINE)) == first
    assert conversation(8, Faults(**BAD_LINE)) != first


@virtual
async def test_total_loss_is_silence() -> None:
    async with simulate(faults=Faults(loss=1.0)) as sim, client(sim.url) as transport:
        for _ in range(100):
            await transport.send(GET_NAME)

        assert await heard_in(transport, 3600) == []
        assert sim.arm.counters.requests == 0
        sim.faults.loss = 0.0
        assert await ask(transport) == NAME_REPLY


@virtual
async def test_a_doubled_message_is_done_twice_and_answered_twice_each() -> None:
    async with simulate(faults=Faults(dup=1.0)) as sim, client(sim.url) as transport:
        await transport.send(GET_NAME)
        assert b"".join(data for _, data in await heard_in(transport, 1)) == NAME_REPLY * 4
        assert sim.arm.counters.requests == 2


@virtual
async def test_a_corrupted_message_is_no_request() -> None:
    async with simulate(faults=Faults(corrupt=1.0), seed=1) as sim, client(sim.url) as transport:
        for _ in range(100):
            await transport.send(GET_NAME)

        assert await heard_in(transport, 1) == []
        assert sim.arm.counters.bad_frames + sim.arm.counters.junk_bytes > 0


@virtual
async def test_a_split_message_comes_in_two_parts_and_is_understood() -> None:
    async with simulate(faults=Faults(split=1.0), seed=1) as sim, client(sim.url) as transport:
        for _ in range(50):
            await transport.send(GET_NAME)
            first, second = [data for _, data in await heard_in(transport, 1)]
            assert first
            assert second
            assert first + second == NAME_REPLY


@virtual
async def test_noise_comes_before_a_message() -> None:
    async with simulate(faults=Faults(noise=1.0), seed=1) as sim, client(sim.url) as transport:
        lengths = set()
        for _ in range(100):
            await transport.send(GET_NAME)
            for _, data in await heard_in(transport, 1):
                assert data.endswith(NAME_REPLY)
                lengths.add(len(data) - len(NAME_REPLY))

        assert lengths == set(range(1, 9))
        assert sim.arm.counters.junk_bytes > 0


@virtual
async def test_latency_is_exact_and_goes_both_ways() -> None:
    async with simulate(faults=Faults(latency=0.25)) as sim, client(sim.url) as transport:
        for _ in range(3):
            await transport.send(GET_NAME)

        assert await heard_in(transport, 10) == [(0.5, NAME_REPLY)] * 3
        assert sim.arm.counters.requests == 3


@at_odd_times
@virtual
async def test_jitter_stays_within_its_bounds() -> None:
    async with simulate(faults=Faults(latency=0.1, jitter=0.1), seed=3) as sim, client(sim.url) as transport:
        times = []
        for _ in range(100):
            await transport.send(GET_NAME)
            [(time, _)] = await heard_in(transport, 1)
            times.append(time)

        assert min(times) >= 0.2
        assert max(times) <= 0.4
        assert len(set(times)) == 100


@virtual
async def test_a_silent_line_loses_everything_even_what_is_on_the_way() -> None:
    async with simulate(faults=Faults(latency=0.25)) as sim, client(sim.url) as transport:
        await transport.send(GET_NAME)
        await asyncio.sleep(0.375)  # the request has arrived, the reply has not
        sim.faults.silent = True
        await transport.send(GET_NAME)
        assert await heard_in(transport, 3600) == []
        assert sim.arm.counters.requests == 1
        sim.faults.silent = False
        assert await heard_in(transport, 3600) == []
        assert await ask(transport) == NAME_REPLY


@virtual
async def test_faults_may_change_at_any_time() -> None:
    async with simulate() as sim, client(sim.url) as transport:
        assert await ask(transport) == NAME_REPLY
        sim.faults.latency = 1.0
        await transport.send(GET_NAME)
        sim.faults.latency = 0.0
        assert [time for time, _ in await heard_in(transport, 10)] == [1.0]
        assert [time for time, _ in [(0.0, await ask(transport))]] == [0.0]


@virtual
async def test_what_was_sent_before_a_client_closed_still_reaches_the_arm() -> None:
    async with simulate(faults=Faults(stall=1.0, stall_time=ENDLESS)) as sim:
        async with client(sim.url) as transport:
            await transport.send(GET_NAME)
            await transport.send(GET_POSE)

        await asyncio.sleep(59.9)
        assert sim.arm.counters.requests == 0
        async with client(sim.url) as another:
            assert await heard_in(another, 0.2) == []  # the answers are for nobody
            assert sim.arm.counters.requests == 2


@virtual
async def test_what_was_sent_before_a_client_closed_is_lost_when_the_cable_is_pulled() -> None:
    async with simulate(faults=Faults(latency=1.0)) as sim:
        async with client(sim.url) as transport:
            await transport.send(GET_NAME)

        sim.unplug()
        await asyncio.sleep(10)
        assert sim.arm.counters.requests == 0


# Stalls, silences, late messages, and arms that vanish.


@virtual
async def test_a_stall_of_a_minute_loses_nothing_and_keeps_the_order() -> None:
    async with simulate(faults=Faults(stall=1.0, stall_time=ENDLESS)) as sim, client(sim.url) as transport:
        await transport.send(GET_NAME)
        sim.faults.stall = 0.0
        for _ in range(100):
            await asyncio.sleep(0.5)
            await transport.send(GET_POSE)
            await transport.send(GET_NAME)

        assert sim.arm.counters.requests == 0
        heard = await heard_in(transport, 20)
        assert {time for time, _ in heard} == {10.0}
        assert b"".join(data for _, data in heard)[: len(NAME_REPLY)] == NAME_REPLY
        assert [len(data) for _, data in heard] == [len(NAME_REPLY)] + [POSE_REPLY, len(NAME_REPLY)] * 100
        assert sim.outages == [(0.0, 60.0)]
        assert await ask(transport) == NAME_REPLY


@virtual
async def test_the_way_back_stalls_too() -> None:
    async with simulate() as sim, client(sim.url) as transport:
        await transport.send(GET_NAME)
        assert await transport.receive() == NAME_REPLY
        answer = sim.arm.answer

        def stalling(frame: Any) -> bytes:
            sim.faults.stall, sim.faults.stall_time = 1.0, ENDLESS
            reply: bytes = answer(frame)
            return reply

        vars(sim.arm)["answer"] = stalling
        await transport.send(GET_NAME)
        vars(sim.arm)["answer"] = answer
        sim.faults.stall = 0.0
        await transport.send(GET_POSE)
        assert sim.arm.counters.requests == 3
        assert [(time, len(data)) for time, data in await heard_in(transport, 70)] == [
            (60.0, len(NAME_REPLY)),
            (60.0, POSE_REPLY),
        ]


@virtual
async def test_a_stall_loses_datagrams() -> None:
    bad = Faults(stall=1.0, stall_time=ENDLESS, reorder=0.001)
    async with simulate(faults=bad) as sim, client(sim.url) as transport:
        await transport.send(GET_NAME)
        bad.stall = 0.0
        await asyncio.sleep(59)
        await transport.send(GET_NAME)
        await asyncio.sleep(2)
        assert sim.arm.counters.requests == 0
        assert await ask(transport) == NAME_REPLY


@virtual
async def test_a_silence_loses_what_is_sent_meanwhile_in_both_directions() -> None:
    async with simulate() as sim, client(sim.url) as transport:
        answer = sim.arm.answer

        def silenced(frame: Any) -> bytes:
            sim.faults.silence, sim.faults.silence_time = 1.0, ENDLESS
            reply: bytes = answer(frame)
            return reply

        vars(sim.arm)["answer"] = silenced
        await transport.send(GET_NAME)  # the answer finds the line dead
        vars(sim.arm)["answer"] = answer
        sim.faults.silence = 0.0
        assert sim.arm.counters.requests == 1
        assert sim.outages == [(0.0, 60.0)]
        for _ in range(59):
            await asyncio.sleep(1)
            await transport.send(GET_NAME)

        assert sim.arm.counters.requests == 1
        assert await heard_in(transport, 10) == []
        assert await ask(transport) == NAME_REPLY


@virtual
async def test_each_client_has_silences_of_its_own() -> None:
    async with simulate(faults=Faults(silence=1.0)) as sim, client(sim.url) as one, client(sim.url) as other:
        await one.send(GET_NAME)
        sim.faults.silence = 0.0
        assert await ask(other) == NAME_REPLY
        assert await heard_in(one, 100) == []


@at_odd_times
@virtual
async def test_a_late_message_is_overtaken_by_those_behind_it() -> None:
    async with simulate(faults=Faults(late=1.0, late_time=ENDLESS)) as sim, client(sim.url) as transport:
        await transport.send(GET_NAME)
        await asyncio.sleep(0.5)
        sim.faults.late = 0.0
        assert sim.arm.counters.requests == 1  # only what the arm says is late
        for _ in range(3):
            await transport.send(GET_POSE)

        assert [(time, len(data)) for time, data in await heard_in(transport, 100)] == [
            (0.0, POSE_REPLY),
            (0.0, POSE_REPLY),
            (0.0, POSE_REPLY),
            (59.5, len(NAME_REPLY)),
        ]


@virtual
async def test_the_switch_holds_back_what_comes_both_ways_and_then_lets_it_go() -> None:
    async with simulate(faults=Faults(latency=0.25)) as sim, client(sim.url) as transport:
        await transport.send(GET_NAME)
        await asyncio.sleep(0.375)  # the request has arrived, the answer has not
        sim.faults.stalled = True
        for _ in range(3):
            await transport.send(GET_POSE)

        assert await heard_in(transport, 3600) == []
        assert sim.arm.counters.requests == 1
        sim.faults.stalled = False
        assert sim.arm.counters.requests == 4
        await transport.send(GET_NAME)
        assert [(time, len(data)) for time, data in await heard_in(transport, 3600)] == [
            (0.0, len(NAME_REPLY)),
            (0.25, POSE_REPLY),
            (0.25, POSE_REPLY),
            (0.25, POSE_REPLY),
            (0.5, len(NAME_REPLY)),
        ]


@virtual
async def test_the_switch_may_be_used_again_and_again() -> None:
    async with simulate() as sim, client(sim.url) as transport:
        for number in range(1, 10):
            sim.faults.stalled = True
            await transport.send(GET_NAME)
            await asyncio.sleep(10)
            assert sim.arm.counters.requests == number - 1
            sim.faults.stalled = False
            assert await transport.receive() == NAME_REPLY


@virtual
async def test_the_switch_loses_datagrams() -> None:
    async with simulate(faults=Faults(dup=1.0)) as sim, client(sim.url) as transport:
        sim.faults.stalled = True
        await transport.send(GET_NAME)
        sim.faults.stalled = False
        assert await heard_in(transport, 10) == []
        assert sim.arm.counters.requests == 0


@virtual
async def test_silence_has_the_last_word_on_what_a_stall_has_held_back() -> None:
    faults = Faults(stalled=True)
    async with simulate(faults=faults) as sim, client(sim.url) as transport:
        await transport.send(GET_NAME)
        faults.silent = True
        await transport.send(GET_NAME)
        faults.silent = faults.stalled = False
        assert [data for _, data in await heard_in(transport, 10)] == [NAME_REPLY]


@pytest.mark.parametrize("listen", ["memory", "pty", "pty:?baud=115200", "tcp://127.0.0.1:0"])
async def test_every_stream_can_be_held_back(listen: str) -> None:
    async with simulate(listen=listen) as sim, client(sim.url) as transport:
        await transport.send(GET_NAME)
        assert await receive(transport, len(NAME_REPLY)) == NAME_REPLY
        sim.faults.stalled = True
        for _ in range(5):
            await transport.send(GET_NAME)
            await asyncio.sleep(0.01)

        assert sim.arm.counters.requests == 1
        sim.faults.stalled = False
        assert await receive(transport, 5 * len(NAME_REPLY)) == 5 * NAME_REPLY


@pytest.mark.parametrize("listen", ["memory", "pty", "tcp://127.0.0.1:0"])
async def test_what_was_sent_before_closing_arrives_on_every_stream(listen: str) -> None:
    async with simulate(listen=listen) as sim:
        sim.faults.stalled = True
        async with client(sim.url) as transport:
            await transport.send(GET_NAME + GET_POSE)
            await asyncio.sleep(0.05)

        await asyncio.sleep(0.05)
        assert sim.arm.counters.requests == 0
        sim.faults.stalled = False
        assert sim.arm.counters.requests == 2


@everywhere
async def test_an_arm_that_vanishes_leaves_the_connection_open(listen: str) -> None:
    async with simulate(listen=listen) as sim, client(sim.url) as transport:
        await transport.send(GET_NAME)
        assert await receive(transport, len(NAME_REPLY)) == NAME_REPLY
        sim.vanish()
        await transport.send(GET_NAME)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.05):
                await transport.receive()

        await transport.send(GET_NAME)
        assert sim.arm.counters.requests == 1
        if listen != "pty":  # whose port has one client for ever
            async with client(sim.url) as another:
                await another.send(GET_NAME)
                assert await receive(another, len(NAME_REPLY)) == NAME_REPLY

        sim.unplug()
        if not listen.startswith("udp"):
            with pytest.raises((anyio.EndOfStream, anyio.BrokenResourceError)):
                await transport.receive()


messages = st.lists(st.binary(min_size=1, max_size=12), max_size=20)


@at_odd_times
@given(
    messages=messages,
    seed=st.integers(0, 2**32),
    latency=st.sampled_from([0.0, 0.25]),
    jitter=st.sampled_from([0.0, 1.0]),
    split=st.sampled_from([0.0, 0.5, 1.0]),
    pause=st.sampled_from([0.0, 0.25]),
)
def test_an_ordered_line_is_a_stream(
    messages: list[bytes], seed: int, latency: float, jitter: float, split: float, pause: float
) -> None:
    assert b"".join(carried(messages, seed, pause, ordered=True, latency=latency, jitter=jitter, split=split)) == (
        b"".join(messages)
    )


@given(messages=messages, seed=st.integers(0, 2**32), split=st.sampled_from([0.0, 1.0]))
def test_messages_overtake_each_other_only_by_jitter(messages: list[bytes], seed: int, split: float) -> None:
    assert b"".join(carried(messages, seed, 0.0, ordered=False, latency=0.25, split=split)) == b"".join(messages)


@at_odd_times
@given(messages=messages, seed=st.integers(0, 2**32))
def test_jitter_loses_nothing(messages: list[bytes], seed: int) -> None:
    assert sorted(carried(messages, seed, 0.0, ordered=False, jitter=1.0)) == sorted(messages)


@at_odd_times
def test_jitter_lets_datagrams_overtake_each_other() -> None:
    sent = [bytes((number,)) for number in range(20)]
    assert carried(sent, 1, 0.0, ordered=False, jitter=1.0) != sent


def carried(messages: Iterable[bytes], seed: int, pause: float, *, ordered: bool, **faults: Any) -> list[bytes]:
    """What comes out of one direction of a line."""
    arrived: list[bytes] = []

    async def carry() -> None:
        channel = FaultyChannel(Faults(**faults), Random(seed), arrived.append, ordered=ordered)
        for message in messages:
            channel.send(message)
            await asyncio.sleep(pause)

        await asyncio.sleep(10)

    run_virtual(carry())
    return arrived


@settings(max_examples=examples(50))
@given(data=st.binary(min_size=1, max_size=50), seed=st.integers(0, 2**32))
def test_each_fault_does_what_it_says(data: bytes, seed: int) -> None:
    def arrives(**faults: Any) -> list[bytes]:
        return [piece for _, piece in Faults(**faults).apply(data, Random(seed))]

    assert arrives() == [data]
    assert arrives(loss=1.0) == arrives(silent=True) == []
    assert arrives(dup=1.0) == [data, data]
    [corrupted] = arrives(corrupt=1.0)
    assert len(corrupted) == len(data)
    assert sum(a != b for a, b in zip(corrupted, data, strict=True)) == 1
    [noisy] = arrives(noise=1.0)
    assert noisy.endswith(data)
    assert 1 <= len(noisy) - len(data) <= 8
    parts = arrives(split=1.0)
    assert b"".join(parts) == data
    assert len(parts) == min(2, len(data))
    assert [delay for delay, _ in Faults(latency=2.0).apply(data, Random(seed))] == [2.0]
    assert all(2.0 <= delay <= 2.5 for delay, _ in Faults(latency=2.0, jitter=0.5).apply(data, Random(seed)))


# The URL of a simulation of one's own.


def answers(url: str, seconds: float = 10.0, count: int = 1) -> list[tuple[float, bytes]]:
    """What a client of an URL hears after some requests at once, and when."""
    heard: list[tuple[float, bytes]] = []

    async def talk() -> None:
        async with client(url) as transport:
            for _ in range(count):
                await transport.send(GET_NAME)

            heard.extend(await heard_in(transport, seconds))

    run_virtual(talk())
    return heard


@at_odd_times
def test_the_options_of_sim_reach_the_line() -> None:
    assert answers("sim:") == [(0.0, NAME_REPLY)]
    assert answers("sim:?loss=1") == []
    assert answers("sim:?latency=0.25") == [(0.5, NAME_REPLY)]
    assert [data for _, data in answers("sim:?dup=1")] == [NAME_REPLY] * 4
    assert answers("sim:?corrupt=1&seed=1") == []
    assert [len(data) for _, data in answers("sim:?noise=1&seed=1")] != [len(NAME_REPLY)]
    assert len(answers("sim:?split=1")) == 2
    assert answers("sim:?silence=1", seconds=120) == []
    assert answers("sim:?stall=1&stall_time=1e12", seconds=200) == [(120.0, NAME_REPLY)]
    assert answers("sim:?late=1&late_time=1e12", seconds=120) == [(60.0, NAME_REPLY)]
    [(time, _)] = answers("sim:?jitter=0.5&seed=1")
    assert 0.0 < time < 1.0


@at_odd_times
def test_the_seed_of_sim_reaches_the_line() -> None:
    url = "sim:?loss=0.3&jitter=0.1&seed="
    assert answers(f"{url}1", count=50) == answers(f"{url}1", count=50)
    assert answers(f"{url}1", count=50) != answers(f"{url}2", count=50)


@pytest.mark.parametrize(("url", "homed"), [("sim:", True), ("sim:?homed=true", True), ("sim:?homed=false", False)])
@virtual
async def test_sim_is_homed_unless_it_is_told_otherwise(url: str, homed: bool) -> None:
    transport: Any = await open_url(urlsplit(url), arm="magician")
    assert transport._simulation.arm.homed is homed
    await transport.aclose()
    with pytest.raises(ValueError, match="expected true or false"):
        await open_url(urlsplit("sim:?homed=maybe"), arm="magician")
    async with simulate() as sim:
        assert not sim.arm.homed


@virtual
async def test_the_speed_of_sim_is_the_arms() -> None:
    loop = asyncio.get_running_loop()
    async with Magician.connect("sim:?speed=10") as arm:
        start = loop.time()
        await arm.wait(10.0)
        assert 1.0 <= loop.time() - start <= 1.3  # the driver counts on real seconds, and looks seldom meanwhile


@virtual
async def test_each_sim_is_an_arm_of_its_own() -> None:
    async with Magician.connect("sim:") as one, Magician.connect("sim:") as other:
        await one.configure_io(1, IOFunction.DO)
        await one.set_output(1, level=True)
        assert await one.get_output(1)
        assert not await other.get_output(1)


@pytest.mark.parametrize(
    ("url", "wrong"),
    [
        ("sim:?speed=0", "speed"),
        ("sim:?speed=-1", "speed"),
        ("sim:?speed=nan", "speed"),
        ("sim:?speed=inf", "speed"),
        ("sim:?speed=fast", "speed='fast'"),
        ("sim:?seed=1.5", "seed='1.5'"),
        ("sim:?loss=2", "loss"),
        ("sim:?corrupt=-0.1", "corrupt"),
        ("sim:?dup=nan", "dup"),
        ("sim:?split=x", "split='x'"),
        ("sim:?noise=", "noise=''"),
        ("sim:?latency=-1", "latency"),
        ("sim:?latency=nan", "latency"),
        ("sim:?jitter=inf", "jitter"),
        ("sim:?stall=2", "stall"),
        ("sim:?late=-1", "late"),
        ("sim:?silence=nan", "silence"),
        ("sim:?stall_time=0", "stall_time"),
        ("sim:?late_time=inf", "late_time"),
        ("sim:?silence_time=-1", "silence_time"),
        ("sim:?silent=1", "'silent'"),
        ("sim:?sped=10", "'sped'"),
        ("sim:?stalled=1", "'stalled'"),
        ("sim:speed=10", "speed=10"),
        ("sim:/arm1", "/arm1"),
        ("sim://nobody?speed=1", "nobody"),
    ],
)
async def test_what_is_wrong_with_the_url_of_a_simulation_is_named(url: str, wrong: str) -> None:
    with pytest.raises(ValueError, match=re.escape(wrong)):
        await open_transport(url, arm="magician")


@virtual
async def test_a_simulation_that_has_ended_cannot_be_reached() -> None:
    async with simulate() as sim:
        pass

    with pytest.raises(ConnectFailed, match="no such simulation"):
        await open_transport(sim.url, arm="magician")


# Bad arguments.


@pytest.mark.parametrize("model", ["", "Magician", "mycobot380"])
async def test_a_model_that_does_not_exist_is_named(model: str) -> None:
    with pytest.raises(ValueError, match=f"'{model}'.*magician"):
        await simulate(model).__aenter__()


@pytest.mark.parametrize(
    "listen",
    [
        "",
        "memory:",
        "pty:/dev/ttyS0",
        "PTY",
        "tcp",
        "tcp:",
        "tcp://",
        "tcp:127.0.0.1:0",
        "tcp://:8899",
        "tcp://127.0.0.1:0/arm",
        "tcp://127.0.0.1:0?speed=3",
        "tcp://127.0.0.1:65536",
        "tcp://127.0.0.1:port",
        "tcp://[::1",
        "udp",
        "udp://",
        "udp://:0",
        "udp://127.0.0.1:-1",
        "serial:///dev/ttyUSB0",
        "carrier-pigeon",
    ],
)
async def test_a_place_where_nobody_can_listen_is_named(listen: str) -> None:
    before = left_behind()
    with pytest.raises(ValueError, match="cannot listen at") as caught:
        await simulate(listen=listen).__aenter__()

    assert repr(listen) in str(caught.value)
    assert "tcp://127.0.0.1:0" in str(caught.value)
    assert left_behind() == before


@pytest.mark.parametrize("speed", [0, -1.0, float("nan"), float("inf")])
async def test_a_speed_that_is_none_is_named(speed: float) -> None:
    with pytest.raises(ValueError, match=f"speed must be .* not {speed!r}"):
        await simulate(speed=speed).__aenter__()


@pytest.mark.parametrize("name", ["loss", "corrupt", "dup", "split", "noise", "stall", "late", "silence"])
@pytest.mark.parametrize("value", [-0.1, 1.1, float("nan")])
def test_a_probability_that_is_none_is_named(name: str, value: float) -> None:
    faults: dict[str, Any] = {name: value}
    with pytest.raises(ValueError, match=f"{name} is a probability"):
        Faults(**faults)


@pytest.mark.parametrize("name", ["latency", "jitter", "stall_time", "late_time", "silence_time"])
@pytest.mark.parametrize("value", [-0.1, float("inf"), float("nan")])
def test_seconds_that_are_none_are_named(name: str, value: float) -> None:
    faults: dict[str, Any] = {name: value}
    with pytest.raises(ValueError, match=f"{name}.* seconds"):
        Faults(**faults)


# What the tests see of the system.


def connected(sim: Simulation, *, receive_buffer: int = 0) -> socket.socket:
    """A socket that knows nothing of this package, connected to a simulation on TCP."""
    host, port = sim.url.removeprefix("tcp://").rsplit(":", 1)
    peer = socket.socket()
    if receive_buffer:
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)

    peer.connect((host, int(port)))
    peer.setblocking(False)
    return peer


def set_name(name: str) -> bytes:
    """The frame of SetDeviceName."""
    payload = bytes((1, 1)) + name.encode() + b"\0"
    return b"\xaa\xaa" + bytes((len(payload),)) + payload + bytes((-sum(payload) % 256,))


def left_behind() -> tuple[set[str], set[str], int]:
    """Descriptors, threads and tasks that there are; the threads in which asyncio looks up names stay."""
    descriptors = set()
    for entry in Path("/proc/self/fd").iterdir():
        with suppress(OSError):
            descriptors.add(str(entry.readlink()))

    threads = {thread.name for thread in threading.enumerate()}
    return descriptors, {name for name in threads if not name.startswith("asyncio_")}, len(asyncio.all_tasks())
