"""The judge of how cancelled calls end finds what is wrong, and lets pass what is right."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest
from calls import Call, How, Violation, made
from virtual import virtual

from dobot_async import ReplyTimeout


async def good() -> None:
    await asyncio.sleep(10)


async def prompt_enough() -> None:
    try:
        await asyncio.sleep(10)
    finally:
        await asyncio.sleep(1.9)


async def too_late() -> None:
    try:
        await asyncio.sleep(10)
    finally:
        await asyncio.sleep(2.1)


async def swallowed() -> None:
    try:
        await asyncio.sleep(10)
    except asyncio.CancelledError:
        return


async def replaced() -> None:
    try:
        await asyncio.sleep(10)
    finally:
        raise ReplyTimeout("no answer")


async def cancels_itself() -> None:
    raise asyncio.CancelledError


hurried = pytest.mark.parametrize("how", ["cancel", "limit"])


@hurried
@pytest.mark.parametrize("work", [good, prompt_enough])
def test_what_ends_as_it_must(how: How, work: Callable[[], Awaitable[None]]) -> None:
    call = Call("it")

    @virtual
    async def run() -> None:
        await made(call, work, how, 0.5)

    run()
    assert call.hurried == 0.5
    assert not call.good


@hurried
@pytest.mark.parametrize(
    ("work", "wrong"),
    [(too_late, "went on for 2.10 s"), (swallowed, "ended with a result"), (replaced, "ended with ReplyTimeout")],
)
def test_what_does_not(how: How, work: Callable[[], Awaitable[None]], wrong: str) -> None:
    @virtual
    async def run() -> None:
        with pytest.raises(Violation, match=wrong):
            await made(Call("it"), work, how, 0.5)

    run()


@virtual
async def test_a_call_that_nobody_hurries() -> None:
    call = Call("it")
    await made(call, good, "plain", 0.5)
    assert (call.begun, call.ended, call.good) == (0.0, 10.0, True)
    with pytest.raises(Violation, match="cancelled by nobody"):
        await made(Call("it"), cancels_itself, "plain", 0.5)


@virtual
async def test_a_call_that_ends_before_it_is_cancelled() -> None:
    for how in ("cancel", "limit"):
        call = Call("it")
        await made(call, good, how, 20.0)
        assert call.good
        assert call.hurried is None


@virtual
async def test_a_call_that_fails_by_itself() -> None:
    call = Call("it")
    await made(call, replaced, "plain", 0.0)
    assert isinstance(call.error, ReplyTimeout)
