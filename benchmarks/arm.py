"""Simulated arms in a process of their own, so that they take neither time nor memory from who is measured.

    python -m benchmarks.arm '{"listen": "pty:?baud=115200", "speed": 1.0}'

The first line that it prints is a JSON list of URLs. Then each line that it reads is a question, answered with a line
of JSON: `counters`, and `executed`: [name, started, finished] of each command that took its time, in seconds of
`time.monotonic`, which on one computer is the same in all processes; `each` is `executed` of every arm, and `heard`
tells of every arm when the bytes that the argument `hears` names had come to its end of the line. It ends with its
input.

Where there are several processors, who is measured has the first one to itself, and the arms have the others.

Its loop waits with `select`, whose timers are exact to some hundredth of a millisecond where epoll's are to a whole
one: the lines of the arms are as slow as they should be, and not slower.
"""

from __future__ import annotations

import asyncio
import json
import os
import selectors
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AsyncExitStack, ExitStack, contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from benchmarks.report import BAUD, BITS
from dobot_async.endpoints.line_rate import RateLimited, RateLimitedPeer
from dobot_async.endpoints.pty import on_pty
from dobot_async.mycobot import commands as cobot
from dobot_async.simulator import Faults, MyCobotQuirks, Simulation, simulate

__all__ = ["AT_ONCE", "Arms", "Clock", "arms", "crowd"]

CORES = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
"""The processors that this process had when it began."""
AT_ONCE = 1e6
"""The speed of an arm that executes at once."""
SEED = 1
QUIRKS: dict[str, dict[str, Any]] = {
    "myarm300": {"quirks": MyCobotQuirks(acknowledges=frozenset({cobot.SEND_ANGLES}), echo=False, transponder=False)},
    "ultraarm": {"homed": True},
}
"""A newer myArm acknowledges motions, and the vendor's library waits for that. A frame that comes byte by byte, as over
a real line, must not count as one in pieces."""


class Arms:
    """Arms in another process.

    Attributes:
        urls: Where they are reached.
    """

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self.urls: list[str] = self._line()

    @property
    def url(self) -> str:
        """Where the first one is reached."""
        return self.urls[0]

    @property
    def counters(self) -> dict[str, int]:
        """What has happened on all connections, of all arms together."""
        answer: dict[str, int] = self._ask("counters")
        return answer

    @property
    def executed(self) -> list[tuple[str, float, float]]:
        """What the first arm has executed: the name, and when it began and ended, by `time.monotonic`."""
        return [(name, started, finished) for name, started, finished in self._ask("executed")]

    @property
    def each(self) -> list[list[tuple[str, float, float]]]:
        """`executed` of every arm."""
        return [[(name, started, finished) for name, started, finished in arm] for arm in self._ask("each")]

    @property
    def heard(self) -> list[list[float]]:
        """When what the arms listen for had come to the end of each one's line."""
        told: list[list[float]] = self._ask("heard")
        return told

    def ended(self, name: str) -> list[float]:
        """When each command of a name had ended."""
        return [finished for each, _, finished in self.executed if each == name]

    def _ask(self, question: str) -> Any:
        assert self._process.stdin
        self._process.stdin.write(question + "\n")
        self._process.stdin.flush()
        return self._line()

    def _line(self) -> Any:
        assert self._process.stdout
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError("the simulated arm's process has ended")

        return json.loads(line)


class MeteredHost:
    """A host behind serial lines; notes when some bytes have come in.

    It notes when they are through the line, not when the simulator, which has many arms to attend to, gets to them.

    Args:
        host: Who is reached.
        baud: Of its lines.
        hears: The bytes.
        came: Returns when they had come at the latest.
    """

    def __init__(self, host: Simulation, baud: int, hears: bytes, came: Callable[[], float]) -> None:
        self._came = came
        self.heard: list[float] = []
        self._lines = RateLimited(host, baud)
        self._takes = len(hears) * BITS / baud
        self._hears = hears

    def client(self, *arguments: Any, **details: Any) -> Listener:
        """Somebody has connected; see `Host`."""
        return Listener(self._lines.client(*arguments, **details), self._note)

    def leave(self, client: Listener) -> None:
        """A client has gone."""
        self._lines.leave(client.line)

    def _note(self, data: bytes) -> None:
        if self._hears in data:
            self.heard.append(self._came() + self._takes)


class Woken(selectors.SelectSelector):
    """Knows since when what it has found is there.

    Attributes:
        at: When it last woke up, in seconds of `time.monotonic`.
    """

    at = 0.0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Waits until something is ready."""
        found = super().select(timeout)
        self.at = time.monotonic()
        return found


@dataclass
class Listener:
    """A client of an `MeteredHost`."""

    line: RateLimitedPeer[Any]
    note: Callable[[bytes], None]

    def send(self, data: bytes) -> None:
        """Takes what the client has sent."""
        self.note(data)
        self.line.send(data)


@contextmanager
def arms(
    listen: str,
    *,
    model: str = "magician",
    speed: float = 1.0,
    count: int = 1,
    loss: float = 0.0,
    hears: bytes = b"",
) -> Iterator[Arms]:
    """Runs simulated arms for the length of a block; with `hears` behind lines of 115200 baud, whatever `listen` is."""
    told = {"listen": listen, "model": model, "speed": speed, "count": count, "loss": loss, "hears": hears.hex()}
    details = json.dumps(told | {"cores": CORES[1:]})
    command = [sys.executable, "-m", "benchmarks.arm", details]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            with alone():
                yield Arms(process)
        finally:
            assert process.stdin
            process.stdin.close()


@contextmanager
def alone() -> Iterator[None]:
    """While this is entered, this process has a processor to itself, where there are several."""
    if len(CORES) < 2:
        yield
        return

    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, CORES[:1])
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@dataclass
class Served:
    """The arms of this process.

    Attributes:
        simulations: The arms.
        hosts: Their lines, if they listen for something.
        speed: Of their clocks.
    """

    simulations: list[Simulation]
    hosts: list[MeteredHost]
    speed: float


@contextmanager
def crowd(listen: str, count: int, **details: Any) -> Iterator[list[Arms]]:
    """Runs so many arms, in as many processes as there are processors beside that of who is measured; see `arms`."""
    processes = min(count, max(1, (os.cpu_count() or 1) - 1))
    with ExitStack() as stack:
        shares = [count // processes + (number < count % processes) for number in range(processes)]
        yield [stack.enter_context(arms(listen, count=share, **details)) for share in shares]


class Clock:
    """The computer's own time, which all processes share, times `speed`."""

    def __init__(self, speed: float) -> None:
        self.speed = speed

    def __call__(self) -> float:
        """Simulated seconds."""
        return time.monotonic() * self.speed


async def serve(selector: Woken, *, listen: str, model: str, speed: float, count: int, loss: float, hears: str) -> None:
    """Runs the arms until the input ends."""
    loop = asyncio.get_running_loop()
    async with AsyncExitStack() as stack:
        simulations = [
            await stack.enter_async_context(
                simulate(
                    model,
                    listen="memory" if hears else listen,
                    clock=Clock(speed),
                    faults=Faults(loss=loss),
                    seed=SEED,
                    **QUIRKS.get(model, {}),
                )
            )
            for _ in range(count)
        ]
        heard = bytes.fromhex(hears)
        hosts = [MeteredHost(simulation, BAUD, heard, lambda: selector.at) for simulation in simulations if heard]
        urls = [await on_pty(host, stack) for host in hosts] or [simulation.url for simulation in simulations]
        print(json.dumps(urls), flush=True)
        served = Served(simulations, hosts, speed)
        questions = asyncio.StreamReader()
        await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(questions), sys.stdin)
        while line := (await questions.readline()).decode().strip():
            print(json.dumps(ANSWERS[line](served)), flush=True)


def counters(served: Served) -> dict[str, int]:
    """All arms' counters, added up."""
    total: dict[str, int] = {}
    for simulation in served.simulations:
        figures = simulation.arm.counters
        for name, figure in asdict(figures).items():
            total[name] = total.get(name, 0) + int(figure)

    return total


def executed(served: Served) -> list[tuple[str, float, float]]:
    """What the first arm has executed."""
    return each(served)[0]


def each(served: Served) -> list[list[tuple[str, float, float]]]:
    """What every arm has executed."""
    return [
        [(done.name, done.started / served.speed, done.finished / served.speed) for done in simulation.arm.executed]
        for simulation in served.simulations
    ]


def heard(served: Served) -> list[list[float]]:
    """When what they listen for had come in on each line."""
    return [host.heard for host in served.hosts]


ANSWERS = {"counters": counters, "executed": executed, "each": each, "heard": heard}


def main() -> None:
    """Runs what the first argument says."""
    details = json.loads(sys.argv[1])
    if cores := details.pop("cores"):
        os.sched_setaffinity(0, cores)

    selector = Woken()
    with asyncio.Runner(loop_factory=lambda: asyncio.SelectorEventLoop(selector)) as runner:
        runner.run(serve(selector, **details))


if __name__ == "__main__":
    main()
