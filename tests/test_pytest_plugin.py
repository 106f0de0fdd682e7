"""The pytest plugin, in test suites of its users: each runs as a process of its own, with warnings as errors."""

from __future__ import annotations

import re
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

from dobot_async.simulator import Simulation

PAGE = Path(__file__).parents[1] / "docs" / "testing-your-application.md"
SUITE = """
import pytest
from dobot_async import Magician
from dobot_async.simulator import DeviceOptions

pytestmark = [pytest.mark.asyncio, pytest.mark.dobot(speed=100, seed=3)]

async def drive(url):
    async with Magician.connect(url) as arm:
        await arm.move_to(220, 0, 40)

async def test_simulated(simulated_arm):
    await drive(simulated_arm.url)
    assert [each.name for each in simulated_arm.arm.executed].count("SetPTPCmd") == 1
    assert not simulated_arm.faults.any

async def test_faulty(faulty_arm):
    faults = faulty_arm.faults
    assert min(faults.loss, faults.corrupt, faults.dup, faults.latency, faults.jitter) > 0
    await drive(faulty_arm.url)
    assert "SetPTPCmd" in [each.name for each in faulty_arm.arm.executed]

@pytest.mark.dobot(loss=0.25, dup=0, listen="tcp://127.0.0.1:0", options=DeviceOptions(capacity=1))
class TestMarked:
    @pytest.mark.dobot(loss=0.125, seed=4)
    async def test_the_nearest_mark_wins(self, faulty_arm, dobot_settings):
        assert (faulty_arm.faults.loss, faulty_arm.faults.dup) == (0.125, 0)
        assert (dobot_settings["seed"], dobot_settings["speed"]) == (4, 100)
        assert faulty_arm.url.startswith("tcp:")
        assert faulty_arm.arm.device.left_space == 1
        await drive(faulty_arm.url)

async def test_both(simulated_arm, faulty_arm):
    assert simulated_arm.url != faulty_arm.url
"""

SCENE_SUITE = """
import pytest
from dobot_async import Magician, MyCobot, UltraArm
from dobot_async.simulator.scene import Mount, Piece, Scene

pytestmark = [pytest.mark.asyncio, pytest.mark.dobot(dup=0)]

@pytest.fixture
def dobot_scene():
    return Scene(pieces=[Piece("red", (250, 0), color="red")])

async def carry(url):
    async with Magician.connect(url) as arm:
        await arm.home()
        for (x, y), on in (((250, 0), True), ((200, 100), False)):
            await arm.move_to(x, y, 20)
            await arm.move_to(x, y, -53.5)
            await arm.suction(on)
            await arm.wait(0.3)
            await arm.move_to(x, y, 20)

async def test_a_piece_is_carried(simulated_arm, dobot_scene):
    assert simulated_arm.scene is dobot_scene
    await carry(simulated_arm.url)
    assert dobot_scene.pieces["red"].position == pytest.approx((200, 100, -138), abs=0.1)

@pytest.mark.parametrize("line", ["good", "wifi", "ble", "cable"])
async def test_on_any_line(request, simulate_arm, dobot_scene, line):
    sim = await simulate_arm(line=None if line == "good" else line)
    assert sim.faults.any == (line != "good")
    await carry(sim.url)
    assert dobot_scene.pieces["red"].position == pytest.approx((200, 100, -138), abs=0.1)

@pytest.mark.dobot(mount=Mount(x=50, name="left"))
async def test_two_arms(simulated_arm, simulate_arm, dobot_scene):
    right = await simulate_arm("ultraarm", mount=Mount(x=500, yaw=180, name="right"))
    async with Magician.connect(simulated_arm.url) as one, UltraArm.connect(right.url) as other:
        await other.home()
        await one.home()
        await one.move_to(200, 0, 0)
        await one.move_to(200, 0, -53.5)
        await one.suction(True)
        await one.wait(0.3)
        assert dobot_scene.pieces["red"].on == "tool of left"
    assert right.scene is dobot_scene
"""
FAMILIES_SUITE = """
import pytest
from dobot_async import MyCobot, UltraArm

pytestmark = pytest.mark.asyncio

@pytest.mark.dobot(model="mycobot280", line="wifi")
async def test_a_cobot(simulated_arm):
    assert simulated_arm.faults.stall and not simulated_arm.faults.jitter
    async with MyCobot.connect(simulated_arm.url, model="mycobot280") as arm:
        await arm.move_joints(10, -20, 30, 0, 0, 0)
    assert simulated_arm.arm.joints[:3] == pytest.approx((10, -20, 30), abs=0.5)

@pytest.mark.dobot(model="ultraarm", loss=0)
async def test_an_ultraarm(faulty_arm):
    assert faulty_arm.faults.latency and not faulty_arm.faults.loss
    async with UltraArm.connect(faulty_arm.url) as arm:
        await arm.home()
        await arm.move_joints(10, 20, 30)
    assert faulty_arm.arm.angles.j1 == pytest.approx(10, abs=0.1)

@pytest.mark.dobot(homed=True)
async def test_homed(simulated_arm, simulate_arm):
    unhomed = await simulate_arm(homed=False)
    assert (simulated_arm.arm.homed, unhomed.arm.homed) == (True, False)

async def test_all(simulate_arm):
    arms = [await simulate_arm(model) for model in ("magician", "myarm300", "ultraarm")]
    assert len({each.url for each in arms}) == 3
"""


def run(directory: Path, suite: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Runs a test suite as a user does, away from the settings of this one."""
    (directory / "test_application.py").write_text(suite, encoding="utf-8")
    command = [sys.executable, "-W", "error", "-m", "pytest", "-W", "error", "--strict-markers", *options]
    if "no:asyncio" not in options:
        command += ["-o", "asyncio_default_fixture_loop_scope=function"]  # pytest-asyncio warns if it is not set

    return subprocess.run(command, cwd=directory, capture_output=True, text=True, timeout=120, check=False)


def passed(ran: subprocess.CompletedProcess[str]) -> int:
    """How many tests passed; no other outcome is one."""
    assert ran.returncode == 0, ran.stdout + ran.stderr
    found = re.search(r"=+ (\d+) passed in [^,]*=+$", ran.stdout.strip())
    assert found, ran.stdout
    return int(found[1])


@pytest.mark.cases(1)
@pytest.mark.parametrize("mode", ["auto", "strict"])
def test_both_modes_of_pytest_asyncio(tmp_path: Path, mode: str) -> None:
    assert passed(run(tmp_path, SUITE, "--asyncio-mode", mode)) == 4


@pytest.mark.full
def test_arms_stand_in_the_scene_of_the_suite(tmp_path: Path) -> None:
    assert passed(run(tmp_path, SCENE_SUITE)) == 6


@pytest.mark.full
def test_all_families_are_served(tmp_path: Path) -> None:
    assert passed(run(tmp_path, FAMILIES_SUITE)) == 4


@pytest.mark.full
def test_auto_mode_needs_no_mark(tmp_path: Path) -> None:
    suite = "async def test_unmarked(simulated_arm):\n    assert simulated_arm.url\n"
    assert passed(run(tmp_path, suite, "--asyncio-mode", "auto", "-p", "no:anyio")) == 1


@pytest.mark.full
def test_the_page_is_a_test_suite(tmp_path: Path) -> None:
    blocks = re.findall(r"^```python\n((?:.*\n)*?)```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    suite = "\n\n".join(blocks)
    assert passed(run(tmp_path, suite)) == suite.count("async def test_") > 0


@pytest.mark.full
def test_without_pytest_asyncio_the_arms_say_what_is_missing(tmp_path: Path) -> None:
    suite = "def test_other(): pass\n\ndef test_arm(simulated_arm): pass\n"
    hidden = "import sys\nsys.modules['pytest_asyncio'] = None\n"
    (tmp_path / "hidden.py").write_text(hidden, encoding="utf-8")
    ran = run(tmp_path, suite, "-p", "no:asyncio", "-p", "hidden")
    assert ran.returncode == 1
    assert "1 passed, 1 error" in ran.stdout
    assert "pip install pytest-asyncio" in ran.stdout


@pytest.mark.full
def test_a_wrong_mark_is_told(tmp_path: Path) -> None:
    suite = """
import pytest

@pytest.mark.dobot(spede=2)
async def test_misspelt(simulated_arm): pass

@pytest.mark.dobot(50)
async def test_without_a_name(simulated_arm): pass

@pytest.mark.dobot(loss=2)
async def test_no_probability(simulated_arm): pass

@pytest.mark.dobot(line="wlan")
async def test_no_line(simulated_arm): pass

@pytest.mark.dobot(mount=None)
async def test_a_mount_without_a_scene(simulated_arm): pass

async def test_a_misspelt_setting(simulate_arm):
    await simulate_arm(spede=2)
"""
    ran = run(tmp_path, suite, "--asyncio-mode", "auto")
    assert "1 failed, 5 errors in" in ran.stdout
    assert "@pytest.mark.dobot takes no spede; it is dobot(listen=" in ran.stdout
    assert "@pytest.mark.dobot takes no 50; it is dobot(listen=" in ran.stdout
    assert "loss is a probability, 0 to 1, not 2" in ran.stdout
    assert "there is no line 'wlan'; there are: bad, wifi, ble, cable" in ran.stdout
    assert "have a fixture dobot_scene that returns one" in ran.stdout
    assert "simulate_arm takes no spede; it is dobot(listen=" in ran.stdout


@pytest.mark.full
def test_the_seed_is_the_tests_own_and_told_when_it_fails(tmp_path: Path) -> None:
    suite = """
import pytest

@pytest.mark.parametrize("case", [1, 2])
async def test_arm(faulty_arm, case):
    assert not case
"""
    ran = run(tmp_path, suite, "--asyncio-mode", "auto")
    assert ran.returncode == 1
    seeds = re.findall(r"^simulated with .*'seed': (\d+)", ran.stdout, re.MULTILINE)
    assert seeds == [str(zlib.crc32(f"test_application.py::test_arm[{case}]".encode())) for case in (1, 2)]


@pytest.mark.full
def test_the_mark_is_listed(tmp_path: Path) -> None:
    assert "@pytest.mark.dobot(listen=..." in run(tmp_path, "", "--markers").stdout


@pytest.mark.full
def test_loading_the_plugin_brings_in_nothing_that_is_not_used_yet(tmp_path: Path) -> None:
    suite = """
import sys

def test_imports(pytestconfig):
    assert pytestconfig.pluginmanager.has_plugin("dobot_async")
    late = {"serial", "serial_asyncio", "bleak", "click", "rich", "dobot_async.simulator", "dobot_async.cli"}
    assert not late & sys.modules.keys()
"""
    assert passed(run(tmp_path, suite)) == 1


async def test_it_serves_this_suite_too(simulated_arm: Simulation) -> None:
    assert simulated_arm.url.startswith("sim://")
