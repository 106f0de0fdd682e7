"""A fleet some of whose arms do not answer any more: all are told to stop, and every cancellation goes on."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from typing import Any

import pytest
from virtual import virtual

from dobot_async import Fleet, Magician, MotionStopped, MotionUnknown, ReplyTimeout
from dobot_async.arms.magician import commands as c
from dobot_async.fleet import Member
from dobot_async.simulator import Simulation, simulate

NEAR, FAR = (220.0, 0.0, 40.0), (240.0, 60.0, 60.0)
IN_TIME = 2.0
"""Seconds within which a cancellation comes out, on the deadest of lines."""

Cell = dict[str, Simulation]
Work = Callable[[Fleet[Magician]], Awaitable[object]]


class Oops(Exception):
    """The user's own."""


@asynccontextmanager
async def cell(*names: str) -> AsyncIterator[Cell]:
    """Simulated Magicians by name."""
    async with AsyncExitStack() as stack:
        yield {name: await stack.enter_async_context(simulate()) for name in names}


def urls(sims: Cell) -> dict[str, str]:
    return {name: sim.url for name, sim in sims.items()}


def cut(sims: Cell, *names: str, loss: float = 1.0) -> None:
    """Nothing goes to these arms any more, nor comes from them."""
    for name in names:
        sims[name].faults.loss = loss


def waits(sim: Simulation) -> list[Any]:
    """What an arm has executed of its waits."""
    return [each for each in sim.arm.executed if each.command is c.SET_WAIT_CMD]


@contextmanager
def in_time(of_which: float = 0.0) -> Iterator[None]:
    """The block ends in time, after so many seconds that it takes anyhow."""
    loop = asyncio.get_running_loop()
    began = loop.time()
    yield
    assert loop.time() - began <= of_which + IN_TIME


async def each(fleet: Fleet[Magician]) -> None:
    await fleet.each("move_to", *FAR)


async def programs(fleet: Fleet[Magician]) -> None:
    async def program(name: str) -> None:
        while True:
            await fleet[name].move_to(*FAR)
            await fleet[name].move_to(*NEAR)

    await fleet.run({name: program(name) for name in fleet})


async def together(fleet: Fleet[Magician]) -> None:
    async with fleet.together() as batches:
        for name in batches:
            batches[name].wait(600)

    await batches.wait()


async def stopped(fleet: Fleet[Magician]) -> None:
    await asyncio.gather(*[fleet[name].queue.wait(600) for name in fleet])
    await asyncio.sleep(0.5)
    await fleet.stop(timeout=60)
    await asyncio.sleep(60)


async def idle(_: Fleet[Magician]) -> None:
    await asyncio.sleep(60)


ALL = pytest.mark.parametrize("work", [each, programs, together, stopped, idle])
MOMENTS = pytest.mark.parametrize("moment", [0.0, 0.02, 0.1, 0.4, 0.6])
DEAD = pytest.mark.parametrize("dead", [("left",), ("left", "right")])


@pytest.mark.cases(6)
@ALL
@MOMENTS
@DEAD
def test_a_cancellation_comes_out_of_a_fleet(work: Work, moment: float, dead: tuple[str, ...]) -> None:
    @virtual
    async def scene() -> None:
        async with cell("left", "right") as sims:
            connected = asyncio.Event()

            async def block() -> None:
                async with Fleet.connect(urls(sims)) as fleet:
                    connected.set()
                    await work(fleet)

            task = asyncio.create_task(block())
            await connected.wait()
            await asyncio.sleep(moment)
            cut(sims, *dead)
            await asyncio.sleep(0.05)
            task.cancel()
            with in_time(), pytest.raises(asyncio.CancelledError) as caught:
                await task

            for name in dead:
                assert any(note.startswith(f"{name}: it is not known whether") for note in caught.value.__notes__)

    scene()


@ALL
def test_a_timeout_comes_out_of_a_fleet(work: Work) -> None:
    @virtual
    async def scene() -> None:
        async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
            asyncio.get_running_loop().call_later(0.45, cut, sims, "left")
            with in_time(0.5), pytest.raises(TimeoutError) as caught:
                async with asyncio.timeout(0.5):
                    await work(fleet)

            assert not isinstance(caught.value, ReplyTimeout)

    scene()


@virtual
async def test_an_error_in_the_block_comes_out_as_it_is_and_all_lines_are_written_to_at_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with cell("left", "middle", "right") as sims:
        with in_time(0.5), pytest.raises(Oops) as caught:
            async with Fleet.connect(urls(sims)) as fleet:
                for name in fleet:
                    await fleet[name].queue.wait(600)

                await asyncio.sleep(0.5)
                cut(sims, "left")
                raise Oops

        assert [note for note in caught.value.__notes__ if note.startswith("left: it is not known whether")]
        assert not [note for note in caught.value.__notes__ if not note.startswith("left: ")]
        assert any("the stop on the way out" in record.getMessage() for record in caplog.records)
        ends = [waits(sims[name])[-1] for name in ("middle", "right")]
        assert [end.outcome for end in ends] == ["aborted", "aborted"]
        assert ends[0].finished == ends[1].finished


@virtual
async def test_a_stop_that_an_arm_does_not_hear_goes_on(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    loop = asyncio.get_running_loop()
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        motions = {name: await fleet[name].queue.wait(600) for name in fleet}
        await asyncio.sleep(0.5)
        cut(sims, "left")
        began = loop.time()
        with pytest.raises(ReplyTimeout, match=r"^left: the arm has not acknowledged within 3 s"):
            await fleet.stop(timeout=3)

        assert loop.time() - began == pytest.approx(3)
        assert sims["right"].arm.device.idle
        assert not sims["left"].arm.device.idle
        for motion in motions.values():
            with pytest.raises(MotionStopped):
                await motion

        with pytest.raises(ReplyTimeout, match="to stop; nothing was sent"):
            await fleet["left"].queue.move_to(*NEAR)

        cut(sims, "left", loss=0.0)
        await asyncio.sleep(3)
        assert sims["left"].arm.device.idle
        await fleet.each("move_to", *NEAR)


@virtual
async def test_a_silent_arm_stops_the_others_and_is_told_until_it_hears() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        motions = {name: await fleet[name].queue.wait(600) for name in fleet}
        await asyncio.sleep(0.5)
        cut(sims, "left")
        with pytest.raises(MotionUnknown, match=r"^left: the arm no longer answers"):
            await motions["left"]

        with pytest.raises(MotionStopped, match="left: the arm no longer answers"):
            await motions["right"]

        assert isinstance(fleet.failures["left"], MotionUnknown)
        await asyncio.sleep(0.1)
        assert sims["right"].arm.device.idle
        with pytest.raises(ReplyTimeout, match=r"^left: "):
            await fleet.recover()

        cut(sims, "left", loss=0.0)
        await asyncio.sleep(3)
        assert sims["left"].arm.device.idle
        await fleet.recover()
        await fleet.each("move_to", *NEAR)


@virtual
async def test_each_who_hears_of_a_failure_gets_an_instance_of_his_own() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        motion = await fleet["right"].queue.wait(600)
        sims["left"].unplug()
        errors = await asyncio.gather(motion.wait(), motion.wait(), return_exceptions=True)
        assert errors[0] is not errors[1]
        assert str(errors[0]) == str(errors[1])
        assert isinstance(errors[0], MotionStopped)


@virtual
async def test_a_fleet_that_only_looks_on_is_left_alone() -> None:
    async with cell("left", "right") as sims, Magician.connect(sims["left"].url) as arm:
        motion = await arm.queue.wait(1)
        with pytest.raises(Oops):
            async with Fleet.connect(urls(sims), control=False) as fleet:
                assert set(await fleet.each("get_pose")) == {"left", "right"}
                with pytest.raises(ValueError, match="only read"):
                    await fleet.stop()

                raise Oops

        await motion


@virtual
async def test_an_arm_that_is_to_finish_is_not_told_to_stop_on_the_way_out() -> None:
    async with cell("left", "right") as sims:
        members = {
            "left": Member(sims["left"].url, Magician, options={"on_error": "leave"}),
            "right": Member(sims["right"].url, Magician),
        }
        with pytest.raises(Oops):
            async with Fleet.connect(members) as fleet:
                await fleet["left"].queue.wait(2)
                await fleet["right"].queue.wait(2)
                await asyncio.sleep(0.5)
                raise Oops

        await asyncio.sleep(5)
        assert [waits(sim)[-1].outcome for sim in sims.values()] == ["done", "aborted"]
