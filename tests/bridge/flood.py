"""Silent connections at each port of this package: memory, lines written, and whether a client with the token gets in.

    python tests/bridge/flood.py [--connections 1100] [--seconds 30] [--ports tcp panel ...]

Ports of a bridge, the panel, MCP by HTTP and the metrics. Who serves is a process of its own, with room for 1024 files
as systems have it. The connections go to this computer's loopback interface, are closed in the end, and say nothing.
Each port has to keep below 80 MB and 200 lines a minute, and to let a client in within 6 s.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import resource
import socket
import ssl
import sys
import tempfile
import time
from asyncio.subprocess import PIPE, STDOUT, Process
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import aiohttp
import trustme

from dobot_async import DobotError, Magician

TOKEN = "flood-4711-flood"
MEGABYTES, LINES, SECONDS = 80.0, 200.0, 6.0
HELLO = {
    "jsonrpc": "2.0",
    "id": 1,
    "method": "initialize",
    "params": {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "flood", "version": "1"}},
}
CERTIFICATE, FILE = "CERTIFICATE", "FILE"
PORTS = {
    "tcp": ["bridge", "sim:", "tcp://127.0.0.1:0"],
    "ws": ["bridge", "sim:", "ws://127.0.0.1:0"],
    "tcp, TLS": ["bridge", "sim:", "tcp://127.0.0.1:0", "--certificate", CERTIFICATE],
    "wss": ["bridge", "sim:", "ws://127.0.0.1:0", "--certificate", CERTIFICATE],
    "udp": ["bridge", "sim:", "udp://127.0.0.1:0"],
    "panel": ["--url", "sim:", "panel", "--port", "0"],
    "panel, TLS": ["--url", "sim:", "panel", "--port", "0", "--certificate", CERTIFICATE],
    "mcp": ["--url", "sim:", "mcp", "--http", "127.0.0.1:0", "--http-token-file", FILE],
    "metrics": ["bridge", "sim:", "tcp://127.0.0.1:0", "--metrics", "127.0.0.1:0"],
}
"""What serves, by the port that is flooded; `dobot-async` comes before it."""


def few_files() -> None:
    resource.setrlimit(resource.RLIMIT_NOFILE, (1024, 1024))


def memory(process: Process) -> float:
    """MB that a process takes."""
    pages = int(Path(f"/proc/{process.pid}/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


async def connections(url: str, number: int) -> list[socket.socket]:
    """Opens connections that say nothing; by UDP, which has none, each says a byte."""
    place = urlsplit(url)
    datagrams = place.scheme == "udp"
    loop = asyncio.get_running_loop()
    opened: list[socket.socket] = []

    async def one() -> None:
        each = socket.socket(type=socket.SOCK_DGRAM if datagrams else socket.SOCK_STREAM)
        each.setblocking(False)
        opened.append(each)
        with suppress(OSError):
            await loop.sock_connect(each, (place.hostname or "", place.port or 0))
            if datagrams:
                await loop.sock_sendall(each, b"\0")

    for start in range(0, number, 100):
        await asyncio.gather(*(one() for _ in range(min(100, number - start))))

    return opened


AUTHORIZATION = {"Authorization": f"Bearer {TOKEN}"}
HTTP: dict[str, tuple[str, dict[str, Any]]] = {
    "panel": ("GET", {"params": {"token": TOKEN}}),
    "mcp": (
        "POST",
        {"json": HELLO, "headers": {**AUTHORIZATION, "Accept": "application/json, text/event-stream"}},
    ),
    "metrics": ("GET", {"headers": AUTHORIZATION}),
}
"""How a client gets in by HTTP: a method, and what more there is of the request."""


async def enter(name: str, url: str, authority: Path) -> float:
    """Seconds until a client with the token has been answered; infinite if it does not get in."""
    began = time.monotonic()
    try:
        if name.partition(",")[0] in HTTP:
            await ask(name, url, authority)
        else:
            trust = f"&ca={authority}" if name in {"tcp, TLS", "wss"} else ""
            async with Magician.connect(f"{url}?token={TOKEN}{trust}", control=False, timeout=SECONDS) as arm:
                await arm.get_pose()
    except (DobotError, aiohttp.ClientError, TimeoutError) as error:
        sys.stdout.write(f"   {type(error).__name__}: {error}\n")
        return float("inf")

    return time.monotonic() - began


async def ask(name: str, url: str, authority: Path) -> None:
    """Have one request answered, by a connection of its own."""
    method, more = HTTP[name.partition(",")[0]]
    trust = ssl.create_default_context(cafile=authority) if name.endswith("TLS") else None
    limit = aiohttp.ClientTimeout(total=SECONDS)
    async with (
        aiohttp.ClientSession(connector=aiohttp.TCPConnector(ssl=trust or True), timeout=limit) as http,
        http.request(method, url, **more) as answer,
    ):
        await answer.read()
        if answer.status != 200:
            raise aiohttp.ClientConnectionError(f"{url} answers with {answer.status}")


async def flood(name: str, arguments: argparse.Namespace, folder: Path) -> bool:
    """Floods one port; returns whether it keeps what it has to."""
    authority = trustme.CA()
    authority.cert_pem.write_to_path(folder / "ca.pem")
    authority.issue_cert("127.0.0.1").private_key_and_cert_chain_pem.write_to_path(folder / "server.pem")
    (folder / "token").write_text(TOKEN, encoding="ascii")
    files = {CERTIFICATE: str(folder / "server.pem"), FILE: str(folder / "token")}
    command = [files.get(each, each) for each in PORTS[name]]
    tokens = {"DOBOT_BRIDGE_TOKEN": TOKEN, "DOBOT_PANEL_OPERATOR": TOKEN, "DOBOT_PANEL_VIEWER": f"{TOKEN}-viewer"}
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "dobot_async", *command),
        stdout=PIPE,
        stderr=STDOUT,
        env={**os.environ, **tokens},
        preexec_fn=few_files,
    )
    assert process.stdout
    url = (await process.stdout.readline()).decode().strip()
    if name == "metrics":  # of which the second line tells
        url = (await process.stdout.readline()).decode().strip()

    if name.startswith("panel"):
        url = url.partition("?")[0]

    lines = 0

    async def count() -> None:
        nonlocal lines
        assert process.stdout
        async for _ in process.stdout:
            lines += 1

    counting = asyncio.create_task(count())
    own = (name, url, folder / "ca.pem")
    before = await enter(*own)
    began = time.monotonic()
    opened = await connections(url, arguments.connections)
    worst, most = 0.0, 0.0
    while not most or time.monotonic() < began + arguments.seconds:
        worst, most = max(worst, await enter(*own)), max(most, memory(process))
        await asyncio.sleep(1)

    minutes = (time.monotonic() - began) / 60
    for each in opened:
        each.close()

    process.terminate()
    await counting
    await process.wait()
    rate = lines / max(minutes, 1)
    fine = most < MEGABYTES and rate < LINES and worst < SECONDS
    sys.stdout.write(
        f"{name:10} {len(opened)} connections: {most:5.1f} MB, {rate:5.0f} lines a minute, "
        f"a client in after {worst:.2f} s ({before:.2f} s before): {'fine' if fine else 'TOO MUCH'}\n"
    )
    sys.stdout.flush()
    return fine


async def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connections", type=int, default=1100)
    parser.add_argument("--seconds", type=float, default=30)
    parser.add_argument("--ports", nargs="+", choices=list(PORTS), default=list(PORTS))
    arguments = parser.parse_args()
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 4096) if hard > 0 else 4096, hard))
    with tempfile.TemporaryDirectory() as folder:
        return sum([not await flood(name, arguments, Path(folder)) for name in arguments.ports])


if __name__ == "__main__":
    sys.exit(asyncio.run(main()))
