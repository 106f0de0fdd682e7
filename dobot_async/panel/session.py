"""One page that is connected: what it asks for, what that answers, and what ends with it.

text --> rate --> Action, by its word: role? lease? arguments --> sync, or a task --> reply
aclose: its leases end, and with them all that it has under way; the arms stand before it returns
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any, TypeGuard, cast

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.bridge.limits import Allowance
from dobot_async.panel.access import Role
from dobot_async.panel.actions import ACTIONS
from dobot_async.panel.arguments import Arguments
from dobot_async.panel.messages import Outlet, as_json
from dobot_async.panel.problems import PanelRefusal, told
from dobot_async.panel.requests import PageRequest

if TYPE_CHECKING:
    from dobot_async.panel.state import PanelState

__all__ = ["PageSession"]

logger: logging.Logger = logging.getLogger("dobot_async.panel")
RATE, BURST = 100.0, 200.0  # messages a second
MOST_TASKS = 64
MOST_STOPS = 16
"""Stops have room of their own: an arm that has much to do can still be stopped."""
STOPPED = {"kind": "stopped", "text": "it was stopped before it was done"}


class PageSession:
    """See the module; a `Operator` of leases.

    Attributes:
        state: What it shares with others.
        role: What it may do.
        name: Who it is, for people.
        gone: Its connection has ended.
        yields: Others may take over from it.
        outlet: What waits to be sent.
    """

    def __init__(self, state: PanelState, role: Role, name: str) -> None:
        self.state = state
        self.role = role
        self.name: str = name
        self._first_name = name
        self.gone: bool = False
        self.yields = True
        self.outlet: Outlet = Outlet()
        self._press = -1
        self._rate = Allowance(RATE, asyncio.get_running_loop().time, most=BURST)
        self._tasks: set[asyncio.Task[None]] = set()
        self._stops: set[asyncio.Task[None]] = set()

    def receive(self, text: str) -> None:
        """Take a message."""
        if self.gone:
            return

        self._rate.spend(1)
        if self._rate.wait:
            self.tell("reply", id=None, ok=False, error={"kind": "rate", "text": "too many messages"})
            self.outlet.close()
            return

        number: int | None = None
        try:
            message = parsed(text)
            given = message.pop("id", None)
            number = given if isinstance(given, int) and not isinstance(given, bool) else None
            self._do(number, message)
        except Exception as error:  # noqa: BLE001 - one message that fails is not the end of the page
            self._reply(number, error=told(error))

    def tell(self, kind: str, **more: Any) -> None:
        """Send it something."""
        self.outlet.put(as_json({"type": kind, **more}))

    def check_press(self, press: int) -> None:
        """Raise Refusal for a press that is not newer than the last one."""
        if press <= self._press:
            raise PanelRefusal("late", f"press {press} is over: the last one was {self._press}")

        self._press = press

    def rename(self, name: str) -> None:
        """Be called so from now on."""
        self.name = f"{name} ({self._first_name})"

    async def aclose(self) -> None:
        """End what it has going on, and its leases."""
        if self.gone:
            return

        self.gone = True
        stations = self.state.stations.values()
        held = [station for station in stations if station.lease.holder is self]
        for station in held:  # at once: the rest may have to wait for others
            station.let_go("left")
            station.works.begin_to_end()

        await asyncio.gather(*(station.lease.end(self, "its page has gone") for station in stations))
        await asyncio.gather(*(cancel_and_join(task) for task in (*self._tasks, *self._stops)))
        self.state.leave(self)
        self.outlet.close()

    def _do(self, number: int | None, message: dict[str, Any]) -> None:
        """Begin what a message asks for."""
        word = message.pop("do", None)
        action = ACTIONS.get(word) if isinstance(word, str) else None
        if action is None:
            raise PanelRefusal("wrong", "there is no such thing to do")

        if action.lease and self.role is not Role.OPERATOR:
            raise PanelRefusal("role", "viewers look on, and stop; they do not move the arm")

        named = "arm" in message
        station = self.state.station(message.pop("arm")) if named else None
        if station is None and action.arm:
            raise PanelRefusal("wrong", "say which arm")

        if action.lease == "held" and station:
            station.lease.check(self)

        under_way, most = (self._stops, MOST_STOPS) if action.urgent else (self._tasks, MOST_TASKS)
        if len(under_way) >= most:
            raise PanelRefusal("rate", f"{most} of these are under way: wait for their answers")

        call = PageRequest(self, station, Arguments(message), number)
        found = action.run(call)
        if is_coroutine(found):
            self._spawn(number, found, under_way)
        else:
            self._reply(number, value=found)

    def _spawn(self, number: int | None, doing: Coroutine[Any, Any, Any], under_way: set[asyncio.Task[None]]) -> None:
        """Do something that takes time, and answer when it is done."""
        task = asyncio.create_task(self._answer(number, doing), name=f"dobot_async panel call of {self.name}")
        under_way.add(task)
        task.add_done_callback(under_way.discard)

    async def _answer(self, number: int | None, doing: Coroutine[Any, Any, Any]) -> None:
        try:
            value = await doing
        except asyncio.CancelledError:
            task = asyncio.current_task()
            if task and task.cancelling():
                raise

            self._reply(number, error=STOPPED)  # the work that it waited for was cancelled
        except Exception as error:  # noqa: BLE001 - whatever it is, the page hears of it, and the log of what is a bug
            self._reply(number, error=told(error))
        else:
            self._reply(number, value=value)

    def _reply(self, number: int | None, *, value: Any = None, error: Any = None) -> None:
        """Answer; of what needs no answer only what went wrong is told."""
        if error is not None:
            self.tell("reply", id=number, ok=False, error=error)
        elif number is not None:
            self.tell("reply", id=number, ok=True, value=value)


def is_coroutine(found: object) -> TypeGuard[Coroutine[Any, Any, Any]]:
    """Whether it is to be awaited."""
    return isinstance(found, Coroutine)


def refuse(word: str) -> None:
    """What JSON has no word for."""
    raise ValueError(word)


def parsed(text: str) -> dict[str, Any]:
    """Return the object in a message; raise ValueError for anything else."""
    try:
        found = json.loads(text, parse_constant=refuse)
    except (ValueError, RecursionError):
        raise ValueError("a message is a JSON object") from None

    if not isinstance(found, dict):
        raise ValueError("a message is a JSON object")  # noqa: TRY004 - it is not the caller's type, but a page's

    return cast("dict[str, Any]", found)
