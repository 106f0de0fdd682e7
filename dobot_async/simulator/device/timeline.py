"""What goes on in an arm: the queue, what executes of it, what goes on beside it, and what ends when.

    run(until) --> step --> step --> ...     each begins or finishes one work, at its exact time

It is told the time, and reads no clock. Whatever a work calls while a step is taken changes the state at once; the
steps that this makes possible are taken after it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from dobot_async.simulator.device.work import (
    INSTANT,
    Activity,
    DeviceFault,
    DeviceOptions,
    Executed,
    Outcome,
    Vector,
    Work,
)

__all__ = ["Timeline"]

MOMENT = 0.005  # seconds to both sides over which a speed is taken


@dataclass(slots=True)
class Active:
    """A work that goes on.

    Attributes:
        work: What.
        index: Its index, if it came through the queue.
        activity: What its beginning returned.
        started: When it began.
        origin: `started`, later by all the time for which the arm was frozen.
        ends: When it will end.
        passed: How much of what happens on the way has happened.
    """

    work: Work
    index: int | None
    activity: Activity
    started: float
    origin: float
    ends: float
    passed: int = 0

    @property
    def due(self) -> float:
        """When the next thing happens with it."""
        ahead = self.activity.on_the_way
        return self.origin + ahead[self.passed][0] if self.passed < len(ahead) else self.ends


class Timeline:
    """What goes on in one arm.

    Args:
        options: How the arm differs from others.
        time: When it was switched on.
        joints: Where they are.
        begin: Begins a work.
        finished: Called with each record.

    Attributes:
        time: How far it has come; while a step is taken, the exact time of it.
        powered: When the arm was switched on.
        queue: What waits, with its indices.
        running: What the queue is at.
        aside: The jog, or immediate motion, beside it.
        started: Whether the queue may begin its next command.
        frozen_at: Since when time has stood still for all that goes on.
        alarms: Those that are set.
        next_index: Index that the next command will get.
        last_index: Index of the last finished command.
        executed: The records.
    """

    def __init__(
        self,
        options: DeviceOptions,
        time: float,
        joints: Vector,
        begin: Callable[[Work], Activity | None],
        finished: Callable[[Executed], None],
    ) -> None:
        self.time: float = time
        self.queue: deque[tuple[int, Work]] = deque()
        self.running: Active | None = None
        self.aside: Active | None = None
        self.executed: deque[Executed] = deque(maxlen=options.keep)
        self._options = options
        self._resting = joints
        self._begins = begin
        self._finished = finished
        self._busy = False
        self.boot()

    @property
    def active(self) -> list[Active]:
        """All that goes on."""
        return [active for active in (self.aside, self.running) if active]

    @property
    def joints(self) -> Vector:
        """Where the joints are."""
        return next((found for found in map(self._joints_of, self.active) if found is not None), self._resting)

    @property
    def joint_speeds(self) -> Vector:
        """How fast the joints turn, from where they are a moment before and after now."""
        still = (0.0,) * len(self._resting)
        if self.frozen_at is not None:
            return still

        for active in self.active:
            elapsed = self.time - active.origin
            ends = max(elapsed - MOMENT, 0.0), elapsed + MOMENT
            before, after = map(active.activity.at, ends)
            if before is not None and after is not None:
                return tuple((b - a) / (ends[1] - ends[0]) for a, b in zip(before, after, strict=True))

        return still

    @property
    def left(self) -> int:
        """How many commands the queue can take."""
        counted = self._options.count_executing and self.running is not None
        return max(0, self._options.capacity - len(self.queue) - counted)

    @property
    def halted(self) -> bool:
        """Whether alarms hold motions back."""
        return self._options.on_fault == "halt" and not self.alarms <= self._options.harmless

    @property
    def busy(self) -> bool:
        """Whether a step is being taken, so that `run` does nothing."""
        return self._busy

    @property
    def due(self) -> float:
        """When the next thing happens by itself; infinity if nothing does."""
        if self.frozen_at is not None:
            return math.inf

        return min((active.due for active in self.active), default=math.inf)

    def boot(self) -> None:
        """Makes the state that of an arm after power-up; what goes on has been ended before."""
        self.queue.clear()
        self.next_index: int = self._options.first_index
        self.last_index: int = self._options.initial_index
        self.alarms: set[int] = set(self._options.power_up_alarms)
        self.started = True
        self.frozen_at: float | None = None
        self.powered: float = self.time

    def run(self, until: float) -> None:
        """Takes all steps that are due; does nothing where a step itself calls."""
        if self._busy:
            return

        self._busy = True
        try:
            until = max(until, self.time)
            while self.frozen_at is None and self._step(until):
                pass

            self.time = until
        finally:
            self._busy = False

    def settle(self) -> None:
        """Takes the steps that a change has made possible, at the time of the change."""
        self.run(self.time)

    def begin(self, work: Work, index: int | None = None) -> Active | None:
        """Begins a work now; returns nothing if it ended by a fault."""
        busy, self._busy = self._busy, True
        try:
            activity = self._begins(work) or INSTANT
        except DeviceFault as fault:
            self.alarms.add(fault.code)
            self.record(work, index, self.time, "alarm")
            return None
        finally:
            self._busy = busy

        duration = activity.duration
        if duration is None:
            duration = 0.0 if activity.ready() else math.inf

        return Active(work, index, activity, self.time, self.time, self.time + duration)

    def interrupt(
        self, outcome: Outcome, *, queued: bool = True, aside: bool = True, moving_only: bool = False
    ) -> None:
        """Ends what goes on before its time."""
        for active in self.active:
            wanted = (aside and active is self.aside) or (queued and active is self.running)
            if wanted and (active.work.moves or not moving_only):
                self._leave(active, None)
                self.record(active.work, active.index, active.started, outcome)

    def replace(self, work: Work) -> bool:
        """Ends the motions that go on, and begins a work in their place; False if anything else goes on."""
        busy, self._busy = self._busy, True  # nothing else begins between the two
        try:
            self.interrupt("aborted", moving_only=True)
            if self.active or self.frozen_at is not None:
                return False

            self.aside = self.begin(work)
            return True
        finally:
            self._busy = busy

    def thaw(self) -> None:
        """Lets time go on for all that goes on."""
        if self.frozen_at is not None:
            for active in self.active:
                active.origin += self.time - self.frozen_at
                active.ends += self.time - self.frozen_at

            self.frozen_at = None
            self.settle()

    def place(self, joints: Vector) -> None:
        """Puts the joints elsewhere; for an arm that does not move."""
        self._resting = joints

    def record(self, work: Work, index: int | None, started: float, outcome: Outcome) -> None:
        """Notes that a work has finished now."""
        if index is not None:
            self.last_index = index

        executed = Executed(index, work.name, work.command, work.value, started, self.time, outcome)
        self.executed.append(executed)
        self._finished(executed)

    def _step(self, until: float) -> bool:
        """Begins or finishes one work; returns whether there was one."""
        if self._begin_next():
            return True

        first = min(self.active, key=lambda active: active.due, default=None)
        if first and first.due <= until:
            self.time = max(self.time, first.due)
            self._pass(first)
            return True

        for active in self.active:
            if active.activity.duration is None and active.activity.ready():
                self.time = active.ends = until
                return True

        return False

    def _begin_next(self) -> bool:
        """Begins the first command of the queue if it may begin."""
        if self.running or not self.queue or not self.started:
            return False

        index, work = self.queue[0]
        if work.moves and (self.halted or (self.aside and self.aside.work.moves)):
            return False

        self.queue.popleft()
        self.running = self.begin(work, index)
        return True

    def _pass(self, active: Active) -> None:
        """Takes a work past the next thing that happens with it."""
        if active.passed == len(active.activity.on_the_way):
            self._complete(active)
        else:
            active.passed += 1
            active.activity.on_the_way[active.passed - 1][1]()

    def _complete(self, active: Active) -> None:
        """Ends a work that has reached its end."""
        self._leave(active, active.activity.duration)
        outcome: Outcome = "done"
        try:
            active.activity.end()
        except DeviceFault as fault:
            self.alarms.add(fault.code)
            outcome = "alarm"

        self.record(active.work, active.index, active.started, outcome)

    def _leave(self, active: Active, elapsed: float | None) -> None:
        """Takes a work off, with the joints where they are after `elapsed` seconds of it (None: now)."""
        joints = self._joints_of(active) if elapsed is None else active.activity.at(elapsed)
        self._resting = self._resting if joints is None else joints
        if active is self.running:
            self.running = None
        else:
            self.aside = None

    def _joints_of(self, active: Active) -> Vector | None:
        now = self.time if self.frozen_at is None else self.frozen_at
        return active.activity.at(now - active.origin)
