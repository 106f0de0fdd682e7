"""What this program knows of an ultraArm beside its place: its power, whether it was homed, what coordinates mean."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.goals import INCREMENTS, MotionFault
from dobot_async.errors import CommandRejected

__all__ = ["JOGS", "ArmState"]

JOGS = frozenset({c.JOG_JOINT, c.JOG_COORD})
NO_POWER = MotionFault("the motors have no power: power_on(), then home()")
NO_PLACE = MotionFault("the arm lost its place when its motors had no power: home() first")


@dataclass(slots=True)
class ArmState:
    """See the module. What is not known counts as good: the arm tells neither, so that the goals have to.

    Attributes:
        powered: False once the motors were told to let go.
        homed: False from then on until it was seen to be home.
        relative: Whether coordinates are increments (G91). The arm is never told: they are added up on this side.
        laser: Whether the laser may be on.
    """

    powered: bool = True
    homed: bool = True
    relative: bool = False
    laser: bool = False

    def note(self, command: Command[Any, Any], value: Any) -> None:
        """Note what a command means for those behind it."""
        if command is c.RELEASE:
            self.powered = self.homed = False
        elif command is c.POWER_ON:
            self.powered = True
        elif command is c.HOME:
            self.homed = True
        elif command in {c.ABSOLUTE, c.RELATIVE}:
            self.relative = command is c.RELATIVE
        elif command is c.LASER_ON or (command is c.SET_PWM and value.duty):
            self.laser = True

    def faults(self) -> tuple[MotionFault, ...]:
        """Return what is known to keep the arm from moving."""
        return () if self.homed else (NO_PLACE,) if self.powered else (NO_POWER,)

    def check(self, command: Command[Any, Any]) -> None:
        """Raise CommandRejected for a motion or a jog that the arm cannot do as it is."""
        if not (command.moves or command in JOGS) or (command is c.HOME and self.powered):
            return

        for fault in self.faults():
            raise CommandRejected(str(fault))

    def increments(self, command: Command[Any, Any]) -> bool:
        """Return whether the coordinates of a command are increments."""
        return command is c.MOVE_BY or (self.relative and command in INCREMENTS)
