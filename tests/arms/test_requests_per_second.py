"""How much an arm is asked: counted where it hears it, in virtual time."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from virtual import virtual

import benchmarks.slow_line  # noqa: F401 - it adds its scheme
from dobot_async import Magician, MyCobot, PTPMode, UltraArm
from dobot_async._core.link.budget import check_budget
from dobot_async.errors import MotionStopped
from dobot_async.simulator import simulate

FAMILIES: dict[str, tuple[Any, dict[str, Any]]] = {
    "magician": (Magician, {"homed": True}),
    "mycobot280": (MyCobot, {}),
    "ultraarm": (UltraArm, {"homed": True}),
}
JOINTS = {"magician": 4, "mycobot280": 6, "ultraarm": 3}
FAMILY = pytest.mark.parametrize("model", FAMILIES)


class Heard:
    """When each frame came to an arm."""

    def __init__(self, sim: Any) -> None:
        self.times: list[float] = []
        make = sim.arm.session

        def session() -> Any:
            inner = make()
            receive: Callable[[bytes], bytes] = inner.receive

            def noted(data: bytes) -> bytes:
                self.times.append(asyncio.get_running_loop().time())
                return receive(data)

            inner.receive = noted
            return inner

        sim.arm.session = session

    def most_within(self, seconds: float) -> int:
        """The most of them within any stretch of time."""
        return max(sum(1 for each in self.times if begin <= each < begin + seconds) for begin in self.times)


def slow(url: str, delay: float = 0.0) -> str:
    """The same arm at the end of a line of 115200 baud."""
    return f"{url.replace('sim://', 'slow://')}?delay={delay}"


async def ask_for_ever(arm: Any) -> None:
    while True:
        await arm.get_joints()


async def end(tasks: list[asyncio.Task[None]]) -> None:
    for task in tasks:
        task.cancel()

    await asyncio.gather(*tasks, return_exceptions=True)


@FAMILY
@virtual
async def test_an_arm_hears_no_more_requests_than_it_is_to(model: str) -> None:
    kind, details = FAMILIES[model]
    async with simulate(model, **details) as sim:
        heard = Heard(sim)
        async with kind.connect(sim.url, max_requests=20) as arm:
            if kind is MyCobot:
                await arm.power_on()

            askers = [asyncio.create_task(ask_for_ever(arm)) for _ in range(12)]
            await arm.move_joints(*[10.0] * JOINTS[model])
            await asyncio.sleep(5)
            await end(askers)

        assert heard.most_within(1.0) <= 20 + 20 * 0.1 + 1
        assert len(heard.times) >= 0.9 * 20 * (heard.times[-1] - heard.times[0])
        assert len([done for done in sim.arm.executed if done.name != "SetWAITCmd"]) == 1


@pytest.mark.parametrize("window", [1, 8])
@virtual
async def test_the_queue_keeps_the_number_of_requests_as_well(window: int) -> None:
    async with simulate(homed=True, speed=1000) as sim:
        heard = Heard(sim)
        async with Magician.connect(sim.url, max_requests=50, window=window) as arm:
            async with arm.queue.batch() as batch:
                for number in range(200):
                    batch.move_to(220, 10.0 * (number % 2), 40)

            await arm.queue.join()

        assert heard.most_within(1.0) <= 50 + 50 * 0.1 + 1
        assert [done.name for done in sim.arm.executed].count("SetPTPCmd") == 200


@FAMILY
@virtual
async def test_a_stop_does_not_wait_for_a_turn(model: str) -> None:
    kind, details = FAMILIES[model]
    loop = asyncio.get_running_loop()
    async with simulate(model, **details) as sim, kind.connect(sim.url, max_requests=5) as arm:
        if kind is MyCobot:
            await arm.power_on()

        moving = asyncio.create_task(arm.move_joints(*[40.0] * JOINTS[model]))
        while not sim.arm.device.moving:  # noqa: ASYNC110 - it has no event
            await asyncio.sleep(0.001)

        askers = [asyncio.create_task(ask_for_ever(arm)) for _ in range(50)]  # ten seconds of turns
        await asyncio.sleep(0.01)
        began = loop.time()
        stopping = asyncio.create_task(arm.stop())
        while sim.arm.device.moving:  # noqa: ASYNC110
            await asyncio.sleep(0.001)

        assert loop.time() - began < 1.0
        await stopping
        with pytest.raises(MotionStopped):
            await moving

        await end(askers)


@pytest.mark.parametrize("number", [4.9, 0, -1, float("inf"), float("nan")])
@FAMILY
async def test_a_number_that_no_arm_can_be_driven_with_is_refused(model: str, number: float) -> None:
    with pytest.raises(ValueError, match="max_requests must be 5 per second or more"):
        async with FAMILIES[model][0].connect("sim:", max_requests=number):
            pass


def test_what_is_no_number_is_told() -> None:
    with pytest.raises(TypeError, match="requests per second, or None"):
        check_budget("many")  # type: ignore[arg-type]

    assert check_budget(None) is None


@pytest.mark.parametrize("mode", [PTPMode.MOVL_XYZ, PTPMode.MOVJ_XYZ])
@virtual
async def test_a_motion_of_three_seconds_takes_sixty_requests_at_the_most(mode: PTPMode) -> None:
    async with simulate(homed=True) as sim:
        heard = Heard(sim)
        async with Magician.connect(slow(sim.url)) as arm:
            await arm.move_to(200, -100, 40)
            await arm.set_speed(50 if mode is PTPMode.MOVL_XYZ else 15)
            before = len(heard.times)
            began = asyncio.get_running_loop().time()
            await arm.move_to(200, 100, 40, mode=mode)
            move = sim.arm.executed[-1]
            assert 2.5 < move.finished - move.started < 4.0
            assert len(heard.times) - before <= 60
            assert asyncio.get_running_loop().time() - began < move.finished - move.started + 0.02


@pytest.mark.parametrize("delay", [0.025, 0.05, 0.1])
@FAMILY
@virtual
async def test_on_a_slow_link_nothing_waits_behind_what_was_asked_before(model: str, delay: float) -> None:
    kind, details = FAMILIES[model]
    loop, rng = asyncio.get_running_loop(), random.Random(1)
    async with simulate(model, **details) as sim:
        heard = Heard(sim)
        options = {"reply_timeout": 1.0} if kind is not Magician else {}
        async with kind.connect(slow(sim.url, delay), **options) as arm:
            if kind is MyCobot:
                await arm.power_on()

            out, most = 0, 0

            def count(outgoing: bool, _: object) -> None:
                nonlocal out, most
                out += 1 if outgoing else -1
                most = max(most, out)

            arm.link.on_frame.add(count)
            before, started = len(heard.times), loop.time()
            for _ in range(10):
                await arm.move_joints(*(rng.uniform(5, 40) for _ in range(JOINTS[model])))

            assert most <= 2
            assert len(heard.times) - before <= (loop.time() - started) / (2 * delay) + 10


@pytest.mark.parametrize("delay", [0.025, 0.05, 0.1])
@virtual
async def test_the_end_is_noticed_two_round_trips_after_it_however_long_they_are(delay: float) -> None:
    """At the median: half of one until the next question, half of one for its answer, and one for the alarms."""
    loop, rng = asyncio.get_running_loop(), random.Random(1)
    began, late = loop.time(), list[float]()
    async with simulate(homed=True) as sim, Magician.connect(slow(sim.url, delay)) as arm:
        for number in range(20):
            x, y = 200 + rng.uniform(0, 40), rng.uniform(60, 120) * (-1) ** number
            await arm.move_to(x, y, 40, mode=PTPMode.MOVL_XYZ)
            late.append(loop.time() - began - sim.arm.executed[-1].finished)

    assert sorted(late)[10] < 2.4 * 2 * delay
    assert max(late) < 5 * 2 * delay


@virtual
async def test_a_turn_is_for_each_in_the_order_in_which_they_came() -> None:
    async with simulate(homed=True) as sim, Magician.connect(sim.url, max_requests=10) as arm:
        loop, ended = asyncio.get_running_loop(), list[tuple[float, int]]()

        async def ask(number: int) -> None:
            await arm.get_pose()
            ended.append((loop.time(), number))

        await asyncio.gather(*map(ask, range(20)))
        assert [number for _, number in ended] == list(range(20))
        assert all(later - earlier < 0.11 for (earlier, _), (later, _) in pairwise(ended))
