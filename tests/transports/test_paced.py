"""A transport that leaves a gap between frames, on a virtual clock."""

from __future__ import annotations

import asyncio

import pytest
from virtual import virtual

from dobot_async.transports.memory import memory_pair
from dobot_async.transports.paced import Paced

GAP = 0.02


def now() -> float:
    return asyncio.get_running_loop().time()


@virtual
async def test_frames_are_a_gap_apart_and_the_first_goes_at_once() -> None:
    near, far = memory_pair()
    paced = Paced(near, GAP)
    begun = now()
    times = []
    for number in range(4):
        await paced.send(bytes((number,)))
        times.append(now() - begun)
        assert await far.receive() == bytes((number,))

    assert times == pytest.approx([0, GAP, 2 * GAP, 3 * GAP])
    await asyncio.sleep(1)
    before = now()
    await paced.send(b"x")
    assert now() == before
    await paced.aclose()
    await far.aclose()


@virtual
async def test_a_send_that_is_cancelled_while_it_waits_has_sent_nothing() -> None:
    near, far = memory_pair()
    paced = Paced(near, GAP)
    await paced.send(b"first")
    waiting = asyncio.create_task(paced.send(b"second"))
    await asyncio.sleep(GAP / 2)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting

    await paced.send(b"third")
    assert [await far.receive(), await far.receive()] == [b"first", b"third"]
    await paced.aclose()
    await far.aclose()


@virtual
async def test_what_arrives_is_passed_on_and_the_limits_are_one() -> None:
    near, far = memory_pair()
    paced = Paced(near, GAP)
    await far.send(b"hello")
    assert await paced.receive() == b"hello"
    assert (paced.in_flight, paced.window, paced.reorder_window) == (1, 1, near.reorder_window)
    await paced.aclose()
    await far.aclose()
