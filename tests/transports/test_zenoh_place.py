"""How a URL becomes a configuration of Zenoh: what is not said stays closed."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from dobot_async import ConnectFailed
from dobot_async.transports import open_transport
from dobot_async.transports.zenoh.config import GONE, ZenohConfig, address

LEASE = "transport/link/tx/lease"


@pytest.fixture(autouse=True)
def no_configuration(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ZENOH_CONFIG", raising=False)


def settings(query: str, *, serving: bool) -> dict[str, Any]:
    """What matters of the configuration of a URL."""
    config = ZenohConfig.of(urlsplit(f"zenoh://left{query}"), serving=serving).configuration(serving=serving)
    keys = ("mode", "listen/endpoints", "connect/endpoints", "scouting/multicast/enabled", "scouting/gossip/enabled")
    return {
        key.split("/")[0] if "scouting" not in key else key.split("/")[1]: json.loads(config.get_json(key))
        for key in keys
    } | {
        "lease": json.loads(config.get_json(LEASE)),
        "autoconnect": json.loads(config.get_json("scouting/multicast/autoconnect")),
    }


@pytest.mark.parametrize(
    ("query", "serving", "expected"),
    [
        ("", True, {"mode": "peer", "listen": ["tcp/127.0.0.1:0"], "gossip": False, "connect": []}),
        ("", False, {"mode": "peer", "listen": [], "connect": []}),
        ("?listen=tcp/1.2.3.4:5", True, {"listen": ["tcp/1.2.3.4:5"], "multicast": False, "gossip": False}),
        ("?connect=tcp/r:1", True, {"mode": "client", "listen": [], "connect": ["tcp/r:1"], "multicast": False}),
        ("?connect=tcp/a:1,tcp/b:2", False, {"mode": "client", "connect": ["tcp/a:1", "tcp/b:2"], "multicast": False}),
        ("?lan=yes", True, {"mode": "peer", "listen": {"router": ["tcp/[::]:7447"], "peer": ["tcp/[::]:0"]}}),
    ],
)
def test_what_is_not_said_stays_closed(query: str, serving: bool, expected: dict[str, Any]) -> None:
    found = settings(query, serving=serving)
    assert {name: found[name] for name in expected} == expected
    assert found["lease"] == 1500


def test_a_server_for_this_computer_connects_to_nobody() -> None:
    assert settings("", serving=True)["autoconnect"] == {"router": [], "peer": [], "client": []}


def test_a_file_says_everything_but_what_the_url_says(tmp_path: Path) -> None:
    file = tmp_path / "a b.json5"
    file.write_text('{mode: "client", connect: {endpoints: ["tcp/f:1"]}, transport: {link: {tx: {lease: 5000}}}}')
    url = address("left", config=str(file))
    found = settings(url.removeprefix("zenoh://left"), serving=False)
    assert (found["mode"], found["connect"], found["lease"]) == ("client", ["tcp/f:1"], 5000)
    url = address("left", config=str(file), connect=("tcp/[::1]:2",))
    assert settings(url.removeprefix("zenoh://left"), serving=False)["connect"] == ["tcp/[::1]:2"]


async def test_without_the_package_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "zenoh", None)
    with pytest.raises(ConnectFailed, match=r"pip install 'dobot-async\[zenoh\]'"):
        await open_transport("zenoh://left", arm="magician")


def test_who_is_gone_is_noticed_soon_unless_a_file_says_otherwise(tmp_path: Path) -> None:
    file = tmp_path / "slow.json5"
    file.write_text(json.dumps({"transport": {"unicast": {"open_timeout": 7000}}}))
    found = ZenohConfig.of(urlsplit(f"zenoh://left?config={file}"), serving=False).configuration(serving=False)
    assert [json.loads(found.get_json(key)) for key in GONE] == [7000, 1500, 1_500_000]
