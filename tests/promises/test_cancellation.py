"""Cancellation is sacred: every call that awaits ends within 2 s of being ended, with the right exception.

Whatever the call does just then, on a line that is dead before it began or goes dead under way:

    task.cancel()            the task counts as cancelled
    asyncio.timeout          TimeoutError, and not one of the driver's
    anyio.fail_after         the same
    anyio.move_on_after      the scope catches what it has thrown

and afterwards another connection and other tasks work. The quick form tries one way of ending per verb and moment, all
of them for those where most can go wrong; PROMISES=all tries everything.
"""

from __future__ import annotations

import asyncio
import os
import zlib
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import anyio
import pytest
from promise_arms import BY_NAME, FAMILIES, Bench, Family, bench, each_family
from promise_clock import Ended, end_of, now, on_virtual_clock, run_on_virtual_clock
from promise_verbs import INTERNAL, Verb, public_calls, verbs

from dobot_async import DobotError

pytestmark = pytest.mark.timeout(100)
EVERYTHING = os.environ.get("PROMISES") == "all"
PATIENCE = 0.15  # seconds from when the line is dead to when the call is ended
BOUND = 2.0
SLACK = 0.02
GIVE_UP = 20.0


async def cancelled(call: Callable[[], Awaitable[Any]], at: float) -> Ended:
    """Ends a call with `task.cancel()`."""
    task = asyncio.ensure_future(call())
    asyncio.get_running_loop().call_later(at, task.cancel)
    return await end_of(task, at + GIVE_UP)


async def timed_out(call: Callable[[], Awaitable[Any]], at: float) -> Ended:
    """Ends a call with `asyncio.timeout`."""

    async def run() -> None:
        async with asyncio.timeout(at):
            await call()

    return await end_of(run(), at + GIVE_UP)


async def failed_after(call: Callable[[], Awaitable[Any]], at: float) -> Ended:
    """Ends a call with `anyio.fail_after`."""

    async def run() -> None:
        with anyio.fail_after(at):
            await call()

    return await end_of(run(), at + GIVE_UP)


async def moved_on_after(call: Callable[[], Awaitable[Any]], at: float) -> Ended:
    """Ends a call with `anyio.move_on_after`; the result says whether the scope has caught itself."""

    async def run() -> bool:
        with anyio.move_on_after(at) as scope:
            await call()

        return scope.cancelled_caught

    return await end_of(run(), at + GIVE_UP)


def is_plain_timeout(ended: Ended) -> bool:
    """Whether a call ended with the TimeoutError of who was waiting, and with none of the driver's."""
    return isinstance(ended.error, TimeoutError) and not isinstance(ended.error, DobotError)


Ender = Callable[[Callable[[], Awaitable[Any]], float], Awaitable[Ended]]
ENDERS: dict[str, tuple[Ender, Callable[[Ended], bool]]] = {
    "task.cancel": (cancelled, lambda ended: ended.cancelled),
    "asyncio.timeout": (timed_out, is_plain_timeout),
    "anyio.fail_after": (failed_after, is_plain_timeout),
    "anyio.move_on_after": (moved_on_after, lambda ended: ended.result is True),
}


async def fault_of(b: Bench, verb: Verb, moment: str, ender: str) -> str:
    """Calls a verb, lets the line go dead, ends the call; returns what is wrong, "" if nothing is."""
    end, is_right = ENDERS[ender]
    prepared = await verb.prepare(b.arm) if verb.prepare else None
    await asyncio.sleep(0.1)
    dead_at = verb.moments[moment]
    if dead_at:
        asyncio.get_running_loop().call_later(dead_at, b.line.die)
    else:
        b.line.die()

    at = dead_at + PATIENCE
    ended = await end(lambda: verb.call(b.arm, prepared), at)
    if ended.seconds < at and (
        (verb.at_once and not ended.error) or (verb.refused and not isinstance(ended.error, TimeoutError))
    ):
        pass
    elif ended.seconds < at - SLACK:
        return f"ended before it was: {ended}"
    elif ended.seconds > at + BOUND + SLACK:
        return f"{ended}, {ended.seconds - at:.1f} s after it was ended"
    elif not is_right(ended):
        return f"{ended}"

    if not b.line.up.dead:
        b.line.die()  # a call that needs no line was faster

    await b.second_connection_works()
    b.line.recover()
    await b.works_again()
    return ""


async def tried(family: Family, verb: Verb, moment: str, ender: str) -> str:
    """One case on a connection of its own; returns what is wrong, "" if nothing is."""
    options: dict[str, Any] = {"model": verb.model} if verb.model else {}
    fault = "not begun"
    # What the block's end says of commands that were never sent is right, and none of this test's business.
    with suppress(DobotError):
        async with bench(replace(family, model=verb.model or family.model), speed=0.1, **options) as b:
            try:
                fault = await fault_of(b, verb, moment, ender)
            except (DobotError, AssertionError, TimeoutError, asyncio.CancelledError) as error:
                fault = f"afterwards: {error!r}"

            b.line.recover()
            with suppress(DobotError, TimeoutError):
                async with asyncio.timeout(10):
                    await b.arm.queue.stop()

    return fault


def queue_class(family: Family) -> Any:
    """The class of a family's queues."""

    async def ask() -> Any:
        async with bench(family) as b:
            return type(b.arm.queue)

    return run_on_virtual_clock(ask())


QUEUES = {family.name: queue_class(family) for family in FAMILIES}
TABLE = [(family.name, verb) for family in FAMILIES for verb in verbs(family, QUEUES[family.name])]


def enders(family: str, verb: Verb, moment: str) -> list[str]:
    """Which ways of ending a call are tried."""
    names = list(ENDERS)
    if EVERYTHING or verb.core:
        return names

    return [names[zlib.crc32(f"{family} {verb} {moment}".encode()) % len(names)]]


@pytest.mark.cases(12)
@pytest.mark.parametrize(("name", "verb"), TABLE, ids=[f"{name}-{str(verb).replace(' ', '_')}" for name, verb in TABLE])
def test_a_call_on_a_dead_line_ends_when_it_is_ended(name: str, verb: Verb) -> None:
    faults = {}
    for moment in verb.moments:
        for ender in enders(name, verb, moment):
            fault = run_on_virtual_clock(tried(BY_NAME[name], verb, moment, ender))
            if fault:
                faults[moment, ender] = fault

    assert not faults, "\n".join(f"{moment}, {ender}: {fault}" for (moment, ender), fault in faults.items())


@each_family
def test_the_table_has_every_public_call(family: Family) -> None:
    listed = {verb.name for name, verb in TABLE if name == family.name}
    on_arm = public_calls(family.kind) - INTERNAL
    assert on_arm - listed == set(), "verbs of the arm that no test of cancellation knows"
    on_queue = {f"queue.{name}" for name in public_calls(QUEUES[family.name]) - INTERNAL}
    assert on_queue - listed == set(), "verbs of the queue that no test of cancellation knows"
    named = {name for name in listed if name.partition(".")[0] not in {"motion", "link", "wifi"}}
    assert named - on_arm - on_queue == set(), "the table has verbs that are no more"


@each_family
@pytest.mark.parametrize("ender", ENDERS)
@on_virtual_clock
async def test_a_connect_to_a_dead_line_ends_when_it_is_ended(family: Family, ender: str) -> None:
    end, is_right = ENDERS[ender]
    async with bench(family) as b:
        count = len(b.lines)

        async def connecting() -> None:
            async with family.connect(b.sim.url, timeout=60):
                pass

        b.lines.born_dead = True
        ended = await end(connecting, 0.5)
        b.lines.born_dead = False
        assert len(b.lines) > count
        assert ended.seconds <= 0.5 + BOUND + SLACK, ended
        assert is_right(ended), ended
        await b.works_again()
        await b.second_connection_works()


@each_family
@pytest.mark.parametrize("ender", ENDERS)
@pytest.mark.parametrize("dead", [0.0, 1.0])
@on_virtual_clock
async def test_a_block_on_a_dead_line_is_left_in_time(family: Family, ender: str, dead: float) -> None:
    """A call that is ended inside of the block ends the block as well, and leaving it takes no more than 2 s."""
    end, is_right = ENDERS[ender]
    left_at: list[float] = []

    async def block() -> None:
        async with bench(family, speed=0.1) as b:
            motion = await b.arm.queue.move_joints(*family.far)
            asyncio.get_running_loop().call_at(now() + dead, b.line.die)
            try:
                await motion
            finally:
                left_at.append(now())

    begun = now()
    ended = await end(block, dead + 1.0)
    assert left_at, ended
    assert begun + ended.seconds <= left_at[0] + BOUND + SLACK, ended
    assert is_right(ended), ended


@each_family
@on_virtual_clock
async def test_a_cancellation_while_a_block_is_being_left_goes_on(family: Family) -> None:
    """Who cancels again while the arm is being stopped gets no other error than CancelledError, and no hang."""

    async def block() -> None:
        async with bench(family, speed=0.1) as b:
            await b.arm.queue.move_joints(*family.far)
            b.line.die()
            raise ZeroDivisionError

    task = asyncio.ensure_future(block())
    asyncio.get_running_loop().call_later(1.0, task.cancel)
    ended = await end_of(task, GIVE_UP)
    assert ended.seconds <= 1.0 + BOUND + SLACK, ended
    assert ended.cancelled, ended


@each_family
@on_virtual_clock
async def test_what_went_wrong_while_stopping_is_a_note(family: Family) -> None:
    notes: list[str] = []

    async def moved(arm: Any) -> None:
        try:
            await arm.move_joints(*family.far)
        except BaseException as error:
            notes.extend(getattr(error, "__notes__", ()))
            raise

    async with bench(family, speed=0.1) as b:
        task = asyncio.ensure_future(moved(b.arm))
        await asyncio.sleep(0.5)
        b.line.die()
        task.cancel()
        ended = await end_of(task, GIVE_UP)
        b.line.recover()
        assert ended.cancelled, ended
        assert notes, "the CancelledError says nothing of a stop that nobody has heard"
