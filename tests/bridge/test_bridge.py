"""A bridge between several programs and one arm: who is answered, who may move the arm, and what stops it."""

from __future__ import annotations

import asyncio
import logging
from contextlib import AsyncExitStack
from functools import partial
from typing import Any

import pytest
from bridge_rig import IN_TIME, TCP, Plain, Rig, ask, bridged, client, far, numbers, set_now, until
from virtual_ports import on_the_virtual_clock, virtual_ports

from dobot_async import ConnectFailed, ConnectionLost, Magician
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame, encode
from dobot_async.bridge import Limits, bridge
from dobot_async.simulator import Faults, simulate

__all__ = ["virtual_ports"]

PLACES = ["tcp://127.0.0.1:0", "udp://127.0.0.1:0", "ws://127.0.0.1:0", "pty"]
START = ask(c.SET_QUEUED_CMD_START_EXEC)
CLEAR = ask(c.SET_QUEUED_CMD_CLEAR)
HALT = ask(c.SET_QUEUED_CMD_FORCE_STOP_EXEC)
ENDLESS = ask(c.SET_WAIT_CMD, c.WAITCmd(10_000_000), queued=True)

everywhere = pytest.mark.parametrize("listen", PLACES)


# Every place.


@everywhere
async def test_a_program_moves_the_arm_through_it(listen: str) -> None:
    async with bridged(listen) as rig, Magician.connect(rig.url) as arm:
        await arm.move_to(220, 0, 40)
        assert (await arm.get_pose()).x == pytest.approx(220, abs=0.01)
        assert rig.executed(c.SET_PTP_CMD) == [c.PTPCmd(c.PTPMode.MOVJ_XYZ, 220, 0, 40, 0)]


@everywhere
async def test_a_request_may_come_byte_by_byte(listen: str) -> None:
    async with bridged(listen) as rig, client(rig.url) as plain:
        for byte in encode(ask(c.GET_DEVICE_NAME)):
            await plain.transport.send(bytes((byte,)))

        assert (await plain.receive()).id == c.GET_DEVICE_NAME.id


@everywhere
async def test_programs_come_and_go(listen: str) -> None:
    async with bridged(listen, limits=Limits(silence=0.2)) as rig:
        for count in range(1, 4):
            async with client(rig.url) as plain:
                assert (await plain.ask(c.GET_DEVICE_NAME)).params == b"Dobot Magician\0"

            await until(partial(has_told, rig, "left", count))

        assert len(rig.told("connected")) == 3


@pytest.mark.parametrize("source", ["memory", "pty", "udp://127.0.0.1:0"])
async def test_the_arm_may_be_anywhere(source: str) -> None:
    async with AsyncExitStack() as stack:
        sim = await stack.enter_async_context(simulate(listen=source, speed=50))
        running = await stack.enter_async_context(bridge(sim.url))
        arm = await stack.enter_async_context(Magician.connect(running.url))
        await arm.move_to(220, 0, 40)
        assert sim.arm.pose.x == pytest.approx(220, abs=0.01)


async def test_it_listens_in_several_places() -> None:
    async with bridged(PLACES) as rig, AsyncExitStack() as stack:
        assert [url.split(":")[0] for url in rig.bridge.urls] == ["tcp", "udp", "ws", "serial"]
        plain = [await stack.enter_async_context(client(url)) for url in rig.bridge.urls]
        names = await asyncio.gather(*(each.ask(c.GET_DEVICE_NAME) for each in plain))
        assert {name.params for name in names} == {b"Dobot Magician\0"}


@on_the_virtual_clock
async def test_without_an_arm_it_does_not_begin() -> None:
    async with simulate(listen=TCP, faults=Faults(silent=True)) as sim:
        with pytest.raises(ConnectFailed, match="no arm answers"):
            async with bridge(sim.url, timeout=0.2):
                pass


@pytest.mark.parametrize(
    ("wrong", "details"),
    [
        ("cannot listen at 'http://x:1'", {"listen": "http://x:1"}),
        ("cannot listen at 'tcp://127.0.0.1'", {"listen": TCP.rpartition(":")[0]}),
        ("a place to listen", {"listen": []}),
        ("deny", {"deny": ["everything"]}),
        ("on_vanish", {"on_vanish": "wait"}),
        ("a word of printable ASCII", {"token": "two words"}),
        ("200 characters at most", {"token": "x" * 201}),
        ("wss needs a certificate", {"listen": "wss://127.0.0.1:0"}),
        ("cannot use the certificate", {"certificate": "/nonexistent"}),
        ("certificate where there is a key", {"key": "/nonexistent"}),
    ],
)
@on_the_virtual_clock
async def test_wrong_arguments_are_named(wrong: str, details: Any) -> None:
    with pytest.raises(ValueError, match=wrong):
        async with bridge("sim:", **details):
            pass


# Answers.


@on_the_virtual_clock
async def test_who_asks_is_answered_and_nobody_else() -> None:
    """Two programs read the same registers of the same addresses, pipelined; the answers are in their own order."""
    async with bridged() as rig, client(rig.url) as one, client(rig.url) as other:
        for address in range(1, 21):
            rig.sim.arm.state.set(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(address, c.IOFunction.ADC))
            rig.sim.arm.set_adc(address, 100 * address)

        async def read(plain: Plain, addresses: list[int]) -> None:
            await plain.send(*(ask(c.GET_IOADC, address) for address in addresses))
            answers = [c.GET_IOADC.reply.decode((await plain.receive()).params) for _ in addresses]
            assert [(each.address, each.value) for each in answers] == [(each, 100 * each) for each in addresses]

        await asyncio.gather(read(one, [*range(1, 21)] * 5), read(other, [*range(20, 0, -1)] * 5))


@on_the_virtual_clock
async def test_the_late_answer_to_somebody_who_has_gone_answers_nobody() -> None:
    async with bridged() as rig:
        async with client(rig.url) as plain:
            await plain.ask(c.GET_DEVICE_NAME)
            rig.sim.faults.latency = 0.1
            requests = rig.sim.arm.counters.requests
            await plain.send(ask(c.GET_DEVICE_NAME))
            await until(lambda: rig.sim.arm.counters.requests > requests)

        rig.sim.arm.state.set(c.SET_DEVICE_NAME, "new")  # the old name is on its way
        async with client(rig.url) as plain:
            assert (await plain.ask(c.GET_DEVICE_NAME)).params == b"new\0"


@on_the_virtual_clock
async def test_what_fits_no_request_is_left_out_and_the_next_is_answered() -> None:
    async with bridged() as rig, client(rig.url) as plain:
        await plain.send(Frame(84, 0, b"x"))
        assert await plain.hears_nothing()
        assert rig.executed(c.SET_PTP_CMD) == []


# Writing.


@on_the_virtual_clock
async def test_commands_are_queued_in_their_order_and_once() -> None:
    targets = [c.PTPCmd(c.PTPMode.MOVJ_XYZ, 200 + place % 7, place % 11, 40, 0) for place in range(60)]
    async with bridged(speed=500.0) as rig, Magician.connect(rig.url, window=8) as arm:
        async with arm.queue.batch() as batch:
            for target in targets:
                batch.put(c.SET_PTP_CMD, target)

        await arm.queue.join()
        assert rig.executed(c.SET_PTP_CMD) == targets


@on_the_virtual_clock
async def test_a_burst_without_waiting_keeps_its_order() -> None:
    async with bridged(speed=500.0) as rig, client(rig.url) as plain:
        frames = [frame for place in range(8) for frame in (set_now(10 + place), far(place))]
        await plain.send(CLEAR, START, *frames)
        replies = [await plain.receive() for _ in range(2 + len(frames))]
        assert [reply.id for reply in replies[2:]] == [frame.id for frame in frames]
        indices = [int.from_bytes(reply.params, "little") for reply in replies[2:] if reply.params]
        assert indices == list(range(indices[0], indices[0] + 8))


@on_the_virtual_clock
async def test_one_program_at_a_time_moves_the_arm() -> None:
    async with bridged() as rig, client(rig.url) as first, client(rig.url) as second:
        assert not rig.bridge.holder
        assert len((await first.ask(c.SET_WAIT_CMD, c.WAITCmd(0), queued=True)).params) == 8
        (holder,) = [event.client for event in rig.happened if event.what == "lease"]
        await second.send(far(), set_now(20), CLEAR)
        assert await second.hears_nothing()
        await until(lambda: len(rig.told("refused")) == 3)
        assert rig.told("refused") == [
            f"{name}: {holder} moves the arm" for name in ("SetPTPCmd", "SetPTPCommonParams", "SetQueuedCmdClear")
        ]
        assert rig.executed(c.SET_PTP_CMD) == []
        await first.transport.aclose()
        await until(lambda: rig.bridge.holder is None)
        assert len((await second.ask(c.SET_WAIT_CMD, c.WAITCmd(0), queued=True)).params) == 8


@on_the_virtual_clock
async def test_a_refusal_is_told_once_however_often_it_is_asked() -> None:
    async with bridged() as rig, client(rig.url) as first, client(rig.url) as second:
        await first.send(START)
        await first.receive()
        await second.send(*[CLEAR] * 20)
        assert await second.hears_nothing()
        await until(lambda: rig.told("refused"))
        assert len(rig.told("refused")) == 1


@on_the_virtual_clock
async def test_takeover() -> None:
    async with bridged(takeover=True, speed=1.0) as rig, client(rig.url) as first, client(rig.url) as second:
        await first.send(START, far())
        assert [(await first.receive()).id for _ in range(2)] == [START.id, c.SET_PTP_CMD.id]
        assert (await second.ask(c.SET_QUEUED_CMD_START_EXEC)).id == START.id
        assert await first.hung_up()
        assert rig.executed(c.SET_PTP_CMD, "aborted") != []
        assert len((await second.ask(c.SET_WAIT_CMD, c.WAITCmd(0), queued=True)).params) == 8
        await until(lambda: len(rig.told("left")) == 1)


@on_the_virtual_clock
async def test_an_immediate_motion_needs_the_lease_as_well() -> None:
    async with bridged() as rig, client(rig.url) as first, client(rig.url) as second:
        await first.ask(c.SET_QUEUED_CMD_START_EXEC)
        await second.send(ask(c.SET_JOG_CMD, c.JOGCmd(is_joint=True, cmd=c.JOGKey.AP_DOWN)))
        assert await second.hears_nothing()
        assert not rig.sim.arm.device.moving


@on_the_virtual_clock
async def test_what_is_asked_after_a_command_is_asked_after_it() -> None:
    """The command waits, because the key of its answer is taken; the question could go, and must not."""
    async with bridged() as rig, client(rig.url) as first, client(rig.url) as second:
        await first.ask(c.SET_QUEUED_CMD_STOP_EXEC)
        rig.sim.faults.latency = 0.05
        sent = rig.bridge.link.stats.sent
        await second.send(ask(c.GET_PTP_COMMON_PARAMS))
        await until(lambda: rig.bridge.link.stats.sent > sent)
        await first.send(ask(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(50, 50), queued=True))
        await first.send(ask(c.GET_QUEUED_CMD_LEFT_SPACE))
        assert (await first.receive()).id == c.SET_PTP_COMMON_PARAMS.id
        left = c.GET_QUEUED_CMD_LEFT_SPACE.reply.decode((await first.receive()).params)
        assert left == 31


# Stopping.


@on_the_virtual_clock
async def test_who_vanishes_in_the_middle_of_a_motion_stops_the_arm() -> None:
    async with bridged(speed=1.0) as rig:
        async with client(rig.url) as plain:
            await plain.send(START, far(), far(-100))
            for _ in range(3):
                await plain.receive()

            await until(lambda: rig.sim.arm.device.moving)

        await until(lambda: rig.bridge.holder is None)
        assert not rig.sim.arm.device.moving
        assert rig.sim.arm.device.left_space == 32
        assert rig.told("stopped") == ["it has gone, and the arm was in motion"]


async def test_who_vanishes_by_udp_stops_the_arm_too() -> None:
    async with bridged("udp://127.0.0.1:0", speed=1.0, limits=Limits(silence=0.1)) as rig, client(rig.url) as plain:
        await plain.ask(c.SET_QUEUED_CMD_START_EXEC)
        await plain.send(far())
        await plain.receive()
        await until(lambda: rig.told("stopped"))
        assert not rig.sim.arm.device.moving


@on_the_virtual_clock
async def test_a_motion_may_outlive_its_program() -> None:
    async with bridged(on_vanish="leave") as rig:
        async with client(rig.url) as plain:
            await plain.send(START, far())
            for _ in range(2):
                await plain.receive()

        await until(lambda: rig.executed(c.SET_PTP_CMD))
        assert rig.told("stopped") == []


@on_the_virtual_clock
async def test_a_program_that_has_finished_leaves_the_arm_as_it_is() -> None:
    async with bridged() as rig:
        async with Magician.connect(rig.url) as arm:
            await arm.move_to(200, 0, 40)

        await until(lambda: rig.bridge.holder is None)
        assert rig.told("stopped") == []
        assert rig.sim.arm.device.started


@pytest.mark.parametrize(
    "frame",
    [
        ask(c.SET_JOG_CMD, c.JOGCmd(is_joint=True, cmd=c.JOGKey.AP_DOWN)),
        ask(c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(is_ctrl_enabled=True, is_on=True)),
        ask(c.SET_E_MOTOR, c.EMotor(0, is_enabled=True, speed=100)),
    ],
    ids=["jog", "laser", "conveyor"],
)
@on_the_virtual_clock
async def test_what_moves_or_burns_without_the_queue_stops_as_well(frame: Frame) -> None:
    async with bridged(speed=1.0) as rig:
        async with client(rig.url) as plain:
            await plain.send(frame)
            await plain.receive()

        await until(lambda: rig.told("stopped"))
        assert not rig.sim.arm.device.moving
        assert not rig.sim.arm.laser
        assert [motor.speed for motor in rig.sim.arm.motors] == [0, 0]


@on_the_virtual_clock
async def test_a_stop_overtakes_and_drops_what_waits() -> None:
    async with bridged(speed=1.0) as rig, client(rig.url) as plain:
        await plain.ask(c.SET_QUEUED_CMD_START_EXEC)
        rig.sim.faults.latency = 0.02
        await plain.send(*[far(place) for place in range(10)])
        await plain.send(HALT)
        ids = [(await plain.receive()).id]
        while ids[-1] != HALT.id:
            ids.append((await plain.receive()).id)

        assert await plain.hears_nothing()
        assert rig.sim.arm.device.left_space >= 31
        await until(lambda: rig.told("refused"))
        assert len(rig.told("refused")) == 1


@on_the_virtual_clock
async def test_a_client_is_answered_in_order_however_many_others_ask_the_same() -> None:
    asked = [ask(c.GET_POSE), ask(c.GET_PTP_COMMON_PARAMS), ask(c.GET_POSE), ask(c.GET_DEVICE_NAME), set_now(50)]
    async with bridged() as rig, client(rig.url) as one, AsyncExitStack() as stack:
        rig.sim.faults.latency = 0.005
        others = [await stack.enter_async_context(client(rig.url)) for _ in range(5)]

        async def read(other: Plain) -> None:
            while True:
                await other.ask(c.GET_POSE)

        reading = [asyncio.create_task(read(other)) for other in others]
        try:
            for _ in range(5):
                await one.send(*asked)
                assert [(await one.receive()).id for _ in asked] == [each.id for each in asked]
        finally:
            for task in reading:
                task.cancel()

            await asyncio.wait(reading)


@on_the_virtual_clock
async def test_anybody_may_switch_off_what_burns_and_drops_nothing_of_the_mover() -> None:
    laser, motors = c.EndEffectorLaser(True, True), [c.EMotor(index, False, 0) for index in (0, 1)]
    async with bridged(speed=1.0) as rig, client(rig.url) as mover, client(rig.url) as other:
        await mover.ask(c.SET_QUEUED_CMD_START_EXEC)
        await mover.ask(c.SET_END_EFFECTOR_LASER, laser)
        for index in (0, 1):
            await mover.ask(c.SET_E_MOTOR, c.EMotor(index, True, 100))

        rig.sim.faults.latency = 0.01
        await mover.send(*[far(place) for place in range(5)])
        await other.send(
            ask(c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(False, False)),
            *(ask(c.SET_E_MOTOR, off) for off in motors),
        )
        for _ in range(3):
            await other.receive()

        assert not rig.sim.arm.laser
        assert [motor.speed for motor in rig.sim.arm.motors] == [0, 0]
        for _ in range(5):
            assert (await mover.receive()).id == far().id

        assert not rig.told("refused")
        assert not rig.told("cut")


@on_the_virtual_clock
async def test_anybody_may_stop_and_whose_motion_it_was_is_told() -> None:
    async with bridged(speed=1.0) as rig, client(rig.url) as other:
        with pytest.raises(ConnectionLost):
            async with Magician.connect(rig.url) as arm:
                motion = await arm.queue.put(c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVL_XYZ, 200, 100, 40, 0))
                await until(lambda: rig.sim.arm.device.moving)
                assert (await other.ask(c.SET_QUEUED_CMD_FORCE_STOP_EXEC)).id == HALT.id
                await motion

        assert not rig.sim.arm.device.moving
        await until(lambda: rig.bridge.holder is None)
        assert "has stopped the arm" in rig.told("cut")[0]
        assert (await other.ask(c.SET_QUEUED_CMD_CLEAR)).id == CLEAR.id


async def test_a_mover_by_udp_that_was_stopped_gets_no_more_answers() -> None:
    async with bridged(["udp://127.0.0.1:0", TCP], speed=1.0) as rig, AsyncExitStack() as stack:
        mover, other = [await stack.enter_async_context(client(url)) for url in rig.bridge.urls]
        await mover.ask(c.SET_QUEUED_CMD_START_EXEC)
        for _ in range(2):
            await mover.send(far())
            await mover.receive()

        await other.ask(c.SET_QUEUED_CMD_FORCE_STOP_EXEC)
        await until(lambda: rig.told("released"))
        assert rig.sim.arm.device.left_space == 32
        requests = rig.sim.arm.counters.requests
        await mover.send(ask(c.GET_DEVICE_NAME))
        assert await other.hears_nothing()
        assert rig.sim.arm.counters.requests == requests + 1


@on_the_virtual_clock
async def test_the_stop_of_another_program_through_the_driver() -> None:
    async with bridged(speed=1.0) as rig, client(rig.url) as mover:
        await mover.send(START, far())
        for _ in range(2):
            await mover.receive()

        async with Magician.connect(rig.url, queue="keep") as arm:
            await arm.stop()
            assert not rig.sim.arm.device.moving
            assert rig.sim.arm.device.left_space == 32


@on_the_virtual_clock
async def test_the_end_of_the_bridge_stops_the_arm() -> None:
    async with simulate(listen=TCP) as sim:
        async with bridge(sim.url) as running, client(running.url) as plain:
            await plain.send(START, far())
            for _ in range(2):
                await plain.receive()

            await until(lambda: sim.arm.device.moving)

        assert not sim.arm.device.moving


@on_the_virtual_clock
async def test_who_is_cancelled_stops_the_arm() -> None:
    async with bridged(speed=1.0) as rig, Magician.connect(rig.url) as arm:

        async def move() -> None:
            await arm.move_to(200, 100, 40)

        moving = asyncio.create_task(move())
        await until(lambda: rig.sim.arm.device.moving)
        moving.cancel()
        with pytest.raises(asyncio.CancelledError):
            await moving

        assert not rig.sim.arm.device.moving


# The line to the arm.


@on_the_virtual_clock
async def test_the_line_to_the_arm_is_mended_and_no_motion_sent_twice() -> None:
    targets = [(200 + place % 5, 10 * (-1) ** place) for place in range(30)]
    async with bridged(speed=20.0) as rig, Magician.connect(rig.url, reply_timeout=0.1) as arm:

        async def break_it() -> None:
            for _ in range(8):
                enough = rig.sim.arm.counters.requests + 7
                await until(lambda: rig.sim.arm.counters.requests >= enough)  # noqa: B023 - awaited in here
                rig.sim.unplug()

        breaking = asyncio.create_task(break_it())
        for x, y in targets:
            await arm.move_to(x, y, 40)

        await breaking
        assert rig.bridge.link.outages >= 1
        assert [(value.x, value.y) for value in rig.executed(c.SET_PTP_CMD)] == targets


@on_the_virtual_clock
async def test_what_was_sent_before_an_outage_is_not_sent_after_it() -> None:
    async with bridged(speed=1.0) as rig, client(rig.url) as plain:
        await plain.ask(c.SET_QUEUED_CMD_START_EXEC)
        rig.sim.faults.silent = True
        sent = rig.bridge.link.stats.sent
        await plain.send(far(), ask(c.GET_DEVICE_NAME))
        await until(lambda: rig.bridge.link.stats.sent == sent + 2)
        rig.sim.unplug()
        await until(lambda: rig.bridge.link.outages)
        rig.sim.faults.silent = False
        assert (await plain.receive()).id == c.GET_DEVICE_NAME.id
        await until(lambda: rig.told("refused"))
        assert "SetPTPCmd" in rig.told("refused")[0]
        assert rig.sim.arm.device.left_space == 32
        assert rig.told("link") == ["the line to the arm broke", "the arm can be reached again"]


@on_the_virtual_clock
async def test_who_vanishes_while_the_arm_is_out_of_reach_stops_it_afterwards() -> None:
    async with AsyncExitStack() as stack:
        rig = await stack.enter_async_context(bridged(speed=1.0))
        async with client(rig.url) as plain:
            await plain.send(START, far())
            for _ in range(2):
                await plain.receive()

            rig.sim.faults.silent = True
            rig.sim.unplug()

        await until(lambda: rig.told("link"))
        assert rig.sim.arm.device.moving
        rig.sim.faults.silent = False
        await until(lambda: rig.told("stopped"))
        assert not rig.sim.arm.device.moving


@on_the_virtual_clock
async def test_reads_survive_a_bad_line_to_the_arm() -> None:
    bad = {"faults": Faults(loss=0.02, split=0.1), "seed": 3}
    async with bridged(arm=bad) as rig, Magician.connect(rig.url, control=False) as arm:
        for _ in range(30):
            pose = await arm.get_pose(timeout=IN_TIME)
            assert (pose.j1, pose.j2, pose.j3) == pytest.approx((0, 45, 45), abs=1e-3)


# Who disturbs.


class Disturbed:
    """A program that reads while another one misbehaves."""

    def __init__(self, plain: Plain) -> None:
        self.plain = plain

    async def read(self, count: int) -> None:
        for _ in range(count):
            pose = numbers(await self.plain.ask(c.GET_POSE))
            assert pose == pytest.approx((259.104, 0, -8.485, 0, 0, 45, 45, 0), abs=1e-2)


def has_told(rig: Rig, what: str, times: int) -> bool:
    return len(rig.told(what)) == times


async def flood(plain: Plain) -> None:
    data = encode(ask(c.GET_POSE)) * 500
    while True:
        await plain.pour(data)


async def talk_garbage(plain: Plain) -> None:
    data = b"\xaa\xaa\x03" * 100 + bytes(range(256))
    while True:
        await plain.pour(data)


async def say_half(plain: Plain) -> None:
    half = encode(far())[:-4]
    while True:
        await plain.pour(half)
        await asyncio.sleep(0.001)


@everywhere
@pytest.mark.parametrize("misbehave", [flood, talk_garbage, say_half])
async def test_who_misbehaves_disturbs_nobody_else(listen: str, misbehave: Any) -> None:
    async with bridged([TCP, listen]) as rig, AsyncExitStack() as stack:
        good = Disturbed(await stack.enter_async_context(client(rig.bridge.urls[0])))
        bad = await stack.enter_async_context(client(rig.bridge.urls[1]))
        disturbing = asyncio.create_task(misbehave(bad))
        try:
            await until(lambda: bad.poured >= 3)
            await good.read(50)
        finally:
            disturbing.cancel()
            await asyncio.gather(disturbing, return_exceptions=True)

        assert rig.executed(c.SET_PTP_CMD) == []


@on_the_virtual_clock
async def test_garbage_without_end_is_cut() -> None:
    async with bridged(limits=Limits(junk=1000)) as rig, client(rig.url) as plain:
        await plain.ask(c.GET_DEVICE_NAME)
        await plain.transport.send(bytes(2000))
        assert await plain.hung_up()
        assert rig.told("cut") == ["1024 bytes without a request among them"]


@on_the_virtual_clock
async def test_half_a_frame_is_given_up() -> None:
    async with bridged() as rig, client(rig.url) as plain:
        await plain.transport.send(encode(far())[:3])
        await plain.send(ask(c.GET_DEVICE_NAME))
        assert (await plain.receive()).id == c.GET_DEVICE_NAME.id


@on_the_virtual_clock
async def test_requests_are_limited() -> None:
    """A quarter of a second's requests may come at once, the others when their time has come."""
    loop = asyncio.get_running_loop()
    async with bridged(limits=Limits(frames=100)) as rig, client(rig.url) as plain:
        began = loop.time()
        await plain.send(*[ask(c.GET_DEVICE_NAME)] * 50)
        for _ in range(50):
            await plain.receive()

        assert loop.time() - began >= 0.2


@on_the_virtual_clock
async def test_there_are_so_many_clients_and_no_more() -> None:
    async with bridged(limits=Limits(clients=2)) as rig, client(rig.url) as one, client(rig.url) as other:
        assert await one.hears_nothing()
        assert await other.hears_nothing()
        async with client(rig.url) as third:
            await third.send(ask(c.GET_DEVICE_NAME))
            assert await third.hung_up()

        assert rig.told("cut") == ["there are too many clients"]
        assert await one.hears_nothing()


async def test_who_does_not_read_does_not_hold_up_the_others() -> None:
    async with bridged() as rig, client(rig.url) as good, client(rig.url) as lazy:
        sending = asyncio.create_task(flood(lazy))
        await Disturbed(good).read(200)
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)


# What may not be sent, and not be told.


@on_the_virtual_clock
async def test_denied_commands_do_not_reach_the_arm() -> None:
    async with bridged(deny=["wifi", "calibration", "firmware"]) as rig, client(rig.url) as plain:
        await plain.ask(c.SET_QUEUED_CMD_START_EXEC)
        before = rig.sim.arm.counters.requests
        await plain.send(
            ask(c.SET_WIFI_PASSWORD, "secret"),
            ask(c.GET_WIFI_PASSWORD),
            ask(c.SET_ANGLE_SENSOR_STATIC_ERROR, c.AngleSensorStaticError(1, 1)),
            Frame(160, 1, b"\x02"),
        )
        assert await plain.hears_nothing()
        assert rig.sim.arm.counters.requests == before + 1
        assert set(rig.told("refused")) >= {"SetWIFIPassword: it is denied here", "command 160: it is denied here"}


@on_the_virtual_clock
async def test_a_password_is_never_told(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    async with bridged() as rig, client(rig.url) as first, client(rig.url) as second:
        await second.ask(c.SET_QUEUED_CMD_START_EXEC)
        await first.send(ask(c.SET_WIFI_PASSWORD, "geheimnis"))
        assert await first.hears_nothing()
        assert (await second.ask(c.SET_WIFI_PASSWORD, "geheimnis")).params == b""
        await until(lambda: rig.told("refused"))
        told = caplog.text + str(rig.happened)
        assert "SetWIFIPassword" in told
        assert "geheimnis" not in told
        assert b"geheimnis".hex() not in told.replace(" ", "")
