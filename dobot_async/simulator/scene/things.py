"""What a scene is made of, as a test writes it down: pieces, blocks, belts, sensors, tools, and how an arm stands.

Descriptions alone: frozen, and good for any number of scenes. Lengths are mm, angles degrees, all in the coordinates of
the scene. `at` is the middle of a thing's lower face; without its third number a block or a belt stands on the table,
and a piece on what is below it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from dobot_async.arms.magician.params import AccessoryVersion, ColorPort, InfraredPort
from dobot_async.simulator.scene.geometry import Place3

__all__ = [
    "SEEN",
    "At",
    "Belt",
    "Block",
    "ColorSpot",
    "CupTool",
    "GripperTool",
    "LightBeam",
    "Mount",
    "PenTool",
    "Piece",
    "Tool",
]

At = tuple[float, float] | tuple[float, float, float]

SEEN = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1)}
"""The flags that a colour sensor gives for the colours that it can tell apart; it sees nothing in any other one."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A box that can be picked up.

    Attributes:
        name: What `scene.pieces` has it under.
        at: Where it is in the beginning: x, y, and how high, before it falls.
        size: Length, width and height.
        color: "red", "green" and "blue" are what a colour sensor can see; any other word is one that it cannot.
        yaw: How far it is turned about the vertical.
    """

    name: str
    at: At
    size: Place3 = (25.0, 25.0, 25.0)
    color: str = "grey"
    yaw: float = 0.0

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, slots=True)
class Block:
    """A box that stays where it is: a pallet that pieces are put on, a wall, a fixture.

    Attributes:
        name: What a piece that stands on it, or a crash, says.
        at: Where it stands.
        size: Length, width and height.
        yaw: How far it is turned about the vertical.
    """

    name: str
    at: At
    size: Place3
    yaw: float = 0.0

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, slots=True)
class Belt:
    """A conveyor belt, which a stepper of a Magician drives. It carries what stands on it along its length.

    Attributes:
        name: What a piece on it says.
        at: Where it stands.
        size: Length, width and height.
        mm_per_pulse: How far a pulse carries; below 0 against the direction of `yaw`. 10000 pulses are about 62 mm on
            the vendor's belt.
        yaw: The direction of positive pulses.
        motor: The stepper, 0 or 1.
        arm: The name of the arm that it is plugged into.
    """

    name: str
    at: At
    size: Place3
    mm_per_pulse: float = 0.0062
    yaw: float = 0.0
    motor: int = 0
    arm: str = ""

    def __post_init__(self) -> None:
        check(self)
        if not math.isfinite(self.mm_per_pulse) or not self.mm_per_pulse:
            raise ValueError(f"mm_per_pulse of {self.name} is finite and not 0, not {self.mm_per_pulse!r}")

        if self.motor not in {0, 1}:
            raise ValueError(f"motor of {self.name} is 0 or 1, not {self.motor!r}")


@dataclass(frozen=True, slots=True)
class LightBeam:
    """An infrared or photoelectric sensor: it sees each piece that reaches into the line from `at` to `to`.

    Attributes:
        at: Where the sensor is.
        to: How far it sees.
        port: The socket, for `get_infrared`.
        pin: The input (a pin, 1 to 20) whose level is 1 while it sees something; of a myCobot, a pin of the Atom.
        arm: The name of the arm that it is plugged into.
        version: Which sensor it is. At a socket that was switched on for the other version it sees nothing.
    """

    at: Place3
    to: Place3
    port: InfraredPort | None = None
    pin: int | None = None
    arm: str = ""
    version: AccessoryVersion = AccessoryVersion.V1

    def __post_init__(self) -> None:
        check(self)
        if (self.port is None) == (self.pin is None):
            raise ValueError("a light beam is plugged into a port or into a pin: give one of port= and pin=")


@dataclass(frozen=True, slots=True)
class ColorSpot:
    """A colour sensor: it sees the nearest piece that reaches into the line from `at` to `to`.

    Attributes:
        at: Where the sensor is.
        to: How far it sees.
        port: The socket; `get_color` tells of it while this socket's sensor is switched on.
        arm: The name of the arm that it is plugged into.
        version: Which sensor it is. At a socket that was switched on for the other version it sees nothing.
    """

    at: Place3
    to: Place3
    port: ColorPort = ColorPort.GP2
    arm: str = ""
    version: AccessoryVersion = AccessoryVersion.V1

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, slots=True)
class CupTool:
    """A suction cup. It takes a piece whose upper face it touches while it sucks.

    Attributes:
        length: How far the tip is below what the arm's coordinates tell (in front of the flange, for a myCobot).
        offset: How far the tip is in front of a Magician's wrist, whatever the program says of its end effector.
        give: How far it may be off, or pressed in, where it touches.
        on: Whether it sucks, told of the simulated arm; by default the arm's own pump.
    """

    length: float = 59.5
    offset: float = 59.7
    give: float = 3.0
    on: Callable[[Any], bool] | None = None

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, slots=True)
class GripperTool:
    """A gripper. It takes a piece that is between its fingers when they close on it.

    Attributes:
        length: How far the tip is below what the arm's coordinates tell (in front of the flange, for a myCobot).
        offset: How far the tip is in front of a Magician's wrist, whatever the program says of its end effector.
        opening: How far it opens; what is wider, on its narrower side, it does not take.
        give: How far the middle of a piece may be from the tip.
    """

    length: float = 59.5
    offset: float = 59.7
    opening: float = 27.5
    give: float = 3.0

    def __post_init__(self) -> None:
        check(self)
        if not self.opening > 0:
            raise ValueError(f"opening is above 0 mm, not {self.opening!r}")


@dataclass(frozen=True, slots=True)
class PenTool:
    """A pen. It draws while its tip touches what is below it.

    Attributes:
        length: How far the tip is below what the arm's coordinates tell (in front of the flange, for a myCobot).
        offset: How far the tip is in front of a Magician's wrist, whatever the program says of its end effector.
        touch: How far above the paper it still draws.
        give: How far it may be pressed in.
    """

    length: float = 59.5
    offset: float = 61.0
    touch: float = 0.5
    give: float = 2.0

    def __post_init__(self) -> None:
        check(self)


Tool = CupTool | GripperTool | PenTool


@dataclass(frozen=True, slots=True)
class Mount:
    """How an arm stands in a scene, and what it has in its hand.

    Attributes:
        x: Where the origin of the arm's own coordinates is. A Magician's is 138 mm above what it stands on.
        y: Likewise.
        z: Likewise.
        yaw: How far the arm is turned to the left about the vertical.
        tool: What it works with.
        name: What belts and sensors that are plugged into it say, and events.
        rail_yaw: Of an arm on a rail, the direction of the rail, seen from the arm: 90 is to its left. The mount is
            where the arm stands at 0 mm. None: it stands on no rail, and stays where it is, whatever its program says.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0
    tool: Tool = field(default_factory=CupTool)
    name: str = ""
    rail_yaw: float | None = None

    def __post_init__(self) -> None:
        check(self)


LENGTHS = ("x", "y", "z", "yaw", "rail_yaw", "length", "offset", "opening", "touch", "give")


def check(thing: Any) -> None:
    """Raises ValueError unless all places are finite, and all sizes above 0."""
    for name in LENGTHS:
        number = getattr(thing, name, None)
        if number is not None and not math.isfinite(number):
            raise ValueError(f"{name} of {thing} is not finite")

    for name in ("at", "to"):
        place = getattr(thing, name, (0.0, 0.0, 0.0))
        if len(place) not in {2, 3} or not all(map(math.isfinite, place)):
            raise ValueError(f"{name} is x, y and z in mm, not {place!r}")

    size = getattr(thing, "size", (1.0, 1.0, 1.0))
    if len(size) != 3 or not all(0 < each < math.inf for each in size):
        raise ValueError(f"size of {thing.name} is three lengths above 0 mm, not {size!r}")
