"""`dobot-async panel`, as a process: what it prints, what it refuses, and that it ends."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import sys
import threading
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest
from click.testing import CliRunner
from panel_rig import browser

from dobot_async.cli.main import cli

IN_TIME = 30.0
OPERATOR, VIEWER = "operator-token-4711", "viewer-token-0815"
CELL = """
[arms.left]
url = "sim:?speed=10"

[arms.right]
url = "sim:?speed=10"
family = "mycobot"
model = "mycobot280"
base = { x = 500, yaw = 180 }

[zones.bin]
box = { x = [200, 300] }
"""


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Lets the threads end with which asyncio waits for processes; they outlive these for a moment."""
    yield
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)


@asynccontextmanager
async def started(*arguments: str, environment: Mapping[str, str] = {}) -> AsyncIterator[Process]:
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-W", "error", "-m", "dobot_async", *arguments),
        stdout=PIPE,
        stderr=PIPE,
        env={**{name: value for name, value in os.environ.items() if not name.startswith("DOBOT")}, **environment},
    )
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            process.kill()

        await process.wait()


async def line(process: Process) -> str:
    assert process.stdout
    async with asyncio.timeout(IN_TIME):
        return (await process.stdout.readline()).decode().strip()


async def hello(url: str, operator: str) -> dict[str, object]:
    """What a page is told first."""
    async with browser() as http:
        await (await http.get(operator)).read()
        async with http.ws_connect(f"{url}ws", headers={"Origin": url.rstrip("/")}) as socket:
            found: dict[str, object] = json.loads((await socket.receive()).data)
            return found


async def test_a_simulated_arm_with_its_scene_and_a_code_for_a_phone() -> None:
    async with started("--url", "sim:", "panel", "--port", "0") as process:
        operator = await line(process)
        assert "?token=" in operator
        assert (await line(process)).startswith("to look on: http")
        assert "█" in await line(process)
        found = await hello(operator.partition("?")[0], operator)
        assert found["role"] == "operator"
        assert found["scene"] is True
        process.send_signal(signal.SIGINT)
        async with asyncio.timeout(IN_TIME):
            _, err = await process.communicate()

        assert process.returncode == 130
        assert not err


@pytest.mark.full
async def test_tokens_that_were_given_are_not_shown(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text(f"{OPERATOR}\n")
    options = (
        "--url",
        "sim:",
        "--json",
        "panel",
        "--port",
        "0",
        "--host",
        "0.0.0.0",
        "--operator-token-file",
        str(file),
    )
    async with started(*options, environment={"DOBOT_PANEL_VIEWER": VIEWER}) as process:
        first = json.loads(await line(process))
        assert first.keys() == {"url"}
        port = first["url"].rpartition(":")[2]
        local = f"http://127.0.0.1:{port}"
        assert (await hello(local, f"{local}?token={VIEWER}"))["role"] == "viewer"
        assert (await hello(local, f"{local}?token={OPERATOR}"))["role"] == "operator"
        process.terminate()
        async with asyncio.timeout(IN_TIME):
            out, err = await process.communicate()

        assert OPERATOR.encode() not in out + err
        assert VIEWER.encode() not in out + err


@pytest.mark.full
async def test_several_arms_and_a_cell_file(tmp_path: Path) -> None:
    async with started("--json", "panel", "--port", "0", "left=sim:", "right=sim:?speed=2") as process:
        first = json.loads(await line(process))
        arms = (await hello(first["url"], first["operator"]))["arms"]
        assert isinstance(arms, list)
        assert [arm["name"] for arm in arms] == ["left", "right"]

    file = tmp_path / "cell.toml"
    file.write_text(CELL)
    async with started("--json", "panel", "--port", "0", "--cell", str(file)) as process:
        first = json.loads(await line(process))
        found = await hello(first["url"], first["operator"])
        assert isinstance(found["arms"], list)
        assert [(arm["model"], arm["base"]["x"]) for arm in found["arms"]] == [("magician", 0), ("mycobot280", 500)]
        assert isinstance(found["zones"], list)
        assert found["zones"][0]["name"] == "bin"


@pytest.mark.full
async def test_an_arm_of_another_family_by_its_model() -> None:
    async with started("--url", "sim:", "--arm", "mecharm270", "--json", "panel", "--port", "0") as process:
        first = json.loads(await line(process))
        async with asyncio.timeout(IN_TIME):
            while True:
                found = await hello(first["url"], first["operator"])
                assert isinstance(found["arms"], list)
                if found["arms"][0].get("model") == "mecharm270":
                    break

                await asyncio.sleep(0.1)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["panel"], "which arm?"),
        (["panel", "--url", "sim:", "--host", "0.0.0.0"], "operator_token="),
        (["panel", "--url", "sim:", "--make-tokens", "--operator-token-file", "FILE"], "--make-tokens"),
        (["panel", "--url", "sim:", "left=sim:"], "--url"),
        (["panel", "left"], "NAME=URL"),
        (["panel", "left=sim:", "left=sim:"], "NAME=URL"),
        (["panel", "left=x://y"], "no scheme"),
        (["panel", "--url", "sim:", "--trace", "-"], "trace"),
        (["panel", "--url", "sim:", "--key", "FILE"], "certificate"),
    ],
)
def test_wrong_usage_is_told(arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DOBOT_URL", raising=False)
    file = tmp_path / "token"
    file.write_text(OPERATOR)
    done = CliRunner().invoke(cli, [str(file) if each == "FILE" else each for each in arguments])
    assert done.exit_code == 2, done.output
    assert said in done.output


@pytest.mark.full
async def test_a_taken_port_is_a_failure_in_one_line() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        async with started("--url", "sim:", "panel", "--port", str(taken.getsockname()[1])) as process:
            _, err = await process.communicate()

    assert process.returncode == 1
    assert err.decode().startswith("error: cannot listen")
    assert err.count(b"\n") == 1


@pytest.mark.full
async def test_without_aiohttp_it_says_what_to_install() -> None:
    program = (
        "import sys; sys.modules['aiohttp'] = None\n"
        "from dobot_async.cli.main import cli\n"
        "cli(['--url', 'sim:', 'panel', '--port', '0'])"
    )
    process = await asyncio.create_subprocess_exec(sys.executable, "-c", program, stdout=PIPE, stderr=PIPE)
    async with asyncio.timeout(IN_TIME):
        _, err = await process.communicate()

    assert b"dobot-async[panel]" in err
    assert b"Traceback" not in err
    assert process.returncode == 1
