"""The command line, run as processes; the arm that they reach is simulated here, so that its side can be looked at."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import sys
import threading
import time
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from click.testing import CliRunner

from dobot_async import Command, Magician, Pen
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Parser
from dobot_async.cli.main import cli
from dobot_async.program import VOCABULARIES
from dobot_async.simulator import Simulation, simulate

MODULE = (sys.executable, "-W", "error", "-m", "dobot_async")
POSE_KEYS = ["x", "y", "z", "r", "j1", "j2", "j3", "j4"]
LONG_PROGRAM = "\n".join(f"move 200 {-60 if line % 2 else 60} 50" for line in range(200))
FAST = 50.0
ON_A_DEAD_LINE = 3.0  # seconds: two, and the end of the interpreter


class Done(NamedTuple):
    """What a process left behind."""

    code: int
    output: str
    errors: str

    @property
    def answer(self) -> Any:
        """The one JSON object that is all of the output."""
        assert self.output.endswith("\n")
        assert self.output.count("\n") == 1
        return json.loads(self.output)


async def start(
    *arguments: str, stdin: int | None = None, stdout: int = PIPE, environment: Mapping[str, str] = {}
) -> Process:
    names = {name: value for name, value in os.environ.items() if name != "DOBOT_URL"}
    return await asyncio.create_subprocess_exec(
        *MODULE, *arguments, stdin=stdin, stdout=stdout, stderr=PIPE, env={**names, **environment}
    )


async def finish(process: Process, text: str | None = None) -> Done:
    output, errors = await process.communicate(text if text is None else text.encode())
    assert process.returncode is not None
    return Done(process.returncode, (output or b"").decode(), errors.decode())


async def run(*arguments: str, text: str | None = None, **environment: str) -> Done:
    stdin = asyncio.subprocess.DEVNULL if text is None else PIPE
    return await finish(await start(*arguments, stdin=stdin, environment=environment), text)


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Lets the threads end with which asyncio waits for processes; they outlive these for a moment."""
    yield
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)


@pytest.fixture
async def sim() -> AsyncIterator[Simulation]:
    async with simulate(listen="tcp://127.0.0.1:0", speed=FAST) as simulation:
        yield simulation


@asynccontextmanager
async def busy(sim: Simulation) -> AsyncIterator[None]:
    """While this is entered, another program moves the arm."""
    async with Magician.connect(sim.url) as arm:
        for _ in range(10):
            await arm.queue.wait(1000)
            await arm.queue.move_to(200, 0, 50)

        yield


async def until_moving(sim: Simulation) -> None:
    """Returns when the arm tells that it moves."""
    async with Magician.connect(sim.url, control=False) as arm:
        start = await arm.get_pose()
        while await arm.get_pose() == start:
            pass


def names(sim: Simulation, outcome: str = "done") -> list[str]:
    """What the arm has executed of its queue, in order, without the waits of 0 ms that count."""
    return [
        each.name
        for each in sim.arm.executed
        if each.outcome == outcome and each.index is not None and each.value != c.WAITCmd(0)
    ]


# --- the answers ---


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("arguments", "keys"),
    [
        (["info"], ["serial_number", "name", "version"]),
        (["pose"], POSE_KEYS),
        (["alarms"], ["alarms"]),
        (["alarms", "--clear"], ["alarms"]),
        (["home"], POSE_KEYS),
        (["move", "200", "-20", "50"], POSE_KEYS),
        (["jog", "x+", "0.01"], POSE_KEYS),
        (["suction", "on"], ["suction"]),
        (["stop"], ["stopped"]),
        (["monitor", "--count", "1"], ["time", "pose", "alarms", "left_space", "index"]),
    ],
    ids=lambda value: value[0],
)
async def test_an_answer_is_one_json_object(arguments: list[str], keys: list[str]) -> None:
    done = await run("--json", "--url", "sim:?speed=50", *arguments)
    assert list(done.answer) == keys
    assert (done.code, done.errors) == (0, "")


@pytest.mark.full
async def test_text_is_plain_in_a_pipe(sim: Simulation) -> None:
    for arguments in (["home"], ["info"], ["monitor", "--count", "2"]):
        done = await run("--url", sim.url, *arguments)
        assert done.code == 0
        assert all(line.isprintable() for line in done.output.splitlines())
        assert done.errors == ""


@pytest.mark.full
async def test_the_url_may_be_in_the_environment(sim: Simulation) -> None:
    assert (await run("--json", "pose", DOBOT_URL=sim.url)).answer["x"] == pytest.approx(sim.arm.pose.x)


async def test_a_motion_is_done_when_its_command_ends(sim: Simulation) -> None:
    done = await run("--json", "--url", sim.url, "move", "210", "-30", "-5.5", "12", "--mode", "movl")
    pose = sim.arm.pose
    assert (pose.x, pose.y, pose.z, pose.r) == pytest.approx((210, -30, -5.5, 12), abs=0.01)
    assert done.answer["z"] == pytest.approx(-5.5, abs=0.01)
    assert sim.arm.executed[-1].value.ptp_mode is c.PTPMode.MOVL_XYZ


@pytest.mark.full
async def test_alarms_are_told_and_cleared(sim: Simulation) -> None:
    sim.arm.device.raise_alarm(0x22)
    done = await run("--json", "--url", sim.url, "alarms")
    assert 0x22 in [alarm["code"] for alarm in done.answer["alarms"]]
    assert "MOVE_INV_LIMIT" in (await run("--url", sim.url, "alarms")).output
    assert (await run("--json", "--url", sim.url, "alarms", "--clear")).answer == {"alarms": []}
    assert sim.arm.alarms == ()
    assert (await run("--url", sim.url, "alarms")).output == "no alarms\n"


@pytest.mark.full
async def test_suction_takes_effect(sim: Simulation) -> None:
    await run("--url", sim.url, "suction", "on")
    assert sim.arm.suction
    await run("--url", sim.url, "suction", "off")
    assert not sim.arm.suction


async def test_jog_goes_the_way_it_says_and_ends(sim: Simulation) -> None:
    before = sim.arm.pose.j1
    done = await run("--json", "--url", sim.url, "jog", "j1-", "0.01")
    assert done.answer["j1"] < before
    assert not sim.arm.device.moving


# --- beside a program that runs ---


@pytest.mark.full
@pytest.mark.parametrize("arguments", [["pose"], ["alarms", "--clear"], ["monitor", "--count", "3"], ["suction", "on"]])
async def test_who_only_looks_disturbs_nobody(sim: Simulation, arguments: list[str]) -> None:
    async with busy(sim):
        assert (await run("--url", sim.url, *arguments)).code == 0
        waiting = 32 - sim.arm.device.left_space
        assert waiting + len(names(sim)) >= 20
        assert names(sim, "aborted") == []


async def test_stop_ends_what_goes_on(sim: Simulation) -> None:
    async with busy(sim):
        assert (await run("--url", sim.url, "stop")).code == 0
        assert sim.arm.device.idle
        assert len(names(sim, "aborted")) == 1
        assert len(names(sim)) < 19


async def test_a_motion_throws_away_what_was_left(sim: Simulation) -> None:
    async with busy(sim):
        pass

    assert (await run("--url", sim.url, "move", "220", "10", "40")).code == 0
    assert sim.arm.executed[-1].value == c.PTPCmd(c.PTPMode.MOVJ_XYZ, 220, 10, 40)
    assert len(names(sim)) < 20


# --- what goes wrong ---


async def test_no_arm_is_one_line_and_exit_code_1() -> None:
    done = await run("--url", "serial:///dev/nowhere", "pose")
    assert (done.code, done.output) == (1, "")
    assert done.errors.count("\n") == 1
    assert done.errors.startswith("error: cannot open /dev/nowhere")


@pytest.mark.full
async def test_an_alarm_is_one_line_and_with_json_an_object(sim: Simulation) -> None:
    done = await run("--json", "--url", sim.url, "move", "900", "0", "0")
    assert done.code == 1
    assert done.errors.count("\n") == 1
    assert done.answer["error"] == "ArmAlarm"
    assert done.answer["message"] in done.errors
    assert [alarm["name"] for alarm in done.answer["alarms"]] == ["PLAN_INV_CALC"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["fly"],
        ["pose", "now"],
        ["--url", "foo:bar", "pose"],
        ["--url", "tcp://nohost", "pose"],
        ["--url", "sim:?fast=1", "pose"],
        ["--url", "sim:", "--arm", "puma", "pose"],
        ["--url", "sim:", "--trace", "/nowhere/at/all", "pose"],
        ["--url", "sim:", "move", "1", "2"],
        ["--url", "sim:", "move", "nan", "0", "0"],
        ["--url", "sim:", "move", "1", "2", "3", "--mode", "walk"],
        ["--url", "sim:", "jog", "up", "1"],
        ["--url", "sim:", "jog", "x+", "-1"],
        ["--url", "sim:", "suction", "maybe"],
        ["--url", "sim:", "run", "/nowhere/at/all"],
        ["--url", "tcp://127.0.0.1:1", "demo"],
        ["--url", "sim:", "demo", "--speed", "2"],
        ["monitor", "--rate", "0"],
        ["simulate", "--listen", "memory"],
        ["simulate", "--listen", "carrier-pigeon"],
        ["simulate", "--loss", "2"],
        ["decode", "AA", "A"],
        ["decode", "hello"],
    ],
    ids=" ".join,
)
def test_wrong_usage_is_exit_code_2(arguments: list[str]) -> None:
    done = CliRunner().invoke(cli, ["--json", *arguments], prog_name="dobot-async")
    assert (done.exit_code, done.stdout) == (2, "")
    assert "Error: " in done.stderr


@pytest.mark.full
async def test_without_a_url_the_forms_are_shown() -> None:
    done = await run("pose")
    assert done.code == 2
    for form in ("--url", "DOBOT_URL", "serial://", "udp://", "tcp://", "sim:"):
        assert form in done.errors


async def test_without_the_extra_one_line_tells_how_to_get_it() -> None:
    source = "import sys; sys.modules['click'] = None; from dobot_async.__main__ import main; main()"
    process = await asyncio.create_subprocess_exec(sys.executable, "-c", source, stdout=PIPE, stderr=PIPE)
    done = await finish(process)
    assert (done.code, done.output) == (2, "")
    assert done.errors.count("\n") == 1
    assert "pip install dobot-async[cli]" in done.errors


async def test_a_reader_that_leaves_is_no_error(sim: Simulation) -> None:
    read, write = os.pipe()
    process = await start("--url", sim.url, "monitor", "--rate", "1000", stdout=write)
    os.close(write)
    assert await asyncio.to_thread(os.read, read, 1)
    os.close(read)
    assert await finish(process) == (141, "", "")


# --- programs ---


@pytest.mark.full
async def test_a_program_is_executed_in_order(sim: Simulation, tmp_path: Path) -> None:
    file = tmp_path / "program.txt"
    file.write_text("\ufeff# a comment\n\nmove 200 0 50 mode=movl  # and another\nSuction on\nwait 0.5\nspeed 30 40\n")
    done = await run("--json", "--url", sim.url, "run", str(file))
    assert done.answer == {"file": str(file), "commands": 4}
    assert done.code == 0
    executed = [(each.name, each.value) for each in sim.arm.executed if each.value != c.WAITCmd(0)]
    assert executed == [
        ("SetPTPCmd", c.PTPCmd(c.PTPMode.MOVL_XYZ, 200, 0, 50)),
        ("SetEndEffectorSuctionCup", c.EndEffectorSuctionCup(True, True)),
        ("SetWAITCmd", c.WAITCmd(500)),
        ("SetPTPCommonParams", c.PTPCommonParams(30, 40)),
    ]


@pytest.mark.parametrize(
    ("line", "command", "value"),
    [
        ("home", c.SET_HOME_CMD, c.HOMECmd()),
        ("move 200 -2 3.5 4 mode=jump", c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.JUMP_XYZ, 200, -2, 3.5, 4)),
        ("joints 1 2 3 4", c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVJ_ANGLE, 1, 2, 3, 4)),
        ("by 0 0 -5", c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVL_INC, 0, 0, -5)),
        ("path 200 2 3", c.SET_CP_CMD, c.CPCmd(c.CPMode.ABSOLUTE, 200, 2, 3)),
        ("engrave 200 2 3 40", c.SET_CPLE_CMD, c.CPLECmd(c.CPMode.ABSOLUTE, 200, 2, 3, 40)),
        ("wait 0.25", c.SET_WAIT_CMD, c.WAITCmd(250)),
        ("wait-input 3 level=off", c.SET_TRIG_CMD, c.TRIGCmd(3, c.TriggerMode.IO, c.TriggerIOCondition.EQUAL, 0)),
        ("suction off", c.SET_END_EFFECTOR_SUCTION_CUP, c.EndEffectorSuctionCup(False, False)),
        ("gripper on", c.SET_END_EFFECTOR_GRIPPER, c.EndEffectorGripper(True, True)),
        ("laser on", c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(True, True)),
        ("pin 4 pwm", c.SET_IO_MULTIPLEXING, c.IOMultiplexing(4, c.IOFunction.PWM)),
        ("output 2 ON", c.SET_IODO, c.IODO(2, 1)),
        ("pwm 4 1000 50", c.SET_IOPWM, c.IOPWM(4, 1000, 50)),
        ("conveyor -5000 motor=1", c.SET_E_MOTOR, c.EMotor(1, True, -5000)),
        ("speed 20", c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(20, 20)),
        ("rail on version=2", c.SET_DEVICE_WITH_L, c.DeviceWithL(True, c.AccessoryVersion.V2)),
        ("tool pen", c.SET_END_EFFECTOR_PARAMS, Pen()),
        ("tool x=80 z=-5", c.SET_END_EFFECTOR_PARAMS, c.EndEffectorParams(80, 0, -5)),
    ],
    ids=str,
)
def test_each_verb_is_the_command_of_the_queue(line: str, command: Command[Any, Any], value: Any) -> None:
    (step,) = VOCABULARIES["magician"].parse([line])
    assert (step.number, step.text, step.verb) == (1, line, line.split(maxsplit=1)[0])
    assert (step.command, step.value) == (command, value)


@pytest.mark.full
async def test_a_program_longer_than_the_queue_runs_from_standard_input(sim: Simulation) -> None:
    done = await run("--url", sim.url, "run", "-", text="\n".join(LONG_PROGRAM.splitlines()[:80]))
    assert (done.code, done.errors) == (0, "")
    assert names(sim) == ["SetPTPCmd"] * 80


async def test_all_lines_are_checked_before_anything_is_sent(sim: Simulation) -> None:
    program = (
        "move 200 0 50\nfly\nmove 1 2\noutput 99 on\nsuction maybe\nmove 1 2 3 mode=walk\nwait 1 loops=2\nwait nan\n"
    )
    done = await run("--url", sim.url, "run", "-", text=program)
    assert (done.code, done.output) == (2, "")
    assert done.errors.count("\n") == 1
    assert done.errors.startswith("error: standard input: line 2: no verb 'fly' for the Magician; there are: home, ")
    assert done.errors.endswith("(wrong as well: lines 3, 4, 5, 6, 7, 8); nothing was sent\n")
    assert sim.arm.counters.requests == 0


async def test_an_alarm_names_the_line_and_ends_the_program(sim: Simulation) -> None:
    program = "wait 0.1\nby 900 0 0  # too far\n" + "move 200 0 50\n" * 50
    done = await run("--url", sim.url, "run", "-", text=program)
    assert done.code == 1
    assert done.errors.count("\n") == 1
    assert done.errors.startswith("error: line 2 (by 900 0 0): the arm raised alarms: 0x11")
    assert sim.arm.device.idle
    assert names(sim) == ["SetWAITCmd"]


@pytest.mark.full
async def test_an_alarm_behind_a_line_of_which_nobody_knows_names_both(sim: Simulation) -> None:
    done = await run("--url", sim.url, "run", "-", text="home\nby 900 0 0\nmove 200 0 50\n")
    assert done.code == 1
    assert re.match(r"error: (line 1 \(home\) or )?line 2 \(by 900 0 0\): the arm raised alarms: 0x1", done.errors)


# --- signals ---


@pytest.mark.cases(1)
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
async def test_a_signal_stops_the_arm(number: signal.Signals, code: int) -> None:
    async with simulate(listen="tcp://127.0.0.1:0") as sim:
        process = await start("--json", "--url", sim.url, "run", "-", stdin=PIPE)
        assert process.stdin
        process.stdin.write(LONG_PROGRAM.encode())
        process.stdin.write_eof()
        await until_moving(sim)
        process.send_signal(number)
        done = await finish(process)
        assert (done.code, done.output) == (code, "")
        assert done.errors == "interrupted; the arm was told to stop\n"
        assert sim.arm.device.idle
        assert "aborted" in [each.outcome for each in sim.arm.executed]


async def test_ctrl_c_ends_in_time_on_a_dead_line_and_says_what_is_not_known() -> None:
    async with simulate(listen="tcp://127.0.0.1:0") as sim:
        process = await start("--url", sim.url, "move", "200", "60", "50")
        await until_moving(sim)
        sim.faults.loss = 1.0
        began = time.monotonic()
        process.send_signal(signal.SIGINT)
        done = await finish(process)
        assert time.monotonic() - began < ON_A_DEAD_LINE
        assert (done.code, done.output) == (130, "")
        assert done.errors.count("\n") == 1
        assert done.errors.startswith("interrupted; the arm was told to stop; ")
        assert "it is not known whether the arm stands" in done.errors


@pytest.mark.full
async def test_an_impatient_ctrl_c_stops_the_arm_all_the_same() -> None:
    async with simulate(listen="tcp://127.0.0.1:0") as sim:
        process = await start("--url", sim.url, "move", "200", "60", "50")
        await until_moving(sim)
        while process.returncode is None:
            # Not send_signal: it asks for the exit code itself, and asyncio then no longer gets it.
            with suppress(ProcessLookupError):  # it has ended, and the loop is yet to hear of it
                os.kill(process.pid, signal.SIGINT)

            with suppress(TimeoutError):
                await asyncio.wait_for(process.wait(), 0.002)

        assert await process.wait() == 130
        assert sim.arm.device.idle
        assert "aborted" in [each.outcome for each in sim.arm.executed]


@pytest.mark.full
async def test_ctrl_c_ends_a_monitor_and_leaves_the_arm_alone(sim: Simulation) -> None:
    async with busy(sim):
        process = await start("--json", "--url", sim.url, "monitor", "--rate", "100")
        assert process.stdout
        await process.stdout.readline()
        process.send_signal(signal.SIGINT)
        done = await finish(process)
        assert (done.code, done.errors) == (130, "")
        assert names(sim, "aborted") == []


# --- the simulator as a process ---


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("listen", "scheme"), [("pty", "serial:///dev/"), ("tcp://127.0.0.1:0", "tcp://"), ("udp://127.0.0.1:0", "udp://")]
)
async def test_simulate_prints_its_url_first(listen: str, scheme: str) -> None:
    process = await start("simulate", "--arm", "magician", "--listen", listen, "--speed", "20")
    assert process.stdout
    url = (await process.stdout.readline()).decode().strip()
    assert url.startswith(scheme)
    assert (await run("--url", url, "move", "210", "0", "40")).code == 0
    async with Magician.connect(url, control=False) as arm:
        assert (await arm.get_pose()).x == pytest.approx(210, abs=0.01)

    process.terminate()
    assert await finish(process) == (143, "", "")


@pytest.mark.full
async def test_simulate_passes_the_faults_on() -> None:
    process = await start("--json", "simulate", "--listen", "tcp://127.0.0.1:0", "--noise", "1", "--seed", "1")
    assert process.stdout
    url = json.loads(await process.stdout.readline())["url"]
    async with Magician.connect(url, control=False) as arm:
        assert arm.link.stats.junk_bytes > 0

    process.send_signal(signal.SIGINT)
    assert (await finish(process)).code == 130


@pytest.mark.full
async def test_a_port_that_is_taken_is_exit_code_1(sim: Simulation) -> None:
    done = await run("simulate", "--listen", sim.url)
    assert (done.code, done.output) == (1, "")
    assert done.errors.count("\n") == 1


# --- frames ---

VECTORS = [
    ("AA AA 02 0A 00 F6", "GetPose", {"request": None}),
    (
        "AA AA 13 54 03 01 00 00 7A 43 00 00 00 00 00 00 00 00 00 00 00 00 EB",
        "SetPTPCmd",
        {"request": {"ptp_mode": "MOVJ_XYZ", "x": 250.0, "y": 0.0, "z": 0.0, "r": 0.0}},
    ),
    (
        "AA AA 08 87 03 00 01 F0 D8 FF FF AF",
        "SetEMotor",
        {"request": {"index": 0, "is_enabled": True, "speed": -10000}},
    ),
    ("AA AA 04 03 01 01 00 FB", "SetDeviceWithL", {"request": {"is_with_l": True, "version": "V1"}}),
    ("AA AA 02 03 01 FC", "SetDeviceWithL", {"reply": None}),
    ("AA AA 04 03 02 01 00 FA", "SetDeviceWithL", {"request": {"is_with_l": True, "version": "V1"}}),
    ("AA AA 0A 03 02 02 00 00 00 00 00 00 00 F9", "GetDeviceWithL", {"reply": {"index": 2}}),
    ("AA AA 02 01 00 FF", "GetDeviceName", {"request": None}),
    ("AA AA 08 01 01 48 65 6C 6C 6F 00 0A", "SetDeviceName", {"request": "Hello"}),
    (
        "AA AA 12 14 00 00 00 00 00 04 00 00 00 20 00 00 00 00 00 00 00 C8",
        "GetAlarmsState",
        {"reply": ["0x22 MOVE_INV_LIMIT", "0x45 LIMIT_AXIS3_NEG"]},
    ),
    ("AA AA 02 F5 01 0A", "SetQueuedCmdClear", {"request": None, "reply": None}),
    ("AA AA 02 FA 00 06", None, {}),
]


@pytest.mark.full
async def test_decode_knows_the_frames_of_real_arms() -> None:
    done = await run("--json", "decode", *(raw for raw, _, _ in VECTORS))
    pieces = done.answer["pieces"]
    assert [piece["raw"].upper() for piece in pieces] == [raw for raw, _, _ in VECTORS]
    for piece, (_, name, values) in zip(pieces, VECTORS, strict=True):
        assert piece["command"] == name
        assert {role: piece[role] for role in ("request", "reply") if role in piece} == values


@pytest.mark.full
async def test_decode_shows_junk_with_its_reason() -> None:
    good, wrong, cut = "AA AA 02 0A 00 F6", "AAAA13540301 00007A43 000000000000000000000000 EA", "aa:aa:13:54"
    pieces = (await run("--json", "decode", "0x01,0x02", good, wrong, good, cut)).answer["pieces"]
    assert [piece.get("junk") for piece in pieces] == [
        "no header",
        None,
        "the checksum is EA, EB would be right",
        None,
        "incomplete, 19 bytes are missing",
    ]
    assert [piece["offset"] for piece in pieces] == [0, 2, 8, 31, 37]


@pytest.mark.full
async def test_decode_knows_the_frames_of_a_mycobot() -> None:
    good = "FE FE 03 12 01 FA"
    done = await run("--json", "--arm", "mycobot", "decode", "07", good, "FE FE 02 29 FA", "FE FE 02 29 FB")
    junk, power, stop, wrong = done.answer["pieces"]
    assert (junk["junk"], junk["offset"]) == ("no header", 0)
    assert (power["command"], power["reply"], "request" in power) == ("IsPowerOn", True, False)
    assert (stop["command"], stop["request"]) == ("Stop", None)
    assert "footer" in wrong["junk"]


@pytest.mark.full
async def test_decode_knows_the_lines_of_an_ultraarm() -> None:
    text = b"G0 X200 Y0.5 F100\rM120\r ANGLES[1.00 ,2.00 ,3.00 ,0.00]\r\nERROR: TOO FAR\r\nhello\r\nQUEUE SIZE[3]\r\n"
    done = await run("--json", "--arm", "ultraarm", "decode", text.hex())
    move, size, angles, error, hello, waiting = done.answer["pieces"]
    assert (move["command"], move["request"]["x"], move["request"]["f"]) == ("G0", 200, 100)
    assert (size["command"], size["request"]) == ("M120", None)
    assert (angles["command"], angles["reply"]["j2"]) == ("M12", 2)
    assert (error["command"], error["reply"]) == (None, "TOO FAR")
    assert "no line" in hello["junk"]
    assert (waiting["command"], waiting["reply"]["queue_size"]) == ("M120", 3)
    assert bytes.fromhex("".join(each["raw"] for each in done.answer["pieces"]).replace(" ", "")) == text


async def test_decode_reads_as_text() -> None:
    done = await run("decode", *(raw for raw, _, _ in VECTORS), "00")
    assert done.code == 0
    assert "    request: ptp_mode MOVJ_XYZ, x 250, y 0, z 0, r 0" in done.output.splitlines()
    assert "its Ctrl says read, which this command is not" in done.output
    assert "no command has the ID 250" in done.output
    assert "junk: no header" in done.output


async def test_a_trace_has_every_frame(sim: Simulation, tmp_path: Path) -> None:
    file = tmp_path / "trace"
    answer = (await run("--json", "--url", sim.url, "--trace", str(file), "move", "220", "0", "40")).answer
    lines = [line for line in map(json.loads, file.read_text().splitlines()) if line["kind"] == "frame"]
    out = [line for line in lines if line["direction"] == "out"]
    assert len(out) == sim.arm.counters.requests
    assert len(lines) - len(out) == sim.arm.counters.replies
    opening = ["GetEndEffectorParams", "SetQueuedCmdClear", "SetQueuedCmdStartExec"]  # a late answer may add barriers
    commands = [line["command"] for line in out]
    assert sorted(opening, key=commands.index) == opening
    assert {"ptp_mode": "MOVJ_XYZ", "x": 220.0, "y": 0.0, "z": 40.0, "r": 0.0} in [line["value"] for line in out]
    assert lines[-1]["command"] == "GetPose"
    assert lines[-1]["value"] == answer
    for line in lines:
        assert "problem" not in line
        (frame,) = Parser().feed(bytes.fromhex(line["raw"]))
        assert c.BY_KEY[frame.id, frame.write].name == line["command"]


@pytest.mark.full
async def test_a_trace_that_cannot_be_written_does_not_keep_the_arm_from_moving(sim: Simulation) -> None:
    done = await run("--json", "--url", sim.url, "--trace", "/dev/full", "move", "220", "0", "40")
    assert done.answer["x"] == pytest.approx(220, abs=0.01)
    assert done.errors.count("\n") == 1
    assert done.errors.startswith("warning: the trace ended early")


# --- the demo, terminals, start-up ---


async def test_the_demo_tells_plain_lines_and_a_summary() -> None:
    done = await run("demo", "--cycles", "1", "--speed", "50")
    assert (done.code, done.errors) == (0, "")
    *progress, pieces, commands, duration, round_trips, junk = done.output.splitlines()
    assert [line.split("  |  ")[0] for line in progress] == ["homing", *(f"{n} of 3 pieces carried" for n in range(4))]
    assert re.match(r"pieces +3 carried at serial:///dev/", pieces)
    assert re.match(r"commands +\d+ executed$", commands)
    assert re.match(r"duration +\d+\.\d s, 50 times real speed$", duration)
    assert re.match(r"round trips +\d+ ", round_trips)
    assert re.match(r"junk bytes +0, 0 bad frames$", junk)


@pytest.mark.full
async def test_the_demo_counts_what_the_arm_did(sim: Simulation) -> None:
    answer = (await run("--json", "--url", sim.url, "demo", "--cycles", "1", "--yes")).answer
    assert answer["commands"] == len(names(sim)) == 1 + 3 * 10
    assert answer["round_trips"] <= sim.arm.counters.replies
    assert answer["junk_bytes"] == 0
    assert not sim.arm.suction


@pytest.mark.full
async def test_the_demo_leaves_the_arm_in_the_environment_alone(sim: Simulation) -> None:
    answer = (await run("--json", "demo", "--cycles", "1", "--speed", "50", DOBOT_URL=sim.url)).answer
    assert answer["url"].startswith("serial:///dev/")
    assert sim.arm.counters.requests == 0


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    master, slave = os.openpty()
    yield master, slave
    os.close(master)
    os.close(slave)


@pytest.mark.cases(1)
@pytest.mark.parametrize("command", ["home", "run", "demo", "monitor"])
async def test_a_terminal_shows_progress(sim: Simulation, terminal: tuple[int, int], command: str) -> None:
    master, slave = terminal
    os.set_blocking(master, False)
    shown = bytearray()
    asyncio.get_running_loop().add_reader(master, lambda: shown.extend(os.read(master, 65536)))
    rest = {"run": ["-"], "demo": ["--cycles", "1", "--yes"], "monitor": ["--count", "3", "--rate", "50"]}
    process = await start(
        "--url",
        sim.url,
        command,
        *rest.get(command, []),
        stdin=PIPE,
        stdout=slave,
        environment={"TERM": "xterm", "COLUMNS": "120"},
    )
    done = await finish(process, "move 200 0 50\nmove 210 0 50\n")
    asyncio.get_running_loop().remove_reader(master)
    assert (done.code, done.errors) == (0, "")
    words = {"home": "homing", "run": "0/2", "demo": "queue", "monitor": "joints"}
    assert words[command].encode() in shown
    assert b"\x1b[" in shown


@pytest.mark.full
async def test_no_progress_and_no_colour_with_json_on_a_terminal(sim: Simulation, terminal: tuple[int, int]) -> None:
    master, slave = terminal
    process = await start("--json", "--url", sim.url, "home", stdout=slave, environment={"TERM": "xterm"})
    assert (await finish(process)).code == 0
    assert list(json.loads(os.read(master, 65536))) == POSE_KEYS


async def test_start_up_leaves_out_what_is_not_needed() -> None:
    late = "[name for name in sys.modules if name.startswith(('rich', 'dobot_async.simulator'))]"
    source = f"import sys, dobot_async.cli.main; print({late})"
    process = await asyncio.create_subprocess_exec(sys.executable, "-c", source, stdout=PIPE, stderr=PIPE)
    assert (await finish(process)).output == "[]\n"
