"""Programs that read and move all the time while the arm's line is bad for a while: how many are answered, and when.

    python tests/bridge/traffic.py [--minutes 10] [--programs 5] [--loss 0.003] [--corrupt 0.002] [--listen tcp ...]

It compares a bridge, by each way in, with one program that does the same on the arm's line by itself, in real time and
at the same time, each with an arm and a process of its own: ways that shared one would wait for each other's Python,
which threads, as Zenoh has them, do longer than an event loop does. It prints a line every half minute: answers,
failures, and the memory.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import resource
import sys
import time
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from dobot_async import Magician, MyCobot, UltraArm
from dobot_async.bridge import bridge
from dobot_async.errors import ConnectFailed, ConnectionLost, DobotError
from dobot_async.simulator import Simulation, simulate
from dobot_async.simulator.magician.body import MAGICIAN

__all__ = ["FAMILIES", "Figures", "Programs", "bare", "through_a_bridge"]

PAUSE = 0.05  # seconds between two reads of a program
BARE = "bare"


@dataclass(frozen=True, slots=True)
class Kind:
    """How an arm of a family is used.

    Attributes:
        connect: Its `connect`.
        read: Reads once.
        move: Moves there and, with True, back again.
    """

    connect: Callable[..., Any]
    read: Callable[[Any], Awaitable[Any]]
    move: Callable[[Any, bool], Awaitable[Any]]


FAMILIES = {
    "magician": Kind(
        Magician.connect, lambda arm: arm.get_pose(), lambda arm, back: arm.move_to(200 + 20 * back, 0, 40)
    ),
    "mycobot280": Kind(
        MyCobot.connect, lambda arm: arm.get_angles(), lambda arm, back: arm.move_joints(10 + 20 * back, 0, 0, 0, 0, 0)
    ),
    "ultraarm": Kind(
        UltraArm.connect, lambda arm: arm.get_angles(), lambda arm, back: arm.move_joints(10 + 20 * back, 0, 0)
    ),
}


@dataclass(slots=True)
class Figures:
    """What programs were told.

    Attributes:
        reads: For each read when it ended, in the loop's seconds, and whether it was answered.
        moves: How many motions were done.
        failures: How often each error was raised.
    """

    reads: list[tuple[float, bool]] = field(default_factory=list)
    moves: int = 0
    failures: Counter[str] = field(default_factory=Counter)

    def between(self, start: float, end: float) -> tuple[float, float]:
        """Answers a second, and the share of reads that were answered."""
        told = [answered for at, answered in self.reads if start <= at < end]
        return sum(told) / (end - start), sum(told) / len(told) if told else 0.0


class Programs:
    """Programs that read, and one that moves as well, until they are ended."""

    def __init__(self, family: str, figures: Figures) -> None:
        self.figures = figures
        self._kind = FAMILIES[family]
        self._loop = asyncio.get_running_loop()
        self._tasks: list[asyncio.Task[None]] = []

    def start(self, work: Any) -> None:
        """Begins with something that goes on until it is ended."""
        self._tasks.append(asyncio.create_task(work))

    async def end(self) -> None:
        """Ends them all."""
        for task in self._tasks:
            task.cancel()

        for result in await asyncio.gather(*self._tasks, return_exceptions=True):
            if isinstance(result, Exception):
                raise result

    async def read(self, arm: Any) -> None:
        """Reads without end; raises ConnectionLost."""
        while True:
            try:
                await self._kind.read(arm)
                self.figures.reads.append((self._loop.time(), True))
            except ConnectionLost:
                raise
            except DobotError as error:
                self.figures.reads.append((self._loop.time(), False))
                self.figures.failures[type(error).__name__] += 1

            await asyncio.sleep(PAUSE)

    async def move(self, arm: Any) -> None:
        """Moves without end; raises ConnectionLost."""
        back = False
        while True:
            back = not back
            try:
                await self._kind.move(arm, back)
                self.figures.moves += 1
            except ConnectionLost:
                raise
            except DobotError as error:
                self.figures.failures[f"move: {type(error).__name__}"] += 1
                await asyncio.sleep(PAUSE)

    async def program(self, url: str, work: Callable[[Any], Awaitable[None]], **details: Any) -> None:
        """A program of its own, which connects again if it is cut off."""
        while True:
            try:
                async with self._kind.connect(url, timeout=10, **details) as arm:
                    await work(arm)
            except (ConnectFailed, ConnectionLost) as error:
                self.figures.failures[type(error).__name__] += 1
                await asyncio.sleep(PAUSE)


@asynccontextmanager
async def bare(sim: Simulation, family: str, programs: int, *, moves: bool = True) -> AsyncIterator[Programs]:
    """All of it in one program, on the arm's line itself; with `moves` the last one moves the arm."""
    running = Programs(family, Figures())
    details = {"model": family} if family.startswith("my") else {}
    async with FAMILIES[family].connect(sim.url, timeout=10, reconnect=True, **details) as arm:
        for _ in range(programs - 1):
            running.start(running.read(arm))

        running.start(running.move(arm) if moves else running.read(arm))
        try:
            yield running
        finally:
            await running.end()


@asynccontextmanager
async def through_a_bridge(
    sim: Simulation, family: str, programs: int, listen: str = "tcp://127.0.0.1:0", *, moves: bool = True
) -> AsyncIterator[Programs]:
    """A program for each, by way of a bridge; with `moves` the last one moves the arm.

    A pseudo-terminal is for one program, the last one; the others come by tcp.
    """
    running = Programs(family, Figures())
    details = {"model": family} if family.startswith("my") else {}
    ways = [listen, "tcp://127.0.0.1:0"] if listen == "pty" else [listen]
    async with bridge(sim.url, listen=ways, family=family, timeout=10) as served:
        for _ in range(programs - 1):
            running.start(running.program(served.urls[-1], running.read, control=False, **details))

        running.start(running.program(served.url, running.move if moves else running.read, control=moves, **details))
        try:
            yield running
        finally:
            await running.end()


def memory() -> float:
    """MB that this process takes now, or, where that cannot be known, has taken at most."""
    with suppress(OSError):
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return pages * resource.getpagesize() / 1e6

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000


@dataclass(slots=True)
class Total:
    """What came of one way.

    Attributes:
        answered: Reads that were answered.
        unanswered: Reads that were not.
        lost: How often a program lost its connection.
    """

    answered: int = 0
    unanswered: int = 0
    lost: int = 0


async def measure(name: str, way: Any, arguments: argparse.Namespace) -> Total:
    """Runs one way for the whole time."""
    total = Total()
    async with AsyncExitStack() as stack:
        details: dict[str, Any] = {"options": replace(MAGICIAN, keep=100)} if arguments.family == "magician" else {}
        sim = await stack.enter_async_context(
            simulate(arguments.family, listen="tcp://127.0.0.1:0", seed=5, speed=20, **details)
        )
        sim.faults.latency = 0.002
        programs: Programs = await stack.enter_async_context(way(sim))
        figures = programs.figures
        await asyncio.sleep(1)
        figures.reads.clear()
        sim.faults.loss, sim.faults.corrupt = arguments.loss, arguments.corrupt
        began = last = time.monotonic()
        while (left := began + arguments.minutes * 60 - time.monotonic()) > 0:
            await asyncio.sleep(min(30, left))
            now = time.monotonic()
            answered = sum(each for _, each in figures.reads)
            total.answered += answered
            total.unanswered += len(figures.reads) - answered
            total.lost = figures.failures["ConnectionLost"]
            line = f"{answered / (now - last):6.1f} answers/s, {len(figures.reads) - answered:3} unanswered"
            sys.stderr.write(
                f"{name:8} {now - began:5.0f} s: {line}, {figures.moves:6} motions, {dict(figures.failures)}, "
                f"{memory():5.1f} MB, {time.process_time():.1f} s of the processor\n"
            )
            figures.reads.clear()
            last = now

    return total


async def measured(way: str) -> Total:
    """Measures one way in a process of its own."""
    command = [sys.executable, *sys.argv, "--way", way]
    process = await asyncio.create_subprocess_exec(*command, stdout=asyncio.subprocess.PIPE)
    told, _ = await process.communicate()
    if process.returncode:
        raise SystemExit(f"{way} has failed")

    return Total(**json.loads(told))


async def one_way(arguments: argparse.Namespace) -> int:
    """Measures one way in this process, and writes what came of it."""
    listen, family, programs = arguments.way, arguments.family, arguments.programs
    place = f"{listen}://127.0.0.1:0" if listen in {"tcp", "udp", "ws"} else listen

    def way(sim: Simulation) -> Any:
        if listen == BARE:
            return bare(sim, family, programs)

        return through_a_bridge(sim, family, programs, place)

    json.dump(asdict(await measure(listen.partition(":")[0], way, arguments)), sys.stdout)
    return 0


async def main(arguments: argparse.Namespace) -> int:
    """Measures the bare line and each way in, all at the same time; returns how many of them fall short."""
    own, *others = await asyncio.gather(*map(measured, (BARE, *arguments.listen)))
    short = 0
    for listen, found in zip(arguments.listen, others, strict=True):
        share = found.answered / own.answered
        fine = share >= 0.95 and not found.lost
        short += not fine
        verdict = "fine" if fine else "TOO LITTLE"
        sys.stdout.write(f"{listen}: {share:.1%} of the bare line's answers, {found.lost} ConnectionLost: {verdict}\n")

    return short


def parse() -> argparse.Namespace:
    """The arguments."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--programs", type=int, default=5)
    parser.add_argument("--loss", type=float, default=0.003)
    parser.add_argument("--corrupt", type=float, default=0.002)
    parser.add_argument("--family", choices=list(FAMILIES), default="magician")
    parser.add_argument("--listen", nargs="+", default=["tcp"], help="tcp, udp, ws, pty, zenoh://name")
    parser.add_argument("--way", help=argparse.SUPPRESS)  # what a process of its own measures
    return parser.parse_args()


if __name__ == "__main__":
    given = parse()
    sys.exit(asyncio.run(one_way(given) if given.way else main(given)))
