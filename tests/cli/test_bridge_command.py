"""`dobot-async bridge`, as a process."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
import threading
import urllib.request
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest
from click.testing import CliRunner

from dobot_async import Magician, MyCobot
from dobot_async.cli.main import cli
from dobot_async.simulator import Simulation, simulate

TCP = "tcp://127.0.0.1:0"
IN_TIME = 20.0


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Lets the threads end with which asyncio waits for processes; they outlive these for a moment."""
    yield
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)


@pytest.fixture
async def sim() -> AsyncIterator[Simulation]:
    async with simulate(listen=TCP, speed=50) as simulation:
        yield simulation


@asynccontextmanager
async def started(
    *arguments: str, before: tuple[str, ...] = (), environment: Mapping[str, str] = {}
) -> AsyncIterator[Process]:
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-W", "error", "-m", "dobot_async", *before, "bridge", *arguments),
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


async def test_it_prints_where_it_is_and_what_happens_and_ends_with_ctrl_c(sim: Simulation) -> None:
    async with started(sim.url, TCP, "ws://127.0.0.1:0") as process:
        urls = [await line(process), await line(process)]
        assert [url.split(":")[0] for url in urls] == ["tcp", "ws"]
        for url in urls:
            async with Magician.connect(url) as arm:
                await arm.move_to(220, 0, 40)

            assert "connected" in await line(process)
            assert "lease" in await line(process)
            assert "released" in await line(process)
            assert "left" in await line(process)

        process.send_signal(signal.SIGINT)
        output, errors = await process.communicate()
        assert (process.returncode, output, errors) == (130, b"", b"")


@pytest.mark.full
async def test_json_is_one_object_with_a_made_up_token(sim: Simulation) -> None:
    async with started(sim.url, "tcp://0.0.0.0:0", before=("--json",)) as process:
        answer = json.loads(await line(process))
        (url,) = answer["urls"]
        assert "0.0.0.0" not in url
        assert len(answer["token"]) >= 32
        async with Magician.connect(f"{url}?token={answer['token']}", control=False) as arm:
            assert (await arm.get_info()).name == "Dobot Magician"

        events = [json.loads(await line(process)) for _ in range(2)]
        assert [event["what"] for event in events] == ["connected", "left"]
        process.send_signal(signal.SIGTERM)
        output, errors = await process.communicate()
        assert (process.returncode, output, errors) == (143, b"", b"")


@pytest.mark.full
@pytest.mark.parametrize("source", ["environment", "file"])
async def test_a_token_of_ones_own_is_not_printed(sim: Simulation, source: str, tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text("geheim\n")
    given = {"DOBOT_BRIDGE_TOKEN": "geheim"} if source == "environment" else {}
    options = [] if given else ["--token-file", str(file)]
    async with started(sim.url, TCP, *options, environment=given) as process:
        url = await line(process)
        async with Magician.connect(f"{url}?token=geheim", control=False) as arm:
            await arm.get_pose()

        process.send_signal(signal.SIGINT)
        output, errors = await process.communicate()
        assert b"geheim" not in output + errors


@pytest.mark.parametrize("text", [b"", b" \n", b"gehe\xffim"])
def test_a_file_without_a_token_is_named(text: bytes, tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_bytes(text)
    done = CliRunner().invoke(cli, ["bridge", "sim:", TCP, "--token-file", str(file)])
    assert done.exit_code == 2
    assert f"{file} has no token" in done.stderr


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["sim:"], 2, "LISTEN_URL"),
        (["sim:", "http://127.0.0.1:1"], 2, "cannot listen at"),
        (["nowhere", TCP], 2, "no scheme"),
        (["sim:", TCP, "--deny", "everything"], 2, "deny"),
        (["tcp://127.0.0.1:1", TCP], 1, "cannot reach"),
    ],
)
async def test_wrong_usage_and_no_arm(arguments: list[str], code: int, told: str) -> None:
    async with started(*arguments) as process:
        output, errors = await process.communicate()
        assert process.returncode == code
        assert output == b""
        assert told in errors.decode()


@pytest.mark.full
async def test_an_arm_of_another_family() -> None:
    async with (
        simulate("mycobot280", listen=TCP, speed=50) as sim,
        started(sim.url, TCP, before=("--arm", "mycobot")) as process,
    ):
        async with MyCobot.connect(await line(process)) as arm:
            await arm.move_joints(10, 0, 0, 0, 0, 0)

        process.send_signal(signal.SIGINT)
        await process.communicate()
        assert process.returncode == 130


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("arm", "more", "told"),
    [("ultraarm", ("udp://127.0.0.1:0",), b"but their order"), ("mycobot", ("--deny", "wifi"), b"deny to be of")],
)
async def test_what_a_family_cannot_do(arm: str, more: tuple[str, ...], told: bytes) -> None:
    async with started("sim:", TCP, *more, before=("--arm", arm)) as process:
        _, errors = await process.communicate()
        assert process.returncode == 2
        assert told in b" ".join(errors.split())


async def test_it_writes_no_trace(tmp_path: Path) -> None:
    async with started("sim:", TCP, before=("--trace", str(tmp_path / "trace"))) as process:
        _, errors = await process.communicate()
        assert process.returncode == 2
        assert b"no trace" in errors


@pytest.mark.full
async def test_metrics_are_served_beside_it(sim: Simulation) -> None:
    async with started(sim.url, TCP, "--metrics", "127.0.0.1:0") as process:
        await line(process)
        url = await line(process)
        page = await asyncio.to_thread(fetched, url)
        assert 'dobot_link_up{arm="magician"} 1.0' in page
        assert 'dobot_bridge_clients{arm="magician"} 0.0' in page
        process.send_signal(signal.SIGINT)
        output, errors = await process.communicate()
        assert (process.returncode, output, errors) == (130, b"", b"")


def fetched(url: str) -> str:
    with urllib.request.urlopen(url, timeout=IN_TIME) as answer:
        text: str = answer.read().decode()
        return text
