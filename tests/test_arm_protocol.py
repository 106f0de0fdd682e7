"""Every family keeps the protocol `Arm`; mypy judges the first function, and the others what runs."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from virtual import virtual

from dobot_async import Arm, Magician, MyCobot, UltraArm, UnsupportedError
from dobot_async.simulator import simulate


def arms(magician: Magician, mycobot: MyCobot, ultraarm: UltraArm) -> tuple[Arm, ...]:
    """Fails to type-check if a family does not keep the protocol."""
    return magician, mycobot, ultraarm


FAMILIES: dict[str, tuple[Any, tuple[str, ...]]] = {
    "magician": (Magician, ("gripper_to",)),
    "mycobot280": (MyCobot, ("suction",)),
    "ultraarm": (UltraArm, ()),
}
each_family = pytest.mark.parametrize("model", FAMILIES)


async def carry(arm: Arm, missing: tuple[str, ...]) -> list[str]:
    """A program for any arm; returns what it has not."""
    lacks = []
    await arm.home()
    await arm.move_to(z=(await arm.get_pose()).z - 20)
    await arm.move_by(z=10)
    for verb, value in (("gripper", True), ("gripper_to", 50), ("suction", True)):
        try:
            await getattr(arm, verb)(value)
        except UnsupportedError:
            lacks.append(verb)

    await arm.wait(0.25)
    await arm.jog("j1+", 0.2)
    motion = await arm.queue.move_by(z=-5)
    async with arm.queue.batch() as batch:
        lifted = batch.move_by(z=5)

    await asyncio.gather(motion, lifted)
    await arm.queue.join()
    await arm.pause()
    await arm.resume()
    await arm.stop()
    await arm.recover()
    assert not await arm.get_alarms()
    assert lacks == list(missing)
    return lacks


@pytest.mark.cases(1)
@each_family
@virtual
async def test_one_program_drives_an_arm_of_any_family(model: str) -> None:
    kind, missing = FAMILIES[model]
    async with simulate(model) as sim, kind.connect(sim.url) as arm:
        assert await carry(arm, missing) == list(missing)


@each_family
@virtual
async def test_an_arm_of_any_family_follows_a_target(model: str) -> None:
    kind, _ = FAMILIES[model]
    async with simulate(model) as sim, kind.connect(sim.url) as arm:
        typed: Arm = arm
        await typed.home()
        before = await typed.get_pose()
        async with typed.following(max_speed=50) as follow:
            for _ in range(60):
                follow.target = (before.x, before.y, before.z - 10)
                await asyncio.sleep(0.05)

        assert (await typed.get_pose()).z < before.z - 2


@each_family
@virtual
async def test_what_every_arm_tells(model: str) -> None:
    kind, _ = FAMILIES[model]
    options: dict[str, Any] = {} if model == "mycobot280" else {"homed": True}
    async with simulate(model, **options) as sim, kind.connect(sim.url) as arm:
        typed: Arm = arm
        pose, info = await typed.get_pose(), await typed.get_info()
        assert pose.joints == pytest.approx(await typed.get_joints(), abs=0.05)
        assert all(isinstance(axis, float) for axis in (pose.x, pose.y, pose.z))
        assert all(isinstance(text, str) for text in (info.serial_number, info.name, info.version))


@each_family
@virtual
async def test_a_word_that_is_no_direction_lists_those_that_are(model: str) -> None:
    kind, _ = FAMILIES[model]
    async with simulate(model) as sim, kind.connect(sim.url) as arm:
        with pytest.raises(ValueError, match=r"x\+"):
            await arm.jog("sideways", 1)
