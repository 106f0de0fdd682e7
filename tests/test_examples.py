"""Each program in examples/ does what it says, as a process of its own, and prints nothing to stderr."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dobot_async import Kinematics
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import simulate

EXAMPLES = Path(__file__).parents[1] / "examples"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
SLOW_MACHINE = re.compile(r"^Executing <.*> took [\d.]+ seconds\n", re.MULTILINE)


def start(name: str, *arguments: str) -> subprocess.Popen[str]:
    """Starts an example."""
    return subprocess.Popen(
        [sys.executable, "-u", "-X", "dev", "-W", "error", str(EXAMPLES / name), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={name: value for name, value in os.environ.items() if name != "DOBOT_URL"},
    )


def run(name: str, *arguments: str) -> str:
    """Runs an example to its end, and returns what it printed."""
    with start(name, *arguments) as process:
        output, errors = process.communicate()

    # In its debug mode asyncio remarks on callbacks that took longer than 0.1 s, which is the machine's fault.
    assert SLOW_MACHINE.sub("", errors) == ""
    assert process.returncode == 0
    return output


def numbers(line: str) -> list[float]:
    return [float(number) for number in NUMBER.findall(line)]


def line_with(output: str, word: str) -> str:
    (line,) = [line for line in output.splitlines() if word in line]
    return line


def check_connect_and_read(output: str) -> None:
    """The pose that the arm tells is the one that its joints give."""
    joints = numbers(line_with(output, "joints"))
    tool = numbers(line_with(output, "tool"))
    assert tool == pytest.approx(Kinematics().forward(*joints), abs=0.05)
    assert tool == pytest.approx(numbers(line_with(output, "computed")), abs=0.05)
    requests, replies, _ = numbers(line_with(output, "link"))
    assert requests == replies > 0


def check_pick_and_place(output: str) -> None:
    assert [numbers(line) for line in output.splitlines()] == [[1], [2], [3]]


def check_cp_drawing(output: str) -> None:
    """Each of the points got an index of its own, nothing came between, and the curve is closed."""
    first, last = numbers(line_with(output, "accepted"))
    assert last - first + 1 == 1000
    (distance,) = numbers(line_with(output, "drawn"))
    assert distance < 0.05


def check_jog(output: str) -> None:
    before, after = numbers(line_with(output, "->"))
    assert before < after
    turns = [numbers(line.removeprefix("j1"))[0] for line in output.splitlines() if line.startswith("j1")]
    assert turns == sorted(set(turns))


def check_io_and_conveyor(output: str) -> None:
    assert re.findall(r"lamp +(on|off)", output) == ["on", "off", "off"]
    value, highest = numbers(line_with(output, "knob"))
    assert 0 <= value <= highest


def check_two_arms(output: str) -> None:
    lines = output.splitlines()
    assert "left reached (240, 20, 40)" in lines
    assert "right reached (400, 0, 40)" not in lines
    assert "0x11" in line_with(output, "right failed")
    assert lines[-2].startswith("left stopped at")


def check_error_handling(output: str) -> None:
    kinds = [line.split(":")[0] for line in output.splitlines()]
    assert kinds == ["wrong port", "checked before", "told by the arm", "too slow", "stopped", "and the arm goes on"]


def check_mirror_hand_guided(output: str) -> None:
    """The follower went where the leader was guided, on the other side."""
    places = [numbers(line) for line in output.splitlines()]
    assert places[0] == pytest.approx(Kinematics().forward(0, 45, 45, 0)[:3], abs=0.1)
    assert places[1:] == [[200 + 5 * step, -4 * step, 40 + step] for step in range(1, 11)]


def check_ble_to_websocket_bridge(output: str) -> None:
    """Through WebSocket comes the pose of an arm that was just switched on."""
    assert numbers(line_with(output, "pose")) == pytest.approx((259.10, 0, -8.49, 0), abs=0.01)


def check_zenoh_two_processes(output: str) -> None:
    """What was published is where the arm was moved."""
    lines = output.splitlines()
    assert lines[0] == "served at zenoh://left"
    assert [numbers(line) for line in lines[1:]] == [[200, 0, 40], [230, 0, 40], [260, 0, 40], [260, 0, 40]]


def check_handover(output: str) -> None:
    """The arms take turns."""
    words = ["left has put down part", "right has fetched part"]
    assert output.splitlines() == [f"{word} {part}" for part in (1, 2, 3) for word in words]


def check_conveyor_three_arms(output: str) -> None:
    """Each part is picked once, in order, and every arm has its share."""
    *picked, total = output.splitlines()
    assert [numbers(line)[1] for line in picked] == list(range(1, 10))
    assert [line.split()[1] for line in picked[:3]] == ["1", "2", "3"]
    assert sum(numbers(total)[1::2]) == 9


def check_mixed_cell(output: str) -> None:
    (skew,) = numbers(line_with(output, "started within"))
    assert skew >= 0
    assert output.splitlines()[-1] == "each was in the middle"


def check_mycobot_pick(output: str) -> None:
    assert output.splitlines()[:2] == ["picked up", "put down"]
    assert numbers(line_with(output, "joints")) == pytest.approx([-30, -30, -60, 0, 0, 0], abs=0.1)


def check_ultraarm_gcode(output: str) -> None:
    """Each line was told, in order, and the square is closed."""
    *lines, last = output.splitlines()
    assert [numbers(line)[0] for line in lines] == [1, 2, 3, 4, 5, 6]
    assert numbers(last) == [200, -20, 60]


def check_color_sorter(output: str) -> None:
    """An arm without anything around it finds nothing to sort; the rest is tested in a scene."""
    assert output == ""


def check_rail_pick_and_place(output: str) -> None:
    assert [numbers(line) for line in output.splitlines()] == [[number, 700] for number in (1, 2, 3)]


def check_svg_drawing(output: str) -> None:
    """The heart: four curves of 24 points each, its beginning and its end; and a line."""
    assert [numbers(line) for line in output.splitlines()] == [[98], [2]]


def check_follow_target(output: str) -> None:
    """It went on all the time, and stands at the end of the trajectory."""
    (sent,), place = (numbers(line) for line in output.splitlines())
    assert sent > 8
    assert place == pytest.approx([200, 0, 40], abs=1)


def check_teach_and_play(output: str) -> None:
    assert numbers(output) == [6]


def check_palletise(output: str) -> None:
    """Without a sensor nothing has a colour, and one pallet has room for four."""
    assert [line.partition(",")[0] for line in output.splitlines()] == ["stacks a part"] * 4 + ["puts back a part"] * 2


def check_camera_sorter(output: str) -> None:
    """It sorts what it has drawn itself; what it does with a picture is in test_scene_examples.py."""
    assert [numbers(line) for line in output.splitlines()] == [[0], [210, -60], [240, 40]]


def check_mcp_session(output: str) -> None:
    """The plan tells which step cannot be done, and the others are done."""
    tools, planned, *done = output.splitlines()
    assert "move" in tools
    assert planned == "planned with a picture; step 3 cannot be done"
    assert done == ["done: move", "done: draw"]


def check_mqtt_session(output: str) -> None:
    """Only who has the lease moves the arm, and only where it reaches."""
    outcomes = [line.split(": ", 1)[1] for line in output.splitlines()]
    assert outcomes == ["refused (Refused)", "done", "done", "refused (Unreachable)", "done"]


def check_sync_pick_and_place(output: str) -> None:
    assert [numbers(line) for line in output.splitlines()] == [[1], [2], [3]]


def check_sync_two_arms(output: str) -> None:
    assert [numbers(line) for line in output.splitlines()] == [[200], [200]]


CHECKS: dict[str, Callable[[str], None]] = {
    "connect_and_read.py": check_connect_and_read,
    "pick_and_place.py": check_pick_and_place,
    "cp_drawing.py": check_cp_drawing,
    "jog.py": check_jog,
    "io_and_conveyor.py": check_io_and_conveyor,
    "two_arms.py": check_two_arms,
    "error_handling.py": check_error_handling,
    "mirror_hand_guided.py": check_mirror_hand_guided,
    "handover.py": check_handover,
    "conveyor_three_arms.py": check_conveyor_three_arms,
    "mixed_cell.py": check_mixed_cell,
    "ble_to_websocket_bridge.py": check_ble_to_websocket_bridge,
    "zenoh_two_processes.py": check_zenoh_two_processes,
    "mycobot_pick.py": check_mycobot_pick,
    "ultraarm_gcode.py": check_ultraarm_gcode,
    "color_sorter.py": check_color_sorter,
    "rail_pick_and_place.py": check_rail_pick_and_place,
    "svg_drawing.py": check_svg_drawing,
    "follow_target.py": check_follow_target,
    "teach_and_play.py": check_teach_and_play,
    "palletise.py": check_palletise,
    "camera_sorter.py": check_camera_sorter,
    "mcp_session.py": check_mcp_session,
    "mqtt_session.py": check_mqtt_session,
    "sync_pick_and_place.py": check_sync_pick_and_place,
    "sync_two_arms.py": check_sync_two_arms,
}


def test_each_example_is_checked() -> None:
    assert {path.name for path in EXAMPLES.glob("*.py")} == set(CHECKS)


@pytest.mark.cases(1)
@pytest.mark.parametrize("name", CHECKS)
def test_example(name: str) -> None:
    CHECKS[name](run(name))


@pytest.mark.full
async def test_pick_and_place_sucks_and_lets_go_where_it_should() -> None:
    async with simulate(listen="tcp://127.0.0.1:0", speed=20) as sim:
        await asyncio.to_thread(run, "pick_and_place.py", sim.url)
        places, at = [], None
        for each in sim.arm.executed:
            at = each.value if each.command is c.SET_PTP_CMD else at
            if each.command is c.SET_END_EFFECTOR_SUCTION_CUP and each.index is not None:
                assert at is not None
                places.append((each.value.is_sucked, at.x, at.y, at.z))

    rows = ((True, 220.0), (False, 260.0))
    assert places == [(sucks, x, y, 20.0) for y in (-40.0, 0.0, 40.0) for sucks, x in rows]


@pytest.mark.full
async def test_io_and_conveyor_tells_what_the_world_puts_in() -> None:
    async with simulate(listen="tcp://127.0.0.1:0", speed=20) as sim:
        sim.arm.set_input(4, 1)
        sim.arm.set_adc(5, 1234)
        output = await asyncio.to_thread(run, "io_and_conveyor.py", sim.url)
        ways = [each.value.speed for each in sim.arm.executed if each.command is c.SET_E_MOTOR_S]

    assert line_with(output, "switch").split() == ["switch", "high"]
    assert numbers(line_with(output, "knob")) == [1234, 4095]
    assert len(ways) == 2
    assert sum(ways) == 0


@pytest.mark.full
async def test_the_mirror_follows_a_hand_until_ctrl_c() -> None:
    async with (
        simulate(listen="tcp://127.0.0.1:0", speed=20) as leader,
        simulate(listen="tcp://127.0.0.1:0", speed=20) as follower,
    ):
        with start("mirror_hand_guided.py", leader.url, follower.url) as process:
            assert process.stdout is not None
            await asyncio.to_thread(process.stdout.readline)
            leader.arm.guide_to(220, 30, 50)
            line = await asyncio.to_thread(process.stdout.readline)
            process.send_signal(signal.SIGINT)
            await asyncio.to_thread(process.communicate)

        assert numbers(line) == [220, -30, 50]
        assert follower.arm.device.idle
        assert not leader.arm.executed


@pytest.mark.full
async def test_ctrl_c_stops_the_arm() -> None:
    async with simulate(listen="tcp://127.0.0.1:0", speed=10) as sim:
        with start("pick_and_place.py", sim.url) as process:
            assert process.stdout is not None
            await asyncio.to_thread(process.stdout.readline)
            process.send_signal(signal.SIGINT)
            await asyncio.to_thread(process.communicate)

        assert sim.arm.device.idle
        assert "aborted" in {each.outcome for each in sim.arm.executed}
