"""Ctrl-C in a real program on a TCP line that has gone dead: it ends as KeyboardInterrupt, and it ends.

For each family and call a program runs with `asyncio.run` in a process of its own; all at once, for they mostly wait.
"""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from promise_arms import FAMILIES, Family
from promise_child import CALLS
from promise_relay import relay_to

import dobot_async
from dobot_async.simulator import simulate

CHILD = Path(__file__).with_name("promise_child.py")
SLOW = 0.1
LIMIT = 30.0  # real seconds; only so that nothing hangs

pytestmark = [pytest.mark.timeout(120), pytest.mark.full]


@dataclass(frozen=True)
class Program:
    """How a program ended.

    Attributes:
        code: Its return code, None if it had to be killed.
        words: What it wrote to stderr.
    """

    code: int | None
    words: str


async def interrupted(family: Family, call: str) -> Program:
    """Runs a program, takes its line away, interrupts it."""
    path = os.pathsep.join([str(Path(dobot_async.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    async with (
        simulate(family.model, speed=SLOW, listen="tcp://127.0.0.1:0", **family.details) as sim,
        relay_to(urlsplit(sim.url).port or 0) as relay,
    ):
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            str(CHILD),
            family.name,
            f"tcp://127.0.0.1:{relay.port}",
            call,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": path},
        )
        assert process.stdout
        try:
            async with asyncio.timeout(LIMIT):
                await process.stdout.readline()

            relay.dead = True
            await asyncio.sleep(0.2)
            process.send_signal(signal.SIGINT)
            async with asyncio.timeout(LIMIT):
                _, words = await process.communicate()
        except TimeoutError:
            process.kill()
            _, words = await process.communicate()
            return Program(None, words.decode())

    return Program(process.returncode, words.decode())


@pytest.fixture(scope="module")
def programs() -> Mapping[tuple[str, str], Program]:
    """How the programs of all families and calls ended."""

    async def run_all() -> dict[tuple[str, str], Program]:
        keys = [(family.name, call) for family in FAMILIES for call in CALLS]
        ended = await asyncio.gather(*(interrupted(family, call) for family in FAMILIES for call in CALLS))
        return dict(zip(keys, ended, strict=True))

    return asyncio.run(run_all())


@pytest.mark.cases(2)
@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("family", [family.name for family in FAMILIES])
def test_an_interrupt_on_a_dead_line_is_a_keyboard_interrupt(
    programs: Mapping[tuple[str, str], Program], family: str, call: str
) -> None:
    program = programs[family, call]
    assert program.code is not None, f"it went on for {LIMIT:g} s:\n{program.words}"
    assert program.words.rstrip().rpartition("\n")[2].startswith("KeyboardInterrupt"), program.words
    assert program.code == -signal.SIGINT
