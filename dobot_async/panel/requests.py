"""A request of a page, and the actions that requests name.

An action checks its arguments before it does anything, and returns a value or an awaitable. A motion is an `ArmTask` of
its arm.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from dobot_async.panel.arguments import Arguments
from dobot_async.panel.arm_tasks import ArmTask
from dobot_async.panel.arms import ArmView

if TYPE_CHECKING:
    from dobot_async.panel.session import PageSession
    from dobot_async.panel.station import Station

__all__ = ["PageRequest", "PanelAction", "switch_tool", "verb"]


@dataclass(frozen=True, slots=True)
class PageRequest:
    """One message.

    Attributes:
        session: Who asks.
        at: Which arm, None where none was named.
        given: The arguments.
        number: The page's number for it.
    """

    session: PageSession
    at: Station | None
    given: Arguments
    number: int | None

    @property
    def station(self) -> Station:
        """Which arm."""
        assert self.at, "the action says that it needs an arm"
        return self.at

    def work(
        self, text: str, doing: Callable[[ArmView, ArmTask], Coroutine[Any, Any, Any]], **manner: Any
    ) -> Coroutine[Any, Any, Any]:
        """Begin something that moves the arm; return what waits for its end."""
        self.given.end()
        work = ArmTask(text, self.session.name, **manner)
        task = self.station.start(work, lambda view: doing(view, work), self.session)
        return ended(task)


async def ended(task: asyncio.Task[Any]) -> Any:
    """Wait for a work; who waits no more ends only the waiting, for the work is its lease's."""
    return await asyncio.shield(task)


@dataclass(frozen=True, slots=True)
class PanelAction:
    """What can be asked for.

    Attributes:
        run: Does it: returns a value, or what is to be awaited.
        lease: "held": who asks has to hold the lease; "may": has to be an operator; "": anybody.
        arm: It is about one arm.
        urgent: There is room for it, however much is under way.
    """

    run: Callable[[PageRequest], Any]
    lease: Literal["held", "may", ""] = "held"
    arm: bool = True
    urgent: bool = False


def verb(text: str, do: Callable[[ArmView], Coroutine[Any, Any, Any]]) -> PanelAction:
    """Return an action without arguments."""
    return PanelAction(lambda call: call.work(text, lambda view, _: do(view)))


def switch_tool(
    call: PageRequest, text: str, do: Callable[[ArmView], Coroutine[Any, Any, Any]]
) -> Coroutine[Any, Any, Any]:
    """Switch something, also beside a jog, and tell everybody."""

    async def done(view: ArmView, _: ArmTask) -> None:
        try:
            await do(view)
        finally:
            call.station.tools_changed()

    return call.work(text, done, beside=True)
