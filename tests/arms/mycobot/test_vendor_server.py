"""Through the TCP server that the vendor's library brings for arms with a computer of their own (port 9000).

    client --TCP--> recv --one write--> serial port of the arm
           <--TCP-- send <--one answer-- read, for half a second at most

It does one thing after the other. What the client has sent meanwhile is taken together and written together, and one
answer is read for all of it: the others stay in the port, and every later answer comes one too late.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest
from virtual import virtual

from dobot_async._core.protocol.transport import Transport
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.frame import Parser
from dobot_async.arms.mycobot.models import MODELS
from dobot_async.arms.mycobot.opening import reply_times
from dobot_async.errors import DobotError
from dobot_async.simulator import MyCobotQuirks, simulate
from dobot_async.transports import open_transport

WAIT = 0.5  # seconds for which the server waits for one answer
ROUND_TRIP = 0.02
OLD = MyCobotQuirks(acknowledges=False, later=False)
PATIENT = reply_times("tcp://192.168.1.5:9000")


class VendorServer:
    """The server, as the transport that it is to its client.

    Attributes:
        swallow: Whether an answer of the arm is lost on its way to the server.
        together: How often it has written several requests at a time.
    """

    in_flight = window = 1
    reorder_window = 0.0

    def __init__(self, port: Transport) -> None:
        self.swallow: Callable[[], bool] = lambda: False
        self.together = 0
        self._port = port
        self._received = bytearray()
        self._asked = asyncio.Event()
        self._frames: list[bytes] = []
        self._came = asyncio.Event()
        self._sent: asyncio.Queue[bytes] = asyncio.Queue()
        self._tasks = [asyncio.create_task(each) for each in (self._serve(), self._listen())]

    async def _listen(self) -> None:
        """The arm's answers get into the port's buffer, whether anybody reads them or not."""
        parser = Parser(MODELS["mycobot280"].known)
        while True:
            for frame in parser.feed(await self._port.receive()):
                if not self.swallow():
                    self._frames.append(bytes(frame))
                    self._came.set()

    async def _serve(self) -> None:
        while True:
            await self._asked.wait()
            self._asked.clear()
            taken, self._received = bytes(self._received), bytearray()
            self.together += taken.count(b"\xfe\xfe") > 1
            await asyncio.sleep(ROUND_TRIP / 2)
            await self._port.send(taken)
            try:
                async with asyncio.timeout(WAIT):
                    while not self._frames:
                        self._came.clear()
                        await self._came.wait()
            except TimeoutError:
                continue

            await asyncio.sleep(ROUND_TRIP / 2)
            self._sent.put_nowait(self._frames.pop(0))

    async def send(self, data: bytes) -> None:
        """The client sends."""
        self._received += data
        self._asked.set()

    async def receive(self) -> bytes:
        """The client receives."""
        return await self._sent.get()

    async def aclose(self) -> None:
        """The client hangs up."""
        for task in self._tasks:
            await cancel_and_join(task)

        await self._port.aclose()


@pytest.fixture
def servers(monkeypatch: pytest.MonkeyPatch) -> list[VendorServer]:
    """The servers through which `sim://` is reached."""
    made: list[VendorServer] = []

    async def opened(url: str, *, arm: str) -> Transport:
        made.append(VendorServer(await open_transport(url, arm=arm)))
        return made[-1]

    monkeypatch.setattr("dobot_async.arms.session.open_transport", opened)
    return made


@pytest.mark.parametrize("quirks", [MyCobotQuirks(), OLD], ids=["new", "old"])
@virtual
async def test_one_swallowed_answer_does_not_put_the_line_out_of_step(
    servers: list[VendorServer], quirks: MyCobotQuirks
) -> None:
    loop = asyncio.get_running_loop()
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url, reply_timeout=PATIENT) as arm:
        [server] = servers
        swallowed = iter([True])
        await arm.get_angles()
        server.swallow = lambda: next(swallowed, False)
        for turn in range(40):
            sim.arm.guide_to(turn, 0, 0, 0, 0, 0)
            at = loop.time()
            assert (await arm.get_angles())[0] == turn
            took = loop.time() - at
            assert took < 3 * ROUND_TRIP if turn else 0.7 <= took < 1.5

        assert next(swallowed, False) is False, "one was swallowed"
        assert server.together == 0


@virtual
async def test_an_impatient_client_puts_it_out_of_step(servers: list[VendorServer]) -> None:
    """What the default is for; if this fails, it may be less."""
    loop = asyncio.get_running_loop()
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, reply_timeout=(0.05, 0.5)) as arm:
        [server] = servers
        swallowed = iter([True])
        await arm.get_angles()
        server.swallow = lambda: next(swallowed, False)
        slow = 0
        for _ in range(40):
            at = loop.time()
            try:
                await arm.get_angles()
            except DobotError:
                slow += 1
            else:
                slow += loop.time() - at > 3 * ROUND_TRIP

        assert server.together > 0
        assert slow > 20, "for good"


@pytest.mark.parametrize("quirks", [MyCobotQuirks(), OLD], ids=["new", "old"])
@virtual
async def test_motions_and_stops_keep_it_in_step(servers: list[VendorServer], quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url, reply_timeout=PATIENT) as arm:
        [server] = servers
        await arm.move_joints(20, -20, -40, 0, 10, 0)
        await arm.gripper(False)
        await arm.move_by(z=-20)
        await arm.queue.move_joint(1, 150, speed=5)
        await asyncio.sleep(1)
        await arm.stop()
        joints = sim.arm.joints
        await asyncio.sleep(5)
        assert sim.arm.joints == joints
        assert (await arm.get_angles())[0] == pytest.approx(joints[0], abs=0.01)
        assert server.together == 0


async def test_a_tcp_url_gets_the_patient_times_and_others_do_not() -> None:
    async with simulate("mycobot280", listen="tcp://127.0.0.1:0") as sim:
        async with MyCobot.connect(sim.url) as arm:
            assert arm.link.reply_timeout >= PATIENT[0] > WAIT

        async with MyCobot.connect(sim.url, reply_timeout=0.2) as arm:
            assert arm.link.reply_timeout == pytest.approx(0.2)

    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        assert arm.link.reply_timeout < WAIT
