"""The requests of a bridge's clients, and the protocol of what handles them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from dobot_async._core.protocol.contract import Frame
from dobot_async.arms.bridge_adapter import RequestKind

if TYPE_CHECKING:
    from dobot_async.bridge.client import Client

__all__ = ["ClientRequest", "Refused", "RequestHandler"]

F = TypeVar("F", bound=Frame)


class Refused(Exception):
    """A request is not passed on; the message says why. The client hears it where its protocol has a word for it."""


@dataclass(slots=True)
class ClientRequest(Generic[F]):
    """A request.

    Attributes:
        frame: As it came.
        kind: What it is to a bridge.
        stops: How many stops there had been when it came.
        times: How often it came before it was sent.
        ahead: Whether it went ahead of what its client had sent before.
        answer: What the client is told, None until that is known.
        in_turn: Whether what its client sent behind it waits until it is sent.
    """

    frame: F
    kind: RequestKind
    stops: int
    times: int = 1
    ahead: bool = False
    answer: bytes | None = None
    in_turn: bool = False


class RequestHandler(Protocol[F]):
    """Where requests are taken."""

    stops: int
    """How often something stopped the arm; what came before the last time is not sent any more."""

    async def answer(self, client: Client[F], request: ClientRequest[F]) -> F | None:
        """Returns the arm's reply, None where the arm need not answer; raises Refused, or DobotError."""
        ...

    def refused(self, client: Client[F], name: str, reason: str) -> None:
        """Takes note that a request was not passed on."""

    def cut(self, client: Client[F], reason: str) -> None:
        """Ends a connection."""
