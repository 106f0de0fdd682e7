"""The part of bench_fleet that is over Zenoh: the same starts and stops, of arms that other processes serve.

    python -m benchmarks.fleet_over_zenoh '{"names": ["arm0", "arm1"]}'

is such a process: it runs an arm and a server for each name, prints a JSON list of URLs, and answers "each" as arm.py
does. The arms have no serial line, so what is found is the way of Zenoh alone, on the loopback interface: `round_trip`
is that of one arm of the same fleet, asked for its pose again and again while nothing else goes on; it is what a start
or a stop takes at least.
"""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Coroutine, Iterator, Sequence
from contextlib import AsyncExitStack, ExitStack, contextmanager
from typing import Any

from benchmarks.arm import Arms
from benchmarks.report import Row, percentile
from dobot_async import Magician
from dobot_async.bridge import bridge
from dobot_async.magician import commands as c
from dobot_async.simulator import simulate

__all__ = ["beside"]

Started = Callable[[Sequence[str], int], Coroutine[Any, Any, tuple[list[float], int]]]
Stopped = Callable[[Sequence[str], int], Coroutine[Any, Any, list[float]]]
WAIT = c.SET_WAIT_CMD.name
ASKED = 50  # times for each round


def beside(local: Sequence[Row], counts: Sequence[int], rounds: int, started: Started, stopped: Stopped) -> list[Row]:
    """Returns the rows of fleets that are over Zenoh below those that are not.

    Args:
        local: The rows of fleets on serial lines.
        counts: How many arms.
        rounds: How often each starts, and how often it is stopped.
        started: Starts the arms at URLs so often; returns the skews that the fleet tells, and the timeouts.
        stopped: Stops them so often; returns when it was told to, by `time.monotonic`.
    """
    found = [{"over": "serial", **row} for row in local]
    found += [{"over": "zenoh", **measured(count, rounds, started, stopped)} for count in counts]
    columns: Row = dict.fromkeys(column for row in found for column in row)
    return [columns | row for row in found]


def measured(count: int, rounds: int, started: Started, stopped: Stopped) -> Row:
    """The row of so many arms."""
    with servers(count) as there:
        urls = [url for process in there for url in process.urls]
        trips = asyncio.run(asked(urls[0], ASKED * rounds))
        told, timeouts = asyncio.run(started(urls, rounds))
        begun = [[began for began, _ in arm[-rounds:]] for arm in waits(there)]
        called = asyncio.run(stopped(urls, rounds))
        stood = [[ended for _, ended in arm[-rounds:]] for arm in waits(there)]

    skews = [max(instants) - min(instants) for instants in zip(*begun, strict=True)]
    stops = [max(instants) - call for call, instants in zip(called, zip(*stood, strict=True), strict=True)]
    figures = {
        "skew_p50_ms": percentile(skews, 50),
        "skew_p99_ms": percentile(skews, 99),
        "told_p50_ms": percentile(told, 50),
        "stop_stood_p50_ms": percentile(stops, 50),
        "round_trip_p50_ms": percentile(trips, 50),
    }
    return {"arms": count, **{name: round(value * 1000, 2) for name, value in figures.items()}, "timeouts": timeouts}


async def asked(url: str, times: int) -> list[float]:
    """Seconds that each question to one arm took."""
    async with Magician.connect(url, control=False) as arm:
        found = []
        for _ in range(times):
            begin = time.perf_counter()
            await arm.get_pose()
            found.append(time.perf_counter() - begin)

        return found


def waits(there: Sequence[Arms]) -> list[list[tuple[float, float]]]:
    """When each waiting of each arm began and ended."""
    return [
        [(began, ended) for name, began, ended in arm if name == WAIT and ended > began]
        for process in there
        for arm in process.each
    ]


@contextmanager
def servers(count: int) -> Iterator[list[Arms]]:
    """Arms and their servers, in as many processes as there are processors beside this one's."""
    processes = min(count, max(1, (os.cpu_count() or 1) - 1))
    names = [f"arm{number}" for number in range(count)]
    with ExitStack() as stack:
        yield [stack.enter_context(server(names[share::processes])) for share in range(processes)]


@contextmanager
def server(names: Sequence[str]) -> Iterator[Arms]:
    """A process with the arms of some names."""
    command = [sys.executable, "-m", "benchmarks.fleet_over_zenoh", json.dumps({"names": names})]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield Arms(process)
        finally:
            assert process.stdin
            process.stdin.close()


async def serve(names: Sequence[str]) -> None:
    """Runs arms and their servers until the input ends."""
    async with AsyncExitStack() as stack:
        arms = [await stack.enter_async_context(simulate("magician", clock=time.monotonic)) for _ in names]
        served = [
            await stack.enter_async_context(bridge(arm.url, listen=f"zenoh://{name}?listen=tcp/127.0.0.1:0"))
            for arm, name in zip(arms, names, strict=True)
        ]
        print(json.dumps([each.url for each in served]), flush=True)
        while (await asyncio.to_thread(sys.stdin.readline)).strip() == "each":
            done = [[(each.name, each.started, each.finished) for each in sim.arm.executed] for sim in arms]
            print(json.dumps(done), flush=True)


if __name__ == "__main__":
    asyncio.run(serve(**json.loads(sys.argv[1])))
