"""Admission: a few at a time, one of each key, the more urgent ones first, whoever gives up."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from virtual import run_virtual

from dobot_async._core.link.admission import Admission, Priority

pytestmark = pytest.mark.virtual_time

URGENT, IMMEDIATE, QUEUED = Priority


@dataclass
class Bench:
    """Requests, and who of them is out."""

    admission: Admission
    out: list[Any] = field(default_factory=list)
    seen: list[Any] = field(default_factory=list)

    async def request(self, name: Any, key: Any, priority: Priority, seconds: float) -> None:
        if not self.admission.try_acquire(key, priority):
            await self.admission.acquire(key, priority)

        self.out.append((name, key, priority))
        self.seen.append(name)
        try:
            await asyncio.sleep(seconds)
        finally:
            self.out.remove((name, key, priority))
            self.admission.release(key, priority)

    def start(self, name: Any, key: Any, priority: Priority = IMMEDIATE, seconds: float = 1.0) -> asyncio.Task[None]:
        return asyncio.create_task(self.request(name, key, priority, seconds))


async def test_so_many_are_out_and_no_more() -> None:
    bench = Bench(Admission(2))
    calls = [bench.start(number, number) for number in range(5)]
    await asyncio.sleep(0.5)
    assert bench.seen == [0, 1]
    await asyncio.gather(*calls)
    assert bench.seen == [0, 1, 2, 3, 4]
    assert asyncio.get_running_loop().time() == pytest.approx(3.0)


async def test_one_of_a_key_is_out_and_others_pass_it() -> None:
    bench = Bench(Admission(8))
    calls = [bench.start(name, name[0]) for name in ("a1", "a2", "b1", "a3", "b2")]
    await asyncio.sleep(0.5)
    assert bench.seen == ["a1", "b1"]
    await asyncio.gather(*calls)
    assert bench.seen == ["a1", "b1", "a2", "b2", "a3"]


async def test_a_key_of_none_excludes_nobody() -> None:
    bench = Bench(Admission(2))
    calls = [bench.start(number, None) for number in range(3)]
    await asyncio.sleep(0.5)
    assert bench.seen == [0, 1]
    await asyncio.gather(*calls)


async def test_urgent_ones_go_beside_all_others_one_of_each_key() -> None:
    bench = Bench(Admission(1))
    calls = [bench.start("a", "a"), bench.start("b", "b")]
    await asyncio.sleep(0)
    calls += [bench.start(name, name[0], URGENT) for name in ("a!", "c!", "a!!")]
    await asyncio.sleep(0.5)
    assert bench.seen == ["a", "a!", "c!"]
    await asyncio.gather(*calls)
    assert sorted(bench.seen) == ["a", "a!", "a!!", "b", "c!"]


async def test_immediate_goes_before_queued_and_else_who_came_first() -> None:
    bench = Bench(Admission(1))
    calls = [bench.start("first", 0)]
    await asyncio.sleep(0)
    calls += [bench.start("q1", None, QUEUED), bench.start("i1", 1), bench.start("q2", None, QUEUED)]
    calls += [bench.start("i2", 2)]
    await asyncio.gather(*calls)
    assert bench.seen == ["first", "i1", "i2", "q1", "q2"]


@pytest.mark.parametrize("steps", range(5))
@pytest.mark.parametrize("late", [False, True])
async def test_who_is_cancelled_leaves_its_place_to_the_next(steps: int, late: bool) -> None:
    """Also if it is cancelled in the moment in which its turn comes."""
    bench = Bench(Admission(1))
    first, second, third = (bench.start(name, name) for name in "abc")
    await asyncio.sleep(1.0 if late else 0.5)
    for _ in range(steps):
        await asyncio.sleep(0)

    second.cancel()
    await asyncio.wait([first, second, third])
    assert bench.seen[-1] == "c"
    await bench.start("d", "b")


actions = st.lists(
    st.tuples(
        st.sampled_from(["a", "b", None]),
        st.sampled_from(list(Priority)),
        st.sampled_from([0.0, 1.0, 2.5]),
        st.sampled_from([0.0, 0.3, 1.0]),
        st.one_of(st.none(), st.sampled_from([0.0, 0.5, 1.0, 2.0])),
    ),
    max_size=20,
)


@given(st.integers(1, 3), actions)
def test_whoever_comes_and_gives_up_the_limits_hold_and_none_is_forgotten(limit: int, script: Any) -> None:
    async def scenario() -> None:
        bench = Bench(Admission(limit))
        calls = []
        for number, (key, priority, seconds, pause, patience) in enumerate(script):
            call = bench.start(number, key, priority, seconds)
            calls.append(call)
            if patience is not None:
                asyncio.get_running_loop().call_later(patience, call.cancel)

            await asyncio.sleep(pause)
            assert sum(priority is not URGENT for _, _, priority in bench.out) <= limit
            keys = [(key, priority is URGENT) for _, key, priority in bench.out if key is not None]
            assert len(keys) == len(set(keys))

        if calls:
            await asyncio.wait(calls)

        for place in range(limit):
            assert bench.admission.try_acquire(place, IMMEDIATE)

        assert not bench.admission.try_acquire("one more", IMMEDIATE)

    run_virtual(scenario())
