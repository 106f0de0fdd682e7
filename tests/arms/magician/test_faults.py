"""What the driver promises on a bad line, case by case, on a virtual clock."""

from __future__ import annotations

import asyncio
import math
from itertools import count

import pytest
from bad_line import BadLine, Spoil, bad_lines
from virtual import virtual

from dobot_async import ConnectFailed, Magician, MotionStopped, MotionUnknown, PTPMode, ReplyTimeout
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.executor import Surplus
from dobot_async.arms.magician.frame import Frame, Parser
from dobot_async.simulator import DeviceOptions, Faults, Simulation, simulate


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch) -> list[BadLine]:
    """The bad lines over which `sim://` is reached from now on."""
    return bad_lines(monkeypatch)


def targets(sim: Simulation) -> list[float]:
    """The x of the PTP commands that the arm has executed."""
    return [each.value.x for each in sim.arm.executed if each.outcome == "done" and each.name == "SetPTPCmd"]


def spoil_once(number: int, into: list[tuple[float, bytes]]) -> Spoil:
    """Does something to the first message of a command, and nothing to the others."""
    left = [into]

    def spoil(data: bytes) -> list[tuple[float, bytes]]:
        frames = Parser().feed(data)
        return left.pop() if left and any(frame.id == number for frame in frames) else [(0, data)]

    return spoil


def spoil_nth(number: int, place: int) -> Spoil:
    """Loses one message of a command, and none of the others."""
    places = count()

    def spoil(data: bytes) -> list[tuple[float, bytes]]:
        hit = any(frame.id == number for frame in Parser().feed(data))
        return [] if hit and next(places) == place else [(0, data)]

    return spoil


@pytest.mark.full
@virtual
async def test_a_thousand_moves_on_a_terrible_line() -> None:
    faults = Faults(loss=0.2, corrupt=0.05, dup=0.05, latency=0.002, jitter=0.005)
    options = DeviceOptions(capacity=8)
    async with (
        simulate(faults=faults, seed=1, speed=20, options=options) as sim,
        Magician.connect(sim.url, timeout=30) as arm,
    ):
        for step in range(1000):
            await arm.queue.move_to(200 + step / 64, 40 * (-1) ** step, 40)

        await arm.queue.join()
        executed = targets(sim)
        # A request that the network doubles is executed twice, directly after itself.
        once = [x for place, x in enumerate(executed) if place == 0 or x != executed[place - 1]]
        assert once == [200 + step / 64 for step in range(1000)]
        assert sim.arm.counters.overflowed == 0


@virtual
async def test_a_lost_acknowledgement_costs_less_than_three_reply_timeouts(lines: list[BadLine]) -> None:
    async with simulate(speed=20) as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(210, 0, 40)
        lines[0].reply = spoil_once(c.SET_PTP_CMD.id, [])
        timeout, before = arm.link.reply_timeout, asyncio.get_running_loop().time()
        motion = await arm.queue.move_to(220, 0, 40)
        assert asyncio.get_running_loop().time() - before < 3 * timeout
        await motion
        assert targets(sim) == [210, 220]


@virtual
async def test_a_lost_request_is_sent_again(lines: list[BadLine]) -> None:
    async with simulate(speed=20) as sim, Magician.connect(sim.url) as arm:
        lines[0].request = spoil_once(c.SET_PTP_CMD.id, [])
        await arm.move_to(220, 0, 40)
        assert targets(sim) == [220]


@virtual
async def test_a_spoilt_request_is_sent_again_even_if_it_ends_nowhere(lines: list[BadLine]) -> None:
    async with simulate(speed=20) as sim, Magician.connect(sim.url) as arm:
        lines[0].request = spoil_once(c.SET_PTP_CMD.id, [(0, bytes.fromhex("AA AA FA 54 03 01"))])
        await arm.move_to(220, 0, 40)
        assert targets(sim) == [220]


@pytest.mark.cases(1)
@pytest.mark.parametrize("late", [0.05, 0.3, 1.5, 2.5])
@virtual
async def test_a_late_reply_never_answers_a_later_call(lines: list[BadLine], late: float) -> None:
    async with simulate(speed=20) as sim, Magician.connect(sim.url) as arm:
        held: list[bytes] = []

        def delay(data: bytes) -> list[tuple[float, bytes]]:
            if not held and data[3] == c.GET_POSE.id:
                held.append(data)
                return [(late, data)]

            return [(0, data)]

        lines[0].reply = delay
        first = await arm.get_pose()
        assert held
        sim.arm.guide_to(240, 20, 20)
        started = asyncio.get_running_loop().time()
        while asyncio.get_running_loop().time() < started + late + 0.2:
            pose = await arm.get_pose()
            assert math.dist((pose.x, pose.y), (240, 20)) < 0.01
            await asyncio.sleep(0.001)

        assert first.x != pytest.approx(240, abs=1)


@pytest.mark.full
@virtual
async def test_several_late_replies_each_alone_never_answer_a_later_call(lines: list[BadLine]) -> None:
    async with simulate(speed=20) as sim, Magician.connect(sim.url) as arm:
        places = count()

        def delay(data: bytes) -> list[tuple[float, bytes]]:
            late = data[3] == c.GET_POSE.id and next(places) % 70 == 0
            return [(1.5, data)] if late else [(0, data)]

        lines[0].reply = delay
        loop = asyncio.get_running_loop()
        ends = loop.time() + 8
        while loop.time() < ends:
            place = 200 + 20 * loop.time() / ends
            sim.arm.guide_to(place, 20, 20)
            assert (await arm.get_pose()).x == pytest.approx(place, abs=0.01)
            await asyncio.sleep(0.001)

        assert next(places) > 2000


@virtual
async def test_replies_after_a_pause_of_the_arm_answer_nobody_else(lines: list[BadLine]) -> None:
    async with simulate(speed=20) as sim, Magician.connect(sim.url) as arm:
        loop = asyncio.get_running_loop()
        until = loop.time() + 1.0
        lines[0].reply = lambda data: [(max(0.0, until - loop.time()), data)]
        before = await arm.get_pose()
        sim.arm.guide_to(240, 20, 20)
        for _ in range(50):
            assert (await arm.get_pose()).x == pytest.approx(240, abs=0.01)

        assert before.x != pytest.approx(240, abs=1)


def doubled(lines: list[BadLine]) -> None:
    """The network delivers the next PTP command twice."""
    line = lines[0]
    line.reorder_window = 0.005

    def twice(data: bytes) -> list[tuple[float, bytes]]:
        if data[3] == c.SET_PTP_CMD.id:
            line.request = lambda data: [(0, data)]
            return [(0, data), (0, data)]

        return [(0, data)]

    line.request = twice


@virtual
async def test_a_doubled_absolute_move_is_a_warning(lines: list[BadLine]) -> None:
    async with simulate(speed=20) as sim, Magician.connect(sim.url) as arm:
        events = aiter(arm.link.events)
        await arm.move_to(210, 0, 40)
        doubled(lines)
        await arm.move_to(220, 0, 40)
        await arm.move_to(230, 0, 40)
        assert targets(sim) == [210, 220, 220, 230]
        while not isinstance(event := await anext(events), Surplus):
            pass

        assert event.count == 1


@virtual
async def test_a_doubled_relative_move_stops_the_arm(lines: list[BadLine]) -> None:
    async with simulate(speed=20) as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(210, 0, 40)
        doubled(lines)
        with pytest.raises(MotionUnknown, match="SetPTPCmd must not run twice"):
            for _ in range(5):
                await arm.move_by(z=5, mode=PTPMode.MOVL_INC)

        assert len(targets(sim)) <= 3
        await arm.move_to(200, 0, 40)


@virtual
async def test_a_vanished_arm_ends_everything_in_time(lines: list[BadLine]) -> None:
    async with simulate() as sim, Magician.connect(sim.url, on_error="leave") as arm:
        motion = await arm.queue.move_to(220, 0, 40)
        lines[0].request = lambda _: []
        loop = asyncio.get_running_loop()
        before = loop.time()
        with pytest.raises(ReplyTimeout):
            await arm.get_pose()

        assert loop.time() - before == pytest.approx(1.5, abs=0.01)
        with pytest.raises(MotionUnknown, match="no longer answers"):
            await motion

        assert loop.time() - before < 8
        with pytest.raises((MotionUnknown, ReplyTimeout, ConnectionError)):
            await arm.queue.move_to(200, 0, 40)

        assert loop.time() - before < 30


@pytest.fixture
def wide_lines(lines: list[BadLine], monkeypatch: pytest.MonkeyPatch) -> list[BadLine]:
    """Bad lines that carry several requests at a time."""
    monkeypatch.setattr(BadLine, "in_flight", 8)
    monkeypatch.setattr(BadLine, "window", 16)
    return lines


@pytest.mark.parametrize("window", [2, 4, 16])
@pytest.mark.parametrize("lost", [0, 1, 2, 15, 16, 17, 39])
@pytest.mark.parametrize("spoilt", ["request", "reply"])
@virtual
async def test_one_message_lost_in_a_window_hides_nothing(
    wide_lines: list[BadLine], window: int, lost: int, spoilt: str
) -> None:
    """Behind a lost command, the acknowledgements of the others would pass for those before them."""
    expected = [200 + step for step in range(40)]
    async with simulate(speed=20) as sim, Magician.connect(sim.url, window=window) as arm:
        setattr(wide_lines[0], spoilt, spoil_nth(c.SET_PTP_CMD.id, lost))
        motions = []
        try:
            async with arm.queue.batch() as batch:
                motions = [batch.move_to(x, 0, 40) for x in expected]

            await arm.queue.join()
        except MotionUnknown:
            done = targets(sim)
            for x, motion in zip(expected, motions, strict=True):
                try:
                    await motion
                except (MotionUnknown, MotionStopped):
                    continue

                assert x in done  # a motion that is said to be done was done
        else:
            assert targets(sim) == expected

        await arm.move_to(300, 0, 40)
        assert targets(sim)[-1] == 300
        assert len(targets(sim)) == len(set(targets(sim)))


@virtual
async def test_a_window_learns_by_the_way_how_much_room_there_is(wide_lines: list[BadLine]) -> None:
    asked = 0

    def note(outgoing: bool, frame: Frame) -> None:
        nonlocal asked
        asked += outgoing and frame.id == c.GET_QUEUED_CMD_LEFT_SPACE.id

    options = DeviceOptions(capacity=40)
    faults = Faults(latency=0.001)
    async with (
        simulate(speed=1e6, options=options, faults=faults) as sim,
        Magician.connect(sim.url, window=16) as arm,
    ):
        arm.link.on_frame.add(note)
        async with arm.queue.batch() as batch:
            for step in range(320):
                batch.move_to(200 + step / 8, 0, 40)

        assert asked <= 320 / 16 + 1
        await arm.queue.join()
        assert targets(sim) == [200 + step / 8 for step in range(320)]
        assert sim.arm.counters.overflowed == 0


@pytest.mark.parametrize("window", [1, 16])
@virtual
async def test_a_stop_ends_a_long_batch_at_once(wide_lines: list[BadLine], window: int) -> None:
    async with simulate(options=DeviceOptions(capacity=4)) as sim, Magician.connect(sim.url, window=window) as arm:

        async def put() -> None:
            async with arm.queue.batch() as batch:
                for step in range(500):
                    batch.move_to(200 + step / 8, 40 * (-1) ** step, 40)

        putting = asyncio.create_task(put())
        await asyncio.sleep(1)
        await arm.stop()
        requests = sim.arm.counters.requests
        with pytest.raises(MotionStopped):
            await putting

        await asyncio.sleep(1)
        assert sim.arm.counters.requests == requests
        assert [each.outcome for each in sim.arm.executed if each.command.moves][-1] == "aborted"


@virtual
async def test_an_arm_that_stops_answering_while_it_is_greeted_fails_in_time(lines: list[BadLine]) -> None:
    async with simulate() as sim:
        first = [True]

        def answer_once(data: bytes) -> list[tuple[float, bytes]]:
            return [(0, data)] if first and first.pop() else []

        loop = asyncio.get_running_loop()
        before = loop.time()
        connecting = Magician.connect(sim.url, timeout=0.5)
        opening = asyncio.create_task(connecting.__aenter__())
        await asyncio.sleep(0)
        lines[0].reply = answer_once
        with pytest.raises(ConnectFailed):
            await opening

        assert loop.time() - before == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("lost", [1, 20])
@virtual
async def test_a_motion_behind_a_stop_that_ends_a_download_is_executed_and_not_stored(
    wide_lines: list[BadLine], lost: int
) -> None:
    """What ends the download mode is lost several times: the stop is not over before the arm has heard it."""
    async with simulate(speed=20, faults=Faults(latency=0.005)) as sim, Magician.connect(sim.url) as arm:

        async def download() -> None:
            async with arm.queue.download() as program:
                for step in range(300):
                    program.move_to(200 + step / 10, 0, 40)

        places = count()

        def request(data: bytes) -> list[tuple[float, bytes]]:
            hit = any(frame.id == c.SET_QUEUED_CMD_STOP_DOWNLOAD.id for frame in Parser().feed(data))
            return [] if hit and next(places) < lost else [(0, data)]

        downloading = asyncio.create_task(download())
        await asyncio.sleep(0.3)
        wide_lines[0].request = request
        await arm.stop()
        assert sim.arm.program
        stored = len(sim.arm.program.commands)
        await arm.move_to(210, 0, 40)
        assert targets(sim) == [210]
        assert 0 < len(sim.arm.program.commands) == stored < 300
        with pytest.raises(MotionStopped):
            await downloading
