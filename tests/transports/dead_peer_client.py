"""A program of its own, in a network of its own: opens connections, and prints when each is found to be dead.

    dead_peer_client.py CA URL...      then a line on stdin at the moment at which the network goes

Prints one line of JSON for each connection: what it was, seconds since then, the error's kind and its cause's.
"""

# ruff: noqa: T201 - what it prints is what it is for

from __future__ import annotations

import asyncio
import json
import sys
import time
from contextlib import aclosing, suppress
from typing import Any

import anyio

from dobot_async._core.link.link import Link
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Parser, request
from dobot_async.errors import ConnectionLost
from dobot_async.transports import open_transport

BEFORE_PROBES_GIVE_UP = 5.7  # seconds
BARRIERS = [request(row, b"", queued=False) for row in (c.GET_POSE, c.GET_ALARMS_STATE)]


async def main() -> None:
    """Opens all, waits for the word, and for the end of each."""
    ca, *urls = sys.argv[1:]
    down = asyncio.Event()
    watches = []
    for url in urls:
        secured = f"{url}?ca={ca}" if url.startswith("wss") or "tls" in url else url
        secured = secured.replace("tls", "tcp")
        for manner, pause in (("idle", None), ("sending", 0.0), ("sent late", BEFORE_PROBES_GIVE_UP)):
            transport: Any = await open_transport(secured, arm="magician")
            await transport.send(b"hello")
            assert await transport.receive() == b"hello"
            watches.append(asyncio.create_task(watch(f"{url.split(':')[0]} {manner}", transport, down, pause)))

    transport = await open_transport(urls[0], arm="magician")
    link = Link(transport, Parser(), request, url=urls[0], barriers=BARRIERS)
    watches.append(asyncio.create_task(watch_link(link, down)))
    print("open", flush=True)
    await asyncio.to_thread(sys.stdin.readline)
    down.set()
    await asyncio.gather(*watches)


async def watch(what: str, transport: Any, down: asyncio.Event, pause: float | None) -> None:
    """Waits for the end of a connection on which something is sent after a pause, or nothing."""
    async with aclosing(transport):
        receiving = asyncio.create_task(transport.receive())
        await down.wait()
        begun = time.monotonic()
        if pause is not None:
            await asyncio.sleep(pause)
            with suppress(anyio.BrokenResourceError):  # on a busy machine it is found to be dead before
                await transport.send(b"lost")

        await asyncio.wait([receiving])
        tell(what, begun, receiving.exception())


async def watch_link(link: Link[Any], down: asyncio.Event) -> None:
    """Waits for the end of a link on which nothing is asked."""
    lost: asyncio.Future[ConnectionLost] = asyncio.get_running_loop().create_future()
    link.on_lost.add(lost.set_result)
    async with aclosing(link):
        await down.wait()
        begun = time.monotonic()
        tell("link idle", begun, await lost)


def tell(what: str, begun: float, error: BaseException | None) -> None:
    """Prints what has come of a connection."""
    cause = error and error.__cause__
    found = {"what": what, "seconds": time.monotonic() - begun, "error": type(error).__name__, "cause": repr(cause)}
    print(json.dumps(found | {"of_the_system": isinstance(cause, OSError)}), flush=True)


asyncio.run(main())
