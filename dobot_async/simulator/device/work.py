"""What a command does when its turn comes, and what is noted of it.

    family --makes--> Work --begin(device)--> Activity --done, alarm or aborted--> Executed

No state, no clock, no bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from dobot_async.simulator.device.device import Device

__all__ = ["INSTANT", "NO_INDEX", "Activity", "DeviceFault", "DeviceOptions", "Executed", "Outcome", "Vector", "Work"]

Vector = tuple[float, ...]
Outcome = Literal["done", "alarm", "aborted"]
NO_INDEX = 2**64 - 1
"""What the firmware says where it has no index to tell."""


class DeviceFault(Exception):
    """What is done ends here with an alarm; raised by `Work.begin` and `Activity.end`."""

    def __init__(self, code: int) -> None:
        super().__init__(f"alarm 0x{code:02X}")
        self.code = code


@dataclass(frozen=True, slots=True)
class Activity:
    """What goes on from the beginning of a work to its end.

    Attributes:
        duration: Seconds; infinity for ever; None until `ready`.
        at: The joints after some seconds, or None if it does not move them. Depends on nothing but the seconds.
        end: What happens at the end, unless it is aborted. May raise Fault.
        on_the_way: What happens after which seconds, in order, as far as it gets; none after the duration.
        ready: For a duration of None: whether the condition holds. Asked at the beginning, when an input changes, and
            at each advance.
    """

    duration: float | None = 0.0
    at: Callable[[float], Vector | None] = lambda _: None
    end: Callable[[], None] = lambda: None
    on_the_way: Sequence[tuple[float, Callable[[], None]]] = ()
    ready: Callable[[], bool] = lambda: True


INSTANT = Activity()
"""Takes no time and moves nothing."""


@dataclass(frozen=True, slots=True)
class Work:
    """What one command does when its turn comes; made by the family.

    Attributes:
        name: For the record.
        begin: Returns what goes on then; None if it is done at once. May raise Fault.
        moves: Whether it moves the arm, so that alarms hold it back.
        command: The family's row, opaque here.
        value: The family's parameters, opaque here.
    """

    name: str
    begin: Callable[[Device], Activity | None]
    moves: bool = False
    command: Any = None
    value: Any = None


@dataclass(frozen=True, slots=True)
class Executed:
    """The record of a command that has finished, at simulated times; `index` is None for what ran beside the queue."""

    index: int | None
    name: str
    command: Any
    value: Any
    started: float
    finished: float
    outcome: Outcome


@dataclass(frozen=True, slots=True)
class DeviceOptions:
    """In what arms and their firmware differ.

    Attributes:
        capacity: How many commands the queue holds.
        count_executing: Whether the command that executes takes a place of the queue.
        first_index: Index of the first command after power-up.
        initial_index: What `current_index` is before any command has finished.
        garbage_index_while_moving: The Magician Lite's way: `current_index` is 2**64 - 1 or 2**64 - 2 in a motion.
        on_fault: "halt": motions wait until the alarms are cleared; "continue": the next one begins.
        harmless: Alarms that are no faults.
        power_up_alarms: Alarms that are set after power-up.
        keep: How many records `executed` keeps; None for all.
    """

    capacity: int = 32
    count_executing: bool = True
    first_index: int = 2
    initial_index: int = NO_INDEX
    garbage_index_while_moving: bool = False
    on_fault: Literal["halt", "continue"] = "halt"
    harmless: frozenset[int] = frozenset({0x00, 0x01})
    power_up_alarms: frozenset[int] = frozenset({0x00})
    keep: int | None = None
