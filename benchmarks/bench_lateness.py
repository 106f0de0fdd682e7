"""How late the end of each kind of command is noticed, and what that costs in requests, in virtual time.

    python -m benchmarks.bench_lateness [--motions 60] [--json] [--quick]

The line carries 115,200 baud each way and loses nothing; neither program takes any time of its own. So the figures are
those of the schedule of questions alone, and the same in every run and on every computer. `floor_ms` is what a client
that asks one question after the other cannot beat at the median: half of a round trip for the index, then the answer
that tells of the end, then the alarms.
"""

from __future__ import annotations

import asyncio
import random
from collections.abc import Awaitable, Callable
from typing import Any

import async_solipsism

import benchmarks.slow_line  # noqa: F401 - it adds its scheme
from benchmarks.report import BAUD, BITS, Row, parsed, percentile, show
from dobot_async import Magician, MyCobot, PTPMode, UltraArm
from dobot_async.simulator import simulate

INDEX, ALARMS = (6, 14), (6, 22)  # bytes of question and answer
FLOOR = (sum(INDEX) / 2 + INDEX[1] + sum(ALARMS)) * BITS / BAUD
SEED = 1
Go = Callable[[Any, random.Random], Awaitable[None]]


def place(rng: random.Random) -> tuple[float, float, float]:
    """Somewhere within reach."""
    return rng.uniform(180, 240), rng.uniform(-100, 100), rng.uniform(0, 60)


async def very_slowly(arm: Magician, rng: random.Random) -> None:
    """A motion of many seconds."""
    await arm.set_speed(4)
    await arm.move_to(*place(rng), mode=PTPMode.MOVL_XYZ)


KINDS: dict[str, tuple[str, Any, Go]] = {
    "MOVL": ("magician", Magician, lambda arm, rng: arm.move_to(*place(rng), mode=PTPMode.MOVL_XYZ)),
    "MOVJ": ("magician", Magician, lambda arm, rng: arm.move_to(*place(rng))),
    "MOVL, slow": ("magician", Magician, very_slowly),
    "JUMP": ("magician", Magician, lambda arm, rng: arm.move_to(*place(rng), mode=PTPMode.JUMP_XYZ)),
    "increment": ("magician", Magician, lambda arm, rng: arm.move_by(z=rng.choice((-1, 1)) * rng.uniform(3, 9))),
    "wait": ("magician", Magician, lambda arm, rng: arm.wait(rng.uniform(0.02, 3.0))),
    "myCobot 280": (
        "mycobot280",
        MyCobot,
        lambda arm, rng: arm.move_joints(*(rng.uniform(-60, 60) for _ in range(6))),
    ),
    "ultraArm": ("ultraarm", UltraArm, lambda arm, rng: arm.move_joints(*(rng.uniform(0, 60) for _ in range(3)))),
}


async def measured(kind: str, motions: int) -> Row:
    """How late the ends of some commands of one kind are noticed."""
    model, family, go = KINDS[kind]
    loop, rng = asyncio.get_running_loop(), random.Random(SEED)
    began = loop.time()
    late, took = [], 0.0
    homed: dict[str, Any] = {} if family is MyCobot else {"homed": True}
    async with simulate(model, **homed) as sim, family.connect(sim.url.replace("sim://", "slow://")) as arm:
        sent = arm.link.stats.sent
        for _ in range(motions):
            before = loop.time()
            await go(arm, rng)
            took += loop.time() - before
            late.append(loop.time() - began - sim.arm.executed[-1].finished)

        return {
            "kind": kind,
            "floor_ms": round(FLOOR * 1000, 2) if family is Magician else None,
            "late_p50_ms": round(percentile(late, 50) * 1000, 2),
            "late_worst_ms": round(max(late) * 1000, 2),
            "requests": round((arm.link.stats.sent - sent) / motions, 1),
            "seconds": round(took / motions, 2),
        }


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, motions=60)
    rows = []
    for kind in KINDS:
        with asyncio.Runner(loop_factory=async_solipsism.EventLoop) as runner:
            rows.append(runner.run(measured(kind, options.motions)))

    show("lateness", rows, as_json=options.json, motions=options.motions)


if __name__ == "__main__":
    main()
