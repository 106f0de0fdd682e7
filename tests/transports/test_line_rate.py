"""The pace of a serial line, on a virtual clock, and a simulated arm behind it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import AsyncExitStack
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from virtual import run_virtual, virtual

from dobot_async import Magician
from dobot_async.endpoints.line_rate import AHEAD, RateLimited, RateLimitedLine, RateLimitedPeer
from dobot_async.endpoints.pty import on_pty
from dobot_async.simulator import simulate
from dobot_async.transports import open_transport

BAUD = 115200
BYTE = 10 / BAUD
MILLISECOND = 0.001
TICK = 2e-6  # of the virtual clock


def now() -> float:
    return asyncio.get_running_loop().time()


@virtual
async def test_the_last_bit_of_what_was_sent_arrives_when_the_baud_rate_says() -> None:
    arrived: list[tuple[float, bytes]] = []
    line = RateLimitedLine(BAUD, lambda data: arrived.append((now(), data)))
    begun = now()
    line.send(bytes(38))
    await asyncio.sleep(1)
    assert sum(len(data) for _, data in arrived) == 38
    assert arrived[-1][0] - begun == pytest.approx(38 * BYTE, abs=TICK)
    assert all(len(data) * BYTE <= MILLISECOND for _, data in arrived)
    begun = now()
    line.send(b"x")
    await asyncio.sleep(1)
    assert arrived[-1][0] - begun == pytest.approx(BYTE, abs=TICK)
    assert arrived[-1][1] == b"x"


@given(st.lists(st.tuples(st.floats(0, 0.05), st.binary(min_size=1, max_size=300)), max_size=20))
def test_each_byte_arrives_once_in_order_and_at_most_a_piece_late(messages: list[tuple[float, bytes]]) -> None:
    async def check() -> None:
        arrived: list[float] = []
        received = bytearray()

        def deliver(data: bytes) -> None:
            arrived.extend([now()] * len(data))
            received.extend(data)

        line = RateLimitedLine(BAUD, deliver)
        due: list[float] = []
        free_at = 0.0
        for pause, data in messages:
            await asyncio.sleep(pause)
            for _ in data:
                free_at = max(free_at, now()) + BYTE
                due.append(free_at)

            line.send(data)

        await asyncio.sleep(1)
        assert received == b"".join(data for _, data in messages)
        assert not line.backlog
        late = [came - ought for came, ought in zip(arrived, due, strict=True)]
        assert all(-TICK < each < MILLISECOND + TICK for each in late)

    run_virtual(check())


@virtual
async def test_a_long_transfer_does_not_drift() -> None:
    last = 0.0

    def deliver(_: bytes) -> None:
        nonlocal last
        last = now()

    line = RateLimitedLine(BAUD, deliver)
    begun = now()
    line.send(bytes(115_200))
    await asyncio.sleep(20)
    assert last - begun == pytest.approx(10, abs=TICK)


@virtual
async def test_what_was_cleared_never_arrives() -> None:
    arrived: list[bytes] = []
    line = RateLimitedLine(BAUD, arrived.append)
    line.send(bytes(100))
    line.clear()
    await asyncio.sleep(1)
    assert not arrived
    assert not line.backlog


class Echo:
    """A host that sends back what it gets."""

    def __init__(self) -> None:
        self.gone: list[EchoClient] = []
        self.hang_ups: list[Callable[[], None]] = []
        self.heard = bytearray()
        self.left = asyncio.Event()

    def client(
        self,
        deliver: Callable[[bytes], None],
        disconnect: Callable[[], None],
        *,
        ordered: bool,
        pause_reading: Callable[[bool], None] = lambda _: None,
        name: str = "",
    ) -> EchoClient:
        self.hang_ups.append(disconnect)
        return EchoClient(self, deliver)

    def leave(self, client: EchoClient) -> None:
        self.gone.append(client)
        self.left.set()


class EchoClient:
    def __init__(self, host: Echo, deliver: Callable[[bytes], None]) -> None:
        self._host = host
        self._deliver = deliver

    def send(self, data: bytes) -> None:
        self._host.heard += data
        self._deliver(data)


@virtual
async def test_both_ways_have_their_own_line_and_a_client_far_ahead_is_held() -> None:
    received = bytearray()
    holds: list[bool] = []
    host = Echo()
    slow = RateLimited(host, BAUD)
    client: RateLimitedPeer[EchoClient] = slow.client(
        received.extend, lambda: None, ordered=True, pause_reading=holds.append
    )
    client.send(bytes(AHEAD + 100))
    assert holds == [True]
    await asyncio.sleep((AHEAD + 100) * BYTE + TICK)
    assert holds == [True, False]
    assert len(received) >= AHEAD  # the echo comes while the rest is still on its way
    await asyncio.sleep(MILLISECOND)
    assert len(received) == AHEAD + 100
    peer = client.peer
    client.send(b"heard")
    slow.leave(client)
    assert not host.gone  # before what it has sent has arrived
    await asyncio.sleep(5 * BYTE + MILLISECOND)
    assert host.heard[-5:] == b"heard"
    assert host.gone == [peer]
    await asyncio.sleep(1)
    assert len(received) == AHEAD + 100  # nobody is there for the echo


@virtual
async def test_a_client_that_has_sent_nothing_leaves_at_once_and_one_that_is_hung_up_on_is_not_waited_for() -> None:
    host = Echo()
    slow = RateLimited(host, BAUD)
    hung_up: list[int] = []

    def connected() -> RateLimitedPeer[EchoClient]:
        return slow.client(lambda _: None, lambda: hung_up.append(1), ordered=True)

    slow.leave(connected())
    assert len(host.gone) == 1
    there, gone = connected(), connected()
    there.send(b"lost")
    host.hang_ups[1]()
    assert hung_up == [1]
    slow.leave(there)
    gone.send(b"lost")
    slow.leave(gone)
    assert len(host.gone) == 2
    host.hang_ups[2]()
    assert hung_up == [1]  # it is gone: whoever has its port now is somebody else
    assert len(host.gone) == 3
    await asyncio.sleep(1)
    assert not host.heard
    assert len(host.gone) == 3


@pytest.mark.skipif(not Path("/dev/ptmx").exists(), reason="no pseudo-terminals")
async def test_what_was_written_before_a_port_is_closed_arrives() -> None:
    async with AsyncExitStack() as stack:
        host = Echo()
        url = await on_pty(RateLimited(host, 9600), stack, lasting=False)
        transport = await open_transport(f"{url}?baud=9600", arm="magician")
        for number in range(10):
            await transport.send(bytes((number,)) * 20)

        await transport.aclose()
        async with asyncio.timeout(5):
            await host.left.wait()

        assert host.heard == b"".join(bytes((number,)) * 20 for number in range(10))


@pytest.mark.skipif(not Path("/dev/ptmx").exists(), reason="no pseudo-terminals")
async def test_a_simulated_arm_at_115200_baud_is_no_faster_than_its_line() -> None:
    async with simulate(listen="pty:?baud=115200", speed=50) as sim, Magician.connect(sim.url, window=8) as arm:
        begun = now()
        pose = await arm.get_pose()
        assert now() - begun > 44 * BYTE
        assert pose.x == pytest.approx(sim.arm.pose.x)
        async with arm.queue.batch() as batch:
            motions = [batch.move_to(220, y, 40) for y in range(20)]

        await motions[-1]
        counters = sim.arm.counters
        assert (counters.overflowed, counters.junk_bytes, counters.bad_frames) == (0, 0, 0)
        assert arm.link.stats.junk_bytes == arm.link.stats.timeouts == 0


@pytest.mark.parametrize("listen", ["pty:?baud=0", "pty:?baud=fast", "pty:?speed=1", "pty://x", "pty:"])
async def test_wrong_options_are_named(listen: str) -> None:
    with pytest.raises(ValueError, match=r"baud|speed|cannot listen"):
        async with simulate(listen=listen):
            pass
