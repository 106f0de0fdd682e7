"""The commands for one arm: which session may send them, which were executed already, and their results.

    message --> JSON, session, id --> known id? the same reply again
                                      stop            any session, at once; it ends the lease
                                      take_lease      for some seconds; taken again it goes on
                                      release_lease
                                      an action       for the holder of the lease

A session is identified by its name alone; only the broker's access control separates sessions. It ends when its lease
expires or is released, when another session stops the arm, and when the broker is lost. Its motions are ended then,
before another session gets the lease.
"""

from __future__ import annotations

import asyncio
import json
import logging
import math
from collections import OrderedDict
from collections.abc import Callable, Coroutine, Mapping
from typing import Any, cast

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async._core.util.text import printable
from dobot_async.bridge.lease import Lease
from dobot_async.bridge.requests import Refused
from dobot_async.errors import DobotError
from dobot_async.mqtt.topics import SESSION
from dobot_async.remote import RemoteArm, Works, parse_action

__all__ = ["CommandHandler", "MqttSession"]

logger: logging.Logger = logging.getLogger("dobot_async.mqtt")
LONGEST = 1 << 18  # bytes of a message
REMEMBERED = 1024  # commands whose ids are known
SHORTEST, USUAL, MOST = 1.0, 5.0, 60.0
"""Seconds of a lease."""

FREE = ("stop", "take_lease", "release_lease")
"""What needs no id: it may be done twice."""


class MqttSession:
    """A session that has, or had, the lease.

    Attributes:
        name: Its name.
        gone: Whether its lease is over.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.gone: bool = False
        self.timer: asyncio.TimerHandle | None = None
        self.works: set[asyncio.Task[None]] = set()

    def leave(self) -> None:
        """It is over."""
        self.gone = True
        if self.timer:
            self.timer.cancel()


class CommandHandler:
    """See the module.

    Args:
        works: What goes on with the arms.
        on: The arm.
        reply: Called with a session, and what it is told.
        changed: Called when somebody else has the lease.
    """

    def __init__(
        self,
        works: Works,
        on: RemoteArm,
        reply: Callable[[str, dict[str, Any]], None],
        changed: Callable[[], None],
    ) -> None:
        self._works = works
        self._on = on
        self._reply = reply
        self._changed = changed
        self._lease: Lease[MqttSession] = Lease(takeover=False, leave=end_works, cut=keep, tell=self._tell)
        self._told: OrderedDict[tuple[str, str], dict[str, Any] | None] = OrderedDict()
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def holder(self) -> str | None:
        """Which session has the lease."""
        return self._lease.holder.name if self._lease.holder else None

    def take(self, payload: bytes) -> None:
        """Take a message."""
        try:
            session, given = parsed(payload)
        except ValueError as error:
            logger.info("%s: a command that is none: %s", self._on.name, printable(str(error)))
            return

        key = given.pop("id", None)
        try:
            check_key(key, needed=given.get("do") not in FREE)
            if key is None or not self._known(session, str(key)):
                self._start(self._answered(session, key, self._served(session, given)), session, given.get("do"))
        except ValueError as error:
            self._reply(session, {"id": None, "ok": False, "error": error_body(error)})

    def lose(self) -> None:
        """The broker is lost: who has the lease cannot be heard any more."""
        if holder := self._lease.holder:
            self._expire(holder)

    async def aclose(self) -> None:
        """End everything; returns when nothing goes on."""
        if holder := self._lease.holder:
            holder.leave()
            await self._lease.end(holder)

        for task in list(self._tasks):
            await cancel_and_join(task)

    def _served(self, session: str, given: dict[str, Any]) -> Coroutine[Any, Any, dict[str, Any]]:
        """What does a command."""
        match given.get("do"):
            case "stop":
                return self._stop(session, given)
            case "take_lease":
                return self._take_lease(session, given)
            case "release_lease":
                return self._release_lease(session, given)
            case _:
                return self._act(session, given)

    async def _stop(self, session: str, given: Mapping[str, Any]) -> dict[str, Any]:
        only(given)
        try:
            await self._works.stop(self._on)
        finally:
            holder = self._lease.holder
            if holder and holder.name != session:
                self._expire(holder)

        return {"stopped": self._on.name}

    async def _take_lease(self, name: str, given: Mapping[str, Any]) -> dict[str, Any]:
        seconds = seconds_of(given)
        holder = self._lease.holder
        session = holder if holder and holder.name == name and not holder.gone else MqttSession(name)
        await self._lease.take(session)
        if session.timer:
            session.timer.cancel()

        session.timer = asyncio.get_running_loop().call_later(seconds, self._expire, session)
        return {"lease": name, "seconds": seconds}

    async def _release_lease(self, session: str, given: Mapping[str, Any]) -> dict[str, Any]:
        only(given)
        if (holder := self._lease.holder) and holder.name == session:
            holder.leave()
            await self._lease.end(holder)

        return {"lease": self.holder}

    async def _act(self, session: str, given: Mapping[str, Any]) -> dict[str, Any]:
        action = parse_action(given)
        holder = self._lease.holder
        if holder is None or holder.gone or holder.name != session:
            who = f"{holder.name} has" if holder else "nobody has"
            raise Refused(f"take the lease first: {who} it")

        task = asyncio.current_task()
        assert task
        holder.works.add(task)
        try:
            return await self._works.do(self._on, action)
        finally:
            holder.works.discard(task)

    async def _answered(self, session: str, key: Any, work: Coroutine[Any, Any, dict[str, Any]]) -> None:
        """Do a command, and say what became of it."""
        try:
            told = {"id": key, "ok": True, "value": await work}
        except (DobotError, ValueError, TypeError, ImportError, Refused) as error:
            told = {"id": key, "ok": False, "error": error_body(error)}
        except asyncio.CancelledError:
            ended = {"kind": "MotionStopped", "text": "the lease has ended, and the arm was told to stop"}
            self._finish(session, key, {"id": key, "ok": False, "error": ended})
            raise

        self._finish(session, key, told)

    def _finish(self, session: str, key: Any, told: dict[str, Any]) -> None:
        if key is not None and (session, str(key)) in self._told:
            self._told[session, str(key)] = told

        self._reply(session, told)

    def _known(self, session: str, key: str) -> bool:
        """Whether a command was given before: it is not done again, and answered as before if it has ended."""
        if (session, key) in self._told:
            if told := self._told[session, key]:
                self._reply(session, told)

            return True

        self._told[session, key] = None
        if len(self._told) > REMEMBERED:
            self._told.popitem(last=False)

        return False

    def _expire(self, session: MqttSession) -> None:
        """A lease is over."""
        session.leave()
        for task in list(session.works):
            task.cancel()

        self._start(self._lease.end(session), session.name, "end of the lease")

    def _start(self, work: Coroutine[Any, Any, None], session: str, what: object) -> None:
        task = asyncio.create_task(work, name=f"dobot_async mqtt {what} of {session}")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _tell(self, what: str, session: MqttSession, detail: str) -> None:
        logger.info("%s: %s: %s: %s", self._on.name, session.name, what, detail)
        self._changed()


def keep(_session: MqttSession, _reason: str) -> None:
    """Nobody takes a lease from who has it, so nobody is cut off."""


async def end_works(session: MqttSession) -> None:
    """End what a session has the arm do; when this returns the arm was stopped."""
    for task in list(session.works):
        await cancel_and_join(task)


def parsed(payload: bytes) -> tuple[str, dict[str, Any]]:
    """The session and the command of a message; raise ValueError for one that is none."""
    if len(payload) > LONGEST:
        raise ValueError(f"a message has {LONGEST} bytes at the most")

    try:
        read = json.loads(payload)
    except (ValueError, RecursionError):
        raise ValueError("a command is a JSON object") from None

    if not isinstance(read, dict):
        raise ValueError("a command is a JSON object")  # noqa: TRY004 - of a message, not of a caller

    given = cast(dict[str, Any], read)
    session = given.pop("session", None)
    if not isinstance(session, str) or not SESSION.fullmatch(session):
        raise ValueError("session: 1 to 64 letters, digits, - and _")

    return session, given


def check_key(key: Any, *, needed: bool) -> None:
    """Raise ValueError for what is no id of a command."""
    if key is None:
        if needed:
            raise ValueError("id: a text or a number, new for each command")
    elif isinstance(key, bool) or not isinstance(key, (str, int)) or len(str(key)) > 64:
        raise ValueError("id: a text or a number of 64 characters at the most")


def seconds_of(given: Mapping[str, Any]) -> float:
    """How long a lease is to last; raise ValueError for what is no such time."""
    only(given, "seconds")
    seconds = given.get("seconds", USUAL)
    good = isinstance(seconds, (int, float)) and not isinstance(seconds, bool) and math.isfinite(seconds)
    if not good or not SHORTEST <= seconds <= MOST:
        raise ValueError(f"seconds: {SHORTEST:g} to {MOST:g}")

    return float(seconds)


def only(given: Mapping[str, Any], *names: str) -> None:
    """Raise ValueError for fields that a command does not have."""
    if more := set(given) - {"do", *names}:
        raise ValueError(f"{given['do']} has no {', '.join(map(ascii, sorted(more)))}")


def error_body(error: BaseException) -> dict[str, str]:
    """What is said of an error."""
    text = "; ".join([str(error), *getattr(error, "__notes__", ())])
    return {"kind": type(error).__name__, "text": printable(text, 1000)}
