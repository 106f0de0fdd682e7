"""The Magician as a bridge sees it: which frames read, which stop, and whether the arm moves for one who has gone.

What is no known read counts as a write, so that nothing reaches the arm unseen because its Ctrl says "read".
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Final, NamedTuple

from dobot_async._core.protocol.contract import Parser
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command, Number, Queueing, u64
from dobot_async.arms.bridge_adapter import ByKey, RequestKind, Switch, TelemetryRead
from dobot_async.arms.magician import alarms
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician import frame as f
from dobot_async.arms.magician.frame import Frame
from dobot_async.arms.magician.opening import BARRIERS
from dobot_async.arms.magician.stopping import LEAVING, TOOLS
from dobot_async.arms.session import open_in_time
from dobot_async.errors import ProtocolError

__all__ = ["BRIDGED", "BridgedMagician", "MagicianWatch"]

INDEX: Number[int] = Number(u64)
GARBAGE = 1 << 32  # an index so far beyond the last one is what some firmware shows while it moves
ACKNOWLEDGED = 1.0  # seconds within which the arm acknowledges a queued command, or does not
PATIENCE = 1.5
LITE_READS = {7, 33, 68, 69, 215}  # of the Magician Lite; they are in no public manual
STOPS = {c.SET_QUEUED_CMD_STOP_EXEC.id, c.SET_QUEUED_CMD_FORCE_STOP_EXEC.id}
TOOLS_OFF = {(row.id, row.request.encode(value)) for row, value in TOOLS}
IDLE = c.SET_JOG_CMD.request.encode(c.JOGCmd(is_joint=False, cmd=c.JOGKey.IDLE))[1:]
MOTORS = {c.SET_E_MOTOR.id, c.SET_E_MOTOR_S.id}
NO_DUTY = c.SET_IOPWM.request.encode(c.IOPWM(1, 1000.0, 0.0))[1:]


class MagicianWatch:
    """What one program has made the arm do: the last index that it got, what goes on beside the queue, what is on.

    An immediate motion ends with a force-stop alone. So does, for all that is known, the command that executes when the
    queue is cleared.
    """

    def __init__(self) -> None:
        self.question: Frame = f.request(c.GET_QUEUED_CMD_CURRENT_INDEX, b"", queued=False)
        self._last: int | None = None
        self._unacknowledged = False
        self._goes_on = False
        self._halted = False
        self._switches: defaultdict[tuple[int, bytes], Switch] = defaultdict(Switch)

    def sent(self, request: Frame) -> None:
        """A request that is no read goes out."""
        switch = switched(request)
        if switch and switch.on:
            self._switches[switch.what].switch_on(queued=request.queued)
        elif not switch and not request.queued and moves(request):
            self._goes_on = True

        if request.queued:
            self._unacknowledged = True

        if request.queued or request.id == c.SET_QUEUED_CMD_START_EXEC.id:
            self._halted = False

    def answered(self, request: Frame, reply: Frame) -> None:
        """It was answered."""
        if request.id == c.SET_QUEUED_CMD_FORCE_STOP_EXEC.id:
            self._halted, self._goes_on = True, False
        elif request.id == c.SET_QUEUED_CMD_CLEAR.id:
            self._emptied()

        switch = switched(request)
        if switch and (not switch.on or (request.queued and switch.ends)):
            self._switches[switch.what].switch_off(queued=request.queued)

        if request.queued:
            self._unacknowledged = False
            if len(reply.params) == INDEX.struct.size:
                self._last = INDEX.decode(reply.params)

    def moving(self, reply: Frame | None) -> bool:
        """Returns whether the arm is, or may be, in the middle of what it was told; `reply` is that to the question."""
        if self._goes_on or self._unacknowledged:
            return True

        if self._last is not None:
            index = self._last - 1 if reply is None else INDEX.decode(reply.params)
            if index < self._last or index > self._last + GARBAGE:
                return True

        return any(switch.is_on(finished=True) for switch in self._switches.values())

    def off(self) -> Sequence[Frame]:
        """Returns what ends the PWM of its pins: what hangs there may turn or burn. The rest is in `stopping`."""
        addresses = [what for row, what in self._switches if row == c.SET_IOPWM.id]
        return [f.request(c.SET_IOPWM, address + NO_DUTY, queued=False) for address in addresses]

    def _emptied(self) -> None:
        """The queue was cleared."""
        if not self._halted and (self._last is not None or self._unacknowledged):
            self._goes_on = True

        self._last, self._unacknowledged = None, False
        for switch in self._switches.values():
            switch.empty()


class Switched(NamedTuple):
    """What a request does to something that burns, turns or moves until it is told otherwise.

    Attributes:
        what: Which thing it is.
        on: Whether it switches it on.
        ends: Whether it ends by itself.
    """

    what: tuple[int, bytes]
    on: bool
    ends: bool = False


def switched(request: Frame) -> Switched | None:
    """What a request switches on or off; None if nothing."""
    params = request.params
    if request.id == c.SET_JOG_CMD.id:
        return Switched((request.id, b""), params[1:] != IDLE)

    if request.id == c.SET_END_EFFECTOR_LASER.id:
        return Switched((request.id, b""), any(params[1:]))

    if request.id in MOTORS:
        ends = request.id == c.SET_E_MOTOR_S.id
        return Switched((c.SET_E_MOTOR.id, params[:1]), any(params[1:2]), ends)

    if request.id == c.SET_IOPWM.id:
        return Switched((request.id, params[:1]), any(params[5:]))

    return None


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
    """See `dobot_async.arms.bridge_adapter.BridgeAdapter`."""

    model = "magician"
    header = f.HEADER
    filler: bytes = f.FILLER
    encode: Final = staticmethod(f.request)
    proves_stop = True
    greeting: Frame = f.request(c.GET_END_EFFECTOR_PARAMS, b"", queued=False)
    barriers: tuple[Frame, ...] = tuple(f.request(row, b"", queued=False) for row in BARRIERS)
    stopping: Sequence[Frame] = tuple(f.request(row, row.request.encode(value), queued=False) for row, value in LEAVING)
    readings: dict[str, TelemetryRead[Frame]] = {  # noqa: RUF012 - a table
        "pose": TelemetryRead(f.request(c.GET_POSE, b"", queued=False), 0.2, told_pose),
        "motion": TelemetryRead(MagicianWatch().question, 0.2, told_index),
        "alarms": TelemetryRead(f.request(c.GET_ALARMS_STATE, b"", queued=False), 1.0, told_alarms),
    }
    deny_groups: dict[str, frozenset[int]] = {  # noqa: RUF012 - a table
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

    def kind(self, request: Frame) -> RequestKind:
        """Returns what a request is."""
        now = request.write and not request.queued
        ends_jog = request.id == c.SET_JOG_CMD.id and request.params[1:] == IDLE
        if request.id in STOPS or (now and ends_jog):
            return RequestKind.STOP

        if now and (request.id, request.params) in TOOLS_OFF:
            return RequestKind.OFF

        known = (request.id, False) in c.BY_KEY or request.id in LITE_READS
        return RequestKind.READ if known and not request.write and not request.queued else RequestKind.WRITE

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
            return self.kind(request) in {RequestKind.STOP, RequestKind.OFF}

        return row.repeatable

    def ack_optional(self, request: Frame) -> bool:  # noqa: ARG002 - it answers everything
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
