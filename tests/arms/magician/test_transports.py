"""A Magician over every transport: the same cycle does the same everywhere, and no peer, however bad, does harm.

That no task, thread or descriptor is left is looked after by the fixtures of all tests.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import os
import re
import socket
import threading
import tty
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, closing, contextmanager, suppress
from pathlib import Path
from random import Random
from typing import Any

import pytest

from dobot_async import (
    ArmAlarm,
    ConnectFailed,
    ConnectionLost,
    Magician,
    MotionStopped,
    PTPMode,
    SuctionCup,
)
from dobot_async._core.link.link import Link
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician import frame
from dobot_async.arms.magician.opening import BARRIERS
from dobot_async.simulator import Simulation, simulate
from dobot_async.transports import open_transport

PLACES = ["memory", "pty", "tcp://127.0.0.1:0", "udp://127.0.0.1:0"]
SCHEMES = ["sim", "serial", "tcp", "udp"]
SPEED = 100.0
IN_TIME = 10.0
PATIENCE = 0.3
PICKS = [(200.0, -60.0), (200.0, 60.0)]
NO_ARM = "no Magician answers.*switched on.*3D-printing"
NOT_AN_ARM = "bytes that are no answer of a Magician.*baud rate.*3D-printing"

everywhere = pytest.mark.parametrize("listen", PLACES)


@pytest.fixture(scope="module", autouse=True)
def opened_before() -> None:
    """What is imported when a transport is first opened takes its time, and the tests have little patience."""

    async def open_all() -> None:
        for listen in PLACES:
            async with simulate(listen=listen) as sim, Magician.connect(sim.url):
                pass

    asyncio.run(open_all())


# The same cycle everywhere.


async def pick_and_place(arm: Magician) -> None:
    """Two parts from here to there, each in one batch."""
    await arm.set_end_effector(SuctionCup())
    await arm.set_speed(100)
    await arm.move_to(200, 0, 60)
    for x, y in PICKS:
        async with arm.queue.batch() as batch:
            batch.move_to(x, y, 60)
            batch.move_to(x, y, 10, mode=PTPMode.MOVL_XYZ)
            batch.suction(True)
            batch.wait(0.2)
            batch.move_by(z=50)
            batch.move_to(240, y, 20, mode=PTPMode.JUMP_XYZ)
            batch.suction(False)
            placed = batch.wait(0.1)

        await placed

    await arm.queue.join()


def of_the_cycle() -> Iterator[tuple[str, Any]]:
    """What the arm is to have executed of its queue."""
    yield "done", c.PTPCmd(PTPMode.MOVJ_XYZ, 200, 0, 60)
    for x, y in PICKS:
        yield "done", c.PTPCmd(PTPMode.MOVJ_XYZ, x, y, 60)
        yield "done", c.PTPCmd(PTPMode.MOVL_XYZ, x, y, 10)
        yield "done", c.EndEffectorSuctionCup(True, True)
        yield "done", c.WAITCmd(200)
        yield "done", c.PTPCmd(PTPMode.MOVL_INC, 0, 0, 50)
        yield "done", c.PTPCmd(PTPMode.JUMP_XYZ, 240, y, 20)
        yield "done", c.EndEffectorSuctionCup(True, False)
        yield "done", c.WAITCmd(100)


def executed(sim: Simulation) -> list[tuple[str, Any]]:
    """What the arm has executed of its queue; without the WAITs of 0 ms with which the driver counts."""
    return [
        (each.outcome, each.value) for each in sim.arm.executed if each.index is not None and each.value != c.WAITCmd(0)
    ]


@pytest.mark.parametrize("window", [1, 8])
@everywhere
async def test_a_whole_cycle_is_the_same_everywhere(listen: str, window: int) -> None:
    """Work, an alarm and the way out of it, a stop, and the end by an error of the program's own."""
    expected = list(of_the_cycle())
    async with simulate(listen=listen, speed=SPEED) as sim:
        with pytest.raises(RuntimeError, match="mine"):
            async with Magician.connect(sim.url, window=window) as arm:
                await pick_and_place(arm)
                assert executed(sim) == expected

                with pytest.raises(ArmAlarm) as caught:
                    await arm.move_to(500, 0, 0)

                assert [alarm.code for alarm in caught.value.alarms] == [0x11]
                await arm.recover()
                expected.append(("alarm", c.PTPCmd(PTPMode.MOVJ_XYZ, 500, 0, 0)))

                await arm.set_speed(0.01)  # so slow that it cannot end before it is stopped
                going = await arm.queue.move_to(200, 0, 60)
                behind = await arm.queue.move_to(200, 10, 60)
                await arm.stop()
                for motion in (going, behind):
                    with pytest.raises(MotionStopped):
                        await motion

                expected.append(("aborted", c.PTPCmd(PTPMode.MOVJ_XYZ, 200, 0, 60)))
                assert executed(sim) == expected

                await arm.set_speed(100)
                await arm.move_to(210, 0, 60)
                expected.append(("done", c.PTPCmd(PTPMode.MOVJ_XYZ, 210, 0, 60)))

                await arm.set_speed(0.01)
                await arm.laser(True)
                left = await arm.queue.move_to(200, 0, 60)
                expected.append(("aborted", c.PTPCmd(PTPMode.MOVJ_XYZ, 200, 0, 60)))
                raise RuntimeError("mine")

        with pytest.raises(MotionStopped):
            await left

        assert executed(sim) == expected
        assert sim.arm.device.idle
        assert not sim.arm.laser
        assert sim.arm.counters.overflowed == sim.arm.counters.unknown == sim.arm.counters.unfit == 0


@everywhere
async def test_a_cancelled_program_stops_the_arm(listen: str) -> None:
    async with simulate(listen=listen) as sim:
        started = asyncio.Event()

        async def program() -> None:
            async with Magician.connect(sim.url) as arm:
                await arm.set_speed(0.01)
                await arm.queue.move_to(200, 0, 60)
                started.set()
                await arm.queue.join()

        running = asyncio.create_task(program())
        await started.wait()
        running.cancel()
        with pytest.raises(asyncio.CancelledError):
            await running

        assert [outcome for outcome, _ in executed(sim)] == ["aborted"]
        assert sim.arm.device.idle


@everywhere
async def test_several_connections_in_turn(listen: str) -> None:
    async with simulate(listen=listen, speed=SPEED) as sim:
        for step in range(5):
            async with Magician.connect(sim.url) as arm:
                assert arm.link.url == sim.url
                await arm.move_to(200, 10 * step, 60)

        assert [value.y for _, value in executed(sim)] == [0, 10, 20, 30, 40]


@pytest.mark.parametrize("listen", ["memory", "tcp://127.0.0.1:0", "udp://127.0.0.1:0"])
async def test_an_observer_beside_a_program(listen: str) -> None:
    async with (
        simulate(listen=listen, speed=SPEED) as sim,
        Magician.connect(sim.url) as arm,
        Magician.connect(sim.url, control=False) as observer,
    ):
        work = asyncio.create_task(pick_and_place(arm))
        poses = set()
        while not work.done():
            poses.add(await observer.get_pose())

        await work
        assert len(poses) > 1
        assert executed(sim) == list(of_the_cycle())


def test_the_places_lead_to_all_schemes() -> None:
    async def schemes() -> list[str]:
        found = []
        for listen in PLACES:
            async with simulate(listen=listen) as sim:
                found.append(sim.url.partition(":")[0])

        return found

    assert asyncio.run(schemes()) == SCHEMES


async def test_a_sim_of_ones_own_does_the_cycle_too() -> None:
    async with Magician.connect("sim:?speed=100") as arm:
        await pick_and_place(arm)
        pose = await arm.get_pose()
        assert (pose.x, pose.y, pose.z) == pytest.approx((240, PICKS[-1][1], 20), abs=0.01)


# Peers that are no arm. Each ends in ConnectFailed, with advice, in bounded time, and holds nobody else up.


async def refused(url: str, advice: str, *, timeout: float = PATIENCE) -> str:
    """Connects in vain while somebody else works; returns what the error says."""
    ticks = 0

    async def work() -> None:
        nonlocal ticks
        while True:
            await asyncio.sleep(0.001)
            ticks += 1

    loop = asyncio.get_running_loop()
    start = loop.time()
    worker = asyncio.create_task(work())
    try:
        async with asyncio.timeout(IN_TIME):
            with pytest.raises(ConnectFailed) as caught:
                async with Magician.connect(url, timeout=timeout):
                    pytest.fail("connected")
    finally:
        worker.cancel()

    text = str(caught.value)
    assert re.search(advice, text), text
    assert ticks >= 3 or loop.time() - start < PATIENCE
    return text


async def until(condition: Callable[[], bool]) -> None:
    """Lets the loop go on until something has come about."""
    async with asyncio.timeout(IN_TIME):
        while True:
            if condition():
                return

            await asyncio.sleep(0.001)


@contextmanager
def pseudo_terminal() -> Iterator[tuple[int, str]]:
    """The arm's end of a port, and the port's path."""
    master, slave = os.openpty()
    tty.setraw(slave)
    try:
        yield master, os.ttyname(slave)
    finally:
        os.close(master)
        os.close(slave)


Peer = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


@asynccontextmanager
async def tcp_peer(behave: Peer) -> AsyncIterator[str]:
    """Somebody on TCP who is no arm; yields the URL."""
    tasks = set()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        tasks.add(asyncio.current_task())
        with suppress(ConnectionError):
            await behave(reader, writer)

        writer.close()
        with suppress(ConnectionError):
            await writer.wait_closed()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    try:
        host, port = server.sockets[0].getsockname()
        yield f"tcp://{host}:{port}"
    finally:
        server.close()
        for task in tasks:
            assert task is not None
            with suppress(TimeoutError):
                async with asyncio.timeout(IN_TIME):
                    await asyncio.wait([task])


async def until_gone(reader: asyncio.StreamReader) -> None:
    while await reader.read(1 << 16):
        pass


async def silent(reader: asyncio.StreamReader, _: asyncio.StreamWriter) -> None:
    await until_gone(reader)


async def hangs_up(_reader: asyncio.StreamReader, _writer: asyncio.StreamWriter) -> None:
    """Accepts and closes."""


async def hangs_up_when_asked(reader: asyncio.StreamReader, _: asyncio.StreamWriter) -> None:
    await reader.read(1)


async def stops_in_mid_frame(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Begins the answer, and no more."""
    await reader.read(1)
    writer.write(bytes.fromhex("AAAA0E3C00CDCC"))
    await until_gone(reader)


async def echoes(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """As a plug that joins both wires does."""
    while data := await reader.read(1 << 16):
        writer.write(data)


async def prints(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """3D-printing firmware."""
    while await reader.read(1 << 16):
        writer.write(b'echo:Unknown command: "..."\nok\n')


@pytest.mark.parametrize(
    ("peer", "advice"),
    [
        (silent, NO_ARM),
        (hangs_up, NO_ARM),
        (hangs_up_when_asked, NO_ARM),
        (stops_in_mid_frame, "3D-printing"),
        (echoes, NO_ARM),
        (prints, NOT_AN_ARM),
    ],
)
async def test_a_tcp_peer_that_is_no_arm(peer: Peer, advice: str) -> None:
    async with tcp_peer(peer) as url:
        assert url in await refused(url, advice)


async def test_a_tcp_peer_that_hangs_up_is_not_waited_for() -> None:
    async with tcp_peer(hangs_up_when_asked) as url:
        await refused(url, NO_ARM, timeout=1000)


FLOODS = {
    "random": Random(1).randbytes(1 << 16),
    "zeros": bytes(1 << 16),
    "headers": b"\xaa" * (1 << 16),
    "long frames": bytes.fromhex("AAAAFA") * (1 << 14),
    "frames": bytes(frame.Frame(c.GET_POSE.id, 0, bytes(32))) * (1 << 10),
}
"""What a peer may send for ever."""


def flood(data: bytes) -> Peer:
    async def send_for_ever(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while True:
            writer.write(data)
            await writer.drain()

    return send_for_ever


@pytest.mark.cases(1)
@pytest.mark.parametrize("kind", FLOODS)
async def test_a_tcp_peer_that_never_stops_sending(kind: str) -> None:
    async with tcp_peer(flood(FLOODS[kind])) as url:
        await refused(url, NOT_AN_ARM if kind != "frames" else "3D-printing")


@pytest.mark.cases(1)
@pytest.mark.parametrize("kind", FLOODS)
async def test_a_serial_peer_that_never_stops_sending(kind: str) -> None:
    with pseudo_terminal() as (master, path), babbling(master, FLOODS[kind]):
        await refused(f"serial://{path}", "3D-printing")


@contextmanager
def babbling(descriptor: int, data: bytes) -> Iterator[None]:
    """Writes to a descriptor for ever, as fast as it is read."""
    loop = asyncio.get_running_loop()
    os.set_blocking(descriptor, False)

    def write() -> None:
        with suppress(BlockingIOError):
            os.write(descriptor, data)

    loop.add_writer(descriptor, write)
    try:
        yield
    finally:
        loop.remove_writer(descriptor)


@pytest.mark.cases(1)
@pytest.mark.parametrize("kind", FLOODS)
async def test_a_udp_peer_that_never_stops_sending(kind: str) -> None:
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as peer:
        peer.bind(("127.0.0.1", 0))
        peer.setblocking(False)
        datagram = FLOODS[kind][:1400]

        async def babble() -> None:
            loop = asyncio.get_running_loop()
            _, address = await loop.sock_recvfrom(peer, 1000)
            while True:
                await loop.sock_sendto(peer, datagram, address)
                await asyncio.sleep(0)

        babbler = asyncio.create_task(babble())
        try:
            await refused("udp://{}:{}".format(*peer.getsockname()), "3D-printing")
        finally:
            babbler.cancel()
            await asyncio.wait([babbler])


@pytest.mark.cases(2)
@pytest.mark.parametrize("listen", ["tcp", "pty"])
@pytest.mark.parametrize("kind", FLOODS)
async def test_a_flood_does_not_pile_up(kind: str, listen: str) -> None:
    """However much comes, the link keeps no more of it than a frame, and the transport no more than its buffer."""
    data, much = FLOODS[kind], 50 * len(FLOODS[kind])

    @asynccontextmanager
    async def peer() -> AsyncIterator[str]:
        if listen == "tcp":
            async with tcp_peer(flood(data)) as url:
                yield url
        else:
            with pseudo_terminal() as (master, path), babbling(master, data):
                yield f"serial://{path}"

    async with peer() as url:
        parser = frame.Parser()
        barriers = [frame.request(row, b"", queued=False) for row in BARRIERS]
        link = Link(await open_transport(url, arm="magician"), parser, frame.request, url=url, barriers=barriers)
        try:
            async with asyncio.timeout(IN_TIME):
                while parser.junk_bytes + 38 * link.stats.received < (much if listen == "tcp" else much // 10):
                    assert len(parser._buffer) < 256
                    await asyncio.sleep(0.001)
        finally:
            await link.aclose()

        assert len(parser._buffer) < 256


async def test_a_port_with_nobody_behind_it() -> None:
    with pseudo_terminal() as (_, path):
        await refused(f"serial://{path}", NO_ARM)


async def test_a_port_that_is_pulled_out_while_connecting() -> None:
    with contextlib.ExitStack() as pulling:
        master, path = pulling.enter_context(pseudo_terminal())
        connecting = asyncio.create_task(refused(f"serial://{path}", NO_ARM, timeout=1000))
        await readable(master)

    await connecting


async def readable(descriptor: int) -> None:
    """Returns when something can be read."""
    loop = asyncio.get_running_loop()
    ready = asyncio.Event()
    loop.add_reader(descriptor, ready.set)
    try:
        await ready.wait()
    finally:
        loop.remove_reader(descriptor)


async def test_a_port_that_does_not_exist() -> None:
    await refused("serial:///dev/no-such-port", "cannot open /dev/no-such-port.*plugged in.*dialout", timeout=IN_TIME)


async def test_a_port_that_is_a_file(tmp_path: Path) -> None:
    file = tmp_path / "port"
    file.touch()
    await refused(f"serial://{file}", "cannot open .*plugged in", timeout=IN_TIME)


async def test_a_port_that_another_program_uses() -> None:
    async with simulate(listen="pty", speed=SPEED) as sim, Magician.connect(sim.url) as arm:
        await refused(sim.url, "cannot open .*no other program", timeout=IN_TIME)
        await arm.move_to(200, 0, 60)


async def test_a_tcp_port_that_is_closed() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        url = "tcp://{}:{}".format(*taken.getsockname())
        await refused(url, "cannot reach tcp://.*address right.*network", timeout=IN_TIME)


async def test_a_tcp_port_where_nobody_accepts() -> None:
    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen()
        await refused("tcp://{}:{}".format(*deaf.getsockname()), NO_ARM)


async def test_a_udp_port_that_is_closed() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        address = taken.getsockname()

    await refused("udp://{}:{}".format(*address), NO_ARM)


async def test_a_udp_port_where_nobody_listens() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as deaf:
        deaf.bind(("127.0.0.1", 0))
        await refused("udp://{}:{}".format(*deaf.getsockname()), NO_ARM)


async def test_a_host_that_does_not_exist() -> None:
    await refused("tcp://no-such-host.invalid:8899", "no-such-host.invalid:8899.*address right", timeout=5.0)


@pytest.mark.parametrize("listen", PLACES)
async def test_connecting_may_be_cancelled(listen: str) -> None:
    """At whatever step it is."""
    async with simulate(listen=listen) as sim:
        sim.faults.silent = True
        for steps in itertools.chain(range(8), [50]):
            connecting = asyncio.create_task(refused(sim.url, ".", timeout=1000))
            for _ in range(steps):
                await asyncio.sleep(0)

            connecting.cancel()
            await asyncio.wait([connecting])

        # A port that is being opened is let go by the thread that opens it.
        await until(lambda: not any("open" in thread.name for thread in threading.enumerate()))
        sim.faults.silent = False
        async with Magician.connect(sim.url) as arm:
            await arm.get_pose()


# The line breaks.


@pytest.mark.parametrize("listen", ["memory", "pty", "tcp://127.0.0.1:0"])
async def test_unplugging_in_the_middle_of_a_motion(listen: str) -> None:
    async with simulate(listen=listen) as sim:
        with pytest.raises(ConnectionLost, match=r"lost.*cable"):
            async with asyncio.timeout(IN_TIME), Magician.connect(sim.url) as arm:
                await arm.set_speed(0.01)
                queued = await arm.queue.move_to(200, 0, 60)
                moving = asyncio.ensure_future(arm.move_to(220, 0, 60))
                waiting = asyncio.create_task(queued.wait())
                await until(lambda: sim.arm.device.following is not None)
                assert sim.arm.device.moving
                sim.unplug()
                for each in (moving, waiting):
                    with pytest.raises(ConnectionLost):
                        await each

                with pytest.raises(ConnectionLost):
                    await queued

                await arm.get_pose()


@pytest.mark.parametrize("listen", ["memory", "pty", "tcp://127.0.0.1:0"])
async def test_the_end_of_the_other_side(listen: str) -> None:
    async with asyncio.timeout(IN_TIME):
        async with simulate(listen=listen) as sim:
            connection = Magician.connect(sim.url)
            arm = await connection.__aenter__()
            await arm.set_speed(0.01)
            motion = await arm.queue.move_to(200, 0, 60)

        with pytest.raises(ConnectionLost):
            await motion

        await connection.__aexit__(None, None, None)
