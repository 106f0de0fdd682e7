"""An arm in time: a bounded command queue, what executes, alarms, joints. Knows no bytes, no family and no kinematics.

    put(work) --> queue --> begin(device) -> Activity --> finish --> executed, on_finish
                              |  aside: one jog or immediate motion, while nothing else executes

The device is lazy: it has no task and never sleeps. Every reader and every verb first brings the state up to `clock()`,
by finishing, in order and at their exact times, what has finished since. How often that happens changes nothing. It
follows that a change of anything that a Work reads in `begin` must be preceded by `advance()`.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import Protocol

from dobot_async.simulator.device.timeline import Timeline
from dobot_async.simulator.device.work import (
    NO_INDEX,
    DeviceOptions,
    Executed,
    Vector,
    Work,
)

__all__ = ["Device", "Surroundings"]


class Surroundings(Protocol):
    """What a device stands in, with others."""

    def advance(self, until: float) -> None:
        """Brings all of them up to a time, by `Device.run`."""


class Device:
    """One simulated arm. Switched on, at rest, its queue empty and running.

    Attributes:
        options: What it was made with.
        accepted: How many commands the queue has taken so far.
        on_finish: Called with each record; it may call the device.
        scene: What it stands in, if anything: it brings up all of its arms together.
    """

    def __init__(
        self,
        clock: Callable[[], float],
        joints: Vector,
        options: DeviceOptions | None = None,
        on_finish: Callable[[Executed], None] | None = None,
    ) -> None:
        self.options: DeviceOptions = options or DeviceOptions()
        self.accepted: int = 0
        self.on_finish = on_finish
        self.scene: Surroundings | None = None
        self._clock = clock
        self._inputs: dict[Hashable, float] = {}
        self._garbage_reads = 0
        self._timeline = Timeline(
            self.options, clock(), tuple(joints), lambda work: work.begin(self), finished=self._finished
        )
        self._queue = self._timeline.queue

    def advance(self) -> None:
        """Brings everything up to the clock."""
        if self.scene is None:
            self._timeline.run(self._clock())
        elif not self._timeline.busy:
            self.scene.advance(self._clock())

    def run(self, until: float) -> None:
        """Brings this device alone up to a time; for what it stands in."""
        self._timeline.run(until)

    @property
    def due(self) -> float:
        """When the next thing happens by itself; infinity if nothing does."""
        return self._timeline.due

    # What can be read of it.

    @property
    def now(self) -> float:
        """Simulated seconds; inside of `begin`, `end` and `on_finish` the exact time of the event."""
        self.advance()
        return self._timeline.time

    @property
    def uptime(self) -> float:
        """Simulated seconds since power-up."""
        return self.now - self._timeline.powered

    @property
    def joints(self) -> Vector:
        """Where the joints are."""
        self.advance()
        return self._timeline.joints

    @property
    def joint_speeds(self) -> Vector:
        """How fast the joints turn, degrees/s."""
        self.advance()
        return self._timeline.joint_speeds

    @property
    def moving(self) -> bool:
        """Whether a motion goes on, in the queue or beside it."""
        self.advance()
        return any(active.work.moves for active in self._timeline.active)

    @property
    def executing(self) -> Work | None:
        """The work that the queue is at, if any."""
        self.advance()
        return self._timeline.running.work if self._timeline.running else None

    @property
    def beside(self) -> Work | None:
        """The work that goes on beside the queue, such as a jog, if any."""
        self.advance()
        return self._timeline.aside.work if self._timeline.aside else None

    @property
    def following(self) -> Work | None:
        """The work that the queue comes to next, if any; in `begin`, the one behind it."""
        self.advance()
        return self._queue[0][1] if self._queue else None

    @property
    def idle(self) -> bool:
        """Whether nothing executes and nothing waits."""
        self.advance()
        return not self._timeline.active and not self._queue

    @property
    def started(self) -> bool:
        """Whether the queue may begin its next command (the run flag)."""
        self.advance()
        return self._timeline.started

    @property
    def left_space(self) -> int:
        """How many commands the queue can take now."""
        self.advance()
        return self._timeline.left

    @property
    def current_index(self) -> int:
        """Index of the last finished command; see the options for the firmware's other answers."""
        if self.options.garbage_index_while_moving and self.moving:
            self._garbage_reads += 1
            return NO_INDEX - self._garbage_reads % 2

        self.advance()
        return self._timeline.last_index

    @property
    def next_index(self) -> int:
        """Index that the next command will get."""
        return self._timeline.next_index

    @property
    def alarms(self) -> frozenset[int]:
        """Codes of the alarms that are set."""
        self.advance()
        return frozenset(self._timeline.alarms)

    @property
    def halted(self) -> bool:
        """Whether alarms hold motions back."""
        self.advance()
        return self._timeline.halted

    @property
    def executed(self) -> list[Executed]:
        """What has finished so far, in the order of finishing."""
        self.advance()
        return list(self._timeline.executed)

    # The queue.

    def put(self, work: Work) -> int | None:
        """Queues a work; returns its index, or None if the queue is full."""
        self.advance()
        if self._timeline.left <= 0:
            return None

        index = self.skip()
        self.accepted += 1
        self._queue.append((index, work))
        self._timeline.settle()
        return index

    def skip(self) -> int:
        """Returns the next index for a command that is not executed, such as one that is only stored."""
        self._timeline.next_index += 1
        return self._timeline.next_index - 1

    def start(self) -> None:
        """Lets the queue run."""
        self.advance()
        self._timeline.started = True
        self._timeline.settle()

    def stop(self) -> None:
        """Lets the command that executes end, and no other begin."""
        self.advance()
        self._timeline.started = False

    def force_stop(self) -> None:
        """Ends all that goes on, now, where the arm is; the queue keeps the rest and waits for `start`."""
        self.advance()
        self._timeline.started = False
        self._timeline.interrupt("aborted")

    def clear(self) -> None:
        """Empties the queue; the command that executes ends now."""
        self.advance()
        self._queue.clear()
        self._timeline.interrupt("aborted", aside=False)
        self._timeline.settle()

    # What goes on beside the queue.

    def perform(self, work: Work) -> None:
        """Does now, whatever else goes on, what takes no time and does not move the arm."""
        self.advance()
        if self._timeline.begin(work):
            self._timeline.record(work, None, self._timeline.time, "done")

        self._timeline.settle()

    def begin_aside(self, work: Work) -> bool:
        """Begins a jog or an immediate motion; returns False, and does nothing, if something executes or is frozen.

        While it moves the arm, the queue's motions wait. Alarms do not hold it back, for a jog leads out of a limit.
        """
        self.advance()
        if self._timeline.active or self._timeline.frozen_at is not None:
            return False

        self._timeline.aside = self._timeline.begin(work)
        self._timeline.settle()
        return True

    def replace(self, work: Work) -> bool:
        """Begins an immediate motion in place of the one that goes on; False, without effect, beside anything else."""
        self.advance()
        begun = self._timeline.replace(work)
        self._timeline.settle()
        return begun

    def end_aside(self) -> None:
        """Ends a jog where the arm is, as a key that is let go does."""
        self.advance()
        self._timeline.interrupt("done", queued=False)
        self._timeline.settle()

    def freeze(self) -> None:
        """Halts in the middle of whatever goes on; its time stands still until `thaw`."""
        self.advance()
        if self._timeline.frozen_at is None:
            self._timeline.frozen_at = self._timeline.time

    def thaw(self) -> None:
        """Goes on from where `freeze` halted."""
        self.advance()
        self._timeline.thaw()

    # Alarms, inputs, power.

    def raise_alarm(self, code: int) -> None:
        """Sets an alarm, as when the arm hits something; a fault ends the motion that goes on."""
        self.advance()
        self._timeline.alarms.add(code)
        if code not in self.options.harmless:
            self._timeline.interrupt("alarm", moving_only=True)
        self._timeline.settle()

    def clear_alarms(self, codes: Iterable[int] | None = None) -> None:
        """Clears these alarms, or all; motions that they held back begin."""
        self.advance()
        self._timeline.alarms -= set(self._timeline.alarms if codes is None else codes)
        self._timeline.settle()

    def get_input(self, key: Hashable, default: float = 0.0) -> float:
        """What an input reads."""
        return self._inputs.get(key, default)

    def set_input(self, key: Hashable, value: float) -> None:
        """Changes what an input reads, as the world outside does; a condition that now holds ends at this moment."""
        self.advance()
        self._inputs[key] = value
        self._timeline.settle()

    def place(self, joints: Vector) -> None:
        """Puts the joints elsewhere at once, as a hand or a reset of the pose does; for an arm that does not move."""
        self.advance()
        self._timeline.place(tuple(joints))

    def power_cycle(self) -> None:
        """Switches off and on: aborts what goes on, and all but the joints and the inputs is as after power-up."""
        self.advance()
        self._timeline.started = False
        self._timeline.interrupt("aborted")
        self._timeline.boot()

    def _finished(self, executed: Executed) -> None:
        if self.on_finish:
            self.on_finish(executed)
