"""Workspace check of a jog: its end is not known, so the pose is polled while it moves."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager, suppress

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async._core.util.workspace import Workspace
from dobot_async.errors import DobotError, MotionStopped

__all__ = ["kept_inside"]

LOOK = 0.03  # seconds between two looks
AHEAD = 0.2
"""Seconds of its way by which a jog is stopped before the edge: between two looks, and until the arm stands."""


@asynccontextmanager
async def kept_inside(
    workspace: Workspace | None,
    place: Callable[[], Awaitable[Sequence[float]]],
    halt: Callable[[], Awaitable[None]],
    what: str,
) -> AsyncGenerator[None]:
    """Watch a jog while the block lasts, and stop it before the tool leaves the workspace, or goes further out.

    Args:
        workspace: Where the tool may be; None does nothing.
        place: Tells where it is.
        halt: Stops the arm.
        what: The jog.

    Raises:
        MotionStopped: It was stopped.
    """
    if workspace is None:
        yield
        return

    stopped: list[str] = []
    watch = asyncio.create_task(watched(workspace, place, halt, stopped), name="dobot_async workspace")
    try:
        yield
    finally:
        await cancel_and_join(watch)

    if stopped:
        raise MotionStopped(f"{what}: the arm was stopped, for the tool would have come {stopped[0]}")


async def watched(
    workspace: Workspace,
    place: Callable[[], Awaitable[Sequence[float]]],
    halt: Callable[[], Awaitable[None]],
    stopped: list[str],
) -> None:
    """Look where the tool is, and where it will soon be; stop it where that is further out than it was so far."""
    now = asyncio.get_running_loop().time
    try:
        before, at = await place(), now()
        least = workspace.excess(before)
        while not stopped:
            await asyncio.sleep(LOOK)
            here, then = await place(), now()
            soon = [a + (a - b) * AHEAD / (then - at) for a, b in zip(here, before, strict=True)]
            left = workspace.left(least, workspace.excess(here)) or workspace.left(least, workspace.excess(soon))
            if left:
                stopped.append(left)

            least = tuple(map(min, least, workspace.excess(here)))
            before, at = here, then
    except DobotError as error:
        stopped.append(f"anywhere, for it cannot be seen: {error}")

    with suppress(DobotError):  # the end of the jog goes on with it
        await halt()
