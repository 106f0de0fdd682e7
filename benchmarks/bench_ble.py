"""Round trips over BLE beside the least that the radio's model allows, by connection interval and packet length.

    python -m benchmarks.bench_ble [--requests 50] [--json] [--quick]

The driver talks to the simulated arm through bleak and a D-Bus of its own, so it needs Linux and dbus-daemon. The arm,
its radio and the Bluetooth service are a process of their own, with a clock that is finer than that of an ordinary
event loop, for a radio is never late. The driver runs as it does for everybody.

A request goes out right after a connection event, with the answer to the one before; the arm's answer comes with a
later event. How many intervals that takes at the least is the limit. `ratio` is the median of the round trips over it.

The limit keeps the pace as the driver does. A request of two chunks is measured with the 20 ms between them that is the
default, and without. The second chunk can take the first event after the pace: at an interval of 7.5 ms the third one,
2.5 ms later. The way of the answer before to the driver, and of the chunk to the radio, have to fit into these. On a
machine that is busy with something else they do not always, and then a request takes an interval more. `least_ms` tells
the best of all, `worst_ms` the worst.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import selectors
import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import AsyncExitStack, contextmanager
from multiprocessing.connection import Connection

from benchmarks.report import Row, parsed, show
from dobot_async._core.protocol.transport import Transport
from dobot_async.arms.magician.frame import Frame, Parser, encode
from dobot_async.magician import commands as c
from dobot_async.simulator import simulate
from dobot_async.simulator.ble.link_layer import RadioSettings, round_trip
from dobot_async.simulator.ble.testbed import forget_bus
from dobot_async.transports import open_transport
from dobot_async.transports.ble.transport import PACE

RADIOS = [RadioSettings(interval=interval, mtu=mtu) for interval in (0.0075, 0.015, 0.03, 0.05) for mtu in (23, 247)]
PARAMS = c.SET_PTP_JOINT_PARAMS.request.encode(c.PTPJointParams((200.0,) * 4, (200.0,) * 4))
REQUESTS = {
    "GetPose": encode(Frame(c.GET_POSE.id, 0, b"")),
    "SetPTPJointParams": encode(Frame(c.SET_PTP_JOINT_PARAMS.id, 1, PARAMS)),
}


async def ask(transport: Transport, request: bytes) -> int:
    """Sends a request and awaits its answer; returns how long that is."""
    parser = Parser()
    await transport.send(request)
    while not (found := parser.feed(await transport.receive())):
        pass

    return len(encode(found[0]))


async def measure(radio: RadioSettings, url: str, pace: float, requests: int) -> list[Row]:
    """The rows of one connection."""
    rows = []
    transport = await open_transport(f"{url}?pace={pace}", arm="magician")
    try:
        for name, request in REQUESTS.items():
            if pace != PACE and len(request) <= radio.payload:
                continue  # one chunk has no pace to keep

            answer = await ask(transport, request)
            times = []
            for _ in range(requests):
                started = time.perf_counter()
                await ask(transport, request)
                times.append(time.perf_counter() - started)

            limit = round_trip(radio, len(request), answer, pace)
            median = statistics.median(times)
            rows.append(
                {
                    "interval_ms": radio.interval * 1000,
                    "mtu": radio.mtu,
                    "pace_ms": pace * 1000,
                    "request": name,
                    "bytes": [len(request), answer],
                    "median_ms": round(median * 1000, 2),
                    "least_ms": round(min(times) * 1000, 2),
                    "worst_ms": round(max(times) * 1000, 2),
                    "limit_ms": round(limit * 1000, 2),
                    "ratio": round(median / limit, 3),
                }
            )
    finally:
        await transport.aclose()

    return rows


async def measure_all(urls: Sequence[str], requests: int) -> list[Row]:
    """All rows."""
    places = [(radio, url, pace) for radio, url in zip(RADIOS, urls, strict=True) for pace in (PACE, 0.0)]
    try:
        return [row for place in places for row in await measure(*place, requests)]
    finally:
        await forget_bus()


@contextmanager
def world() -> Iterator[list[str]]:
    """Runs simulated arms, each behind one of the radios, for the length of a block; yields their URLs."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=simulated, args=(theirs,))
    process.start()
    theirs.close()
    with ours:
        environment, urls = ours.recv()
        os.environ.update(environment)
        yield urls

    process.join()


def simulated(caller: Connection) -> None:
    """The process of the arms."""

    # epoll, which a loop takes by itself, waits for whole milliseconds.
    def loop() -> asyncio.AbstractEventLoop:
        return asyncio.SelectorEventLoop(selectors.SelectSelector())

    with asyncio.Runner(loop_factory=loop) as runner:
        runner.run(serve(caller))


async def serve(caller: Connection) -> None:
    """Runs the arms until the caller has had enough."""
    ended = asyncio.Event()
    async with AsyncExitStack() as stack:
        listen = [f"ble:?interval={radio.interval}&mtu={radio.mtu}" for radio in RADIOS]
        arms = [await stack.enter_async_context(simulate(listen=each)) for each in listen]
        caller.send((arms[0].environment, [arm.url for arm in arms]))
        asyncio.get_running_loop().add_reader(caller.fileno(), ended.set)
        await ended.wait()
        asyncio.get_running_loop().remove_reader(caller.fileno())


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, requests=50)
    with world() as urls:
        rows = asyncio.run(measure_all(urls, options.requests))

    show("ble", rows, as_json=options.json, requests=options.requests)


if __name__ == "__main__":
    main()
