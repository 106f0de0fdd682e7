"""Events: each reader sees what is published after it began, in order, and nobody is held up."""

from __future__ import annotations

import asyncio
import gc
import weakref

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async._core.util.events import BACKLOG, Events, Listener

pytestmark = pytest.mark.virtual_time


async def read_all(listener: Listener[int]) -> list[int]:
    """Reads until the end."""
    return [event async for event in listener]


async def test_each_reader_sees_what_is_published_after_it_began() -> None:
    events: Events[int] = Events()
    events.publish(0)
    first = aiter(events)
    events.publish(1)
    second = aiter(events)
    events.publish(2)
    events.close()
    assert await read_all(first) == [1, 2]
    assert await read_all(second) == [2]


async def test_a_waiting_reader_is_woken() -> None:
    events: Events[int] = Events()
    listener = aiter(events)
    for number in range(3):
        reading = asyncio.ensure_future(anext(listener))
        await asyncio.sleep(0)
        assert not reading.done()
        events.publish(number)
        assert await reading == number


async def test_the_end_wakes_everybody_and_comes_after_what_was_published() -> None:
    events: Events[int] = Events()
    waiting, behind = aiter(events), aiter(events)
    reading = asyncio.create_task(read_all(waiting))
    await asyncio.sleep(0)
    events.publish(1)
    events.publish(2)
    events.close()
    events.close()
    assert await reading == [1, 2]
    assert await read_all(behind) == [1, 2]
    assert await read_all(behind) == []
    assert await read_all(aiter(events)) == []


async def test_a_slow_reader_loses_the_oldest_and_knows_how_many() -> None:
    events: Events[int] = Events()
    slow, quick = aiter(events), aiter(events)
    seen = []
    for number in range(BACKLOG + 10):
        events.publish(number)
        seen.append(await anext(quick))

    events.close()
    assert slow.missed == 10
    assert await read_all(slow) == list(range(10, BACKLOG + 10))
    assert (seen, quick.missed) == (list(range(BACKLOG + 10)), 0)


async def test_a_cancelled_read_loses_nothing() -> None:
    events: Events[int] = Events()
    listener = aiter(events)
    for publish_first in (True, False):
        reading = asyncio.ensure_future(anext(listener))
        await asyncio.sleep(0)
        if publish_first:
            events.publish(1)

        reading.cancel()
        await asyncio.wait([reading])
        if not publish_first:
            events.publish(1)

        assert await anext(listener) == 1


async def test_many_readers_may_share_a_listener() -> None:
    events: Events[int] = Events()
    listener = aiter(events)
    readings = [asyncio.ensure_future(anext(listener)) for _ in range(3)]
    await asyncio.sleep(0)
    for number in range(3):
        events.publish(number)

    assert sorted(await asyncio.gather(*readings)) == [0, 1, 2]
    endings = [asyncio.create_task(read_all(listener)) for _ in range(3)]
    await asyncio.sleep(0)
    events.close()
    assert await asyncio.gather(*endings) == [[], [], []]


@pytest.mark.full
async def test_a_reader_that_is_gone_costs_nothing() -> None:
    events: Events[int] = Events()
    listener = weakref.ref(aiter(events))
    gc.collect()
    assert listener() is None
    events.publish(1)


@given(st.lists(st.sampled_from(["publish", "read", "listen"]), max_size=60))
async def test_readers_see_an_unbroken_run(actions: list[str]) -> None:
    events: Events[int] = Events()
    published = 0
    listeners: list[tuple[Listener[int], int, list[int]]] = []
    for action in actions:
        if action == "publish":
            events.publish(published)
            published += 1
        elif action == "listen":
            listeners.append((aiter(events), published, []))
        else:
            for listener, since, seen in listeners:
                if since + len(seen) < published:
                    seen.append(await anext(listener))

    events.close()
    for listener, since, seen in listeners:
        assert seen + await read_all(listener) == list(range(since, published))
