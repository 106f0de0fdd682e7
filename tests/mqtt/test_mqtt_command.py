"""`dobot-async mqtt`: as a process against a broker, and what it refuses."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import threading
import urllib.request
from asyncio.subprocess import PIPE
from collections.abc import Iterator

import pytest
from bridge_rig import until
from click.testing import CliRunner
from test_mqtt_gateway import FAR, ear, hall, stands, started

from dobot_async.cli.main import cli
from dobot_async.simulator import simulate

IN_TIME = 60.0
TCP = "tcp://127.0.0.1:0"


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Lets the threads end with which asyncio waits for processes."""
    yield
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)


@pytest.mark.full
async def test_it_tells_a_broker_serves_metrics_and_stops_the_arm_when_it_is_ended() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate(listen=TCP, speed=1) as sim:
        options = ("--broker", f"mqtt://127.0.0.1:{broker.port}", "--name", "arm", "--allow-motion")
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-W", "error", "-m", "dobot_async", "--url", sim.url, "mqtt", *options),
            *("--metrics", "127.0.0.1:0", "--interval", "0.2"),
            stdout=PIPE,
            stderr=PIPE,
            env={name: value for name, value in os.environ.items() if not name.startswith("DOBOT")},
        )
        try:
            assert process.stdout
            async with asyncio.timeout(IN_TIME):
                assert (await process.stdout.readline()).decode().startswith("arm at mqtt://127.0.0.1:")
                url = (await process.stdout.readline()).decode().strip()

            await heard.until("dobot/arm/state")
            assert (await heard.do("one", do="take_lease", seconds=60))["ok"]
            await heard.say({"session": "one", "id": "far", **FAR})
            await started(sim)
            page = await asyncio.to_thread(fetched, url)
            assert 'dobot_lease_held{arm="arm"} 1.0' in page
            assert 'dobot_moving{arm="arm"} 1.0' in page
            process.send_signal(signal.SIGTERM)
            await stands(sim)
            async with asyncio.timeout(IN_TIME):
                _, errors = await process.communicate()

            assert (process.returncode, errors.decode().strip()) == (143, "interrupted; the arm was told to stop")
            await until(lambda: heard.told["dobot/gateways/arm"] == "offline")
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()


def fetched(url: str) -> str:
    with urllib.request.urlopen(url, timeout=IN_TIME) as answer:
        text: str = answer.read().decode()
        return text


BROKER = ("--broker", "mqtt://127.0.0.1:1")


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--broker", "127.0.0.1"),
        ("--broker", "mqtt://me:secret@127.0.0.1"),
        (*BROKER, "--name", "a/b"),
        (*BROKER, "--name", "gateways"),
        (*BROKER, "--base", "#"),
        (*BROKER, "--id", "+"),
        (*BROKER, "--discovery", "a b"),
        (*BROKER, "--interval", "0"),
        (*BROKER, "--interval", "4000"),
        (*BROKER, "--speed", "101"),
        (*BROKER, "--metrics", "0.0.0.0:0"),
        (*BROKER, "--cell", __file__),
        (*BROKER, "--password-file", __file__),
    ],
)
def test_wrong_options_are_told_and_nothing_is_sent(options: tuple[str, ...]) -> None:
    result = CliRunner().invoke(cli, ["--url", "tcp://127.0.0.1:1", "mqtt", *options])
    assert result.exit_code == 2, result.output
    assert result.stderr
    assert not result.stdout
    assert "secret" not in result.stderr


def test_a_broker_that_is_not_there_is_told() -> None:
    result = CliRunner().invoke(cli, ["--url", "sim:", "mqtt", *BROKER])
    assert result.exit_code == 1
    assert result.stderr.startswith("error: no broker at mqtt://127.0.0.1:1")


def test_a_library_that_is_missing_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "dobot_async.mqtt", None)
    result = CliRunner().invoke(cli, ["--url", "sim:", "mqtt", *BROKER])
    assert result.exit_code == 2
    assert "pip install 'dobot-async[mqtt]'" in result.stderr
