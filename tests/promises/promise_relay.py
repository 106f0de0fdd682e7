"""A TCP relay in real time, in this process or as one of its own: it may stand still, or be dead with the line open.

python promise_relay.py PORT [--longest 60] [--seed 0]

relays 127.0.0.1:PORT, stands still now and then, and says first at which port it listens.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from random import Random

__all__ = ["Relay", "relay_to"]


class Relay:
    """What goes on between clients and one place.

    Attributes:
        dead: Whether all is read and thrown away.
        up: Set while what clients send flows.
        down: Set while what they are sent flows. One way may stand still alone, with a reply on it.
        port: Where it listens.
    """

    def __init__(self, port: int) -> None:
        self.dead = False
        self.up, self.down = asyncio.Event(), asyncio.Event()
        self.up.set()
        self.down.set()
        self.port = 0
        self._to = port
        self._connections: set[asyncio.Task[None]] = set()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Relays one connection."""
        task = asyncio.current_task()
        assert task
        self._connections.add(task)
        ends = [writer]
        try:
            there, back = await asyncio.open_connection("127.0.0.1", self._to)
            ends.append(back)
            await asyncio.wait(
                [
                    asyncio.create_task(self._copy(reader, back, self.up)),
                    asyncio.create_task(self._copy(there, writer, self.down)),
                ],
                return_when=asyncio.FIRST_COMPLETED,
            )
        finally:
            self._connections.discard(task)
            for each in ends:
                each.close()

            for each in ends:
                with suppress(OSError):
                    await each.wait_closed()

    async def _copy(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, flows: asyncio.Event) -> None:
        with suppress(OSError):
            while data := await reader.read(4096):
                await flows.wait()
                if not self.dead:
                    writer.write(data)

    async def aclose(self) -> None:
        """Waits until all connections are over."""
        while self._connections:
            await asyncio.wait(list(self._connections))


@asynccontextmanager
async def relay_to(port: int) -> AsyncIterator[Relay]:
    """A relay to a port of this computer; when the block ends, its clients have to be gone."""
    relay = Relay(port)
    server = await asyncio.start_server(relay.serve, "127.0.0.1", 0)
    relay.port = server.sockets[0].getsockname()[1]
    try:
        yield relay
    finally:
        server.close()
        relay.up.set()
        relay.down.set()
        await relay.aclose()
        await server.wait_closed()


async def stall(relay: Relay, random: Random, longest: float) -> None:
    """Lets it stand still now and then: mostly for seconds, sometimes for up to the longest."""
    while True:
        await asyncio.sleep(random.expovariate(1 / 8))
        ways = random.choice(((relay.up, relay.down), (relay.up,), (relay.down,)))
        for way in ways:
            way.clear()

        await asyncio.sleep(min(longest, random.choice((random.expovariate(1 / 4), random.random() * longest))))
        for way in ways:
            way.set()


async def main() -> None:
    """Runs until it is ended."""
    options = argparse.ArgumentParser()
    options.add_argument("port", type=int)
    options.add_argument("--longest", type=float, default=60.0)
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()
    async with relay_to(given.port) as relay:
        sys.stdout.write(f"{relay.port}\n")
        sys.stdout.flush()
        await stall(relay, Random(given.seed), given.longest)


if __name__ == "__main__":
    with suppress(KeyboardInterrupt):
        asyncio.run(main())
