"""What must be true of a run: what each call was told, against what the arm has recorded.

The bounds are those of the promise, and none is a constant of the driver:

    a cancelled call      ends within 2 s, as cancelled calls end (`calls`)
    a stop                was heard 1 s after the line carries everything again, whatever became of the call
    "unknown"             is an excuse after a silence of 3 s or a disaster
    a line that is gone   is not one that is silent
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from calls import Call, Violation
from observed import Observed

from dobot_async import (
    ArmAlarm,
    CommandRejected,
    ConnectionLost,
    DobotError,
    MotionStopped,
    MotionUnknown,
    ReplyTimeout,
)
from dobot_async._core.queue.motion import Motion
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import Simulation
from dobot_async.simulator.device.work import Executed

if TYPE_CHECKING:
    from scenario import Plan

__all__ = ["Fate", "Jogging", "Kind", "Record", "Standstill", "check_jogs", "judge", "judge_answer", "judge_set"]

Kind = Literal["move", "step", "far", "wait", "setting"]
Found = list[tuple[int, Executed]]
NAME = re.compile(r"sim://arm[0-9]+")
TINY = 1e-6
UNHEARD = 3.0  # seconds of silence after which nobody can know what became of a motion
SHORT = 0.7  # seconds of silence within which a question may fail that waits for its answer a little longer
LINGERING = 10.0  # seconds after a silence in which its consequences may come to light
BRIEF = 1.0  # seconds: a question with a shorter timeout may fail on any line
HEARD, HEARD_DESPITE_LOSS = 1.0, 5.0  # seconds of a good line, of one that loses, after which a stop has been heard
NOTICED = 1.0  # seconds after which it is known on a good line that a motion is done


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
class Standstill:
    """Commands that a stop ends.

    Attributes:
        why: What stopped them.
        numbers: The first and the last of them.
        begun: When the stop was asked for.
        ended: When it was said to have happened; None if it was not.
        certain: Whether it must be heard even if nobody waits for it any more.
    """

    why: str
    numbers: tuple[int, int]
    begun: float
    ended: float | None
    certain: bool = True


@dataclass
class Jogging:
    """The block of a jog: from when it was entered to when it was to be left, and had been."""

    call: Call
    begun: float
    over: float | None = None


@dataclass
class Record:
    """What was noted of a run.

    Attributes:
        stops: From when to when something was stopped.
        failed: What else failed than a put.
        struck_at: When the power failed or the line broke, or the connection's block was left.
    """

    speed: float
    clock: Callable[[], float]
    trace: Callable[[str], None] | None = None
    fates: list[Fate] = field(default_factory=list)
    begun: int = -1
    stops: list[tuple[float, float]] = field(default_factory=list)
    standstills: list[Standstill] = field(default_factory=list)
    joggings: list[Jogging] = field(default_factory=list)
    failed: list[Call] = field(default_factory=list)
    struck_at: float = math.inf
    left_at: float = math.inf
    pending: int = 0

    def note(self, text: str) -> None:
        """Adds a line to the trace; the names of simulations differ from run to run, and are left out."""
        if self.trace:
            self.trace(f"{self.clock():10.4f} ... {NAME.sub('sim:', text)}")


def judge(record: Record, seen: Observed, sim: Simulation, plan: Plan) -> None:
    """Raises Violation if anything is not as it must be."""
    numbers = {fate.value: fate.number for fate in record.fates}
    found = [
        (numbers[each.value], each) for each in sim.arm.executed if each.index is not None and each.value in numbers
    ]
    check_order(record, found, plan)
    for call in record.failed:
        check_failure(call.error, call.begun or 0.0, call.ended or 0.0, str(call), record, seen, plan, call.timeout)

    for fate in record.fates:
        check_fate(record, fate, [each for number, each in found if number == fate.number], seen, plan)

    check_standstills(record, seen, found, plan)
    check_jogs(record, seen, sim, plan)
    if plan.severity == "none" and not plan.disaster and not any(fate.cancelled for fate in record.fates):
        # A probe that finds out what became of a command takes a place that nobody has counted.
        ensure(sim.arm.counters.overflowed == 0, f"{sim.arm.counters.overflowed} commands were put into a full queue")

    ensure(record.pending == 0, f"{record.pending} Motions are pending at the end")


def judge_answer(call: Call, row: Any, value: Any, seen: Observed, plan: Plan) -> None:
    """Raises Violation unless a read got what the arm has said, after it was asked, and in the time that it had."""
    begun, ended = call.begun or 0.0, call.ended or 0.0
    if call.good and not seen.answered(row, value, call.value, begun - 2 * plan.reorder_window - TINY, ended + TINY):
        when = [time for time, each in seen.answers[row.id, value] if each == call.value and time <= ended]
        last = f"last made at {when[-1]:.4f}" if when else "never made"
        raise Violation(f"an answer from before its question ({last}): {call}")

    if call.timeout is not None and call.hurried is None and ended - begun > call.timeout + 0.1:
        raise Violation(f"took {ended - begun:.2f} s, with a timeout of {call.timeout} s: {call}")


def judge_set(call: Call, row: Any, value: Any, seen: Observed) -> None:
    """Raises Violation unless what was set has been set in the time of the call."""
    begun, ended = call.begun or 0.0, call.ended or 0.0
    if call.good and not any(
        begun <= time <= ended + TINY and each is row and what == value for time, each, what in seen.performed
    ):
        raise Violation(f"it was said to be set, and was not: {call}")


def check_order(record: Record, found: Found, plan: Plan) -> None:
    """Each once, in order; on a line that doubles, a second time right behind the first."""
    order = [number for number, _ in found]
    once = [number for place, number in enumerate(order) if place == 0 or order[place - 1] != number]
    ensure(once == sorted(set(once)), f"something ran again, or out of order: {order}")
    twice = [number for place, number in enumerate(order) if place and order[place - 1] == number]
    if plan.disaster == "power":
        # An arm that counts on from the same index after a power failure is not recognised as another one.
        twice = [number for number in twice if (record.fates[number].ended or 0) < record.struck_at]

    ensure(not twice or plan.doubles, f"ran twice on a line that doubles nothing: {twice}")
    for number in twice:
        fate = record.fates[number]
        told = fate.error is not None or fate.cancelled
        ensure(fate.kind != "step" or told, f"a relative command ran twice, and was said to be done: {fate}")


def check_failure(
    error: BaseException | None,
    begun: float,
    ended: float,
    what: str,
    record: Record,
    seen: Observed,
    plan: Plan,
    timeout: float | None = None,
) -> None:
    """Nothing fails that had no reason to."""
    if ended >= min(record.struck_at, record.left_at) - TINY:
        return

    if isinstance(error, ConnectionLost):
        raise Violation(f"a connection that is open was said to be lost: {error!r}: {what}")

    if isinstance(error, MotionUnknown):
        excused = seen.silent(begun - LINGERING, ended, UNHEARD) or (plan.doubles and "step" in plan.kinds)
        # Nothing can tell a command from a probe, where both are lost and the arm has no index yet. A datagram that
        # stands still for longer than others may overtake it is lost, too.
        excused = excused or ((plan.loses or plan.datagrams) and seen.has_no_index(begun - LINGERING, ended))
        ensure(excused, f"unknown without a silence: {error!r}: {what}")
    elif isinstance(error, ReplyTimeout):
        lost = plan.loses and ended - begun >= BRIEF
        own = timeout is not None and timeout < BRIEF and ended - begun >= timeout - 2 * TINY
        broken = seen.silent(begun - SHORT, ended, SHORT) or seen.broken(begun - SHORT, ended) >= SHORT
        excused = own or lost or broken
        ensure(excused, f"no answer on a line that carries them: {error!r}: {what}")
    elif isinstance(error, ArmAlarm):
        ensure("far" in plan.kinds, f"no alarm was there: {error!r}: {what}")
    elif isinstance(error, CommandRejected):
        ensure(what.startswith("jog"), f"refused, though it is no jog beside motions: {error!r}: {what}")
    elif not isinstance(error, MotionStopped):
        raise Violation(f"failed with what is none of its failures: {error!r}: {what}")


def check_fate(record: Record, fate: Fate, found: Sequence[Executed], seen: Observed, plan: Plan) -> None:
    """One command was told the truth."""
    done = [each for each in found if each.outcome == "done"]
    if plan.disaster == "power" and fate.asked <= record.struck_at <= (fate.ended or math.inf):
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
        if fate.motion and not plan.doubles and plan.disaster != "power":
            ensure(fate.motion.index == done[0].index, f"it has another index: {fate.motion.index}, {done}")

        return

    check_failure(fate.error, fate.asked, fate.ended, str(fate), record, seen, plan)
    if fate.ended >= min(record.struck_at, record.left_at) - TINY:
        return

    if isinstance(fate.error, MotionStopped) and not fate.cancelled:
        stopped = any(fate.asked <= end + TINY and start <= fate.ended + TINY for start, end in record.stops)
        ensure(stopped, f"nobody stopped it: {fate} {record.stops}")

    if plan.severity == "none" and not plan.late and done and fate.watched:
        ensure(
            done[0].finished / record.speed >= fate.ended - NOTICED, f"it was done, and not said to be: {fate}, {done}"
        )


def check_standstills(record: Record, seen: Observed, found: Found, plan: Plan) -> None:
    """What was stopped stands as soon as the arm can have heard of it, and for good."""
    unknown = [
        Standstill(f"{fate.error!r}", (fate.number, fate.number), fate.ended, None)
        for fate in record.fates
        if isinstance(fate.error, MotionUnknown) and fate.ended is not None
    ]
    for each in (*record.standstills, *unknown):
        limit = seen.good_from(each.begun, heard_within(plan))
        if plan.disaster == "unplug" and limit >= record.struck_at:
            continue

        if limit >= record.left_at and not each.why.startswith("left"):
            continue

        if not each.certain:
            limit = math.inf

        if each.ended is not None:
            limit = min(limit, each.ended)

        first, last = each.numbers
        late = [
            (number, run.finished / record.speed)
            for number, run in found
            if first <= number <= last and run.finished / record.speed > limit + TINY
        ]
        ensure(not late, f"stopped by {each.why} at {each.begun:.4f}, and ran after {limit:.4f}: {late}")


def check_jogs(record: Record, seen: Observed, sim: Simulation, plan: Plan) -> None:
    """A jog ends with its block, as soon as the arm can have heard of it."""
    going_on = sim.arm.device.beside
    jogs = [
        (each.started / record.speed, each.finished / record.speed)
        for each in sim.arm.executed
        if each.command is c.SET_JOG_CMD
    ]
    if going_on and going_on.command is c.SET_JOG_CMD:
        jogs.append((sim.arm.device.now / record.speed, math.inf))

    for started, finished in jogs:
        ours = [each for each in record.joggings if each.begun <= started + TINY]
        ensure(bool(ours), f"a jog that nobody asked for at {started:.4f}")
        over = ours[-1].over
        if over is None:
            continue

        limit = seen.good_from(over, heard_within(plan))
        if limit >= min(record.left_at, record.struck_at if plan.disaster == "unplug" else math.inf):
            continue  # who has no connection any more can stop nothing

        if ours[-1].call.good and ours[-1].call.ended is not None:
            limit = min(limit, ours[-1].call.ended)

        ensure(finished <= limit + TINY, f"a jog went on until {finished:.4f}, not {limit:.4f}: {ours[-1].call}")


def heard_within(plan: Plan) -> float:
    """Seconds after which a stop has been heard on a line that is as it mostly is."""
    return HEARD_DESPITE_LOSS if plan.loses else HEARD


def ensure(holds: bool, message: str) -> None:
    """Raises Violation unless it holds."""
    if not holds:
        raise Violation(message)
