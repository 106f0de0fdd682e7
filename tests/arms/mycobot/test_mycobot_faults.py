"""What the driver promises on a bad line, on a virtual clock. The protocol has neither checksums nor numbers."""

from __future__ import annotations

import asyncio
from itertools import pairwise
from typing import Any

import pytest
from bad_line import BadLine, Spoil, bad_lines
from hypothesis import given, settings
from hypothesis import strategies as st
from quick_suite import examples
from virtual import run_virtual, virtual

from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.frame import Frame, encode
from dobot_async.errors import CommandRejected, DobotError, MotionUnknown, ReplyTimeout
from dobot_async.simulator import Faults, MyCobotQuirks, Simulation, simulate


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch) -> list[BadLine]:
    """The bad lines over which `sim://` is reached from now on."""
    return bad_lines(monkeypatch)


def of(number: int, become: Spoil) -> Spoil:
    """Does something to each message of a command, and nothing to the others."""
    return lambda data: become(data) if len(data) > 3 and data[3] == number else [(0, data)]


def sent(sim: Simulation) -> list[float]:
    """The angles of joint 1 that the arm was told to go to, as often as it was told."""
    return [each.value.angle for each in sim.arm.executed if each.command is c.SEND_ANGLE]


@pytest.mark.parametrize(
    "become",
    [
        lambda _: [],
        lambda data: [(0.4, data)],
        lambda data: [(2.0, data)],
        lambda data: [(0.0, data), (0.01, data), (1.5, data)],
        lambda data: [(0.0, data[:-1])],
        lambda data: [(0.0, b"\xfe\xfe\xfe" + data)],
    ],
    ids=["lost", "late", "very late", "thrice", "cut", "behind noise"],
)
@virtual
async def test_no_acknowledgement_makes_a_motion_run_twice(lines: list[BadLine], become: Spoil) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        lines[0].reply = of(c.SEND_ANGLE.id, become)
        for angle in (20.0, -20.0, 40.0):
            await arm.move_joint(1, angle)

        await asyncio.sleep(3)
        assert sent(sim) == [20.0, -20.0, 40.0]
        assert sim.arm.joints[0] == 40


@virtual
async def test_an_acknowledgement_in_the_middle_of_the_motion_changes_nothing(lines: list[BadLine]) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        lines[0].reply = of(c.SEND_ANGLE.id, lambda data: [(1.0, data)])
        for angle in (90.0, -90.0):  # so far that each takes longer than its acknowledgement
            await arm.move_joint(1, angle)
            assert sim.arm.joints[0] == angle

        assert sent(sim) == [90, -90]


@virtual
async def test_a_motion_that_is_lost_is_told_and_not_sent_again(lines: list[BadLine]) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        lines[0].request = of(c.SEND_ANGLE.id, lambda _: [])
        with pytest.raises(CommandRejected, match="may be sent again"):
            await arm.move_joint(1, 90)

        assert sent(sim) == []
        lines[0].request = lambda data: [(0, data)]
        await arm.move_joint(1, 90)
        assert sent(sim) == [90]


@virtual
async def test_a_motion_that_arrives_in_two_parts_is_lost_at_the_m5(lines: list[BadLine]) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        lines[0].request = of(c.SEND_ANGLE.id, lambda data: [(0, data[:4]), (0, data[4:])])
        with pytest.raises(CommandRejected):
            await arm.move_joint(1, 90)

        assert sim.arm.counters.dropped > 0
        assert await arm.get_angles() == (0.0,) * 6


@virtual
async def test_a_late_reply_never_answers_a_later_call(lines: list[BadLine]) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        lines[0].reply = of(c.GET_ENCODER.id, lambda data: [(1.0, data)])
        with pytest.raises(ReplyTimeout):
            await arm.request(c.GET_ENCODER, 1, timeout=0.3)

        lines[0].reply = lambda data: [(0, data)]
        sim.arm.place(45, 0, 0, 0, 0, 0)
        await asyncio.sleep(0.5)
        for _ in range(20):
            assert await arm.request(c.GET_ENCODER, 1, timeout=5) == 2048 + 512
            await asyncio.sleep(0.1)


@virtual
async def test_a_reply_for_another_joint_is_not_taken(lines: list[BadLine]) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        other = encode(Frame(c.GET_JOINT_MIN_ANGLE.id, bytes.fromhex("01 F9 F2")))
        lines[0].reply = of(c.GET_JOINT_MIN_ANGLE.id, lambda data: [(0, other), (0.01, data)])
        assert (await arm.request(c.GET_JOINT_MIN_ANGLE, 2)).angle == -140


@virtual
async def test_the_request_sent_back_is_not_the_answer(lines: list[BadLine]) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        requests: list[bytes] = []

        def note(data: bytes) -> list[tuple[float, bytes]]:
            requests.append(data)
            return [(0, data)]

        lines[0].request = note
        lines[0].reply = lambda data: [(0, requests[-1] + data)]
        await arm.request(c.SET_SERVO_DATA, c.ServoData(1, 21, 7))
        assert await arm.request(c.GET_SERVO_DATA, c.ServoDataAddress(1, 21)) == 7
        assert await arm.get_gripper(kind=c.GripperType.ADAPTIVE) == 0
        sim.arm.gripper.go(1, 100)
        await asyncio.sleep(1)
        lines[0].reply = lambda data: [(0, data)]
        assert await arm.get_gripper(kind=c.GripperType.ADAPTIVE) == 1
        await arm.set_pin(2, True, base=True)
        assert await arm.get_joint_limits(2) == (-140, 140)
        await arm.move_joint(1, 20)


@virtual
async def test_text_of_the_m5_between_frames_is_junk() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.request(c.SET_TRANSPONDER_MODE, c.TransponderMode.CHECK_SETTINGS)
        assert arm.link.stats.junk_bytes == len(b"ok--------------\r\n")
        assert await arm.request(c.GET_TRANSPONDER_MODE, None) is c.TransponderMode.CHECK_SETTINGS


READINGS = ("get_angles", "get_coords", "get_encoders", "get_voltages", "is_moving", "get_tool")


@settings(max_examples=examples(60))
@given(
    cuts=st.lists(st.integers(1, 20), min_size=1, max_size=6),
    noise=st.lists(
        st.one_of(
            st.binary(max_size=6).map(lambda data: data.replace(b"\xfe", b"\x55")),
            st.sampled_from([b"\xfe", b"ok--------------\r\n", b"\xfe\xfe\xfe"]),
        ),
        min_size=1,
        max_size=6,
    ),
)
def test_a_reply_in_pieces_and_among_noise_is_the_same(cuts: list[int], noise: list[bytes]) -> None:
    async def compare() -> None:
        with pytest.MonkeyPatch.context() as patch:
            bad = bad_lines(patch)
            async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
                sim.arm.place(10, -20, 30, -40, 50, -60)
                whole = [await getattr(arm, name)() for name in READINGS]
                turn = iter(range(10_000))

                def spoil(data: bytes) -> list[tuple[float, bytes]]:
                    number = next(turn)
                    size = cuts[number % len(cuts)]
                    data = noise[number % len(noise)] + data
                    return [(at / 10_000, data[at : at + size]) for at in range(0, len(data), size)]

                bad[0].reply = spoil
                assert [await getattr(arm, name)() for name in READINGS] == whole

    run_virtual(compare())


@pytest.mark.cases(2)
@pytest.mark.parametrize(
    "quirks", [MyCobotQuirks(), MyCobotQuirks(acknowledges=False, later=False)], ids=["new", "old"]
)
@pytest.mark.parametrize("seed", range(4))
@virtual
async def test_moves_on_a_bad_line_are_done_or_told_and_never_doubled(seed: int, quirks: MyCobotQuirks) -> None:
    async with (
        simulate("mycobot280", seed=seed, speed=5, quirks=quirks) as sim,
        MyCobot.connect(sim.url, timeout=20) as arm,
    ):
        await arm.get_alarms()  # on a good line it is found out what the firmware knows
        arm_faults(sim, Faults(loss=0.1, split=0.05, noise=0.1, latency=0.002))
        done = []
        for angle in [30.0 * (-1) ** step + 3 * step for step in range(15)]:
            try:
                await arm.move_joint(1, angle)
            except CommandRejected:
                continue

            done.append(angle)
            assert abs(sim.arm.joints[0] - angle) < 0.1

        assert len(done) > 8
        assert sent(sim) == done


def arm_faults(sim: Simulation, faults: Faults) -> None:
    """Spoils a line that is open already."""
    for client in sim._clients:
        client._there._faults = client._back._faults = faults


@virtual
async def test_corrupted_bytes_never_hang_a_call_or_move_the_arm_twice() -> None:
    async with simulate("mycobot280", seed=3, speed=5) as sim, MyCobot.connect(sim.url, timeout=20) as arm:
        arm_faults(sim, Faults(corrupt=0.1, noise=0.1))
        ended: list[Any] = []
        for step in range(10):
            try:
                await arm.move_joint(1, 10.0 + step, timeout=20)
            except (DobotError, ValueError) as error:
                ended.append(type(error))
            else:
                ended.append(None)

        assert len(ended) == 10
        assert len(sent(sim)) <= 10
        assert None in ended


@virtual
async def test_one_spoilt_reading_is_no_alarm(lines: list[BadLine]) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        spoilt = [encode(Frame(c.READ_NEXT_ERROR.id, bytes((0, 0, 64, 0, 0, 0, 0))))]
        lines[0].reply = of(c.READ_NEXT_ERROR.id, lambda data: [(0, spoilt.pop() if spoilt else data)])
        await arm.move_joint(1, 150)
        assert not spoilt


@virtual
async def test_a_silent_device_never_hangs_a_call() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        motion = await arm.queue.move_joint(1, 150)
        await asyncio.sleep(0.2)
        arm_faults(sim, Faults(silent=True))
        loop = asyncio.get_running_loop()
        begun = loop.time()
        for name in READINGS:
            with pytest.raises(ReplyTimeout):
                await getattr(arm, name)()

        for act in (arm.color(1, 2, 3), arm.request(c.SET_FRESH_MODE, True), arm.power_on(), arm.get_alarms()):
            with pytest.raises(ReplyTimeout):
                await act

        with pytest.raises(MotionUnknown, match="no longer answers"):
            await motion

        for later in (arm.stop(), arm.move_joint(1, 0), arm.queue.gripper(True), arm.jog("j1+", 0.1)):
            with pytest.raises(ReplyTimeout):
                await later

        assert loop.time() - begun < 90


@virtual
async def test_frames_go_out_whole_and_with_a_gap_between_them(lines: list[BadLine]) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        times: list[float] = []

        def note(data: bytes) -> list[tuple[float, bytes]]:
            assert data.startswith(b"\xfe\xfe")
            assert len(data) == 3 + data[2]
            times.append(asyncio.get_running_loop().time())
            return [(0, data)]

        lines[0].request = note
        await asyncio.gather(*(getattr(arm, name)() for name in READINGS), arm.color(0, 0, 1), arm.move_joint(1, 5))
        gaps = [b - a for a, b in pairwise(times)]
        assert len(gaps) > 10
        assert min(gaps) >= 0.02 - 1e-9
