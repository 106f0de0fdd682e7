"""What must be true of a run: what each call was told, against what the arm has recorded."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from dobot_async import ArmAlarm, ConnectionLost, DobotError, MotionStopped, MotionUnknown, ReplyTimeout
from dobot_async.magician import commands as c
from dobot_async.magician.frame import Frame, Parser
from dobot_async.motion import POLL, Motion
from dobot_async.simulator import Simulation
from dobot_async.simulator.work import Executed

if TYPE_CHECKING:
    from scenario import Plan

__all__ = ["Fate", "Kind", "Record", "Violation", "judge"]

Kind = Literal["move", "step", "far", "wait", "pwm"]
Found = list[tuple[int, Executed]]
TINY = 1e-6
SILENT = 4.0  # seconds: an arm that could not be heard for so long may be given up


class Violation(AssertionError):
    """Something was not as it must be."""


@dataclass
class Fate:
    """What became of one command, as the program was told.

    Attributes:
        watched: Whether somebody waits for it all the time, so that its end is noticed soon.
        asked: When it was to be put.
        motion: Its Motion, once there is one.
        cancelled: Whether the call was cancelled.
        error: How it failed, if it did.
        ended: When its end was told, by its Motion or by the call.
    """

    number: int
    kind: Kind
    value: Any
    watched: bool
    asked: float
    motion: Motion | None = None
    cancelled: bool = False
    error: DobotError | None = None
    ended: float | None = None


@dataclass
class Record:
    """What was noted of a run.

    Attributes:
        stops: From when to when something was stopped.
        standstills: When a stop began and ended, and the number of the last command that was put before it began.
        failures: How calls other than puts failed, and Motions.
        struck_at: When the power failed or the line broke.
        silence: The longest time for which requests were sent and nothing was heard.
    """

    speed: float
    clock: Callable[[], float]
    trace: Callable[[str], None] | None = None
    fates: list[Fate] = field(default_factory=list)
    stops: list[tuple[float, float]] = field(default_factory=list)
    standstills: list[tuple[float, float, int]] = field(default_factory=list)
    failures: list[DobotError] = field(default_factory=list)
    struck_at: float | None = None
    silence: float = 0.0
    left_over: int = 0
    pending: int = 0
    entering: int = 0
    poses: deque[tuple[float, c.Pose]] = field(default_factory=deque)
    waiting_since: float | None = None

    def failed(self, error: DobotError) -> None:
        """A call failed."""
        self.failures.append(error)
        self.note(f"failed: {error!r}")

    def note(self, text: str) -> None:
        """Adds a line to the trace."""
        if self.trace:
            self.trace(f"{self.clock():10.4f} ... {text}")

    def heard(self, now: float, *, outgoing: bool) -> None:
        """A frame came or went."""
        if outgoing:
            self.waiting_since = now if self.waiting_since is None else self.waiting_since
        elif self.waiting_since is not None:
            self.silence = max(self.silence, now - self.waiting_since)
            self.waiting_since = None

        if self.waiting_since is not None:
            self.silence = max(self.silence, now - self.waiting_since)

    def answered(self, now: float, request: Frame, reply: bytes) -> None:
        """The arm answered a request."""
        if request.id == c.GET_POSE.id and not request.write and reply:
            (frame,) = Parser().feed(reply)
            self.poses.append((now, c.GET_POSE.reply.decode(frame.params)))

    def check_pose(self, pose: c.Pose, start: float, end: float) -> None:
        """Raises if the arm was not asked for this pose in this time."""
        if not any(start - TINY <= time <= end + TINY and each == pose for time, each in self.poses):
            raise Violation(f"a pose that was read between {start:.4f} and {end:.4f} was not the arm's then: {pose}")


def judge(record: Record, sim: Simulation, plan: Plan) -> None:
    """Raises Violation if anything is not as it must be."""
    numbers = {fate.value: fate.number for fate in record.fates}
    found = [
        (numbers[each.value], each) for each in sim.arm.executed if each.index is not None and each.value in numbers
    ]
    check_order(record, found, plan)
    errors = [fate.error for fate in record.fates if fate.error] + record.failures
    check_errors(record, errors, found, plan)
    for fate in record.fates:
        check_fate(record, fate, [each for number, each in found if number == fate.number], plan)

    for start, end, last in record.standstills:
        late = [
            (number, each) for number, each in found if number <= last and each.finished / record.speed > end + TINY
        ]
        ensure(not late, f"what was stopped from {start:.4f} to {end:.4f} ran later: {late}")

    if plan.severity == "none" and not plan.disaster and not any(fate.cancelled for fate in record.fates):
        # A probe that finds out what became of a command takes a place that nobody has counted.
        ensure(sim.arm.counters.overflowed == 0, f"{sim.arm.counters.overflowed} commands were put into a full queue")

    ensure(record.pending == 0, f"{record.pending} Motions are pending at the end")
    ensure(record.entering == 0, f"{record.entering} Motions are not accepted, and not ended")
    ensure(record.left_over == 0, f"{record.left_over} wait for replies at the end")


def check_order(record: Record, found: Found, plan: Plan) -> None:
    """Each once, in order; on a line that doubles, a second time right behind the first."""
    order = [number for number, _ in found]
    once = [number for place, number in enumerate(order) if place == 0 or order[place - 1] != number]
    ensure(once == sorted(set(once)), f"something ran again, or out of order: {order}")
    twice = [number for place, number in enumerate(order) if place and order[place - 1] == number]
    if plan.disaster == "power":
        # An arm that counts on from the same index after a power failure is not recognised as another one.
        twice = [number for number in twice if (record.fates[number].ended or 0) < (record.struck_at or 0)]

    ensure(not twice or plan.doubles, f"ran twice on a line that doubles nothing: {twice}")
    for number in twice:
        fate = record.fates[number]
        told = fate.error is not None or fate.cancelled
        ensure(fate.kind != "step" or told, f"a relative command ran twice, and was said to be done: {fate}")


def check_errors(record: Record, errors: Sequence[DobotError], found: Found, plan: Plan) -> None:
    """Nothing fails that had no reason to."""
    order = [number for number, _ in found]
    surplus = plan.doubles and "step" in plan.kinds
    if record.struck_at is not None or record.silence > SILENT:
        return

    for error in errors:
        unexpected = isinstance(error, (ConnectionLost, ReplyTimeout)) or (
            isinstance(error, MotionUnknown) and not surplus
        )
        ensure(not unexpected, f"failed without a reason: {error!r} (longest silence {record.silence:.2f} s; {order})")


def check_fate(record: Record, fate: Fate, found: Sequence[Executed], plan: Plan) -> None:
    """One command was told the truth."""
    done = [each for each in found if each.outcome == "done"]
    if plan.disaster == "power" and fate.asked <= (record.struck_at or 0) <= (fate.ended or math.inf):
        # An arm that counts on from the same index after a power failure is not recognised as another one.
        return

    if fate.ended is None:
        ensure(fate.cancelled, f"nobody was told anything of {fate}")
        return

    if fate.error is None:
        ensure(bool(done), f"it was said to be done, and was not: {fate}, {found}")
        ensure(
            done[0].finished / record.speed <= fate.ended + TINY, f"it was said to be done too early: {fate}, {done}"
        )
        if fate.motion and not plan.doubles and record.struck_at is None:
            ensure(fate.motion.index == done[0].index, f"it has another index: {fate.motion.index}, {done}")

        return

    if record.struck_at is not None and fate.ended >= record.struck_at:
        return

    if isinstance(fate.error, ArmAlarm):
        ensure("far" in plan.kinds, f"no alarm was there: {fate}")

    if isinstance(fate.error, MotionStopped) and not fate.cancelled:
        stopped = any(fate.asked <= end + TINY and start <= (fate.ended or 0) + TINY for start, end in record.stops)
        ensure(stopped, f"nobody stopped it: {fate} {record.stops}")

    if plan.severity == "none" and done and fate.watched:
        slack = POLL + 30 * (plan.faults.latency + 2 * plan.disorder) + TINY
        ensure(
            done[0].finished / record.speed >= fate.ended - slack, f"it was done, and not said to be: {fate}, {done}"
        )


def ensure(holds: bool, message: str) -> None:
    """Raises Violation unless it holds."""
    if not holds:
        raise Violation(message)
