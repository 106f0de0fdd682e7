"""What the tests of Zenoh share: places and sessions that are confined to the loopback interface, and processes."""

from __future__ import annotations

import asyncio
import json
import os
import random
import socket
import sys
import threading
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import zenoh

__all__ = [
    "configured",
    "connect_to",
    "endpoint",
    "keep",
    "line",
    "place",
    "processes_ended",
    "program",
    "session",
    "warm_up",
    "written",
]

IN_TIME = 20.0
PORTS = 20_000, 32_000


def endpoint(protocol: str = "tcp") -> str:
    """A free place to listen at.

    It is none of those that systems give to who does not ask for one: nobody gets it while nobody listens there, not
    even who tries to connect to it, who could meet himself.
    """
    while True:
        port = random.randrange(*PORTS)
        with suppress(OSError), socket.socket() as probe:
            probe.bind(("127.0.0.1", port))
            return f"{protocol}/127.0.0.1:{port}"


def place(name: str = "left", **more: str) -> str:
    """Where a bridge listens."""
    return f"zenoh://{name}?listen={endpoint()}" + "".join(f"&{option}={value}" for option, value in more.items())


def connect_to(url: str) -> str:
    """The endpoint in a client's URL."""
    return parse_qs(urlsplit(url).query)["connect"][0]


def configured(config: zenoh.Config | None = None, **settings: Any) -> zenoh.Config:
    """A configuration that looks for nobody; `connect__endpoints` is connect/endpoints."""
    given = {
        "mode": "client" if "connect__endpoints" in settings else "peer",
        "scouting__multicast__enabled": False,
        "scouting__gossip__enabled": False,
        "listen__endpoints": [],
        "transport__shared_memory__enabled": False,
        **settings,
    }
    config = config or zenoh.Config()
    for key, value in given.items():
        config.insert_json5(key.replace("__", "/"), json.dumps(value))

    return config


@asynccontextmanager
async def session(url: str = "", **settings: Any) -> AsyncIterator[zenoh.Session]:
    """A session that knows nothing of arms, connected as a client of an URL would be."""
    if url:
        settings["connect__endpoints"] = [connect_to(url)]

    opened = await asyncio.to_thread(zenoh.open, configured(**settings))
    try:
        yield opened
    finally:
        await asyncio.to_thread(opened.close)


def keep(source: zenoh.Session, key: str) -> list[tuple[str, bytes]]:
    """Everything that is published, from now on."""
    kept: list[tuple[str, bytes]] = []

    def take(sample: zenoh.Sample) -> None:
        kept.append((str(sample.key_expr), sample.payload.to_bytes()))

    source.declare_subscriber(key, zenoh.handlers.Callback(take, indirect=False))
    return kept


def warm_up() -> None:
    """Lets Zenoh open what it keeps as long as the program runs: it is nothing that a test leaves behind."""
    where = endpoint()
    with zenoh.open(configured(listen__endpoints=[where])) as one:
        kept = keep(one, "warm/up")
        with zenoh.open(configured(connect__endpoints=[where])) as other:
            while not kept:
                other.put("warm/up", b"")


def written(path: Path, **settings: Any) -> Path:
    """A configuration file."""
    path.write_text(str(configured(**settings)), encoding="utf-8")
    return path


@asynccontextmanager
async def program(*arguments: str, before: tuple[str, ...] = ()) -> AsyncIterator[Process]:
    """A Python process, killed in the end, without settings of this one's user."""
    process = await asyncio.create_subprocess_exec(
        *before,
        *(sys.executable, "-W", "error", *arguments),
        stdout=PIPE,
        stderr=PIPE,
        env={name: value for name, value in os.environ.items() if not name.startswith(("DOBOT", "ZENOH"))},
    )
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            process.kill()

        await process.communicate()


async def line(process: Process) -> str:
    """The next line that a process prints."""
    assert process.stdout
    assert process.stderr
    async with asyncio.timeout(IN_TIME):
        told = await process.stdout.readline()
        assert told, (await process.stderr.read()).decode()
        return told.decode().strip()


def processes_ended() -> None:
    """Lets the threads end with which asyncio waits for processes; they outlive these for a moment."""
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)
