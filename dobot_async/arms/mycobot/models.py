"""The models of the myCobot family, as data: joints, limits, and where their protocols differ.

The table of commands is one for all; `CobotModel.row` gives a model's own row of it: with the layout for its number of
joints, and with its own ID where that differs.

    command        myArm 300    the others           why
    SetColor       70           6A
    transponder    B0, B1       C3, C2               B0 and B1 set and get the Wi-Fi of an M5
    IsInPosition   flag first   flag last
    31             an angle     280, 320, 270: a rotation of the tool (a 260 as the myArm)
    34             jog stop     280, 320, 270: a step along an axis (a 260 as the myArm)
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, TypeVar, cast

from dobot_async._core.protocol.wire import Command, Layout
from dobot_async._core.util.arguments import to_float
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.checks import check
from dobot_async.arms.mycobot.dialects import PositionLayout
from dobot_async.arms.mycobot.frame import Known
from dobot_async.arms.mycobot.layouts import Many
from dobot_async.arms.mycobot.pose import AXES

__all__ = ["AXES", "DEFAULT", "MODELS", "CobotModel", "lengths", "model_of"]

Q = TypeVar("Q")
R = TypeVar("R")
Range = tuple[float, float]
Dialect = Mapping[Command[Any, Any], Mapping[str, Any]]
FAMILY, DEFAULT = "mycobot", "mycobot280"
TURN: Range = (-180.0, 180.0)
SENTINEL = 180.08
"""What all joints are reported to be, with either sign, by an Atom that cannot read its servos."""


@dataclass(frozen=True, eq=False)
class CobotModel:
    """One model.

    Attributes:
        name: What `MyCobot.connect(model=...)` is given.
        title: What it is called.
        joint_limits: Least and greatest angle of each joint, degrees.
        reach: Least and greatest of each coordinate, mm and degrees.
        dialect: What differs in rows of the table.
        lacks: Rows that it does not have.
        acknowledges: Whether its newer firmware answers commands; older firmware of any model does not.
        joint_speed: Degrees/s at 100 percent; none is documented but that of the myCobot 280.
        baud: Of its serial port.
        gripper: The number of its gripper's servo.
    """

    name: str
    title: str
    joint_limits: Sequence[Range]
    reach: Sequence[Range]
    dialect: Dialect
    lacks: frozenset[Command[Any, Any]]
    acknowledges: bool = True
    joint_speed: float = 150.0
    baud: int = 115200
    gripper: int = 7

    @property
    def joints(self) -> int:
        """How many joints it has."""
        return len(self.joint_limits)

    def row(self, command: Command[Q, R]) -> Command[Q, R]:
        """Return this model's own row; raise ValueError for one that it does not have."""
        if command not in self.rows:
            raise ValueError(f"a {self.title} has no {command.name}")

        return cast("Command[Q, R]", self.rows[command])

    def check_servo(self, servo: int) -> None:
        """Raise ValueError for a servo that it does not have: there are those of the joints and the gripper's."""
        if not 1 <= servo <= self.joints and servo != self.gripper:
            raise ValueError(
                f"a {self.title} has the servos 1 to {self.joints}, and {self.gripper} of its gripper, not {servo}"
            )

    def check_has_joint(self, joint: int) -> None:
        """Raise ValueError for a joint that it does not have."""
        if not 1 <= joint <= self.joints:
            raise ValueError(f"a {self.title} has joints 1 to {self.joints}, not {joint}")

    def check_joint(self, joint: int, angle: float) -> None:
        """Raise ValueError for a joint that it does not have, or an angle beyond the joint's limits.

        Args:
            joint: From 1.
            angle: Degrees.
        """
        self.check_has_joint(joint)
        low, high = self.joint_limits[joint - 1]
        if not low <= angle <= high:
            raise ValueError(f"joint {joint} must be in {low:g} to {high:g} degrees, not {angle!r}")

    def check_coord(self, axis: int, value: float) -> None:
        """Raise ValueError for an axis that it does not have, or a coordinate that it never reaches.

        Args:
            axis: From 1, in the order of x, y, z, rx, ry, rz.
            value: mm or degrees.
        """
        self.check_axis(axis)
        low, high = self.reach[axis - 1]
        if not low <= value <= high:
            raise ValueError(f"{AXES[axis - 1]} must be in {low:g} to {high:g}, not {value!r}")

    def check_axis(self, axis: int) -> None:
        """Raise ValueError for an axis that it does not have."""
        if not 1 <= axis <= len(self.reach):
            raise ValueError(f"a {self.title} has the axes 1 to {len(self.reach)}, not {axis}")

    def check(self, command: Command[Any, Any], value: object) -> None:
        """Raise ValueError for parameters of a command that this model cannot do, whatever its pose.

        Args:
            command: A row of the table.
            value: Its parameters.
        """
        check(self, command, value)

    def limited(self, limits: Mapping[str, Range]) -> CobotModel:
        """Return this model with limits of the user's own, by the words j1, j2 ... and x, y, z, rx, ry, rz.

        Args:
            limits: The least and the greatest number of each, in mm or degrees; what is not named stays.

        Raises:
            ValueError: There is no such joint or axis, or the numbers are no range.
            TypeError: They are no numbers.
        """
        if not limits:
            return self

        found = dict(zip(self.words, (*self.joint_limits, *self.reach), strict=True))
        for word, each in limits.items():
            if word not in found:
                raise ValueError(f"limits: a {self.title} has {', '.join(found)}, not {word!r}")

            if not isinstance(each, Iterable):
                raise TypeError(f"limits: {word} must have a least and a greatest value, not {each!r}")

            ends = [to_float(end, f"limits of {word}") for end in each]
            if not (len(ends) == 2 and all(map(math.isfinite, ends)) and ends[0] < ends[1]):
                raise ValueError(f"limits: {word} must have a least and a greatest value, finite, not {each!r}")

            found[word] = ends[0], ends[1]

        values = tuple(found.values())
        return replace(self, joint_limits=values[: self.joints], reach=values[self.joints :])

    @property
    def words(self) -> tuple[str, ...]:
        """Its joints and axes by name: j1, j2, ... x, y, z, rx, ..."""
        return (*(f"j{joint}" for joint in range(1, self.joints + 1)), *AXES[: len(self.reach)])

    @cached_property
    def rows(self) -> Mapping[Command[Any, Any], Command[Any, Any]]:
        """Its own rows, by those of the table."""
        return MappingProxyType({row: self._bound(row) for row in c.ALL if row not in self.lacks})

    @cached_property
    def by_id(self) -> Mapping[int, Command[Any, Any]]:
        """The rows of the table by the IDs that they have here."""
        return MappingProxyType({own.id: row for row, own in self.rows.items()})

    @cached_property
    def known(self) -> Known:
        """How many bytes of parameters the frames of each command may have, of either direction."""
        found: defaultdict[int, set[int]] = defaultdict(set)
        for row in self.rows.values():
            found[row.id] |= lengths(row.request) | lengths(row.reply)

        return MappingProxyType({number: frozenset(each) for number, each in found.items()})

    def _bound(self, row: Command[Any, Any]) -> Command[Any, Any]:
        own = replace(row, **self.dialect.get(row, {}))
        sizes = {Many.JOINTS: self.joints, Many.COORDS: len(self.reach)}
        return replace(own, request=sized(own.request, sizes), reply=sized(own.reply, sizes))


def sized(layout: Layout[Any], sizes: Mapping[Many, int]) -> Layout[Any]:
    """The layout for so many joints and coordinates."""
    resize = getattr(layout, "sized", None)
    return resize(sizes) if resize else layout


def lengths(layout: Any) -> frozenset[int]:
    """How many bytes a layout may have."""
    return getattr(layout, "lengths", frozenset({0}))


def symmetric(*limits: float) -> tuple[Range, ...]:
    """Ranges to both sides of 0."""
    return tuple((-each, each) for each in limits)


def ranges(lows: Iterable[float], highs: Iterable[float]) -> tuple[Range, ...]:
    """Ranges of their ends."""
    return tuple(zip(lows, highs, strict=True))


Rows = frozenset[Command[Any, Any]]
OF_M5: Dialect = {
    c.SET_COLOR: {"id": 0x6A},
    c.GET_TRANSPONDER_MODE: {"id": 0xC3},
    c.SET_TRANSPONDER_MODE: {"id": 0xC2},
}
OF_MYARM: Dialect = {c.IS_IN_POSITION: {"request": PositionLayout(c.ANGLES, c.COORDS, first=True)}}
ONLY_7_JOINTS: Rows = frozenset({c.GET_SOLUTION_ANGLES, c.SET_SOLUTION_ANGLES})
NEWER: Rows = frozenset({c.JOG_ROTATION, c.JOG_INCREMENT_COORD})
OLDER: Rows = frozenset({c.JOG_ABSOLUTE, c.JOG_STOP})

MYCOBOT_280 = CobotModel(
    name="mycobot280",
    title="myCobot 280",
    joint_limits=ranges((-168, -140, -150, -150, -155, -180), (168, 140, 150, 150, 160, 180)),
    reach=(*symmetric(281.45, 281.45), (-70, 412.67), TURN, TURN, TURN),
    dialect=OF_M5,
    lacks=ONLY_7_JOINTS | OLDER,
)

MODELS: Mapping[str, CobotModel] = MappingProxyType(
    {
        model.name: model
        for model in (
            CobotModel(
                name="myarm300",
                title="myArm 300",
                joint_limits=ranges((-160, -70, -170, -113, -170, -115, -180), (160, 115, 170, 75, 170, 115, 180)),
                reach=(*symmetric(310, 310), (-140, 480), TURN, TURN, TURN),
                dialect=OF_MYARM,
                lacks=NEWER,
                acknowledges=False,
                gripper=8,
            ),
            MYCOBOT_280,
            replace(MYCOBOT_280, name="mycobot280pi", title="myCobot 280 Pi", baud=1_000_000),
            CobotModel(
                name="mycobot320",
                title="myCobot 320",
                joint_limits=symmetric(168, 135, 145, 145, 168, 180),
                reach=(*symmetric(350, 350), (-41, 523.9), TURN, TURN, TURN),
                dialect=OF_M5,
                lacks=ONLY_7_JOINTS | OLDER,
            ),
            CobotModel(
                name="mecharm270",
                title="mechArm 270",
                joint_limits=ranges((-160, -75, -175, -155, -115, -180), (160, 120, 65, 155, 115, 180)),
                reach=(*symmetric(272, 272), (-86, 408.9), TURN, TURN, TURN),
                dialect=OF_M5,
                lacks=ONLY_7_JOINTS | OLDER,
            ),
            CobotModel(
                name="mypalletizer260",
                title="myPalletizer 260",
                joint_limits=ranges((-162, -2, -92, -180), (162, 90, 60, 180)),
                reach=(*symmetric(260, 260), (-15, 357.58), TURN),
                dialect=OF_M5,
                lacks=ONLY_7_JOINTS | NEWER,
                acknowledges=False,
            ),
        )
    }
)
"""All models by their names. Limits are those of the vendor's library 4.0.7; other documents give others."""


def model_of(name: str) -> CobotModel:
    """Return the model of a name, the usual one for the family's; raise ValueError that lists them."""
    if name == FAMILY:
        name = DEFAULT

    if name not in MODELS:
        raise ValueError(f"no model {name!r}; there are: {', '.join((FAMILY, *MODELS))}")

    return MODELS[name]
