"""How the rows of a family's table of commands are written, alike for all families.

rows = Rows(Record, NOTHING)                 # dataclasses are records; a command is answered with nothing
GET_POSE = rows.read("GetPose", 10, Pose, "2.4.1")
RESET_POSE = rows.write("ResetPose", 11, ResetPose, "2.4.2")
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from dobot_async._core.protocol.layouts import NOTHING
from dobot_async._core.protocol.wire import Command, Layout, Queueing

__all__ = ["Rows"]

A = TypeVar("A")
Q = TypeVar("Q")
R = TypeVar("R")


class Rows(Generic[A]):
    """Makes the rows of one table.

    Args:
        record: Makes the layout of a dataclass.
        answer: What commands are answered with.
    """

    def __init__(self, record: Callable[[type[Any]], Layout[Any]], answer: Layout[A]) -> None:
        self._record = record
        self._answer = answer

    def read(self, name: str, number: int, reply: type[R] | Layout[R], section: str) -> Command[None, R]:
        """A row that asks for something, with no parameters."""
        return Command(name, number, NOTHING, self.layout(reply), section)

    def ask(
        self,
        name: str,
        number: int,
        request: type[Q] | Layout[Q],
        reply: type[R] | Layout[R],
        section: str,
        echo: str | None = None,
    ) -> Command[Q, R]:
        """A row that asks for something that the request names."""
        return Command(name, number, self.layout(request), self.layout(reply), section, echo=echo)

    def write(
        self,
        name: str,
        number: int,
        request: type[Q] | Layout[Q],
        section: str,
        queueing: Queueing = Queueing.NEVER,
        *,
        repeatable: bool = True,
        timeout: float = 1.5,
        moves: bool = False,
    ) -> Command[Q, A]:
        """A row that sets something."""
        return Command(
            name,
            number,
            self.layout(request),
            self._answer,
            section,
            write=True,
            queueing=queueing,
            repeatable=repeatable,
            timeout=timeout,
            moves=moves,
        )

    def motion(self, name: str, number: int, request: type[Q] | Layout[Q], section: str) -> Command[Q, A]:
        """A row that moves the arm, through the queue; to send it twice is to do it twice."""
        return self.write(name, number, request, section, Queueing.ALWAYS, repeatable=False, moves=True)

    def layout(self, kind: type[Q] | Layout[Q]) -> Layout[Q]:
        """The layout itself, or that of a dataclass."""
        return self._record(kind) if isinstance(kind, type) else kind
