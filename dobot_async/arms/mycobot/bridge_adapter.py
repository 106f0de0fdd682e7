"""The myCobot family as a bridge sees it: which frames read, which stop, and whether the arm moves for somebody.

An arm of this family need not answer commands, and an answer proves nothing. So a write is sent once and may stay
unanswered; that a stop was heard is found by looking at the arm. The gap between frames is the transport's.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from types import MappingProxyType
from typing import Any, Final

from dobot_async._core.protocol.contract import Parser
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.bridge_adapter import ByKey, RequestKind, TelemetryRead
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot import frame as f
from dobot_async.arms.mycobot.alarms import joint_alarms
from dobot_async.arms.mycobot.arm import GAP, opened, with_baud
from dobot_async.arms.mycobot.frame import Frame
from dobot_async.arms.mycobot.models import AXES, DEFAULT, MODELS, CobotModel, lengths
from dobot_async.errors import ProtocolError

__all__ = ["BRIDGED", "BridgedCobot", "CobotWatch"]

BEGINS = 1.5  # seconds within which a motion begins
ACKNOWLEDGED = 0.5  # seconds within which newer firmware acknowledges a command
UNACKNOWLEDGED = 0.2  # the same for a model that mostly does not: the line is not kept longer than that
CALIBRATION = (
    c.SET_SERVO_CALIBRATION,
    c.SET_SERVO_DATA,
    c.SET_GRIPPER_CALIBRATION,
    c.SET_FOUR_PIECES_ZERO,
    c.SET_JOINT_MIN,
    c.SET_JOINT_MAX,
)


class CobotWatch:
    """What one program has made the arm do: it moves while the arm says so, and for a while after the last motion."""

    def __init__(self, model: CobotModel, clock: Callable[[], float]) -> None:
        self.question: Frame = request(model, c.IS_MOVING)
        self._model = model
        self._clock = clock
        self._told = False
        self._paused = False
        self._begins_by = 0.0

    def sent(self, request: Frame) -> None:
        """A request that is no read goes out."""
        row = self._model.by_id.get(request.id)
        if row in STOPS:
            self._paused = False
            self._begins_by = 0.0
        elif row is c.PAUSE:
            self._paused = self._told
        elif row is None or row.moves or row is c.RESUME:
            self._told, self._paused = True, False
            self._begins_by = self._clock() + BEGINS

    def answered(self, request: Frame, reply: Frame) -> None:
        """It was answered, which proves nothing."""

    def moving(self, reply: Frame | None) -> bool:
        """Returns whether the arm is, or may be, in the middle of what it was told; `reply` is that to the question."""
        if reply is None or self._paused or self._clock() < self._begins_by:
            return self._told

        return self._told and self._model.row(c.IS_MOVING).reply.decode(reply.params)

    def off(self) -> Sequence[Frame]:
        """Returns nothing: what these arms switch holds, and does not burn or turn."""
        return ()


STOPS = frozenset({c.STOP, c.JOG_STOP})

BARRIERS = (c.IS_POWER_ON, c.IS_CONTROLLER_CONNECTED, c.IS_FREE_MODE, c.GET_SPEED)
"""Cheap reads used as barriers: the answer to one proves that earlier requests will not be answered."""


class BridgedCobot(ByKey[Frame]):
    """See `dobot_async.arms.bridge_adapter.BridgeAdapter`; one for each model."""

    filler = b""
    header = f.HEADER
    encode: Final = staticmethod(f.request)
    proves_stop = False

    def __init__(self, model: CobotModel) -> None:
        self.model: str = model.name
        self.barriers: tuple[Frame, ...] = tuple(request(model, row) for row in BARRIERS if row in model.rows)
        self.greeting: Frame = request(model, c.IS_POWER_ON)
        self.stopping: Sequence[Frame] = (request(model, c.STOP),)
        self.deny_groups: dict[str, frozenset[int]] = {
            "calibration": frozenset(model.rows[row].id for row in CALIBRATION if row in model.rows)
        }
        self.readings: dict[str, TelemetryRead[Frame]] = {
            "pose": TelemetryRead(request(model, c.GET_COORDS), 0.2, self._told_coords),
            "joints": TelemetryRead(request(model, c.GET_ANGLES), 0.2, self._told_angles),
            "motion": TelemetryRead(request(model, c.IS_MOVING), 0.2, self._told_motion),
            "alarms": TelemetryRead(request(model, c.READ_NEXT_ERROR), 1.0, self._told_alarms),
        }
        self._model = model

    async def open(self, url: str, timeout: float) -> Transport:
        """Opens the way to the arm, which leaves a gap between frames."""
        return await opened(with_baud(url, self._model.baud), self.model, timeout, GAP)

    def parser(self) -> Parser[Frame]:
        """Returns a parser for one stream."""
        return f.Parser(self._model.known)

    def watch(self) -> CobotWatch:
        """Returns what follows one program."""
        return CobotWatch(self._model, asyncio.get_running_loop().time)

    def kind(self, request: Frame) -> RequestKind:
        """Returns what a request is."""
        row = self._row(request)
        if row in STOPS:
            return RequestKind.STOP

        return RequestKind.WRITE if row is None or row.write else RequestKind.READ

    def name(self, request: Frame) -> str:
        """Returns the name of the row."""
        row = self._row(request)
        return row.name if row else f"command {request.id:02X}"

    def patience(self, request: Frame) -> float:
        """Returns the seconds that an answer may take."""
        row = self._row(request)
        if row is None or row.write:
            return ACKNOWLEDGED if self._model.acknowledges else UNACKNOWLEDGED

        return row.timeout

    def repeatable(self, request: Frame) -> bool:
        """Returns whether it may be sent again: reads alone.

        No command need be answered. One more stop, said for the lack of an answer, would end what its program has gone
        on to since.
        """
        return self.kind(request) is RequestKind.READ

    def ack_optional(self, request: Frame) -> bool:
        """Returns whether the arm may have taken a request without an answer: each command."""
        return self.kind(request) is not RequestKind.READ

    def accept(self, request: Frame, reply: Frame) -> Frame:
        """Returns the reply; raises ProtocolError if it cannot be one to this request, or is the request, sent back."""
        row = self._row(request)
        if row is not None and not row.write:
            own = self._model.row(row)
            if request.params and request.params == reply.params and len(reply.params) in lengths(own.reply):
                raise ProtocolError("that is the request, sent back")

            answer = own.reply.decode(reply.params)
            if own.echo and getattr(answer, own.echo) != own.request.decode(request.params):
                raise ProtocolError(f"{own.name} was answered for another {own.echo}")

        return reply

    def check(self, request: Frame) -> None:
        """Raises ProtocolError for a frame that the arm could not take."""
        row = self._row(request)
        if row is None or len(request.params) not in lengths(self._model.row(row).request):
            raise ProtocolError(f"{len(request.params)} bytes of parameters are none of {self.name(request)}")

    def _row(self, request: Frame) -> Command[Any, Any] | None:
        """The row of a request."""
        return self._model.by_id.get(request.id)

    def _decode(self, command: Command[None, Any], reply: Frame) -> Any:
        return self._model.row(command).reply.decode(reply.params)

    def _told_coords(self, reply: Frame) -> dict[str, Any]:
        """Where the tool is, mm and degrees."""
        return dict(zip(AXES, self._decode(c.GET_COORDS, reply), strict=False))

    def _told_angles(self, reply: Frame) -> dict[str, Any]:
        """The joints, degrees."""
        return {f"j{joint}": angle for joint, angle in enumerate(self._decode(c.GET_ANGLES, reply), 1)}

    def _told_motion(self, reply: Frame) -> dict[str, Any]:
        """Whether the arm says that it moves."""
        return {"flag": self._decode(c.IS_MOVING, reply)}

    def _told_alarms(self, reply: Frame) -> dict[str, Any]:
        """What keeps the arm from moving, with cause and remedy."""
        found = joint_alarms(self._decode(c.READ_NEXT_ERROR, reply), self._model.joints)
        return {"alarms": [asdict(alarm) for alarm in found]}


def request(model: CobotModel, command: Command[None, Any]) -> Frame:
    """The request of a row without parameters."""
    return f.request(model.row(command), b"", queued=False)


COBOTS = {name: BridgedCobot(model) for name, model in MODELS.items()}
BRIDGED: Mapping[str, BridgedCobot] = MappingProxyType({"mycobot": COBOTS[DEFAULT], **COBOTS})
"""What a bridge knows of each model; without one it is the usual one."""
