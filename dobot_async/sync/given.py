"""What functions are given by programs without asyncio, and what the asynchronous functions take in its place."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any, Literal, TypeVar

from dobot_async.sync.calls import in_thread
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twins import TWINS, AnyArm

__all__ = ["Check", "Tool", "arm_of", "blocking", "check_of", "like_an_arm", "tool_of"]

T = TypeVar("T")
Check = Callable[[], bool]
"""Tells whether there is a part in the tool."""

Tool = Literal["suction", "gripper"] | Callable[[bool], object]
"""The arm's suction cup, its gripper, or a function of your own: called with True to take, with False to let go."""

EXPECTED = "expected an arm of dobot_async.sync"


def arm_of(arm: AnyArm) -> Any:
    """Return the asynchronous arm of a blocking one; raise TypeError for anything else."""
    if not isinstance(arm, AnyArm):
        raise TypeError(f"{EXPECTED}, not {arm!r}")

    return arm.asynchronous


def like_an_arm(arm: object) -> Any:
    """Return the asynchronous arm of a blocking one, and what else says which arm is meant as it is.

    Raises:
        TypeError: It is an asynchronous arm.
    """
    if isinstance(arm, tuple(TWINS)):
        raise TypeError(f"{EXPECTED}, not one of programs that await: {arm!r}")

    return arm.asynchronous if isinstance(arm, AnyArm) else arm


def tool_of(tool: Tool) -> Any:
    """Return a tool that is awaited; a function is called in a thread of its own, and may command the arm."""
    return awaited(tool) if callable(tool) else tool


def check_of(check: Check | None) -> Callable[[], Awaitable[bool]] | None:
    """Return a check that is awaited; it is called in a thread of its own, and may ask the arm."""
    return awaited(check) if callable(check) else check


def blocking(check: Callable[[], Any]) -> Check:
    """Return a check that waits."""
    return lambda: PORTAL.run(check)


def awaited(function: Callable[..., T]) -> Callable[..., Awaitable[T]]:
    """Return what calls a function in a thread of its own."""

    async def call(*args: Any) -> T:
        return await in_thread(lambda: function(*args))

    return call
