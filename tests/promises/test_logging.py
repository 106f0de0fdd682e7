"""What the driver says by `logging`: what a user wants to know who looks for why something went wrong, and no more.

Reconnects, repeats, resynchronisations, stops that nobody has heard, motions of which nothing is known: INFO or
WARNING, under the logger "dobot_async". Frames: DEBUG alone. A clean run says nothing.
"""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress

import pytest
from promise_arms import BY_NAME, Family, bench, each_family
from promise_clock import now, on_virtual_clock

from dobot_async import DobotError, MotionUnknown, ReplyTimeout

pytestmark = pytest.mark.timeout(100)
MOST = 20  # records of one event; a line that is gone for minutes fills no disk


def said(caplog: pytest.LogCaptureFixture, level: int = logging.INFO) -> list[logging.LogRecord]:
    """The driver's records from a level on."""
    return [each for each in caplog.records if each.name.split(".")[0] == "dobot_async" and each.levelno >= level]


def words(records: list[logging.LogRecord]) -> str:
    """The records as they are read."""
    return "\n".join(f"{each.levelname} {each.name}: {each.getMessage()}" for each in records)


@each_family
@on_virtual_clock
async def test_a_clean_run_says_nothing(family: Family, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "dobot_async")
    async with bench(family, speed=10) as b:
        await family.read(b.arm)
        await b.arm.move_joints(*family.near)
        async with b.arm.queue.batch() as batch:
            batch.move_joints(*family.far)
            batch.move_joints(*family.near)

        await b.arm.queue.join()
        await b.arm.jog(family.jog, 0.2)

    assert not said(caplog), words(said(caplog))


@each_family
@on_virtual_clock
async def test_frames_are_said_at_debug(family: Family, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG, "dobot_async")
    async with bench(family, speed=10) as b:
        await asyncio.sleep(0.2)
        caplog.clear()
        sent = b.line.up.messages
        for _ in range(5):
            await family.read(b.arm)

        assert b.line.up.messages == sent + 5
        assert len(said(caplog, logging.DEBUG)) >= 10  # five questions, five answers
        assert not said(caplog)


@each_family
@on_virtual_clock
async def test_a_repeated_question_is_said(family: Family, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "dobot_async")
    async with bench(family) as b:
        await asyncio.sleep(0.2)
        left = [0]
        b.line.down.spoil = lambda data: None if left and left.pop() == 0 else data
        await family.read(b.arm)
        assert 1 <= len(said(caplog)) <= MOST, words(said(caplog))


@each_family
@on_virtual_clock
async def test_a_resynchronisation_is_said(family: Family, caplog: pytest.LogCaptureFixture) -> None:
    """A question was given up whose answer may still come; the driver makes sure that it answers no later one."""
    caplog.set_level(logging.INFO, "dobot_async")
    async with bench(family) as b:
        await asyncio.sleep(0.2)
        b.line.die()
        with pytest.raises(ReplyTimeout):
            await family.read(b.arm)

        b.line.recover()
        caplog.clear()
        await b.works_again()
        assert 1 <= len(said(caplog)) <= MOST, words(said(caplog))


@each_family
@on_virtual_clock
async def test_a_reconnect_is_said(family: Family, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "dobot_async")
    async with bench(family, reconnect=True) as b:
        await asyncio.sleep(0.2)
        b.lines.refused = True
        b.line.break_off()
        await asyncio.sleep(60)
        b.lines.refused = False
        await b.works_again(within=20)
        assert len(b.lines) == 2
        assert 2 <= len(said(caplog)) <= MOST, words(said(caplog))  # that it was lost, and that it is back


@each_family
@on_virtual_clock
async def test_a_stop_that_nobody_has_heard_is_a_warning(family: Family, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "dobot_async")
    async with bench(family, speed=0.1) as b:
        await b.arm.queue.move_joints(*family.far)
        await asyncio.sleep(0.3)
        b.line.die()
        caplog.clear()
        with suppress(DobotError, TimeoutError):
            async with asyncio.timeout(0.5):
                await b.arm.stop()

        await asyncio.sleep(3)
        assert said(caplog, logging.WARNING), words(said(caplog))
        b.line.recover()
        await asyncio.sleep(1)
        assert len(said(caplog)) <= MOST, words(said(caplog))


@each_family
@on_virtual_clock
async def test_leaving_without_having_been_heard_is_a_warning(family: Family, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "dobot_async")
    with pytest.raises(ZeroDivisionError):
        async with bench(family, speed=0.1) as b:
            await b.arm.queue.move_joints(*family.far)
            await asyncio.sleep(0.3)
            b.line.die()
            raise ZeroDivisionError

    assert said(caplog, logging.WARNING), words(said(caplog))
    assert len(said(caplog)) <= MOST, words(said(caplog))


@on_virtual_clock
async def test_a_motion_of_which_nothing_is_known_is_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "dobot_async")
    async with bench(BY_NAME["magician"], speed=0.1) as b:
        await b.arm.clear_alarms()
        await b.arm.queue.move_to(220, 0, 40)
        await b.arm.queue.set_speed(50)
        motion = await b.arm.queue.move_to(220, 50, 40)
        await asyncio.sleep(0.3)
        b.sim.arm.power_cycle()
        with pytest.raises(MotionUnknown):
            await motion

        assert said(caplog, logging.WARNING), words(said(caplog))


@each_family
@on_virtual_clock
async def test_a_silent_line_does_not_fill_the_log(family: Family, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "dobot_async")
    async with bench(family, speed=0.1, on_error="leave") as b:
        await asyncio.sleep(0.2)
        b.line.die()
        ends = now() + 300
        asked = 0
        while now() < ends:
            asked += 1
            with suppress(DobotError):
                await family.read(b.arm)

        assert 1 <= len(said(caplog)) <= 3 * asked + MOST, words(said(caplog))
        b.line.recover()
