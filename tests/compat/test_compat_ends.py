"""How an old program ends, and what it is told: no hang, no failure in silence, nothing that moves after an error."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

import pytest

from dobot_async import ArmAlarm, CommandRejected, ConnectFailed, ConnectionLost, MotionStopped
from dobot_async.arms.magician import commands as c
from dobot_async.compat import DobotDllType as dType
from dobot_async.compat import pydobot, pydobotplus
from dobot_async.compat._ports import url_of
from dobot_async.simulator import SimulatedMagician, Simulation, simulate

Sim = Simulation[SimulatedMagician]
FAR = (900, 0, 0)
LONG = 60_000  # ms that the arm waits
FAST = 100
WAITS = (c.WAITCmd(500),)


async def with_arm(program: Callable[[str], Any], speed: float = FAST) -> Sim:
    """Run a blocking program in a thread, with the URL of a simulated arm; return the arm, which has ended."""
    async with simulate(listen="tcp://127.0.0.1:0", speed=speed, homed=True) as sim:
        await asyncio.to_thread(program, sim.url)
        assert sim.arm.device.idle
        return sim


def outcomes(sim: Sim, command: object = c.SET_PTP_CMD) -> list[str]:
    """How commands of a kind have ended; connecting has the arm wait for 0 ms."""
    return [each.outcome for each in sim.arm.executed if each.command is command and each.value != c.WAITCmd(0)]


def connected(url: str) -> dType.Api:
    api = dType.load()
    assert dType.ConnectDobot(api, url, 115200)[0] == dType.DobotConnect.DobotConnect_NoError
    return api


async def test_a_loop_that_waits_for_an_index_ends_with_the_alarm() -> None:
    def program(url: str) -> None:
        api = connected(url)
        dType.SetPTPCmd(api, 1, 220, 0, 40, 0, isQueued=1)
        last = dType.SetPTPCmd(api, 1, *FAR, 0, isQueued=1)[0]
        with pytest.raises(ArmAlarm, match="0x11"):
            while last > dType.GetQueuedCmdCurrentIndex(api)[0]:
                pass

        with pytest.raises(ArmAlarm):  # it is not done the second time, either
            dType.GetQueuedCmdCurrentIndex(api)

        assert dType.GetAlarmsState(api)[0][2] == 0b10
        dType.ClearAllAlarmsState(api)
        last = dType.SetPTPCmd(api, 1, 220, 10, 40, 0, isQueued=1)[0]
        while last > dType.GetQueuedCmdCurrentIndex(api)[0]:
            pass

        dType.DisconnectDobot(api)

    sim = await with_arm(program)
    assert outcomes(sim) == ["done", "alarm", "done"]


async def test_a_motion_that_nobody_waits_for_is_told_by_the_next_call() -> None:
    def program(url: str) -> None:
        device = pydobot.Dobot(url)
        device.move_to(*FAR, 0)
        with pytest.raises(ArmAlarm):
            while True:
                device.pose()

        device.pose()  # told once in this thread
        device.clear_alarms()
        device.move_to(220, 0, 40, 0, wait=True)
        device.close()

    sim = await with_arm(program)
    assert outcomes(sim) == ["alarm", "done"]


async def test_close_waits_for_what_was_queued_and_raises_what_failed() -> None:
    def program(url: str) -> None:
        device = pydobot.Dobot(url)
        for y in (0, 20, 40):
            device.move_to(220, y, 40, 0)

        device.close()
        failing = pydobot.Dobot(url)
        failing.move_to(*FAR, 0)
        with pytest.raises(ArmAlarm):
            failing.close()

        with pytest.raises(ConnectionLost, match="closed by this program"):
            failing.pose()

        failing.close()  # does nothing the second time

    sim = await with_arm(program)
    assert outcomes(sim) == ["done"] * 3 + ["alarm"]


@pytest.mark.parametrize("kind", [pydobot.Dobot, pydobotplus.Dobot])
async def test_close_while_an_error_is_handled_stops_the_arm(kind: type[pydobot.Dobot | pydobotplus.Dobot]) -> None:
    def program(url: str) -> None:
        device = kind(url)
        try:
            device.wait(LONG)
            device.move_to(220, 0, 40, 0, wait=False)
            int("no number")  # a mistake of the program
        except ValueError:
            device.close()

    sim = await with_arm(program)
    assert outcomes(sim, c.SET_WAIT_CMD) == ["aborted"]
    assert not outcomes(sim)


async def test_a_failure_is_told_in_each_thread() -> None:
    """Whoever watches the pose hears of it, and so does who waits for the index."""

    def program(url: str) -> None:
        api, told = connected(url), []

        def watch() -> None:
            try:
                while True:
                    dType.GetPose(api)
            except ArmAlarm as error:
                told.append(error)

        watcher = threading.Thread(target=watch)
        watcher.start()
        last = dType.SetPTPCmd(api, 1, *FAR, 0, isQueued=1)[0]
        watcher.join()
        with pytest.raises(ArmAlarm):
            while last > dType.GetQueuedCmdCurrentIndex(api)[0]:
                pass

        assert len(told) == 1
        dType.DisconnectDobot(api)

    await with_arm(program)


async def test_what_is_not_queued_is_done_when_the_call_returns() -> None:
    def program(url: str) -> None:
        api = connected(url)
        assert dType.SetPTPCommonParams(api, 50, 50, isQueued=0) == [0]
        assert dType.SetPTPCmd(api, 1, 220, 30, 40, 0)[0] > 0
        assert dType.GetPose(api)[:3] == pytest.approx([220, 30, 40], abs=0.01)
        dType.DisconnectDobot(api)

    sim = await with_arm(program)
    assert outcomes(sim) == ["done"]


async def test_a_queue_that_was_halted_runs_when_it_is_told_to() -> None:
    def program(url: str) -> None:
        api = connected(url)
        dType.SetQueuedCmdStopExec(api)
        before = dType.GetPose(api)
        last = dType.SetPTPCmd(api, 1, 220, 30, 40, 0, isQueued=1)[0]
        dType.dSleep(50)  # 5 s of the arm
        assert dType.GetPose(api) == before
        assert dType.GetQueuedCmdMotionFinish(api) == [False]
        with pytest.raises(CommandRejected, match="SetQueuedCmdStartExec"):
            dType.SetPTPCmdEx(api, 1, 220, 0, 40, 0, 1)

        dType.SetQueuedCmdStartExec(api)
        while last > dType.GetQueuedCmdCurrentIndex(api)[0]:
            pass

        assert dType.GetQueuedCmdMotionFinish(api) == [True]
        dType.SetQueuedCmdStopExec(api)
        dType.SetPTPCmd(api, 1, 220, 0, 40, 0, isQueued=0)  # at once, as nothing else waits
        dType.SetPTPCmd(api, 1, 220, 10, 40, 0, isQueued=1)
        dType.DisconnectDobot(api)  # does not wait for what does not run
        dType.DisconnectDobot(connected(url))  # which empties the queue

    sim = await with_arm(program)
    assert outcomes(sim)[:2] == ["done", "done"]


@pytest.mark.full
async def test_a_full_queue_that_does_not_run_is_an_error_and_no_hang() -> None:
    def program(url: str) -> None:
        api = connected(url)
        dType.SetQueuedCmdStopExec(api)
        room = dType.GetQueuedCmdLeftSpace(api)[0]
        with pytest.raises(CommandRejected, match="full"):
            for _ in range(room + 1):
                dType.SetWAITCmd(api, 20, isQueued=1)

        dType.SetQueuedCmdClear(api)
        dType.DisconnectDobot(api)

    await with_arm(program)


async def test_who_waits_for_what_was_cleared_is_told() -> None:
    def program(url: str) -> None:
        api = connected(url)
        dType.SetWAITCmd(api, LONG, isQueued=1)
        last = dType.SetPTPCmd(api, 1, 220, 30, 40, 0, isQueued=1)[0]
        dType.SetQueuedCmdForceStopExec(api)
        dType.SetQueuedCmdClear(api)
        with pytest.raises(MotionStopped):
            while last > dType.GetQueuedCmdCurrentIndex(api)[0]:
                pass

        dType.GetPose(api)  # who has cleared it need not be told
        dType.SetPTPCmd(api, 1, 220, 0, 40, 0, isQueued=1)
        dType.dSleep(50)
        assert not outcomes_of(api)  # stopped by force, the queue waits for SetQueuedCmdStartExec
        dType.SetQueuedCmdStartExec(api)
        dType.DisconnectDobot(api)

    def outcomes_of(api: dType.Api) -> bool:
        return dType.GetQueuedCmdMotionFinish(api)[0]

    sim = await with_arm(program)
    assert outcomes(sim) == ["done"]


async def test_a_jog_ends_when_the_program_does() -> None:
    def program(url: str) -> None:
        device = pydobotplus.Dobot(url)
        device.move_to(220, 0, 40)
        device.jog_y(1)
        device.close()

    sim = await with_arm(program)
    jogs = [each.value.cmd for each in sim.arm.executed if each.command is c.SET_JOG_CMD]
    assert jogs == [c.JOGKey.BP_DOWN]


async def test_a_wait_is_in_the_unit_of_the_programs_file() -> None:
    def program(url: str) -> None:
        api = dType.load("seconds", wait="s")
        assert dType.load("seconds") is api
        dType.ConnectDobot(api, url, 115200)
        dType.SetWAITCmd(api, 0.5, isQueued=1)
        with pytest.raises(ValueError, match='load\\(wait="ms"\\)'):
            dType.SetWAITCmd(api, 1000, isQueued=1)

        dType.DisconnectDobot(api)
        other = connected(url)
        dType.SetWAITCmd(other, 500, isQueued=1)
        with pytest.raises(ValueError, match='load\\(wait="s"\\)'):
            dType.SetWAITCmd(other, 0.5, isQueued=1)

        dType.DisconnectDobot(other)

    sim = await with_arm(program)
    assert [each.value.timeout for each in sim.arm.executed if each.value in WAITS] == [500, 500]


async def test_connecting_says_how_it_ended_as_the_dll_does() -> None:
    def program(url: str) -> None:
        api = connected(url)
        assert dType.ConnectDobot(api, url, 115200)[0] == dType.DobotConnect.DobotConnect_Occupied
        dType.DisconnectDobot(api)
        dType.DisconnectDobot(api)
        with pytest.raises(ConnectionLost, match="ConnectDobot"):
            dType.GetPose(api)

        none = dType.load("none")
        assert dType.ConnectDobot(none, "tcp://127.0.0.1:1", 115200)[0] == dType.DobotConnect.DobotConnect_NotFound

    await with_arm(program)


@pytest.mark.parametrize(
    ("port", "url"),
    [
        ("COM3", "serial://COM3"),
        ("/dev/ttyUSB0", "serial:///dev/ttyUSB0"),
        ("192.168.1.20", "udp://192.168.1.20"),
        ("sim:?speed=5", "sim:?speed=5"),
        ("tcp://host:1", "tcp://host:1"),
        ("COM7", "sim:?seed=7"),
        ("", "sim:?seed=1"),
        (None, "sim:?seed=1"),
    ],
)
def test_a_port_leads_to_a_url(port: str | None, url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DOBOT_PORTS", "COM7=sim:?seed=7, COM8=sim:")
    monkeypatch.setenv("DOBOT_URL", "sim:?seed=1")
    assert url_of(port) == url


def test_a_bad_environment_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DOBOT_PORTS", "COM7")
    with pytest.raises(ValueError, match="PORT=URL"):
        url_of("COM3")


def test_without_a_port_the_first_arm_on_usb_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    class Port:
        def __init__(self, device: str, vid: int) -> None:
            self.device, self.vid, self.pid = device, vid, 0xEA60

        def __lt__(self, other: Port) -> bool:
            return self.device < other.device

    monkeypatch.delenv("DOBOT_URL", raising=False)
    found = [Port("COM9", 0x10C4), Port("COM1", 0x1234)]
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: found)
    assert url_of(None) == "serial://COM9"
    assert dType.SearchDobot(dType.load()) == ["COM9"]
    del found[0]
    with pytest.raises(ConnectFailed, match="DOBOT_URL"):
        url_of("")


def handlers() -> list[object]:
    return [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]


def test_signals_are_handled_while_an_arm_is_connected_alone() -> None:
    before = handlers()
    with pytest.raises(ConnectFailed):
        pydobot.Dobot("tcp://127.0.0.1:1")

    assert handlers() == before
    with pydobot.Dobot("sim:?speed=100"):
        assert handlers()[1] != before[1]

    assert handlers() == before


PROGRAM = """
import sys
from dobot_async.compat.pydobot import Dobot
device = Dobot(sys.argv[1])
for y in range(5):
    device.move_to(220, y, 40, 0)
{end}
"""
CODES = {"nothing": 0, "exit": 0, "caught": 0, "terminated": 128 + signal.SIGTERM}
KILLED = """
import os, signal, time
device.wait(600_000)
try:
    os.kill(os.getpid(), signal.{signal})
    time.sleep(100)
except {error}:
    device.pose()
"""
THREAD = """
import threading
def work():
    for y in range(1000): device.move_to(220, y % 50, 40, 0, wait=True)
threading.Thread(target=work).start()
1 / 0
"""
ENDS: dict[str, tuple[str, Callable[[list[str]], bool]]] = {
    "nothing": ("", lambda outcomes: outcomes == ["done"] * 5),
    "exit": ("sys.exit()", lambda outcomes: outcomes == ["done"] * 5),
    "error": ("device.wait(600_000); 1 / 0", lambda outcomes: "done" not in outcomes[4:]),
    "interrupt": ("device.wait(600_000); raise KeyboardInterrupt", lambda outcomes: "done" not in outcomes[4:]),
    "caught": (KILLED.format(signal="SIGINT", error="KeyboardInterrupt"), lambda outcomes: "done" not in outcomes[4:]),
    "terminated": (KILLED.format(signal="SIGTERM", error="LookupError"), lambda outcomes: "done" not in outcomes[4:]),
    "thread": (
        THREAD,
        lambda outcomes: len(outcomes) < 1000,
    ),
}


@pytest.mark.cases(1)
@pytest.mark.parametrize("name", ENDS)
async def test_a_program_that_does_not_close_ends_as_it_should(name: str) -> None:
    """What was queued is done after a normal end; after an error the arm stops, whatever other threads still do."""
    end, holds = ENDS[name]

    def program(url: str) -> None:
        ran = subprocess.run(
            [sys.executable, "-W", "error", "-c", PROGRAM.format(end=end), url],
            capture_output=True,
            text=True,
            check=False,
            timeout=100,
            env=os.environ | {"PYTHONFAULTHANDLER": "1"},
        )
        assert ran.returncode == CODES.get(name, 1), ran.stderr

    sim = await with_arm(program, speed=5)
    assert holds(outcomes(sim))
    assert set(outcomes(sim)) <= {"done", "aborted"}
