"""Three families behind the same verbs: what one has learned of one arm holds for the others."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Callable, Mapping
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass, field
from typing import Any

import pytest

from dobot_async import (
    ConnectFailed,
    ConnectionLost,
    Link,
    Magician,
    Motion,
    MotionStopped,
    MyCobot,
    ReplyTimeout,
    UltraArm,
)
from dobot_async._core.protocol.contract import LinkState
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.queue import MotionQueue
from dobot_async.arms.magician import commands as magician
from dobot_async.arms.mycobot import commands as mycobot
from dobot_async.arms.ultraarm import commands as ultraarm
from dobot_async.simulator import Faults, simulate

SHARED = {"control", "queue", "timeout", "on_error", "reconnect", "reply_timeout"}
FAST, SLOW = 50.0, 0.5


@dataclass(frozen=True)
class Family:
    """What differs from family to family in this file: names of models, targets, and one row that reads."""

    name: str
    model: str
    kind: Any
    near: tuple[float, ...]
    far: tuple[float, ...]
    read: Command[None, Any]
    where: Callable[[Any], tuple[float, ...]]
    details: Mapping[str, Any] = field(
        default_factory=dict, compare=False
    )  # what `simulate` needs, so that the arm can move

    def connect(self, url: str, **options: Any) -> AbstractAsyncContextManager[Any]:
        """The `connect` of its class."""
        connection: AbstractAsyncContextManager[Any] = self.kind.connect(url, **options)
        return connection


FAMILIES = (
    Family(
        "magician",
        "magician",
        Magician,
        (10, 45, 45, 0),
        (90, 45, 45, 0),
        magician.GET_POSE,
        lambda arm: (arm.pose.j1, arm.pose.j2, arm.pose.j3, arm.pose.j4),
    ),
    Family(
        "mycobot",
        "mycobot280",
        MyCobot,
        (10, 0, 0, 0, 0, 0),
        (120, 0, 0, 0, 0, 0),
        mycobot.GET_ANGLES,
        lambda arm: tuple(arm.joints),
    ),
    Family(
        "ultraarm",
        "ultraarm",
        UltraArm,
        (10, 10, 10),
        (120, 10, 10),
        ultraarm.GET_ANGLES,
        lambda arm: (arm.angles.j1, arm.angles.j2, arm.angles.j3),
        {"homed": True},
    ),
)
each_family = pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)


@each_family
def test_connect_takes_the_same_options_with_the_same_defaults(family: Family) -> None:
    found = inspect.signature(family.kind.connect).parameters
    assert set(found) >= {"url"} | SHARED
    given = {name: found[name].default for name in SHARED - {"reply_timeout"}}
    assert given == {"control": True, "queue": "fresh", "timeout": 5.0, "on_error": "stop", "reconnect": False}
    assert all(each.kind is inspect.Parameter.KEYWORD_ONLY for name, each in found.items() if name != "url")


@each_family
async def test_verbs_are_on_the_arm_on_the_queue_and_on_a_batch(family: Family) -> None:
    async with family.connect("sim:") as arm, arm.queue.batch() as batch:
        for verb in ("home", "move_to", "move_joints", "wait", "gripper"):
            shapes = [inspect.signature(getattr(place, verb)).parameters for place in (arm, arm.queue, batch)]
            assert shapes[0] == shapes[1] == shapes[2]
            assert shapes[0]["timeout"].default is None

        for verb in ("stop", "pause", "resume", "join", "put", "put_all", "clear"):
            assert callable(getattr(arm.queue, verb))

        for verb in ("stop", "request", "jog", "jogging"):
            assert callable(getattr(arm, verb))


@each_family
async def test_objects_are_of_the_same_classes(family: Family) -> None:
    async with family.connect("sim:?speed=50") as arm:
        assert type(arm.link) is Link
        queue: Any = arm.queue
        assert isinstance(arm.queue, MotionQueue)
        motion = await queue.move_joints(*family.near)
        assert type(motion) is Motion
        await motion


@each_family
async def test_an_await_returns_when_the_arm_is_there(family: Family) -> None:
    async with simulate(family.model, speed=FAST, **family.details) as sim, family.connect(sim.url) as arm:
        await arm.move_joints(*family.near)
        assert family.where(sim.arm) == pytest.approx((*family.near, *(0,) * 4)[: len(family.near)], abs=0.05)
        assert await arm.request(family.read, None) is not None


@each_family
async def test_motions_can_be_awaited_in_any_order_and_more_than_once(family: Family) -> None:
    async with family.connect("sim:?speed=50") as arm:
        first = await arm.queue.move_joints(*family.near)
        async with arm.queue.batch() as batch:
            second = batch.move_joints(*family.far)
            third = batch.move_joints(*family.near)

        await third
        await asyncio.gather(first, second, second)
        await arm.queue.join()
        assert all(each.done for each in (first, second, third))


@each_family
async def test_a_batch_that_is_left_by_an_error_sends_nothing(family: Family) -> None:
    async with simulate(family.model, speed=FAST, **family.details) as sim, family.connect(sim.url) as arm:
        before = family.where(sim.arm)
        with pytest.raises(ZeroDivisionError):
            async with arm.queue.batch() as batch:
                motion = batch.move_joints(*family.far)
                raise ZeroDivisionError

        with pytest.raises(MotionStopped, match="batch was left"):
            await motion

        await arm.queue.join()
        assert family.where(sim.arm) == before


@each_family
async def test_a_stop_ends_pending_motions(family: Family) -> None:
    async with simulate(family.model, speed=SLOW, **family.details) as sim, family.connect(sim.url) as arm:
        motion = await arm.queue.move_joints(*family.far)
        behind = await arm.queue.move_joints(*family.near)
        await arm.stop()
        for each in (motion, behind):
            with pytest.raises(MotionStopped):
                await each

        assert family.where(sim.arm)[0] < family.far[0]


@each_family
async def test_a_motion_that_takes_too_long_is_stopped(family: Family) -> None:
    async with simulate(family.model, speed=SLOW, **family.details) as sim, family.connect(sim.url) as arm:
        with pytest.raises(ReplyTimeout, match="the arm was stopped"):
            await arm.move_joints(*family.far, timeout=0.2)

        assert family.where(sim.arm)[0] < family.far[0]


@each_family
async def test_an_error_in_the_block_stops_the_arm(family: Family) -> None:
    async with simulate(family.model, speed=SLOW, **family.details) as sim:
        with pytest.raises(ZeroDivisionError):
            async with family.connect(sim.url) as arm:
                await arm.queue.move_joints(*family.far)
                raise ZeroDivisionError

        assert not sim.arm.device.moving if family.name != "mycobot" else not sim.arm.moving
        assert family.where(sim.arm)[0] < family.far[0]


@each_family
async def test_observers_send_reads_alone(family: Family) -> None:
    async with (
        simulate(family.model, speed=FAST, **family.details) as sim,
        family.connect(sim.url, control=False) as arm,
    ):
        await arm.request(family.read, None)
        with pytest.raises(ValueError, match="only reads"):
            await arm.queue.move_joints(*family.far)

        with pytest.raises(ValueError, match="only reads"):
            await arm.move_joints(*family.far)


@each_family
async def test_nobody_answers(family: Family) -> None:
    async with simulate(family.model, faults=Faults(silent=True), **family.details) as sim:
        with pytest.raises(ConnectFailed, match="answers at"):
            async with family.connect(sim.url, timeout=0.3):
                pass


@each_family
async def test_what_cannot_be_opened_in_time_tells_why_and_not_the_token(
    family: Family, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def never(_url: str, *, arm: str) -> None:
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError as error:
            error.add_note(f"there is no way to a {arm}")
            raise

    monkeypatch.setattr("dobot_async.arms.session.open_transport", never)
    with pytest.raises(ConnectFailed, match=r"token=\.\.\. could not be opened within .*no way to a") as failed:
        async with family.connect("tcp://host:1?token=secret", timeout=0.01):
            pass

    assert "secret" not in str(failed.value)


@each_family
async def test_a_line_that_is_cut_ends_everything(family: Family) -> None:
    async with simulate(family.model, speed=SLOW, **family.details) as sim:
        with pytest.raises(ConnectionLost):
            async with family.connect(sim.url) as arm:
                motion = await arm.queue.move_joints(*family.far)
                sim.unplug()
                await motion


@each_family
async def test_a_line_that_is_cut_ends_the_motions_that_nobody_awaits(family: Family) -> None:
    async with simulate(family.model, speed=SLOW, **family.details) as sim, family.connect(sim.url) as arm:
        motion = await arm.queue.move_joints(*family.far)
        changes = aiter(arm.link.state)
        sim.unplug()
        assert await anext(changes) is LinkState.LOST
        assert motion.done
        assert arm.queue.pending == 0
        with pytest.raises(ConnectionLost, match="cable"):
            await motion


@each_family
@pytest.mark.parametrize("url", ["nonsense", "sim:?speed=fast", "http://arm"])
async def test_a_wrong_url_is_named(family: Family, url: str) -> None:
    with pytest.raises(ValueError, match=url[:4]):
        async with family.connect(url):
            pass
