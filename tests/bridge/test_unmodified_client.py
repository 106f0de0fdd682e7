"""Somebody else's client, pydobotlab, through the bridge's pseudo-terminal, as it drives a real arm."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import pydobotlab
import pytest
from bridge_rig import TCP, bridged, client, until
from pydobotlab.config import default_config, set_config
from side_by_side import side_by_side

from dobot_async import Magician
from dobot_async.arms.magician import commands as c


@pytest.fixture(autouse=True)
def packaged_settings(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The client's settings as packaged; it would read, and write, a file of the user's. It need not settle here."""
    set_config(default_config())
    monkeypatch.setattr("pydobotlab.device.CLEAR_ALARM_SETTLE_SECONDS", 0.0)
    yield
    set_config(None)


async def test_two_programs_read_at_the_same_time_and_no_answer_is_wrong() -> None:
    figures, rig = await side_by_side(1000)
    assert figures.wrong == 0
    assert figures.blocking + figures.asynchronous == 1000
    assert rig.sim.arm.counters.requests >= 1000
    assert rig.told("refused") == []


async def test_it_moves_the_arm_while_another_program_watches() -> None:
    async with bridged(["pty", TCP]) as rig:
        lab: Any = pydobotlab.Magician(
            rig.bridge.urls[0].removeprefix("serial://"), via_broker=False, require_panel=False, verbose=False
        )
        await asyncio.to_thread(lab.connect)
        try:
            await asyncio.to_thread(lab.clear_alarm)
            await asyncio.to_thread(lab.wait, 0)

            async def watch() -> None:
                async with Magician.connect(rig.bridge.urls[1], control=False) as arm:
                    y = 0.0
                    while y < 59.9:
                        y = (await arm.get_pose()).y

            watching = asyncio.create_task(watch())
            for x in (220, 230, 240):
                await asyncio.to_thread(lab.move_to, x, 0, 40, 0)
                assert rig.sim.arm.pose.x == pytest.approx(x, abs=0.01)

            await asyncio.to_thread(lab.move_to, 200, 60, 40, 0)
            await watching
            assert [value.x for value in rig.executed(c.SET_PTP_CMD)] == [220, 230, 240, 200]
            assert rig.bridge.holder == rig.bridge.urls[0].removeprefix("serial://")
        finally:
            await asyncio.to_thread(lab.disconnect)

        await until(lambda: rig.bridge.holder is None)
        async with client(rig.bridge.urls[1]) as plain:
            assert len((await plain.ask(c.SET_WAIT_CMD, c.WAITCmd(0), queued=True)).params) == 8
