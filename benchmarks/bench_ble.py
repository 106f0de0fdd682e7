"""Round trips over BLE beside the least that the radio's model allows, by connection interval and packet length.

    python benchmarks/bench_ble.py [--requests 50] [--json] [--quick]

The driver talks to the simulated arm through bleak and a D-Bus of its own, so it needs Linux and dbus-daemon. A request
goes out right after a connection event, with the answer to the one before; the arm's answer comes with a later event.
How many intervals that takes at the least is the limit. `ratio` is the median of the round trips over the limit.

A request of two chunks is measured with the 20 ms that the driver keeps between them by default, and without; the limit
knows. It counts the 20 ms from when the first chunk is sent, the driver from when the system has taken it: where they
end just before an event, as at 7.5 ms, a request may miss it, and takes an interval more.
"""

from __future__ import annotations

import asyncio
import statistics
import time

from report import Row, parsed, show

from dobot_async.magician import commands as c
from dobot_async.magician.frame import Frame, Parser, encode
from dobot_async.simulator import simulate
from dobot_async.simulator.radio import Radio, round_trip
from dobot_async.transports import Transport, open_transport
from dobot_async.transports.ble import PACE

INTERVALS = (0.0075, 0.015, 0.03, 0.05)
MTUS = (23, 247)
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


async def measure(interval: float, mtu: int, pace: float, requests: int) -> list[Row]:
    """The rows of one connection."""
    rows = []
    radio = Radio(interval=interval, mtu=mtu)
    async with simulate(listen=f"ble:?interval={interval}&mtu={mtu}") as sim:
        transport = await open_transport(f"{sim.url}?pace={pace}", arm="magician")
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
                        "interval_ms": interval * 1000,
                        "mtu": mtu,
                        "pace_ms": pace * 1000,
                        "request": name,
                        "bytes": [len(request), answer],
                        "median_ms": round(median * 1000, 2),
                        "worst_ms": round(max(times) * 1000, 2),
                        "limit_ms": round(limit * 1000, 2),
                        "ratio": round(median / limit, 3),
                    }
                )
        finally:
            await transport.aclose()

    return rows


async def measure_all(requests: int) -> list[Row]:
    """All rows."""
    asyncio.get_running_loop().slow_callback_duration = 60.0  # a machine that is busy is no news for standard error
    places = [(interval, mtu, pace) for interval in INTERVALS for mtu in MTUS for pace in (PACE, 0.0)]
    return [row for place in places for row in await measure(*place, requests)]


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, requests=50)
    show("ble", asyncio.run(measure_all(options.requests)), as_json=options.json, requests=options.requests)


if __name__ == "__main__":
    main()
