"""A fleet on lines of 115200 baud: how far apart its arms start, and how soon a stop is at all of them.

    python -m benchmarks.bench_fleet [--rounds 40] [--json] [--quick]

The arms are simulated in other processes, which tell by one clock with this one what came to them, and when. `skew` is
between the first and the last arm's beginning to execute what `fleet.together` started; `told` is what the fleet says
of it. A stop is at an arm (`heard`) when the last byte of the first stop command is through its line, and the arm
stands (`stood`) when it has executed it; both are counted from the call of `fleet.stop()` to the last arm. `bare` is
the same for a loop that does nothing but write that command to each port: what no driver can be faster than. A
simulator attends to its arms one after the other, which real arms do not wait for: that is in `stood`, not in `heard`.
The same over Zenoh, if it is installed, is below: see fleet_over_zenoh.py.
"""

from __future__ import annotations

import asyncio
import os
import sys
import time
import tty
from collections.abc import Sequence
from importlib.util import find_spec

from benchmarks import minimal
from benchmarks.arm import Arms, crowd
from benchmarks.fleet_over_zenoh import beside
from benchmarks.report import Row, parsed, percentile, show
from dobot_async import Fleet
from dobot_async.magician import commands as c

COUNTS = (2, 8, 64)
FEW = (2,)
ONE = 1
WAIT = c.SET_WAIT_CMD.name
SHORT, LONG = 0.05, 100.0  # seconds of waiting, that ends by itself, and that a stop ends
SETTLED = 0.2  # seconds after which all arms execute what they were given, and nothing is on any line
STOP, CLEAR = minimal.framed(242, minimal.WRITE), minimal.framed(245, minimal.WRITE)
HOLD = minimal.framed(110, minimal.WRITE_QUEUED, int(LONG * 1000).to_bytes(4, "little"))
BUFFER = 1 << 16


def urls_of(there: Sequence[Arms]) -> list[str]:
    """Where they all are."""
    return [url for process in there for url in process.urls]


def waits(there: Sequence[Arms]) -> list[list[tuple[float, float]]]:
    """When the waiting of each arm began and ended."""
    done = [arm for process in there for arm in process.each]
    return [[(started, ended) for name, started, ended in arm if name == WAIT and ended > started] for arm in done]


async def started(urls: Sequence[str], rounds: int) -> tuple[list[float], int]:
    """Starts all arms together, again and again; returns the skews that the fleet tells, and the timeouts."""
    told = []
    async with Fleet.connect({url: url for url in urls}) as fleet:
        for _ in range(rounds):
            async with fleet.together() as together:
                for name in together:
                    together[name].wait(SHORT)

            await together.wait()
            told.append(together.skew)

        return told, sum(fleet[name].link.stats.timeouts for name in fleet)


async def stopped(urls: Sequence[str], rounds: int) -> list[float]:
    """Stops all arms, again and again; returns when it was told to."""
    called = []
    async with Fleet.connect({url: url for url in urls}) as fleet:
        for _ in range(rounds):
            for name in fleet:
                await fleet[name].queue.wait(LONG)

            await asyncio.sleep(SETTLED)
            called.append(time.monotonic())
            await fleet.stop()

    return called


def stopped_bare(urls: Sequence[str], rounds: int) -> list[float]:
    """Does so with nothing but writes."""
    called = []
    ports = [os.open(url.removeprefix("serial://"), os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK) for url in urls]
    for port in ports:
        tty.setraw(port)

    for _ in range(rounds):
        for port in ports:
            os.write(port, CLEAR + minimal.START + HOLD)

        time.sleep(SETTLED)
        called.append(time.monotonic())
        for port in ports:
            os.write(port, STOP)

        time.sleep(SETTLED)
        for port in ports:
            os.read(port, BUFFER)

    for port in ports:
        os.close(port)

    return called


def reached(called: Sequence[float], there: Sequence[Arms]) -> tuple[list[float], list[float]]:
    """After how many seconds each stop was at the last arm, and the last arm stood."""
    heard = [arm for process in there for arm in process.heard]
    stood = [[ended for _, ended in arm] for arm in waits(there)]
    if any(len(arm) != len(called) for arm in stood):
        sys.exit("an arm did not stop as often as it was told to")

    return after(called, heard), after(called, stood)


def after(called: Sequence[float], instants: Sequence[Sequence[float]]) -> list[float]:
    """After how many seconds each call had its effect on the last one."""
    return [max(next(at for at in each if at > call) for each in instants) - call for call in called]


def measured(count: int, rounds: int) -> Row:
    """The row of so many arms."""
    with crowd("pty", count, hears=STOP) as there:
        told, timeouts = asyncio.run(started(urls_of(there), rounds))
        begun = [[began for began, _ in arm] for arm in waits(there)]

    if any(len(arm) != rounds for arm in begun):
        sys.exit("an arm did not start as often as it was told to")

    skews = [max(instants) - min(instants) for instants in zip(*begun, strict=True)]
    with crowd("pty", count, hears=STOP) as there:
        heard, stood = reached(asyncio.run(stopped(urls_of(there), rounds)), there)

    with crowd("pty", count, hears=STOP) as there:
        bare_heard, bare_stood = reached(stopped_bare(urls_of(there), rounds), there)

    figures = {
        "skew_p50_ms": percentile(skews, 50),
        "skew_p99_ms": percentile(skews, 99),
        "told_p50_ms": percentile(told, 50),
        "stop_heard_p50_ms": percentile(heard, 50),
        "bare_heard_p50_ms": percentile(bare_heard, 50),
        "stop_stood_p50_ms": percentile(stood, 50),
        "bare_stood_p50_ms": percentile(bare_stood, 50),
    }
    return {"arms": count, **{name: round(value * 1000, 2) for name, value in figures.items()}, "timeouts": timeouts}


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, rounds=40)
    counts = (ONE, *(FEW if options.quick else COUNTS))
    rows = [measured(count, options.rounds) for count in counts]
    if find_spec("zenoh"):
        rows = beside(rows, counts, options.rounds, started, stopped)

    show("fleet", rows, as_json=options.json, rounds=options.rounds)


if __name__ == "__main__":
    main()
