"""Parameters of the Magician's commands, 2.14 and 2.15: WAIT and TRIG; see the package."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from dobot_async._core.protocol.wire import Scalar, u16, u32
from dobot_async.arms.magician.params.io import IOAddress

__all__ = ["TRIGCmd", "TriggerADCCondition", "TriggerIOCondition", "TriggerMode", "WAITCmd"]


@dataclass(frozen=True, slots=True)
class WAITCmd:
    """Holds the queue for `timeout` milliseconds. 2.14.1."""

    timeout: u32


class TriggerMode(IntEnum):
    """What a trigger looks at: a digital or an analog input. 2.15.1."""

    IO = 0
    ADC = 1


class TriggerIOCondition(IntEnum):
    """How a digital input is compared with the threshold. 2.15.1."""

    EQUAL = 0
    NOT_EQUAL = 1


class TriggerADCCondition(IntEnum):
    """How an analog input is compared with the threshold. 2.15.1."""

    LESS = 0
    LESS_OR_EQUAL = 1
    GREATER_OR_EQUAL = 2
    GREATER = 3


@dataclass(frozen=True, slots=True)
class TRIGCmd:
    """Holds the queue until an input meets a condition, for ever if it never does. 2.15.1.

    Attributes:
        address: The input, 1 to 20.
        mode: Whether it is read as a level or as an analog value.
        condition: A `TriggerIOCondition` or a `TriggerADCCondition`, as the mode says.
        threshold: The level, 0 or 1, or the analog value, 0 to 4095.
    """

    address: IOAddress
    mode: Annotated[TriggerMode, Scalar("B")]
    condition: Annotated[int, Scalar("B", 0, 3)]
    threshold: u16
