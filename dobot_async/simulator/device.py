"""An arm in time: a bounded command queue, what executes, alarms, joints. Knows no bytes, no family and no kinematics.

    put(work) --> queue --> begin(device) -> Activity --> finish --> executed, on_finish
                              |  aside: one jog or immediate motion, while nothing else executes

The device is lazy: it has no task and never sleeps. Every reader and every verb first brings the state up to `clock()`,
by finishing, in order and at their exact times, what has finished since. How often that happens changes nothing. It
follows that a change of anything that a Work reads in `begin` must be preceded by `advance()`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass

from dobot_async.simulator.work import (
    INSTANT,
    NO_INDEX,
    Activity,
    DeviceOptions,
    Executed,
    Fault,
    Outcome,
    Vector,
    Work,
)

__all__ = ["Activity", "Device", "DeviceOptions", "Executed", "Fault", "Outcome", "Vector", "Work"]


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


class Device:
    """One simulated arm. Switched on, at rest, its queue empty and running.

    Attributes:
        options: What it was made with.
        accepted: How many commands the queue has taken so far.
        on_finish: Called with each record; it may call the device.
    """

    def __init__(
        self,
        clock: Callable[[], float],
        joints: Vector,
        options: DeviceOptions | None = None,
        on_finish: Callable[[Executed], None] | None = None,
    ) -> None:
        self.options = options or DeviceOptions()
        self.accepted = 0
        self.on_finish = on_finish
        self._clock = clock
        self._time = clock()
        self._joints = tuple(joints)
        self._inputs: dict[Hashable, float] = {}
        self._executed: deque[Executed] = deque(maxlen=self.options.keep)
        self._queue: deque[tuple[int, Work]] = deque()
        self._running: Active | None = None
        self._aside: Active | None = None
        self._frozen = False
        self._busy = False
        self._garbage_reads = 0
        self._boot()

    def advance(self) -> None:
        """Brings everything up to the clock."""
        self._run(self._clock())

    # What can be read of it.

    @property
    def now(self) -> float:
        """Simulated seconds; inside of `begin`, `end` and `on_finish` the exact time of the event."""
        self.advance()
        return self._time

    @property
    def uptime(self) -> float:
        """Simulated seconds since power-up."""
        return self.now - self._powered

    @property
    def joints(self) -> Vector:
        """Where the joints are."""
        self.advance()
        return next((found for found in map(self._joints_of, self._active()) if found is not None), self._joints)

    @property
    def moving(self) -> bool:
        """Whether a motion goes on, in the queue or beside it."""
        self.advance()
        return any(active.work.moves for active in self._active())

    @property
    def executing(self) -> Work | None:
        """The work that the queue is at, if any."""
        self.advance()
        return self._running.work if self._running else None

    @property
    def following(self) -> Work | None:
        """The work that the queue comes to next, if any; in `begin`, the one behind it."""
        self.advance()
        return self._queue[0][1] if self._queue else None

    @property
    def idle(self) -> bool:
        """Whether nothing executes and nothing waits."""
        self.advance()
        return not self._active() and not self._queue

    @property
    def started(self) -> bool:
        """Whether the queue may begin its next command (the run flag)."""
        self.advance()
        return self._started

    @property
    def left_space(self) -> int:
        """How many commands the queue can take now."""
        self.advance()
        return self._left()

    @property
    def current_index(self) -> int:
        """Index of the last finished command; see the options for the firmware's other answers."""
        if self.options.garbage_index_while_moving and self.moving:
            self._garbage_reads += 1
            return NO_INDEX - self._garbage_reads % 2

        self.advance()
        return self._last_index

    @property
    def next_index(self) -> int:
        """Index that the next command will get."""
        return self._next_index

    @property
    def alarms(self) -> frozenset[int]:
        """Codes of the alarms that are set."""
        self.advance()
        return frozenset(self._alarms)

    @property
    def halted(self) -> bool:
        """Whether alarms hold motions back."""
        self.advance()
        return self._halted()

    @property
    def executed(self) -> list[Executed]:
        """What has finished so far, in the order of finishing."""
        self.advance()
        return list(self._executed)

    # The queue.

    def put(self, work: Work) -> int | None:
        """Queues a work; returns its index, or None if the queue is full."""
        self.advance()
        if self._left() <= 0:
            return None

        index = self._next_index
        self._next_index += 1
        self.accepted += 1
        self._queue.append((index, work))
        self._settle()
        return index

    def skip(self) -> int:
        """Returns the next index for a command that is not executed, such as one that is only stored."""
        self._next_index += 1
        return self._next_index - 1

    def start(self) -> None:
        """Lets the queue run."""
        self.advance()
        self._started = True
        self._settle()

    def stop(self) -> None:
        """Lets the command that executes end, and no other begin."""
        self.advance()
        self._started = False

    def force_stop(self) -> None:
        """Ends all that goes on, now, where the arm is; the queue keeps the rest and waits for `start`."""
        self.advance()
        self._started = False
        self._interrupt("aborted")

    def clear(self) -> None:
        """Empties the queue; the command that executes ends now."""
        self.advance()
        self._queue.clear()
        self._interrupt("aborted", aside=False)
        self._settle()

    # What goes on beside the queue.

    def perform(self, work: Work) -> None:
        """Does now, whatever else goes on, what takes no time and does not move the arm."""
        self.advance()
        if self._begin(work, None):
            self._record(work, None, self._time, "done")

        self._settle()

    def begin_aside(self, work: Work) -> bool:
        """Begins a jog or an immediate motion; returns False, and does nothing, if something executes or is frozen.

        While it moves the arm, the queue's motions wait. Alarms do not hold it back, for a jog leads out of a limit.
        """
        self.advance()
        if self._active() or self._frozen:
            return False

        self._aside = self._begin(work, None)
        self._settle()
        return True

    def end_aside(self) -> None:
        """Ends a jog where the arm is, as a key that is let go does."""
        self.advance()
        self._interrupt("done", queued=False)
        self._settle()

    def freeze(self) -> None:
        """Halts in the middle of whatever goes on; its time stands still until `thaw`."""
        self.advance()
        if not self._frozen:
            self._frozen, self._frozen_at = True, self._time

    def thaw(self) -> None:
        """Goes on from where `freeze` halted."""
        self.advance()
        if self._frozen:
            self._frozen = False
            for active in self._active():
                active.origin += self._time - self._frozen_at
                active.ends += self._time - self._frozen_at
            self._settle()

    # Alarms, inputs, power.

    def raise_alarm(self, code: int) -> None:
        """Sets an alarm, as when the arm hits something; a fault ends the motion that goes on."""
        self.advance()
        self._alarms.add(code)
        if code not in self.options.harmless:
            self._interrupt("alarm", moving_only=True)
        self._settle()

    def clear_alarms(self, codes: Iterable[int] | None = None) -> None:
        """Clears these alarms, or all; motions that they held back begin."""
        self.advance()
        self._alarms -= self._alarms if codes is None else set(codes)
        self._settle()

    def get_input(self, key: Hashable, default: float = 0.0) -> float:
        """What an input reads."""
        return self._inputs.get(key, default)

    def set_input(self, key: Hashable, value: float) -> None:
        """Changes what an input reads, as the world outside does; a condition that now holds ends at this moment."""
        self.advance()
        self._inputs[key] = value
        self._settle()

    def place(self, joints: Vector) -> None:
        """Puts the joints elsewhere at once, as a hand or a reset of the pose does; for an arm that does not move."""
        self.advance()
        self._joints = tuple(joints)

    def power_cycle(self) -> None:
        """Switches off and on: aborts what goes on, and all but the joints and the inputs is as after power-up."""
        self.advance()
        self._started = False
        self._interrupt("aborted")
        self._boot()

    # Below here nothing reads the clock.

    def _boot(self) -> None:
        """The state after power-up."""
        self._queue.clear()
        self._next_index = self.options.first_index
        self._last_index = self.options.initial_index
        self._alarms = set(self.options.power_up_alarms)
        self._started = True
        self._frozen = False
        self._frozen_at = self._powered = self._time

    def _run(self, until: float) -> None:
        """Takes all steps that are due; does nothing where a step itself calls the device."""
        if self._busy:
            return

        self._busy = True
        try:
            until = max(until, self._time)
            while not self._frozen and self._step(until):
                pass
            self._time = until
        finally:
            self._busy = False

    def _settle(self) -> None:
        """Takes the steps that a change has made possible, at the time of the change."""
        self._run(self._time)

    def _step(self, until: float) -> bool:
        """Begins or finishes one work; returns whether there was one."""
        if self._begin_next():
            return True

        first = min(self._active(), key=lambda active: active.due, default=None)
        if first and first.due <= until:
            self._time = max(self._time, first.due)
            self._pass(first)
            return True

        for active in self._active():
            if active.activity.duration is None and active.activity.ready():
                self._time = active.ends = until
                return True

        return False

    def _begin_next(self) -> bool:
        """Begins the first command of the queue if it may begin."""
        if self._running or not self._queue or not self._started:
            return False

        index, work = self._queue[0]
        if work.moves and (self._halted() or (self._aside and self._aside.work.moves)):
            return False

        self._queue.popleft()
        self._running = self._begin(work, index)
        return True

    def _begin(self, work: Work, index: int | None) -> Active | None:
        """Begins a work now; returns nothing if it ended by a fault."""
        busy, self._busy = self._busy, True
        try:
            activity = work.begin(self) or INSTANT
        except Fault as fault:
            self._alarms.add(fault.code)
            self._record(work, index, self._time, "alarm")
            return None
        finally:
            self._busy = busy

        duration = activity.duration
        if duration is None:
            duration = 0.0 if activity.ready() else math.inf

        return Active(work, index, activity, self._time, self._time, self._time + duration)

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
        except Fault as fault:
            self._alarms.add(fault.code)
            outcome = "alarm"

        self._record(active.work, active.index, active.started, outcome)

    def _interrupt(
        self, outcome: Outcome, *, queued: bool = True, aside: bool = True, moving_only: bool = False
    ) -> None:
        """Ends what goes on before its time."""
        for active in self._active():
            wanted = (aside and active is self._aside) or (queued and active is self._running)
            if wanted and (active.work.moves or not moving_only):
                self._leave(active, None)
                self._record(active.work, active.index, active.started, outcome)

    def _leave(self, active: Active, elapsed: float | None) -> None:
        """Takes a work off, with the joints where they are after `elapsed` seconds of it (None: now)."""
        joints = self._joints_of(active) if elapsed is None else active.activity.at(elapsed)
        self._joints = self._joints if joints is None else joints
        if active is self._running:
            self._running = None
        else:
            self._aside = None

    def _record(self, work: Work, index: int | None, started: float, outcome: Outcome) -> None:
        """Notes that a work has finished now."""
        if index is not None:
            self._last_index = index

        executed = Executed(index, work.name, work.command, work.value, started, self._time, outcome)
        self._executed.append(executed)
        if self.on_finish:
            self.on_finish(executed)

    def _active(self) -> list[Active]:
        return [active for active in (self._aside, self._running) if active]

    def _joints_of(self, active: Active) -> Vector | None:
        return active.activity.at((self._frozen_at if self._frozen else self._time) - active.origin)

    def _left(self) -> int:
        counted = self.options.count_executing and self._running is not None
        return max(0, self.options.capacity - len(self._queue) - counted)

    def _halted(self) -> bool:
        return self.options.on_fault == "halt" and not self._alarms <= self.options.harmless
