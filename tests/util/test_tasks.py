"""Tasks that nobody leaves behind, and what has to be done to an arm whatever becomes of who asked for it."""

from __future__ import annotations

import asyncio
import logging
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable, Coroutine
from typing import Any

import anyio
import pytest

from dobot_async._core.util.tasks import Cleanup, Ended, cancel_and_join, join, run_shielded, run_within
from dobot_async.errors import CommandRejected, ConnectionLost, DobotError, ReplyTimeout

pytestmark = pytest.mark.virtual_time

TICK = 1e-6  # seconds that count as none
BOUNDED = 6.0
"""Seconds within which everybody is let go, at the most."""


def now() -> float:
    """The virtual time."""
    return asyncio.get_running_loop().time()


def start(work: Coroutine[Any, Any, Any]) -> asyncio.Task[Any]:
    """Begins a call."""
    return asyncio.create_task(work)


class Work:
    """Something to do that takes a time.

    Attributes:
        began: Whether it began.
        done: Whether it came to its end.
        cancelled: How often it was cancelled.
    """

    def __init__(self, seconds: float, error: BaseException | None = None, *, stubborn: int = 0) -> None:
        self.seconds, self.error, self.stubborn = seconds, error, stubborn
        self.began = self.done = False
        self.cancelled = 0

    async def __call__(self) -> str:
        self.began = True
        end = now() + self.seconds
        while (left := end - now()) > TICK:
            try:
                await asyncio.sleep(left)
            except asyncio.CancelledError:
                self.cancelled += 1
                if self.cancelled > self.stubborn:
                    raise

        self.done = True
        if self.error:
            raise self.error

        return "result"


# run_shielded


async def test_shielded_work_returns_or_raises() -> None:
    assert await run_shielded(Work(1)()) == "result"
    with pytest.raises(ZeroDivisionError):
        await run_shielded(Work(1, ZeroDivisionError())())


@pytest.mark.parametrize("error", [None, ZeroDivisionError("lost")])
@pytest.mark.parametrize("times", [1, 3])
async def test_shielded_work_comes_to_its_end_before_the_cancellation_goes_on(
    error: Exception | None, times: int
) -> None:
    work = Work(1, error)
    call = start(run_shielded(work()))
    for _ in range(times):
        await asyncio.sleep(0.2)
        call.cancel()

    await asyncio.wait([call])
    assert call.cancelled()
    assert (work.done, work.cancelled) == (True, 0)
    assert now() == pytest.approx(1.0)


async def test_shielded_work_is_not_ended_by_a_scope_either() -> None:
    work = Work(1)
    with anyio.move_on_after(0.3) as scope:
        await run_shielded(work())
        await asyncio.sleep(10)

    assert scope.cancelled_caught
    assert work.done
    assert now() == pytest.approx(1.0)


# run_within


async def test_work_within_a_time_returns_or_raises() -> None:
    assert await run_within(2, Work(1)()) == "result"
    with pytest.raises(ZeroDivisionError):
        await run_within(2, Work(1, ZeroDivisionError())())


async def test_work_that_takes_longer_is_ended() -> None:
    work = Work(5)
    with pytest.raises(TimeoutError, match="not done within 2 s"):
        await run_within(2, work())

    assert work.cancelled == 1
    assert now() == pytest.approx(2.0)


async def test_work_is_ended_when_it_is_no_longer_needed() -> None:
    work = Work(5)
    until: asyncio.Future[None] = asyncio.get_running_loop().create_future()
    asyncio.get_running_loop().call_later(1, until.set_result, None)
    with pytest.raises(Ended):
        await run_within(1000.0, work(), until=until)

    assert work.cancelled == 1
    assert now() == pytest.approx(1.0)


@pytest.mark.parametrize("after", [0.0, 0.5])
async def test_work_is_ended_if_the_caller_is_cancelled(after: float) -> None:
    work = Work(5)
    call = start(run_within(10, work()))
    await asyncio.sleep(after)
    call.cancel()
    await asyncio.wait([call])
    assert call.cancelled()
    assert not work.done


# cancel_and_join, join


@pytest.mark.parametrize("error", [None, ZeroDivisionError("lost")])
async def test_a_task_that_is_done_is_joined_whatever_came_of_it(error: Exception | None) -> None:
    task = start(Work(0, error)())
    await asyncio.sleep(1)
    await cancel_and_join(task)
    assert task.done()


async def test_a_task_is_cancelled_and_waited_for() -> None:
    cleaned = []

    async def work() -> None:
        try:
            await asyncio.sleep(100)
        finally:
            await asyncio.sleep(1)
            cleaned.append(True)

    task = start(work())
    await asyncio.sleep(0)
    await cancel_and_join(task)
    assert cleaned == [True]
    assert now() == pytest.approx(1.0)


async def test_a_task_that_will_not_end_is_not_waited_for_for_ever() -> None:
    work = Work(1000, stubborn=100)
    task = start(work())
    await asyncio.sleep(0)
    await cancel_and_join(task)
    assert not task.done()
    assert work.cancelled == 2
    assert now() <= 10
    work.stubborn = 0
    await cancel_and_join(task)


async def test_who_is_cancelled_while_it_joins_joins_and_is_cancelled_after_it() -> None:
    async def work() -> None:
        try:
            await asyncio.sleep(100)
        finally:
            await asyncio.sleep(1)

    task = start(work())
    await asyncio.sleep(0)
    call = start(cancel_and_join(task))
    for _ in range(3):
        await asyncio.sleep(0.1)
        call.cancel()

    await asyncio.wait([call])
    assert call.cancelled()
    assert task.done()
    assert now() == pytest.approx(1.0)


async def test_join_tells_of_the_cancellation_and_leaves_the_task_alone() -> None:
    work = Work(5)
    task = start(work())
    call = start(join(task, 1.0))
    await asyncio.sleep(0.5)
    call.cancel()
    assert isinstance(await call, asyncio.CancelledError)
    assert now() == pytest.approx(1.0)
    assert await join(task) is None
    assert (work.done, work.cancelled) == (True, 0)


# Cleanup


@pytest.fixture
async def cleanup() -> Any:
    made = Cleanup("sim:")
    yield made
    await made.aclose()


async def test_what_is_done_in_time_is_done(cleanup: Cleanup) -> None:
    assert await cleanup.finish(cleanup.start(Work(0.5)(), "the stop")) is None
    assert now() == pytest.approx(0.5)


async def test_waiting_is_bounded_and_the_work_goes_on(cleanup: Cleanup) -> None:
    work = Work(20)
    failure = await cleanup.finish(cleanup.start(work(), "the stop"))
    assert isinstance(failure, ReplyTimeout)
    assert str(failure).startswith("the stop: sim: has not acknowledged it yet")
    assert now() <= 2
    assert not work.cancelled
    await asyncio.sleep(20)
    assert work.done


async def test_what_an_arm_does_wrong_is_returned_and_what_the_driver_does_wrong_is_raised(cleanup: Cleanup) -> None:
    rejected = CommandRejected("no")
    assert await cleanup.finish(cleanup.start(Work(0, rejected)(), "the stop")) is rejected
    with pytest.raises(ZeroDivisionError):
        await cleanup.finish(cleanup.start(Work(0, ZeroDivisionError())(), "the stop"))


@pytest.mark.parametrize("times", [1, 3])
@pytest.mark.parametrize("seconds", [0.9, 20.0])
async def test_a_cancellation_comes_out_once_and_after_as_long_as_without_it(
    cleanup: Cleanup, seconds: float, times: int
) -> None:
    work = Work(seconds)
    call = start(cleanup.finish(cleanup.start(work(), "the stop")))
    for _ in range(times):
        await asyncio.sleep(0.1)
        call.cancel()

    with pytest.raises(asyncio.CancelledError) as caught:
        await call

    assert not work.cancelled
    assert now() <= 2
    assert now() >= min(seconds, 1) - TICK
    notes = getattr(caught.value, "__notes__", [])
    assert [note.startswith("the stop: sim:") for note in notes] == ([True] if seconds > 2 else [])


async def test_aclose_cancels_and_joins(caplog: pytest.LogCaptureFixture) -> None:
    cleanup = Cleanup("sim:")
    works = [Work(1000), Work(1000)]
    tasks = [cleanup.start(work(), f"stop {number}") for number, work in enumerate(works)]
    waiting = start(cleanup.finish(tasks[0], 100))
    await asyncio.sleep(1)
    await cleanup.aclose()
    assert [task.cancelled() for task in tasks] == [True, True]
    assert isinstance(await waiting, ConnectionLost)
    assert sum("given up" in record.message for record in caplog.records) == 2
    assert now() == pytest.approx(1.0)
    await cleanup.aclose()


async def test_what_fails_while_nobody_waits_is_logged(caplog: pytest.LogCaptureFixture, cleanup: Cleanup) -> None:
    cleanup.start(Work(1, ReplyTimeout("silent"))(), "the stop")
    await asyncio.sleep(2)
    assert [record.message for record in caplog.records] == ["dobot_async the stop: silent"]
    assert caplog.records[0].levelno == logging.WARNING


# At the end of a block, whatever ends it


async def block(cleanup: Cleanup, work: Work, body: Callable[[], Coroutine[Any, Any, Any]]) -> None:
    """Something that has to be stopped at its end."""
    async with cleanup.at_end(work, "the stop"):
        await body()


async def test_at_its_end_it_is_done(cleanup: Cleanup) -> None:
    work = Work(0.5)
    await block(cleanup, work, Work(1))
    assert work.done


async def test_what_cannot_be_done_is_raised_where_nothing_else_is(cleanup: Cleanup) -> None:
    with pytest.raises(CommandRejected):
        await block(cleanup, Work(0.5, CommandRejected("no")), Work(1))

    with pytest.raises(ReplyTimeout):
        await block(cleanup, Work(100), Work(1))

    assert now() <= 1 + 1 + 0.5 + BOUNDED


@pytest.mark.parametrize("failure", [None, CommandRejected("no")])
async def test_an_error_of_the_block_comes_out_as_it_is(cleanup: Cleanup, failure: DobotError | None) -> None:
    error = ZeroDivisionError("of the block")
    work = Work(0.5, failure)
    with pytest.raises(ZeroDivisionError) as caught:
        await block(cleanup, work, Work(1, error))

    assert caught.value is error
    assert work.done
    assert getattr(error, "__notes__", []) == ([str(failure)] if failure else [])


@pytest.mark.parametrize("error", [KeyboardInterrupt(), SystemExit(3), GeneratorExit()])
async def test_even_what_is_no_exception_waits_for_it(cleanup: Cleanup, error: BaseException) -> None:
    work = Work(0.5)
    with pytest.raises(type(error)) as caught:
        async with cleanup.at_end(work, "the stop"):
            raise error

    assert caught.value is error
    assert work.done


@pytest.mark.parametrize("seconds", [0.5, 100.0])
@pytest.mark.parametrize("times", [1, 2, 3])
async def test_a_cancelled_task_is_cancelled_after_it(cleanup: Cleanup, seconds: float, times: int) -> None:
    work = Work(seconds)
    call = start(block(cleanup, work, Work(10)))
    for _ in range(times):
        await asyncio.sleep(0.1)
        call.cancel()

    await asyncio.wait([call])
    assert call.cancelled()
    assert work.began
    assert not work.cancelled
    assert now() <= 0.3 + 2


@pytest.mark.parametrize("seconds", [0.5, 100.0])
async def test_a_scope_that_is_cancelled_waits_for_it(cleanup: Cleanup, seconds: float) -> None:
    work = Work(seconds)
    with anyio.move_on_after(1) as scope:
        await block(cleanup, work, Work(10))

    assert scope.cancelled_caught
    assert work.began
    assert not work.cancelled
    assert now() <= 1 + 2


async def test_outer_scopes_may_be_cancelled_meanwhile(cleanup: Cleanup) -> None:
    work = Work(0.9)
    with anyio.move_on_after(1.5) as outer:
        with anyio.move_on_after(1):
            await block(cleanup, work, Work(10))

        await asyncio.sleep(10)

    assert outer.cancelled_caught
    assert work.done
    assert now() == pytest.approx(1.9)


@pytest.mark.parametrize("seconds", [0.5, 100.0])
async def test_a_timeout_is_a_timeout_after_it(cleanup: Cleanup, seconds: float) -> None:
    work = Work(seconds)
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(1):
            await block(cleanup, work, Work(10))

    assert work.began
    assert now() <= 1 + 2
    await asyncio.sleep(1)  # nothing is left that cancels


async def test_a_task_group_that_fails_waits_for_it(cleanup: Cleanup) -> None:
    work = Work(0.5)
    with pytest.raises(ExceptionGroup) as caught:
        async with asyncio.TaskGroup() as group:
            group.create_task(block(cleanup, work, Work(10)))
            group.create_task(Work(1, ZeroDivisionError())())

    assert caught.group_contains(ZeroDivisionError)
    assert work.done


async def test_who_is_cancelled_at_the_end_of_a_good_block_is_cancelled_after_it(cleanup: Cleanup) -> None:
    work = Work(1)
    call = start(block(cleanup, work, Work(1)))
    await asyncio.sleep(1.5)
    call.cancel()
    await asyncio.wait([call])
    assert call.cancelled()
    assert work.done


PROGRAM = """
import asyncio, sys
from dobot_async._core.util.tasks import Cleanup

async def stop():
    await asyncio.sleep(0.1)
    print("stopped", flush=True)

async def main():
    cleanup = Cleanup("sim:")
    try:
        async with cleanup.at_end(stop, "the stop"):
            print("ready", flush=True)
            await asyncio.sleep(30)
    finally:
        await cleanup.aclose()

try:
    asyncio.run(main())
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="a signal of POSIX")
def test_ctrl_c_waits_for_it() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(PROGRAM)], stdout=subprocess.PIPE, text=True
    ) as program:
        assert program.stdout
        assert program.stdout.readline() == "ready\n"
        program.send_signal(signal.SIGINT)
        out, _ = program.communicate(timeout=60)

    assert out == "stopped\ninterrupted\n"
