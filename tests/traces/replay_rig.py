"""A run that fails, recorded on a bad line to a simulated arm; and the same program again, on what was recorded."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from bad_line import BadLine, bad_lines

from dobot_async import DobotError, Magician, MyCobot, UltraArm
from dobot_async.simulator import Simulation, simulate

__all__ = ["ARMS", "Arm", "Program", "outcome_of", "recorded"]

Outcome = list[tuple[str, str]]
Program = Callable[[Any, "Log"], Awaitable[None]]


@dataclass(frozen=True)
class Arm:
    """One family: what connects to it, and how it is simulated."""

    kind: Any
    model: str
    details: dict[str, Any]

    def connect(self, url: str, **options: Any) -> AbstractAsyncContextManager[Any]:
        found: AbstractAsyncContextManager[Any] = self.kind.connect(url, **options)
        return found


ARMS = {
    "magician": Arm(Magician, "magician", {"homed": True}),
    "mycobot": Arm(MyCobot, "mycobot280", {}),
    "ultraarm": Arm(UltraArm, "ultraarm", {"homed": True}),
}


class Log:
    """What each step of a program came out with."""

    def __init__(self) -> None:
        self.outcome: Outcome = []

    async def step(self, name: str, work: Awaitable[object]) -> None:
        """Does one step; what it returns or raises is its outcome."""
        try:
            self.outcome.append((name, repr(await work)))
        except DobotError as error:
            self.outcome.append((name, f"{type(error).__name__}: {error}"))


async def outcome_of(arm: Arm, url: str, program: Program, **options: Any) -> Outcome:
    """What the steps of a program come out with, and how its block ends."""
    log = Log()
    try:
        async with arm.connect(url, **options) as connected:
            await program(connected, log)
    except DobotError as error:
        log.outcome.append(("the block", f"{type(error).__name__}: {error}"))

    return [(name, text.replace(url, "URL")) for name, text in log.outcome]


async def recorded(
    arm: Arm,
    program: Program,
    path: Path,
    spoil: Callable[[BadLine, Simulation], None] = lambda *_: None,
    **options: Any,
) -> tuple[Outcome, list[Any]]:
    """What a program comes out with on a line that a test spoils, and what the arm executed; all of it is recorded."""
    with pytest.MonkeyPatch.context() as patch:
        lines = bad_lines(patch, in_order=True)
        async with simulate(arm.model, **arm.details) as sim:

            async def spoilt(connected: Any, log: Log) -> None:
                spoil(lines[0], sim)
                await program(connected, log)

            outcome = await outcome_of(arm, sim.url, spoilt, record=path, **options)
            return outcome, [(each.name, each.outcome) for each in sim.arm.executed if each.command.moves]
