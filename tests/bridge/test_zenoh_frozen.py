"""Programs and servers on Zenoh that live, and read nothing: they are frozen, as a debugger does it."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Iterator
from pathlib import Path

import anyio
import pytest
from bridge_rig import IN_TIME, ask, bridged, client, until
from zenoh_rig import endpoint, line, place, processes_ended, program, warm_up, written

from dobot_async import ConnectionLost, Magician
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import encode
from dobot_async.bridge import Limits
from dobot_async.transports import open_transport
from dobot_async.transports.zenoh.config import ZenohConfig
from dobot_async.transports.zenoh.session import ZenohSession

BUFFERS = {"so_sndbuf": 4096, "so_rcvbuf": 4096}
MANY = Limits(frames=1e6, data=1e7)
GET_POSE = encode(ask(c.GET_POSE))
ASKER = """
import asyncio, sys
from dobot_async.transports import open_transport

async def main():
    transport = await open_transport(sys.argv[1], arm="magician")
    for _ in range(50):
        await transport.send(bytes.fromhex(sys.argv[2]) * 150)

    await transport.receive()
    print("asked", flush=True)
    await asyncio.sleep(3600)

asyncio.run(main())
"""

SLEEPER = """
import asyncio, os, signal, sys
from dobot_async.transports import open_transport

async def main():
    transport = await open_transport(sys.argv[1], arm="magician")
    await transport.send(bytes.fromhex(sys.argv[2]))
    left = int(sys.argv[3]) - len(await transport.receive())
    os.kill(os.getpid(), signal.SIGSTOP)
    while left > 0:
        left -= len(await transport.receive())

    print(left)
    await transport.aclose()

asyncio.run(main())
"""


@pytest.fixture(scope="module", autouse=True)
def runtime() -> None:
    warm_up()


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is waited for at the end, once somebody does not read, is short."""
    monkeypatch.setattr("dobot_async.transports.zenoh.session.CLOSED", 0.5)


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    yield
    processes_ended()


async def test_a_program_that_freezes_is_cut_off_and_its_neighbour_does_not_notice(tmp_path: Path) -> None:
    where = endpoint()
    served = written(tmp_path / "server.json5", listen__endpoints=[where], transport__link__tcp=BUFFERS)
    used = written(tmp_path / "client.json5", connect__endpoints=[where], transport__link__tcp=BUFFERS)
    url = f"zenoh://left?config={used}"
    async with (
        bridged(f"zenoh://left?config={served}", limits=MANY) as rig,
        Magician.connect(f"zenoh://left?connect={where}") as mover,
        program("-c", ASKER, url, GET_POSE.hex()) as frozen,
    ):
        assert await line(frozen) == "asked"
        frozen.send_signal(signal.SIGSTOP)
        while not rig.told("left"):
            await mover.move_to(220, 0, 40)
            await mover.move_to(220, 10, 40)

        assert await mover.get_pose()
        assert mover.link.stats.timeouts == 0
        assert rig.bridge.clients == 1


async def test_a_program_that_freezes_for_a_moment_loses_nothing(tmp_path: Path) -> None:
    where, count = endpoint(), 1000
    slow = {
        "transport__link__tcp": BUFFERS,
        "transport__link__tx__lease": 60_000,
        "transport__link__tx__queue__congestion_control__block__wait_before_close": 60_000_000,
    }
    served = written(tmp_path / "server.json5", listen__endpoints=[where], **slow)
    used = written(tmp_path / "client.json5", connect__endpoints=[where], **slow)
    async with bridged(f"zenoh://left?config={served}", limits=MANY) as rig, client(rig.url + f"?config={used}") as one:
        size = len(encode(await one.ask(c.GET_POSE))) * count
        arguments = ("-c", SLEEPER, f"zenoh://left?config={used}", (GET_POSE * count).hex(), str(size))
        async with program(*arguments) as sleeper:
            before = rig.sim.arm.counters.requests
            await until(lambda: rig.sim.arm.counters.requests >= before + count / 8)
            await one.ask(c.GET_POSE)
            sleeper.send_signal(signal.SIGCONT)
            assert await line(sleeper) == "0"


@pytest.mark.full
async def test_a_server_that_freezes_is_a_lost_connection_and_holds_up_nothing_but_that() -> None:
    async with (
        bridged(place("right")) as other,
        program("-m", "dobot_async", "serve", "--name", "left", "--listen", "tcp/127.0.0.1:0", "sim:") as server,
        Magician.connect(await line(server)) as arm,
        Magician.connect(other.url) as neighbour,
    ):
        await arm.get_pose()
        server.send_signal(signal.SIGSTOP)
        asked = asyncio.ensure_future(arm.move_to(220, 0, 40))
        while not asked.done():
            await neighbour.get_pose()

        with pytest.raises(ConnectionLost, match="not on Zenoh any more"):
            await arm.get_pose()

        assert neighbour.link.stats.timeouts == 0
        assert isinstance(asked.exception(), Exception)


@pytest.mark.full
async def test_a_frozen_server_is_given_up_in_the_middle_of_what_it_does_not_read(tmp_path: Path) -> None:
    where = endpoint()
    served = written(tmp_path / "server.json5", listen__endpoints=[where], transport__link__tcp=BUFFERS)
    used = written(tmp_path / "client.json5", connect__endpoints=[where], transport__link__tcp=BUFFERS)
    async with program("-m", "dobot_async", "serve", "--name", "left", "--zenoh", str(served), "sim:") as server:
        await line(server)
        transport = await open_transport(f"zenoh://left?config={used}", arm="magician")
        server.send_signal(signal.SIGSTOP)
        with pytest.raises(anyio.BrokenResourceError) as broken:
            while True:
                await transport.send(GET_POSE * 100)
                await asyncio.sleep(0.001)

        assert "read" in str(broken.value.__cause__) or "not on Zenoh" in str(broken.value.__cause__)
        await transport.aclose()


@pytest.mark.full
async def test_a_program_ends_in_time_whose_server_is_frozen_and_reads_nothing(tmp_path: Path) -> None:
    where = endpoint()
    served = written(tmp_path / "server.json5", listen__endpoints=[where], transport__link__tcp=BUFFERS)
    used = written(tmp_path / "client.json5", connect__endpoints=[where], transport__link__tcp=BUFFERS)
    async with program("-m", "dobot_async", "serve", "--name", "left", "--zenoh", str(served), "sim:") as server:
        await line(server)
        transport = await open_transport(f"zenoh://left?config={used}", arm="magician")
        server.send_signal(signal.SIGSTOP)
        for _ in range(60):
            await transport.send(bytes(1000))

        async with asyncio.timeout(IN_TIME):
            await transport.aclose()


async def test_what_a_closed_session_still_hears_arrives_nowhere() -> None:
    heard: list[str] = []
    session = ZenohSession(ZenohConfig("left"))
    await session.open(lambda _: None)
    handler = session.crossing.to(heard.append, str)
    handler.callback("before")
    await until(lambda: heard)
    handler.callback("on its way")
    await session.aclose()
    handler.callback("after")
    await asyncio.sleep(0)
    assert heard == ["before"]
