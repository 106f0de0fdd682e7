"""The life of an arm's connection, and of a motion that belongs to one call; the same for all families."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any, NamedTuple, Protocol, TypeVar

from dobot_async._core.link.budget import check_budget
from dobot_async._core.link.link import Link
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.arguments import check_choice, check_duration, check_timeout
from dobot_async._core.util.shapes import Box, Cylinder
from dobot_async._core.util.tasks import Cleanup, run_shielded
from dobot_async._core.util.urls import hidden
from dobot_async._core.util.workspace import Workspace, workspace_of
from dobot_async.errors import ConnectFailed, DobotError, MotionStopped, ReplyTimeout
from dobot_async.traces.recorder import RecordSettings, recorded
from dobot_async.transports import open_transport

__all__ = ["arm_session", "check_options", "open_in_time", "run_owned"]

Q = TypeVar("Q")
LEAST = 1.0
"""Seconds that an arm has for its first answer, whatever it took to open the way to it: that may take long where the
arm is not to blame, as on a busy computer that imports the simulator first."""


class Session(Protocol):
    """An arm, as far as its connection is concerned."""

    @property
    def link(self) -> Link[Any]:
        """The connection."""
        ...

    @property
    def queue(self) -> MotionQueue:
        """The queue of its motions."""
        ...

    async def greet(self, timeout: float) -> None:
        """Prove that the arm answers; raise ConnectFailed, with what to check, if it does not in so many seconds."""

    async def leave(self) -> None:
        """Stop the arm, and what burns or turns on it, until it has heard that."""


S = TypeVar("S", bound=Session)


class CommonOptions(NamedTuple):
    """What `connect` takes in all families, checked.

    Attributes:
        timeout: Seconds until an arm must have answered.
        reply_timeout: The least and the most seconds until a request is sent again.
        max_requests: A second; None for as many as the arm answers.
        workspace: Where the tool may be.
    """

    timeout: float
    reply_timeout: tuple[float, float]
    max_requests: float | None
    workspace: Workspace | None


def check_options(
    queue: str,
    on_error: str,
    timeout: float,
    reply_timeout: float | tuple[float, float],
    max_requests: float | None = None,
    workspace: Workspace | Box | Cylinder | None = None,
) -> CommonOptions:
    """Check what `connect` takes in all families.

    Raises:
        ValueError: Something is wrong.
    """
    check_choice("queue", queue, "fresh", "keep")
    check_choice("on_error", on_error, "stop", "leave")
    floor, ceiling = reply_timeout if isinstance(reply_timeout, tuple) else (reply_timeout, reply_timeout)
    if not 0 < floor <= ceiling < float("inf"):
        raise ValueError(f"reply_timeout must be seconds, or (least, most), above 0 and finite, not {reply_timeout!r}")

    seconds = check_duration(timeout, "timeout")
    if not seconds:
        raise ValueError("timeout must be above 0 seconds: an arm needs some time to answer")

    return CommonOptions(seconds, (floor, ceiling), check_budget(max_requests), workspace_of(workspace))


@asynccontextmanager
async def arm_session(
    url: str,
    timeout: float,
    reopen: Callable[[str], Awaitable[Transport]],
    build: Callable[[Transport, str], S],
    *,
    stop_on_error: bool,
    recording: RecordSettings | None = None,
) -> AsyncGenerator[S]:
    """Connect to an arm, hold it for the length of a block, and leave it.

    Args:
        url: Where it is.
        timeout: Seconds until it must have answered.
        reopen: Opens the way to a URL.
        build: Makes the arm of a transport, and of the URL by which the same arm can be reached again.
        stop_on_error: Stop the arm when the block is left by an error or a cancellation.
        recording: Where to write down what goes over the connection.
    """
    with recorded(recording, url) as recorder:
        loop = asyncio.get_running_loop()
        deadline = loop.time() + timeout
        transport = await reopen(url)
        arm = build(transport, getattr(transport, "url", None) or url)
        if recorder:
            recorder.watch(arm.link, arm.queue)

        try:
            await arm.greet(max(deadline - loop.time(), min(timeout, LEAST)))
        except BaseException:
            await run_shielded(close(arm))
            raise

        async with left(arm, stop_on_error=stop_on_error):
            yield arm


@asynccontextmanager
async def left(arm: Session, *, stop_on_error: bool) -> AsyncGenerator[None]:
    """Leave an arm when the block ends: stop it if that is wanted and the block failed, and close its connection."""
    try:
        yield
    except BaseException as error:
        if stop_on_error:
            cleanup = arm.link.cleanup
            failure = await cleanup.finish(cleanup.start(arm.leave(), "the stop on the way out"))
            if failure:
                error.add_note(f"it is not known whether the arm stands: {failure}")

        raise
    finally:
        await run_shielded(close(arm))


async def close(arm: Session) -> None:
    """End everything of a connection; the arm is left as it is."""
    await arm.queue.aclose()
    await arm.link.aclose()


async def run_owned(
    queue: MotionQueue, cleanup: Cleanup, command: Command[Q, Any], value: Q, timeout: float | None
) -> None:
    """Queue a motion and wait for its end; it does not outlive the call: cancelled, or too late, the arm stops.

    Raises:
        ReplyTimeout: It was not done in time; the arm was told to stop.
        DobotError: As `MotionQueue.put` and `Motion.wait`.
    """
    timeout = check_timeout(timeout)
    queue.prepare(command, value)
    try:
        async with asyncio.timeout(timeout):
            motion = await queue.put(command, value)
            await motion
    except (TimeoutError, asyncio.CancelledError) as error:
        if isinstance(error, DobotError):
            raise

        stopped = MotionStopped(f"the call that {command.name} belonged to was cancelled, or its time was over")
        failure = await cleanup.finish(queue.begin_stop(stopped))
        if isinstance(error, TimeoutError):
            told = f"the arm does not acknowledge its stop: {failure}" if failure else "the arm was stopped"
            raise ReplyTimeout(f"{command.name} was not done within {timeout:.3g} s; {told}") from None

        if failure:
            error.add_note(str(failure))

        raise


async def open_in_time(url: str, arm: str, timeout: float) -> Transport:
    """Open the way to an arm; raise ConnectFailed, with the transport's advice, if that takes too long."""
    try:
        async with asyncio.timeout(timeout):
            return await open_transport(url, arm=arm)
    except TimeoutError as error:
        # What the transport was about when the time was over may have left advice.
        why = getattr(error.__cause__, "__notes__", ["is the address right?"])[0]
        raise ConnectFailed(f"{hidden(url)} could not be opened within {timeout:.3g} s; {why}") from None
