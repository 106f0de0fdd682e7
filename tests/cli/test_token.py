"""The token of a bridge on the command line: from a file or the environment, never twice, and never shown."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from dobot_async.bridge import bridge
from dobot_async.cli.credentials import with_token
from dobot_async.cli.main import cli
from dobot_async.simulator import simulate

TOKEN = "geheim-4711"


@pytest.fixture(autouse=True)
def none_given(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DOBOT_TOKEN", "DOBOT_BRIDGE_TOKEN", "DOBOT_URL"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    found = tmp_path / "a token"
    found.write_text(f"{TOKEN}\n")
    return found


@pytest.mark.cases(1)
@pytest.mark.parametrize("listen", ["tcp://127.0.0.1:0", "ws://127.0.0.1:0"])
@pytest.mark.parametrize("way", ["file", "environment"])
async def test_a_client_gets_in_with_it(listen: str, way: str, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options = ["--token-file", str(file)] if way == "file" else []
    if way == "environment":
        monkeypatch.setenv("DOBOT_TOKEN", TOKEN)

    async with simulate(listen="tcp://127.0.0.1:0") as sim, bridge(sim.url, listen=listen, token=TOKEN) as running:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "dobot_async", "--url", running.url, *options, "pose"),
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        assert process.pid
        out, err = await process.communicate()
        assert process.returncode == 0, err
        assert TOKEN.encode() not in out + err


@pytest.mark.parametrize(
    ("url", "expected"),
    [
        ("tcp://h:1", "tcp://h:1?token=geheim-4711"),
        ("ws://h:1?ca=a.pem", "ws://h:1?ca=a.pem&token=geheim-4711"),
        ("tcp://h:1?token=other", "tcp://h:1?token=other"),
        ("udp://h?token_file=f", "udp://h?token_file=f"),
        ("serial:///dev/ttyUSB0", "serial:///dev/ttyUSB0"),
        ("sim:", "sim:"),
    ],
)
def test_the_environment_gives_it_where_one_is_presented(
    url: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert with_token(url, None) == url
    monkeypatch.setenv("DOBOT_TOKEN", TOKEN)
    assert with_token(url, None) == expected


@pytest.mark.parametrize("url", ["sim:", "serial:///dev/ttyUSB0", "tcp://h:1?token=x", "ws://h:1?token_file=x"])
def test_a_file_that_would_have_no_effect_is_refused(url: str, file: Path) -> None:
    done = CliRunner().invoke(cli, ["--url", url, "--token-file", str(file), "pose"])
    assert done.exit_code == 2
    assert "--token-file is for a bridge" in done.stderr


@pytest.mark.parametrize(
    ("options", "environment", "message"),
    [
        (["--token", "a", "--token-file", "FILE"], {}, "not both"),
        ([], {"DOBOT_BRIDGE_TOKEN": ""}, "DOBOT_BRIDGE_TOKEN is empty"),
        (["--token", ""], {}, "a word of printable ASCII"),
        (["--token", "x" * 201], {}, "200 characters at most"),
    ],
)
def test_a_bridge_is_told_one_token_or_none(
    options: list[str], environment: dict[str, str], message: str, file: Path
) -> None:
    given = [str(file) if option == "FILE" else option for option in options]
    done: Any = CliRunner(env=environment).invoke(cli, ["bridge", "sim:", "tcp://127.0.0.1:0", *given])
    assert done.exit_code == 2
    assert message in done.stderr
