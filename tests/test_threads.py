"""A program without asyncio, as docs/notebooks-threads-guis.md has it: what leaves its block stops the arm."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from anyio.from_thread import start_blocking_portal

from dobot_async import Magician
from dobot_async.simulator import simulate


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_error_in_a_program_without_asyncio_stops_the_arm(error: type[BaseException]) -> None:
    with (
        start_blocking_portal() as portal,
        portal.wrap_async_context_manager(simulate(speed=5)) as sim,
    ):
        arms = portal.wrap_async_context_manager(Magician.connect(sim.url))
        with pytest.raises(error), arms as arm:
            portal.call(arm.move_to, 220, 100, 40)
            portal.call(arm.queue.move_to, 220, -100, 40)
            raise error

        executed = portal.call(told, lambda: [each.outcome for each in sim.arm.executed if each.name == "SetPTPCmd"])
        assert executed == ["done", "aborted"]
        assert portal.call(told, lambda: sim.arm.device.idle)


def test_several_threads_drive_one_arm() -> None:
    with (
        start_blocking_portal() as portal,
        portal.wrap_async_context_manager(simulate(speed=50)) as sim,
        portal.wrap_async_context_manager(Magician.connect(sim.url)) as arm,
        ThreadPoolExecutor(4) as threads,
    ):
        list(threads.map(lambda y: portal.call(arm.move_to, 220, y, 40), range(-40, 40, 10)))
        moves = portal.call(told, lambda: [each.value.y for each in sim.arm.executed if each.name == "SetPTPCmd"])
        assert sorted(moves) == list(range(-40, 40, 10))


async def told(read: Any) -> Any:
    """Reads of a simulated arm in its own thread."""
    return read()
