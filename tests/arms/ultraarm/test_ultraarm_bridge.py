"""An ultraArm behind a bridge: several programs on one arm whose answers tell by their order alone whose they are."""

from __future__ import annotations

import asyncio
import sys
import time
import warnings
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any, NamedTuple

import pytest
from bridge_rig import IN_TIME, TCP, until
from hypothesis import given
from hypothesis import strategies as st

from dobot_async import MotionStopped, UltraArm, UltraArmJog
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.bridge_adapter import RequestKind
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.bridge_adapter import BRIDGED, UltraArmWatch
from dobot_async.arms.ultraarm.bridge_lines import Answers, BridgedLine, Requests
from dobot_async.bridge import Bridge, BridgeEvent, bridge
from dobot_async.errors import CommandRejected, ConnectionLost, ProtocolError
from dobot_async.simulator import Simulation, UltraArmQuirks, simulate
from dobot_async.transports import open_transport

PLAIN = UltraArmQuirks()
FAR = b"G0 X200 Y200 Z40 F50\r"


class Rig(NamedTuple):
    """An arm, the bridge to it, and what has happened."""

    sim: Simulation
    bridge: Bridge[Any]
    happened: list[BridgeEvent]

    def told(self, what: str) -> list[str]:
        return [event.detail for event in self.happened if event.what == what]

    def executed(self, command: Command[Any, Any]) -> list[Any]:
        return [each.value for each in self.sim.arm.executed if each.command is command]


@asynccontextmanager
async def bridged(
    listen: str | list[str] = TCP, *, speed: float = 20.0, quirks: UltraArmQuirks = PLAIN, **details: Any
) -> AsyncIterator[Rig]:
    async with (
        simulate("ultraarm", homed=True, listen=TCP, speed=speed, quirks=quirks) as sim,
        over(sim.url, listen, **details) as (running, happened),
    ):
        yield Rig(sim, running, happened)


@asynccontextmanager
async def over(
    url: str, listen: str | list[str] = TCP, **details: Any
) -> AsyncIterator[tuple[Bridge[Any], list[BridgeEvent]]]:
    """A bridge to whatever is there, and what happens at it."""
    async with bridge(url, listen=listen, family="ultraarm", **details) as running:
        happened: list[BridgeEvent] = []

        async def note() -> None:
            async for event in running.events:
                happened[len(happened) :] = [event]

        noting = asyncio.create_task(note())
        await asyncio.sleep(0)
        yield running, happened

    await noting


class Plain:
    """A client that knows lines alone."""

    def __init__(self, transport: Transport) -> None:
        self.transport = transport
        self._heard = b""

    async def send(self, data: bytes) -> None:
        await self.transport.send(data)

    async def line(self) -> str:
        """The next line that it hears."""
        async with asyncio.timeout(IN_TIME):
            while b"\n" not in self._heard:
                self._heard += await self.transport.receive()

        line, _, self._heard = self._heard.partition(b"\n")
        return line.decode().strip()

    async def ask(self, line: str) -> str:
        await self.send(line.encode() + b"\r")
        return await self.line()


@asynccontextmanager
async def plain(url: str) -> AsyncIterator[Plain]:
    transport = await open_transport(url, arm="ultraarm")
    try:
        yield Plain(transport)
    finally:
        await transport.aclose()


# One arm, several programs.


@pytest.mark.parametrize("listen", [TCP, "ws://127.0.0.1:0", "pty"])
async def test_a_program_moves_the_arm_through_it(listen: str) -> None:
    async with bridged(listen) as rig, UltraArm.connect(rig.bridge.url) as arm:
        await arm.home()
        await arm.move_to(200, 60, 40)
        await arm.move_by(z=-10)
        await arm.suction(True)
        here = await arm.get_coords()
        assert (here.x, here.y, here.z) == pytest.approx((200, 60, 30), abs=0.02)
        assert rig.sim.arm.registers.pump
        assert len(rig.executed(c.MOVE_COORDS)) == 2


@pytest.mark.parametrize("acknowledge", ["size", "ok", "nothing"])
async def test_others_watch_while_one_moves_and_hear_that_they_may_not_move(acknowledge: Any) -> None:
    async with bridged(quirks=UltraArmQuirks(acknowledge=acknowledge)) as rig, UltraArm.connect(rig.bridge.url) as arm:
        async with UltraArm.connect(rig.bridge.url) as other:
            motion = await arm.queue.move_to(200, 100, 40)
            await until(lambda: rig.sim.arm.device.moving)
            with pytest.raises(CommandRejected, match="moves the arm"):
                await other.request(c.PUMP_ON, None)

            assert (await other.get_coords()).x > 0
            assert not (await other.get_angles()).j4
            await motion

        assert [move.y for move in rig.executed(c.MOVE_COORDS)] == [100]
        assert "moves the arm" in rig.told("refused")[0]


@pytest.mark.full
async def test_many_commands_arrive_in_order_and_once_while_others_read() -> None:
    async with bridged(speed=200) as rig, UltraArm.connect(rig.bridge.url) as arm, plain(rig.bridge.url) as other:
        reading = asyncio.create_task(read_for_ever(other))
        targets = [200 + step / 4 for step in range(40)]
        for x in targets:
            motion = await arm.queue.move_to(x, 0, 40, speed=200)

        await motion
        assert [each.x for each in rig.executed(c.MOVE_COORDS)] == targets
        reading.cancel()
        await asyncio.wait([reading])
        assert reading.cancelled(), "every answer was one to its question"


async def read_for_ever(client: Plain) -> None:
    """Asks for one thing after the other."""
    while True:
        assert "ANGLES[" in await client.ask("M12")
        assert "ENDSTOP[" in await client.ask("m119")
        assert (await client.ask("M9")).startswith("Moving")
        assert "QUEUE SIZE[" in await client.ask("M120")
        assert "COORDS[" in await client.ask("M114")


async def test_a_program_that_vanishes_in_the_middle_of_a_motion_stops_the_arm() -> None:
    async with bridged(speed=1) as rig:
        async with plain(rig.bridge.url) as mover:
            await mover.ask("M3")
            await mover.send(FAR)
            await until(lambda: rig.sim.arm.device.moving)

        await until(lambda: rig.told("released"))
        assert rig.told("stopped")
        assert not rig.sim.arm.device.moving
        assert not rig.sim.arm.registers.laser
        assert not rig.sim.arm.registers.powered, "nothing but M17 ends a motion of this firmware"


async def test_a_program_that_vanishes_while_it_jogs_ends_the_jog_and_the_motors_hold() -> None:
    async with bridged(speed=1) as rig:
        async with plain(rig.bridge.url) as mover:
            await mover.ask("M13 J1 D0 F50")
            await until(lambda: rig.sim.arm.device.moving)

        await until(lambda: rig.told("released"))
        assert rig.told("stopped")
        assert not rig.sim.arm.device.moving
        assert rig.sim.arm.registers.powered


async def test_a_program_that_has_finished_may_go() -> None:
    async with bridged() as rig:
        async with UltraArm.connect(rig.bridge.url) as arm:
            await arm.move_to(200, 0, 40)

        await until(lambda: rig.told("released"))
        assert not rig.told("stopped")
        assert rig.sim.arm.registers.powered


async def test_on_vanish_leave_lets_the_arm_finish() -> None:
    async with bridged(speed=5, on_vanish="leave") as rig:
        async with plain(rig.bridge.url) as mover:
            await mover.send(FAR)
            await until(lambda: rig.sim.arm.device.moving)

        await until(lambda: rig.told("released"))
        await until(lambda: not rig.sim.arm.device.moving)
        assert rig.sim.arm.pose.y == pytest.approx(200, abs=0.1)


@pytest.mark.parametrize("stop", [b"M15\r", b"M17\r"])
async def test_anybody_may_stop_and_the_mover_hears_of_it(stop: bytes) -> None:
    quirks = UltraArmQuirks(jog_stop="all")
    async with bridged(speed=1, quirks=quirks) as rig, UltraArm.connect(rig.bridge.url, on_error="leave") as arm:
        motion = await arm.queue.move_to(200, 200, 40)
        await until(lambda: rig.sim.arm.device.moving)
        async with plain(rig.bridge.url) as other:
            await other.send(stop)
            assert (await other.line()).startswith("QUEUE SIZE")
            with pytest.raises((ConnectionLost, MotionStopped)):
                await motion

        await until(lambda: not rig.sim.arm.device.moving)
        assert rig.sim.arm.pose.y < 190


async def test_takeover_stops_the_arm_and_ends_the_former_connection() -> None:
    async with bridged(speed=1, takeover=True) as rig, plain(rig.bridge.url) as first, plain(rig.bridge.url) as second:
        await first.send(FAR)
        await until(lambda: rig.sim.arm.device.moving)
        assert await second.ask("M18") == "QUEUE SIZE[0]"
        assert rig.told("cut")
        assert rig.told("stopped")
        assert not rig.sim.arm.device.moving


async def test_the_token_is_asked_for() -> None:
    async with bridged(token="sesame") as rig:
        async with UltraArm.connect(f"{rig.bridge.url}?token=sesame") as arm:
            await arm.get_coords()

        assert not rig.told("turned away")


# Whose an answer is.


async def test_the_answers_of_one_client_come_in_its_order_refusals_and_stops_included() -> None:
    async with bridged() as rig, plain(rig.bridge.url) as mover, plain(rig.bridge.url) as other:
        assert (await mover.ask("M28")).startswith("QUEUE SIZE")
        lines = b"M12\rM12\rM27\rM119\rM15\rM12\rM114\rM15\rM15\rHELLO WORLD\rM9\r"
        await other.send(lines)
        heard = [await other.line() for _ in range(11)]
        wanted = [
            "ANGLES",
            "ANGLES",
            "ERROR",
            "ENDSTOP",
            "QUEUE",
            "ANGLES",
            "COORDS",
            "QUEUE",
            "QUEUE",
            "ERROR",
            "Moving",
        ]
        assert [word for line, word in zip(heard, wanted, strict=True) if word not in line] == []


async def test_bytes_may_be_cut_anywhere_and_noise_between_lines_counts_for_nothing() -> None:
    async with bridged() as rig, plain(rig.bridge.url) as client:
        for byte in b"m12\xff\x00\r\n\rG92 x200 \r\nM114\r":
            await client.send(bytes([byte]))

        assert "ANGLES[" in await client.line()
        assert (await client.line()).startswith("QUEUE SIZE")
        assert "200.00" in await client.line()


async def test_what_firmware_answers_with_nothing_is_answered_with_nothing() -> None:
    async with bridged(quirks=UltraArmQuirks(acknowledge="nothing")) as rig, plain(rig.bridge.url) as client:
        await client.send(b"M28\r")
        assert "QUEUE SIZE" in await client.ask("M120")
        assert await client.ask("M99") == "ERROR: COMMAND NOT RECOGNIZED"


class Odd:
    """An arm that does as a test says: it answers each line by a function."""

    def __init__(self, answer: Any) -> None:
        self.answer = answer
        self.lines: list[bytes] = []
        self._writers: list[asyncio.StreamWriter] = []

    def say(self, text: bytes) -> None:
        """Says something unasked."""
        for writer in self._writers:
            writer.write(text)

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.append(writer)
        try:
            while True:
                line = (await reader.readuntil(b"\r")).strip()
                self.lines.append(line)
                writer.write(self.answer(line))
        except (asyncio.IncompleteReadError, ConnectionError):
            writer.close()


READINGS = {
    b"M120": b"QUEUE SIZE[0]\r\n",
    b"M114": b"DATA : COORDS[1.00 ,2.00 ,3.00 ,0.00]\r\n",
    b"M119": b"ENDSTOP[0,0,0]\r\n",
    b"M9": b"Moving end\r\n",
    b"M12": b"ANGLES[1,2,3,0]\r\n",
}


@asynccontextmanager
async def odd(answer: Any) -> AsyncIterator[tuple[Odd, str]]:
    """An odd arm, and where the bridge to it is."""
    arm = Odd(answer)
    server = await asyncio.start_server(arm.serve, "127.0.0.1", 0)
    async with server:
        port = server.sockets[0].getsockname()[1]
        async with over(f"tcp://127.0.0.1:{port}") as (running, _):
            yield arm, running.url


async def test_what_the_arm_says_unasked_goes_to_who_moves_it() -> None:
    async with odd(lambda line: READINGS.get(line, b"")) as (arm, url), plain(url) as mover, plain(url) as other:
        await mover.send(b"G28\rM120\r")
        assert await mover.line() == "QUEUE SIZE[0]"
        arm.say(b"DATA: [ok]\r\n")
        assert await mover.line() == "DATA: [ok]"
        assert "ANGLES" in await other.ask("M12")


async def test_what_it_says_while_it_answers_somebody_else_does_too() -> None:
    def answer(line: bytes) -> bytes:
        return b"Moving end\r\n" * (line == b"M12") + READINGS.get(line, b"")

    async with odd(answer) as (_, url), plain(url) as mover, plain(url) as other:
        await mover.send(b"G28\rM120\r")
        assert await mover.line() == "QUEUE SIZE[0]"
        assert await other.ask("M12") == "ANGLES[1,2,3,0]"
        assert await mover.line() == "Moving end"
        assert await other.ask("M9") == "Moving end"


async def test_an_arm_that_falls_silent_accepts_nothing() -> None:
    moved = asyncio.Event()
    awake = asyncio.Event()

    def answer(line: bytes) -> bytes:
        if line.startswith(b"G0"):
            moved.set()

        return READINGS.get(line, b"") if awake.is_set() or not moved.is_set() else b""

    async with odd(answer) as (arm, url), plain(url) as mover, plain(url) as other:
        await mover.send(b"G0 X1\rM120\rM114\r")
        await moved.wait()
        asked = asyncio.create_task(other.ask("M12"))
        await until(lambda: b"M12" in arm.lines)
        awake.set()
        assert "ANGLES" in await asked
        assert "ANGLES" in await mover.ask("M12"), "nothing that would look like an answer to G0 came before"
        assert arm.lines.count(b"G0 X1") == 1


async def test_udp_is_refused_with_the_reason() -> None:
    with pytest.raises(ValueError, match="nothing but their order"):
        async with bridge("sim:", family="ultraarm", listen="udp://127.0.0.1:0"):
            pass


async def test_calibration_can_be_denied() -> None:
    async with bridged(deny=["calibration"]) as rig, plain(rig.bridge.url) as client:
        assert await client.ask("M24 M1") == "ERROR: it is denied here"
        assert (
            await client.ask("G4 S0 M24") == "ERROR: COMMAND NOT RECOGNIZED: expected one command, letters with numbers"
        )
        assert rig.sim.arm.counters.unknown == 0
        assert rig.bridge.holder is None


# The vendor's own library, over the bridge's pseudo-terminal.


async def test_the_vendors_library_drives_the_arm_while_another_program_watches(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what it imports beside this is not up to date
        library = pytest.importorskip("pymycobot.ultraArmP340")

    kind: Any = getattr(library, "ultraArmP340", library)
    module = sys.modules[kind.__module__]
    hurried = SimpleNamespace(**{**vars(time), "sleep": lambda seconds: time.sleep(min(seconds, 0.05))})
    monkeypatch.setattr(module, "time", hurried)
    async with bridged(["pty", TCP]) as rig, UltraArm.connect(rig.bridge.urls[1], control=False) as watcher:
        lab = await asyncio.to_thread(kind, rig.bridge.urls[0].removeprefix("serial://"))
        try:
            watched = asyncio.create_task(reads(watcher))
            for name, args, returned in [
                ("go_zero", (), None),
                ("sync", (), None),
                ("get_angles_info", (), [0.0] * 4),
                ("set_coords", ([200, 0, 40], 100), None),
                ("sync", (), None),
                ("get_coords_info", (), [200.0, 0.0, 40.0, 0.0]),
                ("set_angles", ([30, 10.5, 20], 100), None),
                ("sync", (), None),
                ("get_angles_info", (), [30.0, 10.5, 20.0, 0.0]),
                ("set_jog_angle", (1, 0, 50), None),
                ("set_jog_stop", (), None),
                ("is_moving_end", (), 1),
                ("get_system_version", (), 1.2),
                ("set_gpio_state", (1,), None),
            ]:
                async with asyncio.timeout(IN_TIME):
                    found = await asyncio.to_thread(getattr(lab, name), *args)

                assert returned is None or found == pytest.approx(returned, abs=0.05), name

            watched.cancel()
            await asyncio.wait([watched])
            assert watched.cancelled()
            assert not rig.told("refused")
            assert rig.sim.arm.registers.pump
            assert rig.sim.arm.counters.unknown == 0
        finally:
            await asyncio.to_thread(lab.close)


async def reads(arm: UltraArm) -> None:
    """Reads for ever; each answer is one to its question."""
    while True:
        assert isinstance(await arm.get_coords(), c.UltraArmCoords)
        assert isinstance(await arm.get_angles(), c.UltraArmAngles)
        assert isinstance(await arm.is_moving(), bool)


async def test_a_jog_of_the_driver_goes_through() -> None:
    async with bridged(speed=1) as rig, UltraArm.connect(rig.bridge.url) as arm:
        async with arm.jogging(UltraArmJog.J1_PLUS):
            await until(lambda: rig.sim.arm.device.moving)

        assert not await arm.is_moving()
        assert rig.sim.arm.angles.j1 > 0


# What lines are to it.


@pytest.mark.parametrize(
    ("line", "kind"),
    [
        (b"M12", RequestKind.READ),
        (b"m 114 ", RequestKind.READ),
        (b"M52 J4 S8", RequestKind.READ),
        (b"M15", RequestKind.STOP),
        (b"M17", RequestKind.STOP),
        (b"G0 X1", RequestKind.WRITE),
        (b"G90", RequestKind.WRITE),
        (b"M31", RequestKind.WRITE),
        (b"M114 G28", RequestKind.WRITE),
        (b"M15 X1", RequestKind.WRITE),
        (b"M999", RequestKind.WRITE),
        (b"X200", RequestKind.WRITE),
        (b"%", RequestKind.WRITE),
    ],
)
def test_what_is_not_wholly_understood_is_a_write(line: bytes, kind: RequestKind) -> None:
    assert BRIDGED.kind(BridgedLine(line + b"\r")) is kind


@pytest.mark.parametrize(
    "line", [b"M31", b"m031", b"M31.0", b"M31.", b"M+31", b"M 31", b"N5 M31", b"M31X", b"M+031.00 S1"]
)
def test_however_a_command_is_written_it_is_denied(line: bytes) -> None:
    request = BridgedLine(line + b"\r")
    assert BRIDGED.subject(request) in BRIDGED.deny_groups["calibration"]
    assert BRIDGED.kind(request) is RequestKind.WRITE


@pytest.mark.parametrize(
    "line", [b"%", b"M114 G28", b"N1 G28 M24", b"M31.9", b"M-31", b"M31 M31", b"M", b"X200", b"(x)M31", b"M31;x"]
)
def test_what_is_not_one_command_with_a_whole_number_is_refused(line: bytes) -> None:
    with pytest.raises(ProtocolError):
        BRIDGED.check(BridgedLine(line + b"\r"))


@given(st.lists(st.sampled_from([b"M12", b"M9", b"M120", b"M119", b"M114", b"G0 X1", b"M15"]), max_size=12), st.data())
def test_however_lines_are_cut_and_joined_each_is_there_once(lines: list[bytes], data: st.DataObject) -> None:
    stream = b"".join(line + b"\r" for line in lines)
    parser, found = Requests(), b""
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        found += b"".join(request.text for request in parser.feed(stream[:size]))
        stream = stream[size:]

    assert found == b"".join(line + b"\r" for line in lines)


@given(st.binary(max_size=400))
def test_no_bytes_are_too_much_for_the_parsers(data: bytes) -> None:
    for parser in (Requests(), Answers()):
        for frame in parser.feed(data):
            assert BRIDGED.kind(frame) in RequestKind
            assert frame.aside or frame.key.endswith("M114")


def test_a_watch_knows_what_moves_and_what_burns() -> None:
    now = 0.0
    watch = UltraArmWatch(lambda: now)
    rest = BridgedLine(b"Moving end\r\nQUEUE SIZE[0]\r\nENDSTOP[0,0,0]\r\nCOORDS[0,0,0,0]")
    busy = BridgedLine(b"Moving\r\nQUEUE SIZE[0]\r\nENDSTOP[0,0,0]\r\nCOORDS[0,0,0,0]")
    assert not watch.moving(busy), "for somebody else"
    watch.sent(BridgedLine(b"G0 X1\r"))
    assert watch.moving(None)
    assert watch.moving(rest), "it may not have begun"
    now = 1.0
    assert watch.moving(busy)
    assert not watch.moving(rest)
    watch.sent(BridgedLine(b"M21 P200\r"))
    assert watch.moving(rest)
    end(watch, b"M21 P0\r")
    assert not watch.moving(rest)
    watch.sent(BridgedLine(b"M3\r"))
    assert watch.moving(rest)
    end(watch, b"M5\r")
    assert watch.moving(busy), "it may not have come to that yet"
    assert not watch.moving(rest)
    watch.sent(BridgedLine(b"M15\r"))
    assert watch.moving(rest), "the stop may have thrown M5 away"


def end(watch: UltraArmWatch, line: bytes) -> None:
    """Something is switched off, which is acknowledged."""
    watch.sent(BridgedLine(line))
    watch.answered(BridgedLine(line), BridgedLine(b"ok\r\n"))


@pytest.mark.parametrize("cut", range(1, 12))
@pytest.mark.parametrize("token", [b"TOKEN abc\n", b""])
def test_a_token_that_nobody_asked_for_spoils_no_command(token: bytes, cut: int) -> None:
    stream = token + b"M120\rT\rG0 X200\r"
    parser = Requests()
    found = [*parser.feed(stream[:cut]), *parser.feed(stream[cut:])]
    assert [line.text for line in found] == [b"M120\r", b"T\r", b"G0 X200\r"]


async def test_a_client_with_a_token_at_a_bridge_without_one() -> None:
    async with bridged() as rig, UltraArm.connect(f"{rig.bridge.url}?token=abc") as arm:
        assert (await arm.get_coords()).x > 0
        assert arm.link.stats.repeated == arm.link.stats.unexpected == 0
