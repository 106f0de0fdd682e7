"""Parameters of the Magician's commands, 2.16: the extended IO, steppers and sensors; see the package."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from dobot_async._core.protocol.wire import Scalar, flag, i32, u8, u32
from dobot_async.arms.magician.params.device import AccessoryVersion

__all__ = [
    "IOADC",
    "IODI",
    "IODO",
    "IOPWM",
    "Color",
    "ColorPort",
    "ColorSensor",
    "EMotor",
    "EMotorS",
    "IOAddress",
    "IOFunction",
    "IOMultiplexing",
    "InfraredPort",
    "InfraredSensor",
    "Level",
]


IOAddress = Annotated[int, Scalar("B", 1, 20)]
Level = Annotated[int, Scalar("B", 0, 1)]


class IOFunction(IntEnum):
    """What a pin of the extended IO is for. 2.16.1.

    DIPU and DIPD are inputs with a resistor to high and to low (V1.1.5).
    """

    DUMMY = 0
    DO = 1
    PWM = 2
    DI = 3
    ADC = 4
    DIPU = 5
    DIPD = 6


@dataclass(frozen=True, slots=True)
class IOMultiplexing:
    """Gives a pin (1 to 20) its function. 2.16.1."""

    address: IOAddress
    multiplex: Annotated[IOFunction, Scalar("B")]


@dataclass(frozen=True, slots=True)
class IODO:
    """The level of an output: 0 low, 1 high. 2.16.2."""

    address: IOAddress
    level: Level


@dataclass(frozen=True, slots=True)
class IOPWM:
    """The PWM of an output: 10 Hz to 1 MHz, duty cycle 0 to 100 percent. 2.16.3."""

    address: IOAddress
    frequency: Annotated[float, Scalar("f", 10, 1_000_000)]
    duty_cycle: Annotated[float, Scalar("f", 0, 100)]


@dataclass(frozen=True, slots=True)
class IODI:
    """The level at an input: 0 low, 1 high. 2.16.4."""

    address: IOAddress
    level: Level


@dataclass(frozen=True, slots=True)
class IOADC:
    """The value at an analog input, 0 to 4095. 2.16.5."""

    address: IOAddress
    value: Annotated[int, Scalar("H", 0, 4095)]


@dataclass(frozen=True, slots=True)
class EMotor:
    """Runs stepper 0 or 1 at a speed in pulses/s, whose sign is the direction, until told otherwise. 2.16.6.

    10000 pulses/s move the vendor's conveyor at about 62 mm/s.
    """

    index: Annotated[int, Scalar("B", 0, 1)]
    is_enabled: flag
    speed: i32


@dataclass(frozen=True, slots=True)
class EMotorS:
    """Runs stepper 0 or 1 at a speed in pulses/s for a distance in pulses. V1.1."""

    index: Annotated[int, Scalar("B", 0, 1)]
    is_enabled: flag
    speed: i32
    distance: u32


class ColorPort(IntEnum):
    """The socket of a colour sensor. V1.1."""

    GP1 = 0
    GP2 = 1
    GP4 = 2
    GP5 = 3


class InfraredPort(IntEnum):
    """The socket of an infrared sensor. V1.1."""

    GP1 = 0
    GP2 = 1
    GP4 = 2
    GP5 = 3


@dataclass(frozen=True, slots=True)
class ColorSensor:
    """Switches the colour sensor at a port on or off. V1.1."""

    enable: flag
    port: Annotated[ColorPort, Scalar("B")]
    version: Annotated[AccessoryVersion, Scalar("B")] = AccessoryVersion.V1


@dataclass(frozen=True, slots=True)
class Color:
    """What the colour sensor sees. V1.1.

    Documents say 0 to 255 each; arms give flags: 1 for the colour that it is, 0 for the others.
    """

    r: u8
    g: u8
    b: u8

    @property
    def name(self) -> str:
        """The colour that is the strongest, "red", "green" or "blue"; "" where none is."""
        strongest = max(self.r, self.g, self.b)
        found = [name for name, value in (("red", self.r), ("green", self.g), ("blue", self.b)) if value == strongest]
        return found[0] if strongest and len(found) == 1 else ""


@dataclass(frozen=True, slots=True)
class InfraredSensor:
    """Switches the infrared sensor at a port on or off. V1.1."""

    enable: flag
    port: Annotated[InfraredPort, Scalar("B")]
    version: Annotated[AccessoryVersion, Scalar("B")] = AccessoryVersion.V1
