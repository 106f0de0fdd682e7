"""An arm of the myCobot family behind a bridge: several programs, one mover, and an arm that need not answer."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any, NamedTuple

import pytest
from bridge_rig import IN_TIME, TCP, until
from virtual_ports import on_the_virtual_clock, virtual_ports

from dobot_async import MotionStopped, MyCobot
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.bridge_adapter import RequestKind
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot import frame as f
from dobot_async.arms.mycobot.bridge_adapter import BRIDGED, CobotWatch
from dobot_async.arms.mycobot.models import MODELS
from dobot_async.bridge import Bridge, BridgeEvent, bridge
from dobot_async.errors import ConnectFailed, ConnectionLost, ProtocolError
from dobot_async.simulator import MyCobotQuirks, Simulation, simulate
from dobot_async.transports import open_transport

__all__ = ["virtual_ports"]

FAR = (90.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NEW = MyCobotQuirks()
OLD = MyCobotQuirks(acknowledges=False, later=False, echo=False)
MODEL = MODELS["mycobot280"]


class Rig(NamedTuple):
    """An arm, the bridge to it, what went to the arm, and what has happened."""

    sim: Simulation
    bridge: Bridge[Any]
    sent: list[f.Frame]
    happened: list[BridgeEvent]

    def told(self, what: str) -> list[str]:
        return [event.detail for event in self.happened if event.what == what]

    def times(self, command: Command[Any, Any]) -> int:
        """How often a row was sent to the arm."""
        return sum(frame.id == MODEL.row(command).id for frame in self.sent)


@asynccontextmanager
async def bridged(
    listen: str | list[str] = TCP,
    *,
    model: str = "mycobot280",
    speed: float = 20.0,
    quirks: MyCobotQuirks = NEW,
    **details: Any,
) -> AsyncIterator[Rig]:
    async with simulate(model, listen=TCP, speed=speed, quirks=quirks) as sim:
        async with bridge(sim.url, listen=listen, family=model, **details) as running:
            happened: list[BridgeEvent] = []
            sent: list[f.Frame] = []
            running.link.on_frame.add(lambda outgoing, frame: sent.append(frame) if outgoing else None)

            async def note() -> None:
                async for event in running.events:
                    happened[len(happened) :] = [event]

            noting = asyncio.create_task(note())
            await asyncio.sleep(0)
            yield Rig(sim, running, sent, happened)

        await noting


@asynccontextmanager
async def plain(url: str) -> AsyncIterator[Transport]:
    """A client that knows bytes alone."""
    transport = await open_transport(url, arm="mycobot280")
    try:
        yield transport
    finally:
        await transport.aclose()


def frame(command: Command[Any, Any], value: Any = None) -> bytes:
    row = MODEL.row(command)
    return bytes(f.Frame(row.id, row.request.encode(value)))


async def heard(transport: Transport) -> f.Frame:
    """The next frame."""
    parser = f.Parser(MODEL.known)
    async with asyncio.timeout(IN_TIME):
        while True:
            frames = parser.feed(await transport.receive())
            if frames:
                return frames[0]


# One arm, several programs.


@pytest.mark.parametrize("listen", ["udp://127.0.0.1:0", "pty"])
async def test_a_program_moves_the_arm_through_it(listen: str) -> None:
    await moves_through("mycobot280", listen)


@on_the_virtual_clock
@pytest.mark.parametrize("model", ["mycobot280", "myarm300", "mypalletizer260"])
async def test_a_program_moves_any_model_through_it(model: str) -> None:
    await moves_through(model, TCP)


async def moves_through(model: str, listen: str) -> None:
    """Moves an arm by way of a bridge."""
    async with bridged(listen, model=model) as rig, MyCobot.connect(rig.bridge.url, model=model) as arm:
        target = (30.0, *(10.0,) * (arm.model.joints - 1))
        await arm.move_joints(*target)
        assert await arm.get_angles() == pytest.approx(target, abs=0.02)
        assert list(rig.sim.arm.joints) == pytest.approx(target, abs=0.02)
        assert rig.times(c.SEND_ANGLES) == 1


@on_the_virtual_clock
async def test_others_watch_while_one_moves_and_may_not_move() -> None:
    async with bridged() as rig, MyCobot.connect(rig.bridge.url) as arm, plain(rig.bridge.url) as other:
        async with MyCobot.connect(rig.bridge.url, control=False) as watcher:
            motion = await arm.queue.move_joints(*FAR, speed=20)
            await until(lambda: rig.times(c.SEND_ANGLES))
            await other.send(frame(c.SEND_ANGLES, c.JointsMove((0,) * 6, 50)))
            await until(lambda: rig.told("refused"))
            assert "moves the arm" in rig.told("refused")[0]
            assert len(await watcher.get_angles()) == 6
            await motion

        assert list(rig.sim.arm.joints) == pytest.approx(FAR, abs=0.02)
        assert rig.times(c.SEND_ANGLES) == 1


@on_the_virtual_clock
@pytest.mark.parametrize("quirks", [NEW, OLD], ids=["newer", "older"])
async def test_a_program_that_vanishes_in_the_middle_of_a_motion_stops_the_arm(quirks: MyCobotQuirks) -> None:
    async with bridged(speed=1.0, quirks=quirks) as rig:
        async with plain(rig.bridge.url) as mover:
            await mover.send(frame(c.SEND_ANGLES, c.JointsMove(FAR, 30)))
            await until(lambda: rig.sim.arm.joints[0] > 1)

        await until(lambda: rig.told("released"))
        assert rig.told("stopped")
        assert not rig.sim.arm.moving
        assert rig.sim.arm.joints[0] < 80
        assert rig.times(c.SEND_ANGLES) == 1


@on_the_virtual_clock
async def test_a_program_that_has_finished_may_go() -> None:
    async with bridged() as rig:
        async with plain(rig.bridge.url) as mover:
            await mover.send(frame(c.SET_COLOR, c.RGB(1, 2, 3)))
            assert (await heard(mover)).id == MODEL.row(c.SET_COLOR).id

        await until(lambda: rig.told("released"))
        assert not rig.told("stopped")
        assert rig.times(c.STOP) == 0


@on_the_virtual_clock
async def test_anybody_may_stop_and_the_mover_hears_of_it() -> None:
    async with bridged(speed=1.0) as rig, MyCobot.connect(rig.bridge.url, on_error="leave") as arm:
        motion = await arm.queue.move_joints(*FAR, speed=20)
        await until(lambda: rig.sim.arm.joints[0] > 1)
        async with plain(rig.bridge.url) as other:
            await other.send(frame(c.STOP))
            assert (await heard(other)).id == MODEL.row(c.STOP).id
            with pytest.raises((ConnectionLost, MotionStopped)):
                await motion

        await until(lambda: not rig.sim.arm.moving)
        assert rig.sim.arm.joints[0] < 80


@on_the_virtual_clock
async def test_half_a_frame_and_garbage_disturb_nobody() -> None:
    async with bridged() as rig, plain(rig.bridge.url) as other, MyCobot.connect(rig.bridge.url) as arm:
        await other.send(frame(c.SEND_ANGLES, c.JointsMove(FAR, 50))[:7])
        await arm.move_joints(20, 0, 0, 0, 0, 0)
        await other.send(b"\xfe\xfe\xfe\xff garbage" * 20 + frame(c.IS_POWER_ON))
        assert (await heard(other)).params == b"\x01"
        assert list(rig.sim.arm.joints) == pytest.approx((20, 0, 0, 0, 0, 0), abs=0.02)
        assert rig.times(c.SEND_ANGLES) == 1
        assert rig.sim.arm.counters.dropped == rig.sim.arm.counters.unfit == 0


@on_the_virtual_clock
async def test_an_arm_that_acknowledges_nothing_is_told_once_and_nothing_is_refused() -> None:
    async with bridged(quirks=OLD) as rig, MyCobot.connect(rig.bridge.url, acknowledges=False) as arm:
        await arm.move_joints(20, 0, 0, 0, 0, 0)
        await arm.color(1, 2, 3)
        assert rig.times(c.SEND_ANGLES) == rig.times(c.SET_COLOR) == 1
        assert not rig.told("refused")


@on_the_virtual_clock
async def test_calibration_can_be_denied() -> None:
    async with bridged(deny=["calibration"]) as rig, plain(rig.bridge.url) as other:
        await other.send(frame(c.SET_SERVO_CALIBRATION, 1))
        await until(lambda: rig.told("refused"))
        assert rig.times(c.SET_SERVO_CALIBRATION) == 0


# The vendor's own library, over the bridge's pseudo-terminal.


async def test_the_vendors_library_drives_the_arm_while_another_program_watches(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pymycobot = pytest.importorskip("pymycobot")
    monkeypatch.setattr("locale.getdefaultlocale", lambda *_: ("en_US", "UTF-8"))
    clock = SimpleNamespace(time=time.time, sleep=lambda seconds: time.sleep(min(seconds, 0.02)))
    monkeypatch.setattr("pymycobot.mycobot280.time", clock)
    here = [20.0, -20.5, 30.25, -40.75, 50.0, -60.0]
    async with bridged(["pty", TCP]) as rig, MyCobot.connect(rig.bridge.urls[1], control=False) as watcher:
        lab = await asyncio.to_thread(pymycobot.MyCobot280, rig.bridge.urls[0].removeprefix("serial://"), "115200")
        try:
            watched = asyncio.create_task(reads(watcher))
            for name, args, returned in [
                ("is_power_on", (), 1),
                ("get_system_version", (), 1.3),
                ("get_angles", (), [0.0] * 6),
                ("send_angles", (here, 80), 1),
                ("sync_send_angles", (here, 80), 1),
                ("get_angles", (), here),
                ("is_in_position", (here, 0), 1),
                ("send_angle", (1, 45, 80), 1),
                ("sync_send_angles", ([0] * 6, 80), 1),
                ("is_moving", (), 0),
                ("set_color", (1, 2, 3), 1),
                ("get_joint_min_angle", (2,), -140.0),
                ("stop", (), 1),
            ]:
                async with asyncio.timeout(IN_TIME):
                    found = await asyncio.to_thread(getattr(lab, name), *args)

                assert found == (pytest.approx(returned, abs=0.05) if isinstance(returned, list) else returned), name

            watched.cancel()
            await asyncio.wait([watched])
            assert watched.cancelled()
            assert not rig.told("refused")
        finally:
            lab._serial_port.close()


async def reads(arm: MyCobot) -> None:
    """Reads for ever; each answer is one to its question."""
    while True:
        assert len(await arm.get_angles()) == 6
        assert isinstance(await arm.is_moving(), bool)


# What cannot be bridged.


async def test_an_unknown_arm_is_refused_with_the_names() -> None:
    with pytest.raises(ValueError, match="magician, mycobot, "):
        async with bridge("sim:", family="robot"):
            pass


@on_the_virtual_clock
async def test_a_magician_is_no_mycobot() -> None:
    async with simulate("magician", listen=TCP) as sim:
        with pytest.raises(ConnectFailed, match="no arm answers"):
            async with bridge(sim.url, family="mycobot280", timeout=0.5):
                pass


# The family's own words.


@pytest.mark.parametrize("model", MODELS.values(), ids=lambda model: model.name)
def test_a_row_is_what_the_table_says(model: Any) -> None:
    family = BRIDGED[model.name]
    for row, own in model.rows.items():
        stops = row in {c.STOP, c.JOG_STOP}
        each = f.Frame(own.id, b"")
        assert family.kind(each) is (
            RequestKind.STOP if stops else RequestKind.WRITE if row.write else RequestKind.READ
        )
        assert family.name(each) == own.name
        assert family.repeatable(each) is not row.write
        assert family.ack_optional(each) is row.write


def test_an_answer_fits_its_request() -> None:
    family = BRIDGED["mycobot280"]
    ask = f.Frame(c.GET_JOINT_MIN_ANGLE.id, b"\x02")
    assert family.accept(ask, f.Frame(ask.id, b"\x02\x00\x10"))
    for wrong in (b"\x03\x00\x10", b"\x02", b""):
        with pytest.raises(ProtocolError):
            family.accept(ask, f.Frame(ask.id, wrong))

    typed = f.Frame(c.GET_GRIPPER_VALUE.id, b"\x01")
    with pytest.raises(ProtocolError, match="sent back"):
        family.accept(typed, typed)


def test_the_arm_moves_while_it_says_so_and_for_a_while_after_it_was_told() -> None:
    now = 0.0
    watch = CobotWatch(MODEL, lambda: now)
    still, moving = (f.Frame(c.IS_MOVING.id, flag) for flag in (b"\x00", b"\x01"))
    motion = f.Frame(c.SEND_ANGLES.id, b"")
    assert not watch.moving(None)
    assert not watch.moving(moving)  # on behalf of somebody else
    watch.sent(motion)
    assert watch.moving(still)
    now = 2.0
    assert watch.moving(None)
    assert watch.moving(moving)
    assert not watch.moving(still)
    watch.sent(f.Frame(c.PAUSE.id, b""))
    assert watch.moving(still)
    watch.sent(f.Frame(c.STOP.id, b""))
    assert not watch.moving(still)
    assert watch.moving(moving)
