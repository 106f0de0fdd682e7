"""The long forms of `test_no_stale_answer`.

python tests/promises/stale.py --answers 200000    so many in all, over all kinds of lines, in virtual time
python tests/promises/stale.py --tcp 600           for so many seconds over a real TCP relay that stands still at random

Each prints answers, stale ones, and frames to the arm per answer. Ends with 1 if an answer was stale.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import time
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any
from urllib.parse import urlsplit

from promise_stale import KINDS, Tally, ask_until, tally_of

from dobot_async import Magician
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import Simulation, simulate

RELAY = Path(__file__).with_name("promise_relay.py")
STEP = 0.02  # seconds in which the simulated arm's world stays the same
TURN = 120.0  # seconds after which it is as before
WAY = 60.0  # mm


def say(line: str) -> None:
    """Writes a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def virtual(answers: int, first: int) -> int:
    """All kinds of lines in virtual time; returns how many answers were stale."""
    stale = 0
    for kind in KINDS:
        begun = time.monotonic()
        for calm in (True, False) if kind.most else (False,):
            tally = tally_of(
                kind, answers // (2 * len(KINDS)) if kind.most else answers // len(KINDS), calm=calm, first=first
            )
            how = "calm" if calm else "with cancellations"
            say(f"{kind.name}, {how}: {tally} [{time.monotonic() - begun:.0f} s]")
            stale += tally.stale

    return stale


def age_of(told: float, asked: float, turn: float) -> float:
    """How long before the question the world was as the arm told, up to half a turn."""
    return (asked - told + turn / 2) % turn - turn / 2


async def turn_the_world(sim: Simulation) -> None:
    """Lets what the arm tells say what time it is: where its tool is, and what an input reads."""
    loop = asyncio.get_running_loop()
    while True:
        now = loop.time() % TURN
        sim.arm.guide_to(200 + WAY * now / TURN, 20, 20)
        sim.arm.set_adc(5, int(now / TURN * 4095))
        await asyncio.sleep(STEP)


async def over_tcp(seconds: float, seed: int, longest: float) -> Tally:
    """Three callers over a relay that is a process of its own, in real time."""
    loop = asyncio.get_running_loop()
    tally = Tally()
    async with simulate("magician", listen="tcp://127.0.0.1:0") as sim:
        begun = loop.time()
        turning = asyncio.create_task(turn_the_world(sim))
        relay = await asyncio.create_subprocess_exec(
            sys.executable,
            str(RELAY),
            str(urlsplit(sim.url).port),
            "--seed",
            str(seed),
            "--longest",
            str(longest),
            stdout=asyncio.subprocess.PIPE,
        )
        assert relay.stdout
        port = int(await relay.stdout.readline())
        questions: Any = (
            (c.GET_DEVICE_TIME, None, lambda told, asked: asked - begun - (told + 1) / 1000),
            (c.GET_POSE, None, lambda told, asked: age_of((told.x - 200) / WAY * TURN, asked, TURN)),
            (c.GET_IOADC, 5, lambda told, asked: age_of((told.value + 1) / 4095 * TURN, asked, TURN)),
        )
        try:
            async with Magician.connect(f"tcp://127.0.0.1:{port}", timeout=90, on_error="leave") as arm:
                before = sim.arm.counters.requests
                ends = loop.time() + seconds
                async with asyncio.TaskGroup() as group:
                    for number in range(3):
                        group.create_task(
                            ask_until(
                                arm,
                                lambda: loop.time() > ends,
                                Random(10 * seed + number),
                                tally,
                                loop.time,
                                questions=questions,
                                fresh=5 * STEP,
                                pause=6.0,
                            )
                        )

                tally.frames = sim.arm.counters.requests - before
        finally:
            turning.cancel()
            with suppress(ProcessLookupError):
                relay.kill()

            await relay.wait()

    return tally


def main() -> int:
    """Runs what was asked for; returns the exit code."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--answers", type=int, default=0)
    options.add_argument("--tcp", type=float, default=0.0, metavar="SECONDS")
    options.add_argument("--longest", type=float, default=60.0, help="seconds that the relay stands still at the most")
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()
    stale = virtual(given.answers, given.seed) if given.answers else 0
    if given.tcp:
        tally = asyncio.run(over_tcp(given.tcp, given.seed, given.longest))
        say(f"tcp, stalls of up to {given.longest:g} s: {tally}")
        stale += tally.stale

    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
