"""What programs of a Magician are written in, and what is checked of them before anything is sent.

Where the arm will be after each step is worked out as far as it is known, from the end effector and the rail that the
program declares: targets out of reach are refused, and increments that lead there. Without a `tool` line the tool is as
far from the wrist as a suction cup or a gripper.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.effectors import Gripper, Laser, Pen, SuctionCup
from dobot_async.arms.magician.kinematics import Joints, Kinematics, Point
from dobot_async.arms.magician.reach import ANGLES, INCREMENTS
from dobot_async.arms.magician.verbs import Verbs
from dobot_async.program.vocabulary import NUMBER, ON_OFF, WHOLE, Verb, Vocabulary, choice, takes

__all__ = ["MODES", "VOCABULARY"]

Q = TypeVar("Q")
Result = tuple[Command[Any, Any], Any]

MODES = {mode.name.lower().removesuffix("_xyz").replace("_", "-"): mode for mode in c.PTPMode}
"""The ways a Magician moves, by the words for them: movj, movl, jump, ..., movj-angle, movl-inc, ..."""

TOOLS: Mapping[str, c.EndEffectorParams] = {
    "suction": SuctionCup(),
    "gripper": Gripper(),
    "pen": Pen(),
    "laser": Laser(),
}
VERSIONS = {"1": c.AccessoryVersion.V1, "2": c.AccessoryVersion.V2}
FUNCTIONS = {each.name.lower(): each for each in c.IOFunction}


class CheckedVerbs(Verbs[Result]):
    """The verbs, each of which returns its command and value if the arm could take them."""

    def __init__(self, _options: Mapping[str, Any]) -> None:
        self._kinematics = Kinematics()
        self._joints: Joints | None = None
        self._rail = False

    @property
    def place(self) -> Point | None:
        """Where the tool is after the last step, None if that is not known."""
        return self._kinematics.forward(*self._joints) if self._joints else None

    def lose_place(self) -> None:
        """Where the tool is depends on a line that is wrong."""
        self._joints = None

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Result:
        """Check a command, and remember where it leads; a line of a program has no timeout."""
        assert timeout is None
        assert command.queueing is not Queueing.NEVER
        command.request.encode(value)
        self._follow(value)
        return command, value

    def _follow(self, value: Any) -> None:
        """Work out where the arm is after a command; raise ValueError if it cannot go there."""
        match value:
            case c.EndEffectorParams():
                self._kinematics = replace(
                    self._kinematics, x_bias=value.x_bias, y_bias=value.y_bias, z_bias=value.z_bias
                )
            case c.DeviceWithL():
                self._rail = value.is_with_l
            case c.PTPWithLCmd() if not self._rail:
                raise ValueError("l is a place on the rail: write `rail on` in a line before this one")
            case c.PTPCmd() | c.PTPWithLCmd():
                self._joints = self._after_ptp(value)
            case c.CPCmd() | c.CPLECmd():
                self._joints = self._after_path(value)
            case c.HOMECmd():
                self._joints = None
            case _:
                pass  # all others leave the arm where it is

    def _after_ptp(self, value: c.PTPCmd | c.PTPWithLCmd) -> Joints | None:
        mode, numbers = value.ptp_mode, (value.x, value.y, value.z, value.r)
        if mode in INCREMENTS and not self._joints:
            return None

        by_joint = mode in ANGLES or mode is c.PTPMode.MOVJ_INC
        if mode in INCREMENTS and self._joints:
            start = self._joints if by_joint else self._kinematics.forward(*self._joints)
            numbers = (start[0] + value.x, start[1] + value.y, start[2] + value.z, start[3] + value.r)

        if not by_joint:
            return self._kinematics.check(*numbers)

        self._kinematics.check_joints(*numbers)
        return Joints(*numbers)

    def _after_path(self, value: c.CPCmd | c.CPLECmd) -> Joints | None:
        """A continuous path keeps the tool's rotation, which may not be known."""
        start = self.place
        if value.cp_mode is c.CPMode.RELATIVE:
            return (
                self._kinematics.check(start.x + value.x, start.y + value.y, start.z + value.z, start.r)
                if start
                else None
            )

        if start:
            return self._kinematics.check(value.x, value.y, value.z, start.r)

        self._kinematics.inverse(value.x, value.y, value.z, 0.0)
        return None


def declare_rail(verbs: CheckedVerbs, *states: bool, version: c.AccessoryVersion = c.AccessoryVersion.V1) -> Result:
    """Say whether the arm stands on a rail."""
    (on,) = states
    return verbs.perform(c.SET_DEVICE_WITH_L, c.DeviceWithL(on, version), None)


def declare_tool(verbs: CheckedVerbs, *tools: c.EndEffectorParams, **biases: float) -> Result:
    """Say what is on the arm: one of the vendor's tools, or how far the tool is from the wrist, mm. Manual 2.9.1."""
    if not tools and "x" not in biases:
        raise ValueError(f"expected: tool, and {', '.join(TOOLS)} or x=MM, how far it is from the wrist")

    known = tools[0] if tools else c.EndEffectorParams(0.0, 0.0, 0.0)
    given = {f"{axis}_bias": bias for axis, bias in biases.items()}
    return verbs.perform(c.SET_END_EFFECTOR_PARAMS, replace(known, **given), None)


XYZR = takes(NUMBER, "x", "y", "z", "r")
PIN = takes(WHOLE, "address")
MODE = choice(MODES)


def suck(verbs: CheckedVerbs, on: bool) -> Result:
    """The cup, and its pump with it."""
    return verbs.suction(on, pump=on)


VOCABULARY = Vocabulary(
    "Magician",
    {
        "home": Verb(CheckedVerbs.home),
        "move": Verb(CheckedVerbs.move_to, XYZR, 3, {"mode": MODE, "l": NUMBER}),
        "joints": Verb(CheckedVerbs.move_joints, takes(NUMBER, "j1", "j2", "j3", "j4"), 4),
        "by": Verb(CheckedVerbs.move_by, XYZR, 3),
        "path": Verb(CheckedVerbs.path_to, XYZR[:3], 3),
        "engrave": Verb(CheckedVerbs.engrave_to, (*XYZR[:3], ("power", NUMBER)), 4),
        "wait": Verb(CheckedVerbs.wait, takes(NUMBER, "seconds"), 1),
        "wait-input": Verb(CheckedVerbs.wait_for_input, PIN, 1, {"level": ON_OFF}),
        "suction": Verb(suck, takes(ON_OFF, "on"), 1),
        "gripper": Verb(CheckedVerbs.gripper, takes(ON_OFF, "closed"), 1, {"pump": ON_OFF}),
        "laser": Verb(CheckedVerbs.laser, takes(ON_OFF, "on"), 1),
        "pin": Verb(CheckedVerbs.configure_io, (*PIN, ("function", choice(FUNCTIONS))), 2),
        "output": Verb(CheckedVerbs.set_output, (*PIN, ("level", ON_OFF)), 2),
        "pwm": Verb(CheckedVerbs.set_pwm, (*PIN, *takes(NUMBER, "frequency", "duty_cycle")), 3),
        "conveyor": Verb(CheckedVerbs.conveyor, takes(WHOLE, "speed"), 1, {"distance": WHOLE, "motor": WHOLE}),
        "speed": Verb(CheckedVerbs.set_speed, takes(NUMBER, "velocity", "acceleration"), 1),
        "rail": Verb(declare_rail, takes(ON_OFF, "on"), 1, {"version": choice(VERSIONS)}),
        "tool": Verb(declare_tool, (("name", choice(TOOLS)),), 0, dict(takes(NUMBER, "x", "y", "z"))),
    },
    CheckedVerbs,
)
