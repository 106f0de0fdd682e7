"""The end of a lease: nobody else may write before the arm was seen to stand, several times in a row."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest
from virtual import virtual

from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.bridge_adapter import BRIDGED, CobotWatch
from dobot_async.arms.mycobot.frame import Frame
from dobot_async.arms.mycobot.models import MODELS
from dobot_async.bridge.lease import Lease
from dobot_async.bridge.requests import Refused
from dobot_async.bridge.standstill import Standstill

MODEL = MODELS["mycobot280"]


class FakeLine:
    """The way to an arm that moves until it hears a stop, of which some are lost; and some looks are spoilt.

    Attributes:
        moving: Whether the arm moves.
    """

    def __init__(self, spoilt: Sequence[int], lost: int) -> None:
        self.moving = True
        self._spoilt = spoilt
        self._lost = lost
        self._looks = 0

    async def ask(self, _: Frame) -> Frame:
        """Answers whether it moves; a spoilt answer says that it stands."""
        await asyncio.sleep(0.02)
        self._looks += 1
        return Frame(c.IS_MOVING.id, bytes([self.moving and self._looks - 1 not in self._spoilt]))

    async def stop(self, frames: Sequence[Frame]) -> list[bool]:
        """Stops the arm, if that is not lost on the way; it is never acknowledged."""
        await asyncio.sleep(1)
        self._lost -= 1
        self.moving = self.moving and self._lost >= 0
        return [False] * len(frames)


@pytest.mark.parametrize("lost", [0, 1, 3])
@pytest.mark.parametrize("spoilt", [[], [0], [1], [0, 1], [1, 2], [0, 1, 3, 4]], ids=str)
@virtual
async def test_an_arm_that_seems_to_stand_for_a_moment_is_stopped_before_the_lease_ends(
    spoilt: list[int], lost: int
) -> None:
    now = 0.0
    line: Any = FakeLine(spoilt, lost)
    told: list[tuple[str, bool]] = []

    def tell(what: str, *_: object) -> None:
        told.append((what, line.moving))

    leave = Standstill(line, BRIDGED["mycobot280"], tell).reach
    lease: Lease[Any] = Lease(takeover=False, leave=leave, cut=lambda *_: None, tell=tell)
    first: Any = SimpleNamespace(gone=False, name="first", watch=CobotWatch(MODEL, lambda: now))
    second: Any = SimpleNamespace(gone=False, name="second", watch=CobotWatch(MODEL, lambda: now))
    await lease.take(first)
    first.watch.sent(Frame(c.SEND_ANGLES.id, b""))
    now = 60.0  # the motion has long begun
    first.gone = True
    await asyncio.gather(lease.end(first), lease.take(second))
    assert not line.moving
    assert told == [("lease", True), ("stopped", False), ("released", False), ("lease", False)]
    assert lease.holder is second


@virtual
async def test_who_has_gone_while_it_waited_takes_the_lease_from_nobody() -> None:
    """Its turn comes when the arm of the one before has been brought to rest, and it may be gone by then."""
    at_rest = asyncio.Event()
    cut: list[str] = []

    async def leave(_: object) -> None:
        await at_rest.wait()

    lease: Lease[Any] = Lease(takeover=True, leave=leave, cut=lambda *_: cut.append("cut"), tell=lambda *_: None)
    first, second, third = (SimpleNamespace(gone=False, name=name) for name in ("first", "second", "third"))
    await lease.take(first)
    first.gone = True
    tasks = [asyncio.create_task(lease.take(each)) for each in (second, third)]
    await asyncio.sleep(1)
    third.gone = True
    at_rest.set()
    await tasks[0]
    with pytest.raises(Refused, match="has gone"):
        await tasks[1]

    assert lease.holder is second
    assert not cut


@pytest.mark.parametrize(("heard", "told"), [([True], 2), ([False, True], 3), ([False, False, True], 4)])
@virtual
async def test_behind_the_stop_that_was_heard_all_is_said_once_more(heard: list[bool], told: int) -> None:
    """What was still in the queue may have switched something on after it was switched off."""
    said: list[int] = []

    async def stop(frames: Sequence[object]) -> list[bool]:
        said.append(len(frames))
        return [heard[min(len(said), len(heard)) - 1], True]

    async def ask(_: object) -> bool:
        return True

    line: Any = SimpleNamespace(stop=stop, ask=ask)
    family: Any = SimpleNamespace(
        proves_stop=True, stopping=["stop"], escalated_stop=["stop"], ack_optional=lambda _: True
    )
    watch = SimpleNamespace(moving=lambda _: True, question="?", off=lambda: ["laser off"])
    holder: Any = SimpleNamespace(watch=watch)
    await Standstill(line, family, lambda *_: None).reach(holder)
    assert said == [2] * told
