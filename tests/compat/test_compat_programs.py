"""Ten programs of other libraries, with one import changed: each leaves every part where it belongs."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest
from compat_jobs import EXAMPLES, JOBS, MOTIONS, Run, run

ORIGINALS = {"pydobot": "pydobot", "pydobotplus": "pydobotplus", "dll": "DobotDllType", "dobotlab": "DobotEDU"}
SLOW = 10  # times as fast as a real arm, so that a test can be in time
BLOCKED = 0x22  # met a joint's limit on the way
programs = pytest.mark.parametrize("program", JOBS)


@programs
def test_one_import_is_changed(program: str) -> None:
    """Of the lines that import this package there is one, and it says which one it was."""
    text = (EXAMPLES / program).read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if "import" in line and "dobot_async" in line]
    now, _, was = line.partition("  # was: ")
    assert ORIGINALS[program.partition("_")[0]] in was
    assert set(re.findall(r"\w+", was)) - {"DobotEDU", "dobotplus"} <= set(re.findall(r"\w+", now))
    assert text.count("dobot_async") == 1


@pytest.mark.full
@programs
async def test_every_part_is_where_it_belongs(program: str) -> None:
    job = JOBS[program]
    ended = await run(job)
    assert (ended.code, ended.errors) == (0, "")
    job.check(ended.scene)


@pytest.mark.cases(1)
@programs
async def test_a_lost_reply_changes_nothing(program: str) -> None:
    """The arm has taken the motions whose replies were lost: none is made twice, and none is left out."""
    job = JOBS[program]
    ended = await run(job, lose=2)
    assert (ended.code, ended.errors) == (0, "")
    assert sum(line.lost for line in ended.lines) >= 2
    job.check(ended.scene)


@pytest.mark.full
@programs
async def test_an_alarm_is_raised(program: str) -> None:
    """The program ends with what the alarm is, and the arm makes no motion after it."""
    alarms = []

    async def block(going: Run) -> None:
        await going.in_the_middle()
        sim = going.sims[0]
        await going.until(lambda: not sim.arm.device.idle)
        sim.arm.raise_alarm(BLOCKED)
        alarms.append(len(sim.arm.executed))

    ended = await run(replace(JOBS[program], speed=SLOW), block)
    assert "ArmAlarm" in ended.errors
    assert f"0x{BLOCKED:02X}" in ended.errors
    done = [each for each in ended.sims[0].arm.executed[alarms[0] :] if each.command in MOTIONS]
    assert "done" not in {each.outcome for each in done}


@pytest.mark.full
@programs
async def test_ctrl_c_stops_the_arms(program: str) -> None:
    """Ctrl-C comes out as KeyboardInterrupt, wherever the program is, and nothing moves after it."""

    async def press(going: Run) -> None:
        await going.in_the_middle()
        going.interrupt()

    ended = await run(replace(JOBS[program], speed=SLOW), press)
    assert "KeyboardInterrupt" in ended.errors
    assert ended.code
    for sim in ended.sims:
        assert sim.arm.device.idle
        motions = [each.outcome for each in sim.arm.executed if each.command in MOTIONS]
        assert set(motions) <= {"done", "aborted"}


@pytest.mark.full
async def test_the_drawing_is_on_the_paper() -> None:
    """pydobot cannot say that there is a pen, which is 1.3 mm longer than a cup."""
    ended = await run(JOBS["pydobot_drawing.py"])
    square, circle = ended.scene.drawing
    for corner in ((250, 20), (250, -20), (210, -20), (210, 20)):
        assert min(math.dist(corner, point[:2]) for point in square) < 2

    assert all(13 < math.dist((230, 0), point[:2]) < 17 for point in circle)
