"""Every benchmark runs, briefly, and says something; its counters are looked at, speed is not.

That the arm never waits for its host is shown on a virtual clock, for here others may have the processor.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from virtual import virtual

from dobot_async import Magician
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import FILLER
from dobot_async.simulator import Faults, simulate

BENCHMARKS = Path(__file__).parent.parent / "benchmarks"
NEEDS = {"bench_ble.py": "dbus-daemon"}
NOTHING = ("overflow", "timeouts")
LINE = 0.0032  # seconds that a CP command and its acknowledgement take at 115200 baud
POINTS, STEP, SPEED = 600, 0.5, 100.0


@pytest.mark.full
@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
@pytest.mark.parametrize("name", sorted(path.name for path in BENCHMARKS.glob("bench_*.py")))
def test_runs_and_reports(name: str) -> None:
    needed = NEEDS.get(name)
    if needed and not shutil.which(needed) and not os.environ.get("DOBOT_REQUIRE_DBUS"):
        pytest.skip(f"{needed} is not installed")

    command = [sys.executable, "-W", "error", str(BENCHMARKS / name), "--json", "--quick"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    report = json.loads(done.stdout)
    assert report["rows"]
    for row in (report, *report["rows"]):
        assert not any(row.get(counter) for counter in NOTHING), row
        assert row.get("junk", 0) % len(FILLER) == 0  # that is sent to an arm that somebody else keeps from answering


@pytest.mark.full
def test_all_are_written_down_and_drawn(tmp_path: Path) -> None:
    results = tmp_path / "RESULTS.md"
    results.write_text("# Results\n\n<!-- parser -->\nold\n<!-- end of parser -->\n\nWords.\n")
    command = [sys.executable, str(BENCHMARKS / "run_all.py"), "--quick", "--only", "parser", "queue"]
    subprocess.run([*command, "--results", results, "--plots", tmp_path], check=True, timeout=100, capture_output=True)
    written = results.read_text()
    assert "old" not in written
    assert written.index("floor_frames_per_s") < written.index("Words.") < written.index("ptp_per_s")
    assert (tmp_path / "bench-queue.png").read_bytes().startswith(b"\x89PNG")


@virtual
async def test_the_arm_never_waits_for_its_host() -> None:
    async with simulate(faults=Faults(latency=LINE / 2)) as sim, Magician.connect(sim.url) as arm:
        await arm.request(c.SET_CP_PARAMS, c.CPParams(plan_acc=20_000.0, junction_vel=SPEED, acc=20_000.0))
        await arm.request(c.SET_CP_COMMON_PARAMS, c.CPCommonParams(100.0, 100.0))
        await arm.move_to(230, -30, 40)
        await arm.queue.wait(0.5)
        async with arm.queue.batch() as batch:
            for number in range(POINTS):
                # Out and back, so that it stays within reach; the simulated arm takes the turn without slowing down.
                y = STEP * (number % 100 if number // 100 % 2 == 0 else 100 - number % 100)
                last = batch.put(c.SET_CP_CMD, c.CPCmd(c.CPMode.ABSOLUTE, 230.0, y - 30.0 + STEP, 40.0))

        await last
        path = [each for each in sim.arm.executed if each.command is c.SET_CP_CMD]
        assert len(path) == POINTS
        assert all(then.started == now.finished for now, then in pairwise(path))
        # The first one speeds up, the last one slows down; no other may take longer than its length at full speed.
        assert max(each.finished - each.started for each in path[1:-1]) < 1.01 * STEP / SPEED
        assert sim.arm.counters.overflowed == 0
