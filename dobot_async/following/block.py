"""The block in which an arm follows a target: it begins, it has the arm for itself, and it ends with a stop.

    update --> nothing pending --> led_by(motion) --> exclusively(follow.run) | the user's block --> begin_stop --> end

What leads the arm runs in place of the queue's writer, so that every stop, whoever asks for it, ends it before the arm
is told; and nothing that is queued comes in between.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Generator
from contextlib import asynccontextmanager, contextmanager
from typing import Any, SupportsFloat

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.layouts import NOTHING
from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async._core.queue.executor import Entry, in_motions, unseen
from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.arguments import check_duration
from dobot_async._core.util.tasks import STAYING, cancel_and_join
from dobot_async.errors import ArmAlarm, DobotError, MotionStopped, MotionUnknown, another
from dobot_async.following.boundary import Boundary
from dobot_async.following.follow import Follow
from dobot_async.following.strategy import FollowLimits, Strategy

__all__ = ["MAX_SPEED", "MAX_TURN", "RATE", "STALE", "follow_target", "positive"]

logger: logging.Logger = logging.getLogger("dobot_async.following")
RATE, MAX_SPEED, MAX_TURN, STALE = 30.0, 100.0, 90.0, 0.3
FASTEST = 200.0  # setpoints per second
FOLLOWING: Command[None, None] = Command(
    "following",
    -1,
    NOTHING,
    NOTHING,
    "on this side",
    write=True,
    queueing=Queueing.ALWAYS,
    repeatable=False,
    moves=True,
)
"""All of a following, as one motion."""


class Unwatched:
    """The watcher of a Motion of which the arm need not be asked: what leads the arm knows."""

    def watch(self, seconds: float) -> None:
        """Do nothing."""

    @contextmanager
    def watching(self) -> Generator[None]:
        """Do nothing."""
        yield

    def note(self, motion: Motion) -> None:
        """Do nothing."""

    def count(self, error: DobotError | None) -> None:
        """Do nothing: it is no motion of the queue."""


@asynccontextmanager
async def follow_target(
    link: Link[Any],
    queue: MotionQueue,
    strategy: Strategy,
    *,
    rate: SupportsFloat,
    max_speed: SupportsFloat,
    max_turn: SupportsFloat,
    stale: SupportsFloat,
) -> AsyncGenerator[Follow]:
    """Let an arm follow a target for the length of the block; see `arm.following`.

    Args:
        link: The arm's connection.
        queue: Its queue.
        strategy: How it is led.
        rate: Setpoints per second at the most, above 0 to 200.
        max_speed: mm/s of the setpoint, above 0.
        max_turn: Degrees/s of angles and joints, above 0.
        stale: Seconds for which a target counts, above 0.
    """
    pace = FollowLimits(
        positive(rate, "rate", FASTEST),
        positive(max_speed, "max_speed"),
        positive(max_turn, "max_turn"),
        positive(stale, "stale"),
    )
    motion = Motion(Unwatched(), Entry(FOLLOWING, None, None))
    motion.call = motion  # it need not be sent to be awaited
    async with queue.unplanned_motion():
        await queue.update()
        with queue.led_by(motion):
            boundary = Boundary(queue.bounds, strategy)
            follow = Follow(strategy, motion, pace, boundary, lambda: link.outages)
            leading = asyncio.create_task(lead(queue, follow), name="dobot_async following")
            try:
                await follow.begun(leading)
                yield follow
                follow.close()
                if strategy.settle:  # what nothing ends is let go on to its end, which is near
                    await asyncio.wait([leading], timeout=strategy.settle)
            except BaseException as error:
                stopped = MotionStopped("the block of the following was left by an error")
                failure = await link.cleanup.finish(begin_end(link, queue, strategy, leading, stopped))
                if failure:
                    error.add_note(f"it is not known whether the arm stands: {failure}")

                raise

            motion.end()
            failed = motion.exception()
            over = MotionStopped("the following has ended")
            failure = await link.cleanup.finish(begin_end(link, queue, strategy, leading, over), STAYING)
            if failed and failure:
                failed.add_note(str(failure))

            if failed or failure:
                raise another(failed or failure or over)


async def lead(queue: MotionQueue, follow: Follow) -> None:
    """Lead the arm in place of the queue's writer; what goes wrong stops it, and ends the Motion."""
    try:
        await queue.exclusively(follow.run(), "the following")
    except DobotError as error:
        failure = unseen(error)
    except Exception as error:
        logger.exception("the following failed")
        failure = MotionUnknown(f"the driver failed while it led the arm: {error!r}")
    else:
        return

    if not follow.motion.ended:  # else who stopped it has said why
        queue.give_up(named(failure, follow))


def named(error: DobotError, follow: Follow) -> DobotError:
    """Say which target was followed."""
    target = f"following {follow.target}" if follow.target else "a following that had no target yet"
    if isinstance(error, ArmAlarm):
        return in_motions(error, [target])

    found = another(error)
    found.args = (f"{error}; in {target}",)
    return found


def begin_end(
    link: Link[Any], queue: MotionQueue, strategy: Strategy, leading: asyncio.Task[None], reason: DobotError
) -> asyncio.Task[None]:
    """Begin to stop the arm, now; return the task that puts back behind the stop what was changed."""
    stop = queue.begin_stop(reason)

    async def end() -> None:
        try:
            await stop
            if link.reorder_window:  # a setpoint may have been overtaken by the stop
                await asyncio.sleep(link.reorder_window)
                await queue.begin_stop(reason)
        finally:
            await cancel_and_join(leading)

        await strategy.end()

    return link.cleanup.start(end(), "the end of the following")


def positive(value: SupportsFloat, name: str, most: float = float("inf")) -> float:
    """Return a finite number above 0; raise ValueError or TypeError for others."""
    found = check_duration(value, name, most)
    if not found:
        raise ValueError(f"{name} must be above 0, not {value!r}")

    return found
