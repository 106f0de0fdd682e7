"""The directions that an ultraArm can be jogged in."""

from __future__ import annotations

from enum import Enum

from dobot_async.ultraarm import commands as c

__all__ = ["UltraArmJog"]


class UltraArmJog(Enum):
    """A direction to jog in: of the tool, or of a joint. Manual 5, M13 and M14."""

    X_PLUS = (False, 1, c.JogDirection.POSITIVE)
    X_MINUS = (False, 1, c.JogDirection.NEGATIVE)
    Y_PLUS = (False, 2, c.JogDirection.POSITIVE)
    Y_MINUS = (False, 2, c.JogDirection.NEGATIVE)
    Z_PLUS = (False, 3, c.JogDirection.POSITIVE)
    Z_MINUS = (False, 3, c.JogDirection.NEGATIVE)
    J1_PLUS = (True, 1, c.JogDirection.POSITIVE)
    J1_MINUS = (True, 1, c.JogDirection.NEGATIVE)
    J2_PLUS = (True, 2, c.JogDirection.POSITIVE)
    J2_MINUS = (True, 2, c.JogDirection.NEGATIVE)
    J3_PLUS = (True, 3, c.JogDirection.POSITIVE)
    J3_MINUS = (True, 3, c.JogDirection.NEGATIVE)
