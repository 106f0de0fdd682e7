"""What programs of an ultraArm are written in; goals are checked against the limits, as far as they are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.verbs import Pump, Verbs
from dobot_async.program.vocabulary import NUMBER, ON_OFF, WHOLE, Verb, Vocabulary, takes

__all__ = ["VOCABULARY"]

Q = TypeVar("Q")
Result = tuple[Command[Any, Any], Any]
AXES = ("x", "y", "z", "e")
GRIPPER_SPEED = 200


class CheckedVerbs(Verbs[Result]):
    """The verbs, each of which returns its command and value if the arm could take them."""

    def __init__(self, options: Mapping[str, Any]) -> None:
        self.pump: Pump = options.get("pump", "manual")
        self._limits: c.UltraArmLimits = options.get("limits", c.MANUAL_LIMITS)
        self._at: dict[str, float | None] = dict.fromkeys(AXES)

    @property
    def place(self) -> tuple[float, float, float] | None:
        """Where the tool is after the last step, None if that is not known."""
        x, y, z = self._at["x"], self._at["y"], self._at["z"]
        return None if x is None or y is None or z is None else (x, y, z)

    def lose_place(self) -> None:
        """Where the tool is depends on a line that is wrong."""
        self._at = dict.fromkeys(AXES)

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Result:
        """Check a command, and remember where it leads; a line of a program has no timeout."""
        assert timeout is None
        command.request.encode(value)
        if isinstance(value, c.CoordsMove):
            self._go(value, by=command is c.MOVE_BY)
        else:
            self._limits.check(value)
            if command.moves:
                self.lose_place()

        return command, value

    def _go(self, value: c.CoordsMove, *, by: bool) -> None:
        """Check the goal of a motion; increments from an unknown place are left to the arm."""
        goal = dict(self._at)
        for axis in AXES:
            given, at = getattr(value, axis), self._at[axis]
            if given is not None:
                goal[axis] = given if not by else None if at is None else at + given

        self._limits.check(c.CoordsMove(**goal))
        self._at = goal


def set_gripper(verbs: CheckedVerbs, percent: int, speed: int = GRIPPER_SPEED) -> Result:
    """Open the gripper to 0 (closed) to 100. Manual 5, M25."""
    return verbs.perform(c.SET_GRIPPER, c.GripperSet(percent, speed), None)


SPEED = {"speed": NUMBER}
JOINTS = takes(NUMBER, *(each.name for each in fields(c.JointsMove) if each.name != "f"))

VOCABULARY = Vocabulary(
    "ultraArm",
    {
        "home": Verb(CheckedVerbs.home),
        "move": Verb(CheckedVerbs.move_to, takes(NUMBER, *AXES), 3, SPEED),
        "by": Verb(CheckedVerbs.move_by, takes(NUMBER, *AXES), 3, SPEED),
        "joints": Verb(CheckedVerbs.move_joints, JOINTS, 3, SPEED),
        "joint": Verb(CheckedVerbs.move_joint, (("joint", WHOLE), ("angle", NUMBER)), 2, SPEED),
        "wait": Verb(CheckedVerbs.wait, takes(NUMBER, "seconds"), 1),
        "suction": Verb(CheckedVerbs.suction, takes(ON_OFF, "on"), 1),
        "gripper-to": Verb(set_gripper, takes(WHOLE, "percent"), 1, {"speed": WHOLE}),
        "laser": Verb(CheckedVerbs.laser, takes(ON_OFF, "on"), 1),
        "pwm": Verb(CheckedVerbs.pwm, takes(WHOLE, "duty"), 1),
        "fan": Verb(CheckedVerbs.fan, takes(ON_OFF, "on"), 1),
    },
    CheckedVerbs,
)
