"""`discover` and `wifi`, run as processes; the arms that they find are simulated here, on the loopback network."""

from __future__ import annotations

import asyncio
import json
import os
import sys
import threading
from asyncio.subprocess import DEVNULL, PIPE
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from click.testing import CliRunner

from dobot_async import DeviceInfo, Found
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame
from dobot_async.arms.magician.trace_words import FRAMES
from dobot_async.cli.commands.discover import table
from dobot_async.cli.main import cli
from dobot_async.simulator import Simulation, announced, simulate

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has a whole network on its loopback")

MODULE = (sys.executable, "-W", "error", "-m", "dobot_async")
LOOPBACK = "127.255.255.255"
OWN = f"127.{64 + (os.getpid() >> 8) % 190}.{os.getpid() & 255}"
"""Where this process's simulated arms are; others may test at the same time."""

PASSWORD = "correct horse"
FAST = 50.0


class Done(NamedTuple):
    """What a process left behind."""

    code: int
    output: str
    errors: str

    @property
    def answer(self) -> Any:
        """The one JSON object that is all of the output."""
        assert self.output.count("\n") == 1
        return json.loads(self.output)


async def run(*arguments: str, text: str | None = None) -> Done:
    names = {name: value for name, value in os.environ.items() if name != "DOBOT_URL"}
    process = await asyncio.create_subprocess_exec(
        *MODULE, *arguments, stdin=DEVNULL if text is None else PIPE, stdout=PIPE, stderr=PIPE, env=names
    )
    output, errors = await process.communicate(None if text is None else text.encode())
    assert process.returncode is not None
    return Done(process.returncode, output.decode(), errors.decode())


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Lets the threads end with which asyncio waits for processes; they outlive these for a moment."""
    yield
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)


@asynccontextmanager
async def in_wifi(*numbers: int) -> AsyncIterator[tuple[list[Simulation], list[str]]]:
    """Simulated arms in the Wi-Fi, each with its number as its serial number; and the options to find them with."""
    async with AsyncExitStack() as stack:
        sims, options = [], []
        for number in numbers:
            sim = await stack.enter_async_context(simulate(listen=f"udp://{OWN}.{number}:8899", speed=FAST))
            sim.arm.state.set(c.SET_DEVICE_SN, f"SN{number}")
            port = await stack.enter_async_context(announced(sim.url, LOOPBACK, 0))
            sims.append(sim)
            options += ["--broadcast", f"{LOOPBACK}:{port}"]

        yield sims, options


@pytest.fixture
async def on_usb() -> AsyncIterator[Simulation]:
    """The arm that is to be set up; in its network it is number 2."""
    async with simulate(listen="tcp://127.0.0.1:0", speed=FAST) as sim:
        sim.arm.state.set(c.SET_DEVICE_SN, "SN2")
        yield sim


# --- discover ---


@pytest.mark.full
async def test_a_search_with_probe_tells_who_is_there() -> None:
    async with in_wifi(1, 2) as (_, options):
        arguments = ("discover", "--source", "wifi", "--timeout", "2", "--probe", *options)
        asjson, astext = await asyncio.gather(run("--json", *arguments), run(*arguments))

    assert [(each["url"], each["info"]["serial_number"]) for each in asjson.answer["arms"]] == [
        (f"udp://{OWN}.1", "SN1"),
        (f"udp://{OWN}.2", "SN2"),
    ]
    assert (asjson.code, asjson.answer["problems"], asjson.errors) == (0, [], "")
    heading, *lines = astext.output.splitlines()
    assert heading.split()[:2] == ["URL", "ARM"]
    assert [line.split()[:2] for line in lines] == [[f"udp://{OWN}.{number}", "magician"] for number in (1, 2)]
    assert all("Dobot Magician" in line and "firmware 3.7.0" in line for line in lines)


def test_a_source_that_fails_is_a_line_on_standard_error(tmp_path: Path) -> None:
    runner = CliRunner(env={"DBUS_SYSTEM_BUS_ADDRESS": f"unix:path={tmp_path}/none"})
    done = runner.invoke(cli, ["discover", "--source", "ble", "--source", "serial", "--timeout", "0.1"])
    assert done.exit_code == 0
    assert done.stderr.startswith("warning: the search by ble failed: ")
    assert done.stderr.count("\n") == 1
    answer = json.loads(runner.invoke(cli, ["--json", "discover", "--source", "ble", "--timeout", "0.1"]).stdout)
    assert [problem["source"] for problem in answer["problems"]] == ["ble"]


@pytest.mark.parametrize(
    "place", ["example.org", "10.0.0", "10.0.0.255:", "10.0.0.255:x", "10.0.0.255:65536", "10.0.0.255:-1"]
)
def test_where_to_ask_must_be_an_address(place: str) -> None:
    done = CliRunner().invoke(cli, ["discover", "--source", "serial", "--broadcast", place])
    assert done.exit_code == (0 if place.endswith(":") else 2)


@pytest.mark.parametrize(
    "arguments", [["discover", "--timeout"], ["monitor", "--rate"], ["demo", "--speed"], ["wifi", "lab", "--search"]]
)
@pytest.mark.parametrize("number", ["nan", "0", "-1", "soon"])
def test_a_number_above_0_is_one(arguments: list[str], number: str) -> None:
    done = CliRunner().invoke(cli, [*arguments, number])
    assert done.exit_code == 2
    assert f"Invalid value for '{arguments[-1]}'" in done.output


def test_the_table_says_what_is_known() -> None:
    found = [
        Found("serial:///dev/ttyUSB0", "serial", "1-1", "USB2.0-Serial", ("magician", "ultraarm")),
        Found("udp://10.0.0.7", "wifi", "D8", "USR-C322", ("magician",), problem="no Magician answers"),
        Found("ble://AA", "ble", "AA", "", ("magician",), DeviceInfo("SN1", "left\x1b[2J", "3.7.0"), also=("sim:",)),
        Found("x:", "x", "x"),
    ]
    assert [line.rstrip() for line in table(found).splitlines()] == [
        "URL                    ARM                   WHAT IT SAYS OF ITSELF",
        "serial:///dev/ttyUSB0  magician or ultraarm  USB2.0-Serial",
        "udp://10.0.0.7         magician              USR-C322, no answer: no Magician answers",
        "ble://AA               magician              left?[2J, SN1, firmware 3.7.0, also at sim:",
        "x:                                           -",
    ]
    assert table([]) == "nothing found"


# --- wifi ---


async def test_an_arm_is_brought_into_a_network_and_found_there(on_usb: Simulation) -> None:
    on_usb.arm.state.networks = {"cell": PASSWORD}
    async with in_wifi(1, 2) as (_, options):
        done = await run("--json", "--url", on_usb.url, "wifi", "cell", *options, text=f"{PASSWORD}\nmore\n")

    assert done.answer == {"ssid": "cell", "serial_number": "SN2", "url": f"udp://{OWN}.2"}
    assert (done.code, done.errors) == (0, "")
    assert on_usb.arm.state.get(c.SET_WIFI_PASSWORD) == PASSWORD
    assert on_usb.arm.state.get(c.SET_WIFI_IP_ADDRESS).dhcp
    assert not on_usb.arm.executed


@pytest.mark.full
async def test_an_address_of_its_own_is_enough_to_know_it(on_usb: Simulation) -> None:
    async with in_wifi(3) as (_, options):
        address = ["--address", f"{OWN}.3", "--gateway", f"{OWN}.1"]
        done = await run("--url", on_usb.url, "wifi", "cell", "--open", *address, *options)

    assert (done.code, done.output, done.errors) == (0, f"udp://{OWN}.3\n", "")
    assert on_usb.arm.state.get(c.SET_WIFI_GATEWAY).addr == tuple(map(int, f"{OWN}.1".split(".")))


@pytest.mark.full
async def test_the_password_is_in_no_trace(on_usb: Simulation, tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    async with in_wifi(2) as (_, options):
        done = await run("--trace", str(trace), "--url", on_usb.url, "wifi", "cell", *options, text=PASSWORD)

    text = trace.read_text()
    assert done.code == 0
    assert PASSWORD not in text + done.output + done.errors
    assert PASSWORD.encode().hex(" ") not in text
    (line,) = [
        each
        for each in map(json.loads, text.splitlines())
        if each.get("command") == "SetWIFIPassword" and each["value"]
    ]
    assert (line["value"], line["raw"]) == ("***", "aa aa *** 98 01 ***")
    assert '"cell"' in text


def test_nor_is_it_when_it_is_read_or_does_not_fit() -> None:
    text = ""
    for frame in (Frame(152, 0, b"hunter2\0"), Frame(152, 1, b"hunter2"), Frame(152, 3, b"hunter2" * 20)):
        for outgoing in (False, True):
            text += json.dumps(FRAMES.line(frame, outgoing=outgoing))

    assert text.count("***") == 3 * 3 + 3  # a request is cut, an answer has another password
    assert "hunter2" not in text
    assert b"hunter2".hex(" ") not in text


@pytest.mark.full
async def test_a_network_that_it_cannot_join(on_usb: Simulation) -> None:
    on_usb.arm.state.networks = {"cell": PASSWORD}
    done = await run("--url", on_usb.url, "wifi", "cell", "--timeout", "0.5", text="wrong\n")
    assert (done.code, done.output) == (1, "")
    assert done.errors.startswith("error: the arm did not join its Wi-Fi within 0.5 s")


@pytest.mark.full
async def test_an_arm_that_is_not_found_is_not_made_up(on_usb: Simulation) -> None:
    async with in_wifi(1) as (_, options):
        done = await run("--url", on_usb.url, "wifi", "cell", "--search", "1.5", *options, text="pass\n")

    assert (done.code, done.output) == (1, "")
    assert f"it is none of udp://{OWN}.1 (SN1)" in done.errors
    assert done.errors.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "text", "message"),
    [
        (["cell"], "", "no password"),
        (["cell"], "\nsecret\n", "no password"),
        (["cell"], b"\xff\n", "no utf-8 text"),
        (["cell", "--open", "--gateway", "10.0.0.1"], "", "DHCP"),
        (["cell", "--open", "--address", "10.0.0.x"], "", "10.0.0.x"),
        (["cell", "secret"], "", "unexpected extra argument"),
        (["x" * 33, "--open"], "", "33 bytes"),
    ],
)
def test_wrong_usage_sets_nothing_up(arguments: list[str], text: str | bytes, message: str) -> None:
    done = CliRunner().invoke(cli, ["--url", "sim:", "wifi", *arguments], input=text)
    assert done.exit_code == 2
    assert message in done.stderr


@pytest.mark.full
async def test_a_terminal_is_asked_and_does_not_show_the_password(on_usb: Simulation) -> None:
    master, slave = os.openpty()
    program = "import os, sys; os.login_tty(0); os.execv(sys.executable, [sys.executable, *sys.argv[1:]])"
    async with in_wifi(2) as (_, options):
        arguments = ["-m", "dobot_async", "--url", on_usb.url, "wifi", "cell", *options]
        process = await asyncio.create_subprocess_exec(sys.executable, "-c", program, *arguments, stdin=slave)
        os.close(slave)
        shown = await asyncio.to_thread(dialogue, master, "Password of cell: ", PASSWORD + "\n")
        assert await process.wait() == 0

    assert f"udp://{OWN}.2" in shown
    assert PASSWORD not in shown
    assert on_usb.arm.state.get(c.SET_WIFI_PASSWORD) == PASSWORD


def dialogue(terminal: int, question: str, answer: str) -> str:
    """Answers a question on a terminal; returns all that was shown there until everybody has left it."""
    shown = ""
    asked = False
    while True:
        try:
            shown += os.read(terminal, 1024).decode()
        except OSError:
            os.close(terminal)
            return shown

        if question in shown and not asked:
            asked = True
            os.write(terminal, answer.encode())
