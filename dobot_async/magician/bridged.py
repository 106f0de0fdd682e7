"""The Magician as a bridge sees it: which frames read, which stop, and whether the arm moves for one who has gone.

What is no known read counts as a write, so that nothing reaches the arm unseen because its Ctrl says "read".
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from dobot_async.arms.session import open_in_time
from dobot_async.bridged import ByKey, Kind, Reading
from dobot_async.contract import Parser
from dobot_async.errors import ProtocolError
from dobot_async.magician import alarms
from dobot_async.magician import commands as c
from dobot_async.magician import frame as f
from dobot_async.magician.arm import BARRIERS, LEAVING
from dobot_async.magician.frame import Frame
from dobot_async.transports import Transport
from dobot_async.wire import Command, Number, Queueing, u64

__all__ = ["BRIDGED", "BridgedMagician", "MagicianWatch"]

INDEX: Number[int] = Number(u64)
GARBAGE = 1 << 32  # an index so far beyond the last one is what some firmware shows while it moves
ACKNOWLEDGED = 1.0  # seconds within which the arm acknowledges a queued command, or does not
PATIENCE = 1.5
LITE_READS = {7, 33, 68, 69, 215}  # of the Magician Lite; they are in no public manual
STOPS = {c.SET_QUEUED_CMD_STOP_EXEC.id, c.SET_QUEUED_CMD_FORCE_STOP_EXEC.id}
IDLE = c.SET_JOG_CMD.request.encode(c.JOGCmd(is_joint=False, cmd=c.JOGKey.IDLE))[1:]
MOTORS = {c.SET_E_MOTOR.id, c.SET_E_MOTOR_S.id}


class MagicianWatch:
    """What one program has made the arm do: the last index that it got, and what has no index."""

    def __init__(self) -> None:
        self.question = f.request(c.GET_QUEUED_CMD_CURRENT_INDEX, b"", queued=False)
        self._last: int | None = None
        self._running: set[object] = set()

    def sent(self, request: Frame) -> None:
        """A request that is no read goes out."""
        if request.id in {c.SET_QUEUED_CMD_CLEAR.id, c.SET_QUEUED_CMD_FORCE_STOP_EXEC.id}:
            self._running -= {"unacknowledged", "immediate"}
            if request.id == c.SET_QUEUED_CMD_CLEAR.id:
                self._last = None
        elif request.id == c.SET_JOG_CMD.id:
            self._note("jog", running=request.params[1:] != IDLE)
        elif request.id == c.SET_END_EFFECTOR_LASER.id:
            self._note("laser", running=any(request.params[1:]))
        elif request.id == c.SET_E_MOTOR.id:
            self._note(request.params[:1], running=any(request.params[1:2]))
        elif not request.queued and moves(request):
            self._note("immediate", running=True)

        if request.queued:
            self._note("unacknowledged", running=True)

    def answered(self, request: Frame, reply: Frame) -> None:
        """It was answered."""
        if request.queued:
            self._note("unacknowledged", running=False)
            if len(reply.params) == INDEX.struct.size:
                self._last = INDEX.decode(reply.params)

    def moving(self, reply: Frame | None) -> bool:
        """Returns whether the arm is, or may be, in the middle of what it was told; `reply` is that to the question."""
        if self._running or self._last is None:
            return bool(self._running)

        if reply is None:
            return True

        index = INDEX.decode(reply.params)
        return index < self._last or index > self._last + GARBAGE

    def _note(self, what: object, *, running: bool) -> None:
        if running:
            self._running.add(what)
        else:
            self._running.discard(what)


def told_pose(reply: Frame) -> dict[str, Any]:
    """The pose, mm and degrees."""
    return asdict(c.GET_POSE.reply.decode(reply.params))


def told_alarms(reply: Frame) -> dict[str, Any]:
    """The alarms, with cause and remedy."""
    return {"alarms": [asdict(alarm) for alarm in alarms.decode(reply.params)]}


def told_index(reply: Frame) -> dict[str, Any]:
    """How far the arm has come in its queue."""
    return {"index": INDEX.decode(reply.params)}


class BridgedMagician(ByKey[Frame]):
    """See `dobot_async.bridged.Bridged`."""

    model = "magician"
    header = f.HEADER
    filler = f.FILLER
    encode = staticmethod(f.request)
    proves_stop = True
    greeting = f.request(c.GET_END_EFFECTOR_PARAMS, b"", queued=False)
    barriers = tuple(f.request(row, b"", queued=False) for row in BARRIERS)
    stopping = tuple(f.request(row, row.request.encode(value), queued=False) for row, value in LEAVING)
    readings = {  # noqa: RUF012 - a table
        "pose": Reading(f.request(c.GET_POSE, b"", queued=False), 0.2, told_pose),
        "motion": Reading(MagicianWatch().question, 0.2, told_index),
        "alarms": Reading(f.request(c.GET_ALARMS_STATE, b"", queued=False), 1.0, told_alarms),
    }
    denials = {  # noqa: RUF012 - a table
        "wifi": frozenset(range(150, 158)),
        "calibration": frozenset(
            {c.RESET_POSE.id, c.SET_AUTO_LEVELING_CMD.id, *range(140, 144), 222, 223, 224, 230, 231}
        ),
        "firmware": frozenset({c.SET_DEVICE_SN.id, 160, 161, 162, 163}),
    }

    async def open(self, url: str, timeout: float) -> Transport:
        """Opens the way to the arm."""
        return await open_in_time(url, self.model, timeout)

    def parser(self) -> Parser[Frame]:
        """Returns a parser for one stream."""
        return f.Parser()

    def watch(self) -> MagicianWatch:
        """Returns what follows one program."""
        return MagicianWatch()

    def kind(self, request: Frame) -> Kind:
        """Returns what a request is."""
        if request.id in STOPS or (
            request.id == c.SET_JOG_CMD.id and request.write and not request.queued and request.params[1:] == IDLE
        ):
            return Kind.STOP

        known = (request.id, False) in c.BY_KEY or request.id in LITE_READS
        return Kind.READ if known and not request.write and not request.queued else Kind.WRITE

    def name(self, request: Frame) -> str:
        """Returns the manual's name; nothing of the parameters, one of which is a password."""
        row = row_of(request)
        return row.name if row else f"command {request.id}"

    def patience(self, request: Frame) -> float:
        """Returns the seconds that an answer may take."""
        row = row_of(request)
        return ACKNOWLEDGED if request.queued else row.timeout if row else PATIENCE

    def repeatable(self, request: Frame) -> bool:
        """Returns whether it does no harm to send it again: never for what moves anything."""
        row = row_of(request)
        if row is None or request.queued or row.moves or row.id in MOTORS:
            return self.kind(request) is Kind.STOP

        return row.repeatable

    def may_be_silent(self, request: Frame) -> bool:  # noqa: ARG002 - it answers everything
        """Returns False."""
        return False

    def accept(self, request: Frame, reply: Frame) -> Frame:
        """Returns the reply; raises ProtocolError if it cannot be one to this request."""
        row = row_of(request)
        index = len(reply.params) == INDEX.struct.size
        if request.queued and (index or row is None or row.queueing is not Queueing.NEVER):
            if not index:
                raise ProtocolError(f"{len(reply.params)} bytes are no index")
        elif row is not None:
            answer = row.reply.decode(reply.params)
            if row.echo and getattr(answer, row.echo) != row.request.decode(request.params):
                raise ProtocolError(f"{row.name} was answered for another {row.echo}")

        self.check(reply)
        return reply

    def check(self, request: Frame) -> None:
        """Raises ProtocolError for a frame that is longer than the buffer of the arm."""
        if len(request.params) > f.MAX_PARAMS:
            raise ProtocolError(f"{len(request.params)} bytes of parameters; a frame carries at most {f.MAX_PARAMS}")


BRIDGED = BridgedMagician()


def row_of(request: Frame) -> Command[object, object] | None:
    """The row of a request, None if there is none."""
    return c.BY_KEY.get((request.id, request.write))


def moves(request: Frame) -> bool:
    """Whether it moves the arm, or may for all that is known."""
    row = row_of(request)
    return row is None or row.moves
