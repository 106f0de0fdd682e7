"""A panel with a bad line and pages that come and go: memory, tasks, and whether the arm ever moves without a hand.

    python tests/panel/endurance.py [--minutes 60] [--loss 0.02] [--every 5]

One process has a simulated arm and its panel, in real time. An operator jogs, holds for a moment, and lets go in one
of several ways: by release, by silence, by closing its socket, by cutting it. A viewer comes and goes, and stops the
arm now and then. What the simulated arm does decides: it has to stand `REST` after the last sign of a hand. A line is
printed every half minute. In the end neither tasks nor sockets have grown, and the memory by less than `GROWTH`.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import random
import resource
import sys
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from panel_rig import ARM, Page, Shown, page, shown

from dobot_async.panel import Role
from dobot_async.simulator import Faults

__all__ = ["Figures", "endure"]

REST = 4.0  # seconds after the last sign of a hand: a lossy line, and a machine that is busy
GROWTH = 20.0  # MB
HELD = 0.8  # seconds
WAIT = 20.0


@dataclass(slots=True)
class Figures:
    """What came of it.

    Attributes:
        presses: How often the arm was told to jog.
        ends: How presses ended, by what the panel said.
        stops: How often the viewer stopped the arm.
        visits: How often the viewer came.
        orphans: How often the arm moved although no hand held.
        refused: How often the panel would not do something, by its word.
        memory: MB when it began, and in the end.
        tasks: Tasks of the event loop then, with no page connected.
        files: Open files then.
    """

    presses: int = 0
    ends: Counter[str] = field(default_factory=Counter)
    stops: int = 0
    visits: int = 0
    orphans: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    memory: list[float] = field(default_factory=list)
    tasks: list[int] = field(default_factory=list)
    files: list[int] = field(default_factory=list)

    def look(self) -> None:
        """Take note of what the process holds."""
        self.memory.append(memory())
        self.tasks.append(len(asyncio.all_tasks()))
        self.files.append(files())

    @property
    def is_fine(self) -> bool:
        """Whether all is kept that has to be."""
        kept = self.tasks[-1] <= self.tasks[0] and self.files[-1] <= self.files[0]
        return not self.orphans and kept and self.memory[-1] - self.memory[0] < GROWTH

    def __str__(self) -> str:
        return (
            f"{self.presses} presses, {dict(self.ends)}, refused {dict(self.refused)}, {self.visits} visits, "
            f"{self.stops} stops by the viewer, {self.orphans} motions without a hand, "
            f"{self.memory[0]:.1f} to {self.memory[-1]:.1f} MB, tasks {self.tasks[0]} to {self.tasks[-1]}, "
            f"files {self.files[0]} to {self.files[-1]}"
        )


def memory() -> float:
    """MB that this process takes now; what it has taken at most where that cannot be known."""
    with suppress(OSError):
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return pages * resource.getpagesize() / 1e6

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000


def files() -> int:
    """How many files and sockets this process has open, 0 where that cannot be known."""
    with suppress(OSError):
        return sum(1 for _ in Path("/proc/self/fd").iterdir())

    return 0


class Operator:
    """Holds and lets go.

    Args:
        rig: The arm and its panel.
        figures: Where it takes note.
        seed: Of what it does.
        rest: Seconds after which the arm stands that nobody holds.
    """

    def __init__(self, rig: Shown, figures: Figures, seed: int, rest: float) -> None:
        self._rig = rig
        self._figures = figures
        self._rest = rest
        self._random = random.Random(seed)
        self._ways: tuple[Callable[[Page, int], Awaitable[object]], ...] = (release, fall_silent, close, cut)

    async def work(self) -> None:
        """One page, a few presses, and the last one is let go of in some way."""
        async with page(self._rig) as one:
            answer = await one.ask("take_lease", arm=ARM, takeover=True)
            if not answer["ok"]:
                self._figures.refused[answer["error"]["kind"]] += 1
                return

            for _ in range(self._random.randint(1, 3)):
                if one.ended.is_set() or not one.last("lease")["mine"]:
                    return

                await self._press(one)

    async def _press(self, one: Page) -> None:
        """Press, hold, let go, and look whether the arm stands."""
        with suppress(TimeoutError, ConnectionError):
            async with asyncio.timeout(WAIT):
                _, press = await one.press(self._random.choice(("y+", "y-", "x+", "x-", "j1+", "j1-")), speed=20)
                self._figures.presses += 1
                end = time.monotonic() + HELD
                await one.hold(press, lambda: time.monotonic() > end)
                await self._random.choice(self._ways)(one, press)

        await self._check_rest()
        self._figures.ends[one.last("jog").get("why") or "unheard"] += 1

    async def _check_rest(self) -> None:
        """Count a motion that goes on without a hand."""
        await asyncio.sleep(self._rest)
        before = self._rig.sim.arm.pose
        await asyncio.sleep(0.1)
        self._figures.orphans += before != self._rig.sim.arm.pose


async def release(one: Page, press: int) -> None:
    """In good order."""
    await one.send("release", arm=ARM, press=press)


async def fall_silent(_one: Page, _press: int) -> None:
    """As a phone that sleeps: the socket stays."""


async def close(one: Page, _press: int) -> None:
    """The tab is closed."""
    await one.socket.close()


async def cut(one: Page, _press: int) -> None:
    """The browser is gone."""
    transport = one.socket.get_extra_info("socket")
    if transport is not None:
        with suppress(OSError):
            transport.shutdown(2)


async def operate(operator: Operator, until: float) -> None:
    """Operators, one after the other."""
    while time.monotonic() < until:
        await operator.work()


async def look_on(rig: Shown, figures: Figures, until: float, every: float) -> None:
    """A viewer that comes and goes, and stops the arm every fifth time."""
    while time.monotonic() < until:
        async with page(rig, Role.VIEWER) as one:
            figures.visits += 1
            if figures.visits % 5 == 0:
                answer = await one.ask("stop")
                figures.stops += answer["ok"]

            await asyncio.sleep(every / 2)

        await asyncio.sleep(every / 2)


async def tell(figures: Figures, every: float = 30.0) -> None:
    """Print a line now and then."""
    while True:
        await asyncio.sleep(every)
        sys.stdout.write(f"{time.strftime('%H:%M:%S')} {memory():.1f} MB, {figures}\n")
        sys.stdout.flush()


async def endure(
    seconds: float, *, loss: float = 0.02, every: float = 5.0, seed: int = 1, rest: float = REST
) -> Figures:
    """Let it go on for some time; return what came of it."""
    figures = Figures()
    async with shown(line=Faults(loss=loss)) as rig:
        async with page(rig):
            pass  # what is loaded once is loaded

        await asyncio.sleep(1)
        figures.look()
        until = time.monotonic() + seconds
        telling = asyncio.create_task(tell(figures))
        try:
            await asyncio.gather(
                operate(Operator(rig, figures, seed, rest), until), look_on(rig, figures, until, every)
            )
        finally:
            telling.cancel()
            await asyncio.wait([telling])

        await asyncio.sleep(2)
        figures.look()

    return figures


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--loss", type=float, default=0.02)
    parser.add_argument("--every", type=float, default=5.0, help="seconds from one visit of the viewer to the next")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    found = asyncio.run(endure(given.minutes * 60, loss=given.loss, every=given.every, seed=given.seed))
    sys.stdout.write(f"{found}: {'fine' if found.is_fine else 'NOT FINE'}\n")
    sys.stdout.write(json.dumps({"fine": found.is_fine, "presses": found.presses, "orphans": found.orphans}) + "\n")
    return not found.is_fine


if __name__ == "__main__":
    sys.exit(main())
