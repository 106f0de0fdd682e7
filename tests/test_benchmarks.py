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
from xml.etree import ElementTree as ET

import pytest
from virtual import virtual

from benchmarks import svg
from benchmarks.__main__ import NAMES
from benchmarks.targets import TARGETS, verdicts
from dobot_async import Magician
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import FILLER
from dobot_async.simulator import Faults, simulate

BENCHMARKS = Path(__file__).parent.parent / "benchmarks"
NEEDS = {"bench_ble": "dbus-daemon"}
NOTHING = ("overflow", "timeouts")
LINE = 0.0032  # seconds that a CP command and its acknowledgement take at 115200 baud
POINTS, STEP, SPEED = 600, 0.5, 100.0


@pytest.mark.full
@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
@pytest.mark.parametrize("name", sorted(path.stem for path in BENCHMARKS.glob("bench_*.py")))
def test_runs_and_reports(name: str) -> None:
    needed = NEEDS.get(name)
    if needed and not shutil.which(needed) and not os.environ.get("DOBOT_REQUIRE_DBUS"):
        pytest.skip(f"{needed} is not installed")

    command = [sys.executable, "-W", "error", "-m", f"benchmarks.{name}", "--json", "--quick"]
    done = subprocess.run(command, cwd=BENCHMARKS.parent, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    report = json.loads(done.stdout)
    assert report["rows"]
    for row in (report, *report["rows"]):
        assert not any(row.get(counter) for counter in NOTHING), row
        assert row.get("junk", 0) % len(FILLER) == 0  # that is sent to an arm that somebody else keeps from answering


def test_all_are_known_to_the_command() -> None:
    assert {f"bench_{name}" for name in NAMES} == {path.stem for path in BENCHMARKS.glob("bench_*.py")}


@pytest.mark.full
def test_what_was_found_is_written_down_quoted_and_drawn(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("Before.\n<!-- figures: lateness -->\nold\n<!-- end of figures -->\nBehind.\n")
    command = [sys.executable, "-m", "benchmarks", "parser", "lateness", "--quick", "--docs", str(tmp_path)]
    subprocess.run(
        [*command, "--results", str(tmp_path / "RESULTS.md")],
        check=True,
        cwd=BENCHMARKS.parent,
        timeout=100,
        capture_output=True,
    )
    written = (tmp_path / "RESULTS.md").read_text()
    assert written.index("## Targets") < written.index("floor_frames_per_s") < written.index("late_p50_ms")
    quoted = page.read_text()
    assert "old" not in quoted
    assert quoted.index("Before.") < quoted.index("late_p50_ms") < quoted.index("Behind.")
    plot = ET.fromstring((tmp_path / "bench-lateness.svg").read_text())
    assert plot.tag == "{http://www.w3.org/2000/svg}svg"


def test_targets_are_judged_by_the_rows_that_they_name() -> None:
    slow = {"link": "115200 baud", "client": "dobot_async", "late_p50_ms": 4.6, "late_worst_ms": 7.2}
    families = [
        {"family": "myArm", "client": "dobot_async", "late_p50_ms": 37.0},
        {"family": "myArm", "client": "pymycobot (myArm)", "late_p50_ms": 76.0},
    ]
    found = {"completion": [slow | {"link": "pty", "late_p50_ms": 99.0}, slow], "families": families}
    verdict = {row["target"]: row["verdict"] for row in verdicts(found)}
    assert verdict["end of a motion, median, ms, 115200 baud"] == "pass"
    assert verdict["end of a motion, worst of 100, ms, 115200 baud"] == "FAIL"
    assert verdict["myArm: how late its end is noticed, beside pymycobot"] == "pass"
    assert verdict["ultraArm: how late its end is noticed, beside pymycobot"] == "not measured"


@pytest.mark.full
def test_each_target_names_a_column_that_its_benchmark_has() -> None:
    command = [sys.executable, "-m", "benchmarks.bench_startup", "--json", "--quick"]
    done = subprocess.run(command, cwd=BENCHMARKS.parent, capture_output=True, text=True, timeout=100, check=True)
    found = {"startup": json.loads(done.stdout)["rows"]}
    wanted = [target for target in TARGETS if target.benchmark == "startup"]
    assert wanted
    assert all(target.figure(found) is not None for target in wanted)


def test_plots_are_xml_with_a_shape_for_each_value() -> None:
    drawn = svg.bars("a < b", {"x": {"one": 1.0, "two": 2000.0}, "y": {"two": 3.0}}, log=True)
    ET.fromstring(drawn)
    assert drawn.count("<rect") == 1 + 2 + 3  # the page, what the colours mean, the bars
    drawn = svg.lines("s", "s", {"one": [(0.0, 0.0), (1.0, 2.0)], "two": [(0.0, 1.0), (2.0, 3.0)]})
    ET.fromstring(drawn)
    assert drawn.count("<polyline") == 2


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
