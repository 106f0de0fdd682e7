"""One message of a page, and what can be done with it.

An action reads its arguments at once, so that what is wrong is told before anything is done, and returns a value, or
what is to be awaited. A motion is a `Work` of its arm.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from dobot_async.panel.arguments import Arguments
from dobot_async.panel.arms import ArmView
from dobot_async.panel.works import Work

if TYPE_CHECKING:
    from dobot_async.panel.session import Session
    from dobot_async.panel.station import Station

__all__ = ["Action", "Call", "told_of_tools", "verb"]


@dataclass(frozen=True, slots=True)
class Call:
    """One message.

    Attributes:
        session: Who asks.
        at: Which arm, None where none was named.
        given: The arguments.
        number: The page's number for it.
    """

    session: Session
    at: Station | None
    given: Arguments
    number: int | None

    @property
    def station(self) -> Station:
        """Which arm."""
        assert self.at, "the action says that it needs an arm"
        return self.at

    def work(
        self, text: str, doing: Callable[[ArmView, Work], Coroutine[Any, Any, Any]], **manner: Any
    ) -> Coroutine[Any, Any, Any]:
        """Begin something that moves the arm; return what waits for its end."""
        self.given.end()
        work = Work(text, self.session.name, **manner)
        task = self.station.start(work, lambda view: doing(view, work), self.session)
        return ended(task)


async def ended(task: asyncio.Task[Any]) -> Any:
    """Wait for a work; who waits no more ends only the waiting, for the work is its lease's."""
    return await asyncio.shield(task)


@dataclass(frozen=True, slots=True)
class Action:
    """What can be asked for.

    Attributes:
        run: Does it: returns a value, or what is to be awaited.
        lease: "held": who asks has to hold the lease; "may": has to be an operator; "": anybody.
        arm: It is about one arm.
        urgent: There is room for it, however much is under way.
    """

    run: Callable[[Call], Any]
    lease: Literal["held", "may", ""] = "held"
    arm: bool = True
    urgent: bool = False


def verb(text: str, do: Callable[[ArmView], Coroutine[Any, Any, Any]]) -> Action:
    """Return an action without arguments."""
    return Action(lambda call: call.work(text, lambda view, _: do(view)))


def told_of_tools(call: Call, text: str, do: Callable[[ArmView], Coroutine[Any, Any, Any]]) -> Coroutine[Any, Any, Any]:
    """Switch something, also beside a jog, and tell everybody."""

    async def done(view: ArmView, _: Work) -> None:
        try:
            await do(view)
        finally:
            call.station.tools_changed()

    return call.work(text, done, beside=True)
