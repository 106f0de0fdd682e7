"""How much of a core the viewers of a panel cost, and how long a jog takes to begin and to end, as the page sees it.

The panel is a process of its own, with a simulated arm in it; the pages are in this one, so that they are not counted.
"""

from __future__ import annotations

import asyncio
import json
import os
import statistics
import sys
import time
from asyncio.subprocess import PIPE
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import aiohttp

from benchmarks.report import Row, parsed, show


class Viewer:
    """A page that looks on, or holds."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.states = 0
        self.tick = 0
        self.last: dict[str, Any] = {}
        self.changed = asyncio.Event()

    async def read(self) -> None:
        """Count what comes."""
        async for message in self.socket:
            found = json.loads(message.data)
            self.states += found["type"] == "state"
            self.tick = found["n"] if found["type"] == "tick" else self.tick
            self.last[found["type"]] = found
            self.changed.set()

    async def until(self, condition: Any) -> float:
        """Return when something was told."""
        while not condition(self.last):
            self.changed.clear()
            await self.changed.wait()

        return time.perf_counter()

    async def send(self, **message: Any) -> None:
        """Ask for something."""
        await self.socket.send_str(json.dumps(message))


def cpu_seconds(process: int) -> float:
    """How long a process has computed; 0 where the system does not show it."""
    status = Path(f"/proc/{process}/stat")
    if not status.exists():
        return 0.0

    fields = status.read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def jogged(viewer: Viewer, presses: int) -> tuple[list[float], list[float]]:
    """How long the arm takes to move after a press, and to stand after a release, as the panel tells."""
    begins, ends = [], []
    await viewer.send(do="take_lease", arm="arm")
    await viewer.until(lambda last: last.get("tick"))
    for press in range(1, presses + 1):
        direction = "y+" if press % 2 else "y-"
        began = time.perf_counter()
        await viewer.send(do="jog", arm="arm", direction=direction, press=press, tick=viewer.tick, speed=50)
        moved = await viewer.until(lambda last, press=press: last.get("jog", {}).get("press") == press)
        begins.append(moved - began)
        for _ in range(3):
            await asyncio.sleep(0.1)
            await viewer.send(do="beat", arm="arm", press=press, tick=viewer.tick)

        released = time.perf_counter()
        await viewer.send(do="release", arm="arm", press=press)
        stood = await viewer.until(lambda last: last["jog"]["state"] == "ended")
        ends.append(stood - released)

    return begins, ends


async def measured(seconds: int, viewers: int, presses: int) -> Row:
    """Start a panel, look on with several pages, and jog with one of them."""
    command = (sys.executable, "-m", "dobot_async", "--url", "sim:", "--json", "panel", "--port", "0")
    process = await asyncio.create_subprocess_exec(*command, stdout=PIPE)
    assert process.stdout
    where = json.loads(await process.stdout.readline())
    async with AsyncExitStack() as stack:
        pages = []
        for _ in range(viewers):
            http = await stack.enter_async_context(aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True)))
            await (await http.get(where["operator"])).read()
            origin = {"Origin": where["url"].rstrip("/")}
            socket = await stack.enter_async_context(http.ws_connect(f"{where['url']}ws", headers=origin))
            pages.append(Viewer(socket))

        reading = [asyncio.create_task(each.read()) for each in pages]
        await pages[0].until(lambda last: last.get("state"))
        before, counted, began = cpu_seconds(process.pid), sum(each.states for each in pages), time.perf_counter()
        await asyncio.sleep(seconds)
        taken = time.perf_counter() - began
        used = cpu_seconds(process.pid) - before
        rate = (sum(each.states for each in pages) - counted) / taken / viewers
        begins, ends = await jogged(pages[0], presses)
        for each in pages:
            await each.socket.close()

        await asyncio.gather(*reading)

    process.terminate()
    await process.wait()
    return {
        "viewers": viewers,
        "poses_per_s": round(rate, 1),
        "core_percent": round(100 * used / taken, 1),
        "press_ms": round(1e3 * statistics.median(begins), 1),
        "press_most_ms": round(1e3 * max(begins), 1),
        "release_ms": round(1e3 * statistics.median(ends), 1),
        "release_most_ms": round(1e3 * max(ends), 1),
    }


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, seconds=10, viewers=10, presses=20)
    row = asyncio.run(measured(options.seconds, options.viewers, options.presses))
    show("panel", [row], as_json=options.json, seconds=options.seconds)


if __name__ == "__main__":
    main()
