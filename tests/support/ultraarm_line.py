"""A simulated ultraArm behind a line that may be bad: a stream, so what is late delays all that is behind it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from bad_line import BadLine, Spoil, bad_lines

from dobot_async import UltraArm
from dobot_async.simulator import Simulation, simulate

__all__ = ["BadLine", "Spoil", "once", "rig"]


def once(word: bytes, into: Spoil) -> Spoil:
    """Does something to the first message with a word in it, and nothing to the others."""
    left = [into]

    def spoil(data: bytes) -> list[tuple[float, bytes]]:
        return left.pop()(data) if left and word in data else [(0, data)]

    return spoil


@asynccontextmanager
async def rig(
    monkeypatch: pytest.MonkeyPatch, *, sim: dict[str, Any] | None = None, **options: Any
) -> AsyncIterator[tuple[Simulation, UltraArm, BadLine]]:
    """A simulated arm, a driver, and the line between them."""
    made = bad_lines(monkeypatch, in_order=True)
    async with (
        simulate("ultraarm", homed=True, **(sim or {})) as simulation,
        UltraArm.connect(simulation.url, **options) as arm,
    ):
        yield simulation, arm, made[0]
