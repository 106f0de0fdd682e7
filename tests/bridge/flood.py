"""Silent connections at each port of a bridge: its memory, what it writes, and whether a client with the token gets in.

    python tests/bridge/flood.py [--connections 1100] [--seconds 30]

The bridge is a process of its own, with room for 1024 files as systems have it. The connections go to this computer's
loopback interface, are closed in the end, and say nothing. Each port has to keep below 80 MB and 200 lines a minute,
and to let a client in within 6 s.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import resource
import socket
import sys
import tempfile
import time
from asyncio.subprocess import PIPE, STDOUT, Process
from contextlib import suppress
from pathlib import Path
from urllib.parse import urlsplit

import trustme

from dobot_async import DobotError, Magician

TOKEN = "flood-4711"
MEGABYTES, LINES, SECONDS = 80.0, 200.0, 6.0
PORTS = {
    "tcp": ["tcp://127.0.0.1:0"],
    "ws": ["ws://127.0.0.1:0"],
    "tcp, TLS": ["tcp://127.0.0.1:0", "--certificate"],
    "wss": ["wss://127.0.0.1:0", "--certificate"],
    "udp": ["udp://127.0.0.1:0"],
}


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


async def enter(url: str) -> float:
    """Seconds until a client with the token has read the pose; infinite if it does not get in."""
    began = time.monotonic()
    try:
        async with Magician.connect(url, control=False, timeout=SECONDS) as arm:
            await arm.get_pose()
    except DobotError as error:
        sys.stdout.write(f"   {error}\n")
        return float("inf")

    return time.monotonic() - began


async def flood(name: str, arguments: argparse.Namespace, folder: Path) -> bool:
    """Floods one port; returns whether it keeps what it has to."""
    authority = trustme.CA()
    authority.cert_pem.write_to_path(folder / "ca.pem")
    authority.issue_cert("127.0.0.1").private_key_and_cert_chain_pem.write_to_path(folder / "server.pem")
    listen, *tls = PORTS[name]
    process = await asyncio.create_subprocess_exec(
        *(
            sys.executable,
            "-m",
            "dobot_async",
            "bridge",
            "sim:",
            listen,
            *tls,
            *[str(folder / "server.pem")][: len(tls)],
        ),
        stdout=PIPE,
        stderr=STDOUT,
        env={**os.environ, "DOBOT_BRIDGE_TOKEN": TOKEN},
        preexec_fn=few_files,
    )
    assert process.stdout
    url = (await process.stdout.readline()).decode().strip()
    lines = 0

    async def count() -> None:
        nonlocal lines
        assert process.stdout
        async for _ in process.stdout:
            lines += 1

    counting = asyncio.create_task(count())
    trust = f"&ca={folder / 'ca.pem'}" if tls else ""
    own = f"{url}?token={TOKEN}{trust}"
    before = await enter(own)
    began = time.monotonic()
    opened = await connections(url, arguments.connections)
    worst, most = 0.0, 0.0
    while not most or time.monotonic() < began + arguments.seconds:
        worst, most = max(worst, await enter(own)), max(most, memory(process))
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
        f"{name:9} {len(opened)} connections: {most:5.1f} MB, {rate:5.0f} lines a minute, "
        f"a client in after {worst:.2f} s ({before:.2f} s before): {'fine' if fine else 'TOO MUCH'}\n"
    )
    sys.stdout.flush()
    return fine


async def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connections", type=int, default=1100)
    parser.add_argument("--seconds", type=float, default=30)
    arguments = parser.parse_args()
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 4096) if hard > 0 else 4096, hard))
    with tempfile.TemporaryDirectory() as folder:
        return sum([not await flood(name, arguments, Path(folder)) for name in PORTS])


if __name__ == "__main__":
    sys.exit(asyncio.run(main()))
