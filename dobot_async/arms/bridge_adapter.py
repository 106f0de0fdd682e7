"""What a bridge has to know of a family to pass its frames on between several programs and one arm.

It is little, for the arm's answers mean nothing to a bridge: which frames only read, which stop, and what has to be
known of the rest to tell whether the arm moves on behalf of a program that has gone.
"""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.contract import Encoder, Frame, Parser
from dobot_async._core.protocol.transport import Transport

__all__ = ["BridgeAdapter", "ByKey", "ClientWatch", "RequestKind", "Switch", "TelemetryRead"]

F = TypeVar("F", bound=Frame)


class RequestKind(enum.Enum):
    """What a request is to a bridge."""

    READ = "read"
    """Changes nothing; anybody may send it."""
    WRITE = "write"
    """Changes something, or moves the arm; one program at a time may send it."""
    STOP = "stop"
    """Makes the arm stop; anybody may send it, and it goes ahead of everything. What waits to be written is dropped."""
    OFF = "off"
    """Switches off what burns or turns; anybody may send it, and it goes ahead of everything. Nothing else changes."""


class ClientWatch(Protocol[F]):
    """What one program has made the arm do."""

    @property
    def question(self) -> F:
        """The request whose answer tells whether the arm has finished."""
        ...

    def sent(self, request: F) -> None:
        """A request that is no read goes out."""

    def answered(self, request: F, reply: F) -> None:
        """It was answered."""

    def moving(self, reply: F | None) -> bool:
        """Returns whether the arm is, or may be, in the middle of what it was told; `reply` is that to the question."""
        ...

    def off(self) -> Sequence[F]:
        """Returns what ends, beside `BridgeAdapter.stopping`, what the program may have switched on."""
        ...


class Switch:
    """Whether something that burns or turns is on, as far as the arm can have executed what it was told.

    Where that is not known it counts as on. What was sent last says little: a queued "on" may be executed after an
    immediate "off", and a queued "off" may be thrown away with the queue.

    1. Any "on" counts from the moment that it is sent.
    2. A queued "off" counts when the queue has been executed to its end, unless an "on" came behind it, or the queue
       was emptied meanwhile.
    3. An immediate "off" counts when it was answered, unless a queued "on" may still come.
    """

    def __init__(self) -> None:
        self._on = False
        self._may_come = False
        self._off_behind = False

    def switch_on(self, *, queued: bool) -> None:
        """An "on" is sent."""
        self._on = True
        self._may_come = self._may_come or queued
        self._off_behind = False

    def switch_off(self, *, queued: bool) -> None:
        """An "off" was acknowledged."""
        if queued:
            self._off_behind = True
        elif not self._may_come:
            self._on = False

    def empty(self) -> None:
        """The queue was emptied: of what was queued nobody knows what has been executed."""
        self._may_come = self._off_behind = False

    def is_on(self, *, finished: bool) -> bool:
        """Returns whether it is, or may be, on; `finished` says that the queue has been executed to its end."""
        return self._on and not (finished and self._off_behind)


@dataclass(frozen=True, slots=True)
class TelemetryRead(Generic[F]):
    """Something that a bridge reads by itself, for those who only look.

    Attributes:
        request: What it asks the arm.
        period: Seconds from one reading to the next.
        tell: What the reply says, as JSON can hold it.
    """

    request: F
    period: float
    tell: Callable[[F], Mapping[str, Any]]


class BridgeAdapter(Protocol[F]):
    """One family."""

    @property
    def model(self) -> str:
        """What `sim:` is to simulate, and what a served arm is called."""
        ...

    @property
    def filler(self) -> bytes:
        """Bytes that end a half frame that the arm waits for."""
        ...

    @property
    def barriers(self) -> Sequence[F]:
        """Cheap reads that harm nobody, of several keys: an answer to one tells what will not be answered any more."""
        ...

    @property
    def greeting(self) -> F:
        """A read that any arm of the family answers."""
        ...

    @property
    def stopping(self) -> Sequence[F]:
        """What stops the arm, and what it was told, and switches off what burns or turns; the stop comes first."""
        ...

    @property
    def proves_stop(self) -> bool:
        """Whether an answer to a stop proves that the arm obeys; else it is looked at until it is seen to stand."""
        ...

    @property
    def escalated_stop(self) -> Sequence[F]:
        """What is said instead to an arm that has heard `stopping` several times and is still seen to move."""
        ...

    @property
    def in_order(self) -> bool:
        """Whether nothing but their order tells whose answers are.

        A client then gets its answers in the order of its requests, one for each, and what came behind a request that
        the arm did not answer is dropped.
        """
        ...

    @property
    def deny_groups(self) -> Mapping[str, Collection[Hashable]]:
        """Groups of commands that can be blocked, by name: the subjects of their requests."""
        ...

    @property
    def readings(self) -> Mapping[str, TelemetryRead[F]]:
        """What those who only look may like to know, by name; "motion" asks the question of a `ClientWatch`."""
        ...

    @property
    def encode(self) -> Encoder[F]:
        """What makes frames of the family's commands."""
        ...

    async def open(self, url: str, timeout: float) -> Transport:
        """Opens the way to an arm, with the family's options; raises ConnectFailed if that takes too long."""
        ...

    def parser(self) -> Parser[F]:
        """Returns a parser for what the arm sends."""
        ...

    def requests(self) -> Parser[F]:
        """Returns a parser for what a client sends."""
        ...

    def begins(self, data: bytes) -> bool | None:
        """Returns whether bytes are how a client's first request begins; None while too few of them are there."""
        ...

    def attach(self, link: Link[F], parser: Parser[F]) -> None:
        """Called with a new link to the arm, and the parser of what it sends."""

    def watch(self) -> ClientWatch[F]:
        """Returns what follows one program."""
        ...

    def kind(self, request: F) -> RequestKind:
        """Returns what a request is."""
        ...

    def subject(self, request: F) -> Hashable:
        """Returns what `deny_groups` call a request."""
        ...

    def name(self, request: F) -> str:
        """Returns what people call a request; nothing of its parameters."""
        ...

    def patience(self, request: F) -> float:
        """Returns the seconds that an answer may take."""
        ...

    def repeatable(self, request: F) -> bool:
        """Returns whether it does no harm to send it again: never for what moves anything."""
        ...

    def ack_optional(self, request: F) -> bool:
        """Returns whether the arm may take a request and answer nothing."""
        ...

    def accept(self, request: F, reply: F) -> F:
        """Returns the reply; raises ProtocolError if it cannot be one to this request."""
        ...

    def check(self, request: F) -> None:
        """Raises ProtocolError for a frame that the arm could not take."""

    def is_unsolicited(self, frame: F) -> bool:
        """Returns whether a frame that nobody waits for is for who moves the arm; else it is late, and for nobody."""
        ...

    def refusal(self, reason: str) -> bytes:
        """Returns what a client is told whose request is not passed on; nothing if the protocol has no word for it."""
        ...


class ByKey(ABC, Generic[F]):
    """A family whose answers tell by their keys whose they are, and which has no word for a refusal."""

    in_order = False
    header: bytes
    """What each frame begins with."""
    stopping: Sequence[F] = ()

    @property
    def escalated_stop(self) -> Sequence[F]:
        """Nothing else than `stopping`."""
        return self.stopping

    @abstractmethod
    def parser(self) -> Parser[F]:
        """Returns a parser for one stream."""

    def requests(self) -> Parser[F]:
        """Returns a parser for what a client sends, which looks like what the arm sends."""
        return self.parser()

    def begins(self, data: bytes) -> bool | None:
        """Returns whether bytes begin with the header of a frame; None while they are a part of it."""
        if len(data) < len(self.header):
            return None if self.header.startswith(data) else False

        return data.startswith(self.header)

    def attach(self, link: Link[F], parser: Parser[F]) -> None:
        """The parser needs to know of nothing."""

    def subject(self, request: F) -> Hashable:
        """Returns the key."""
        return request.key

    def is_unsolicited(self, frame: F) -> bool:  # noqa: ARG002 - its key tells that nobody waits for it
        """Returns False."""
        return False

    def refusal(self, reason: str) -> bytes:  # noqa: ARG002 - the protocol has no refusal
        """Returns nothing."""
        return b""
