"""What the benchmark says of the lag holds: in virtual time it says the same on every computer."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from follow_rig import now
from virtual import virtual

from dobot_async import Fleet, Magician
from dobot_async.simulator import simulate

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def rows() -> dict[str, dict[str, Any]]:
    command = [sys.executable, "-m", "benchmarks.bench_following", "--json", "--rounds", "6"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=100, check=True)
    return {row["kind"]: row for row in json.loads(done.stdout)["rows"]}


@pytest.mark.full
def test_a_magician_is_five_times_less_behind_than_with_each_target_queued(rows: dict[str, dict[str, Any]]) -> None:
    queued = rows["Magician, queued"]["lag_p50_ms"]
    for way in ("Magician", "Magician, clear", "Magician, 50 %", "Magician, workspace"):
        assert 5 * rows[way]["lag_p95_ms"] < queued


@pytest.mark.full
def test_who_keeps_up_is_less_than_a_second_behind(rows: dict[str, dict[str, Any]]) -> None:
    for kind, row in rows.items():
        if "queued" not in kind and "ramps" not in kind.replace("no ramps", ""):
            assert 0 < row["lag_p5_ms"] <= row["lag_p95_ms"] < 1000, kind
            assert row["lag_p95_ms"] - row["lag_p5_ms"] < 500, kind


def test_all_rest_within_a_moment_of_the_end(rows: dict[str, dict[str, Any]]) -> None:
    assert all(row["rests_after_ms"] <= 200 for kind, row in rows.items() if "0.5 s" not in kind)
    assert rows["ultraArm, ramps, 0.5 s"]["rests_after_ms"] <= 1000


@virtual
async def test_an_arm_follows_in_a_fleet_too() -> None:
    async with simulate("magician", homed=True) as sim, Fleet.connect({"left": sim.url}) as fleet:
        arm = fleet["left"]
        assert isinstance(arm, Magician)
        sim.arm.device.place((0, 30, 40, 0, 0))
        async with arm.following() as follow:
            ends = now() + 1
            while now() < ends:
                follow.target = (240, 20, 20)
                await asyncio.sleep(0.05)

        assert sim.arm.pose.y > 15
        assert not sim.arm.device.moving
        await arm.move_to(240, 0, 20)
