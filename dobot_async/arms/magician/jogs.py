"""The directions in which a Magician jogs, their words, and the limits that each may meet."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import Alarm
from dobot_async.errors import ArmAlarm

__all__ = ["Jog", "check_limits"]


class Jog(Enum):
    """A direction to jog in: of the tool, of a joint, or along the rail. Manual 2.10.4.

    The rail's keys are sent as those of a joint: API Description V1.2.3, table 11.9.
    """

    X_PLUS = (False, c.JOGKey.AP_DOWN)
    X_MINUS = (False, c.JOGKey.AN_DOWN)
    Y_PLUS = (False, c.JOGKey.BP_DOWN)
    Y_MINUS = (False, c.JOGKey.BN_DOWN)
    Z_PLUS = (False, c.JOGKey.CP_DOWN)
    Z_MINUS = (False, c.JOGKey.CN_DOWN)
    R_PLUS = (False, c.JOGKey.DP_DOWN)
    R_MINUS = (False, c.JOGKey.DN_DOWN)
    J1_PLUS = (True, c.JOGKey.AP_DOWN)
    J1_MINUS = (True, c.JOGKey.AN_DOWN)
    J2_PLUS = (True, c.JOGKey.BP_DOWN)
    J2_MINUS = (True, c.JOGKey.BN_DOWN)
    J3_PLUS = (True, c.JOGKey.CP_DOWN)
    J3_MINUS = (True, c.JOGKey.CN_DOWN)
    J4_PLUS = (True, c.JOGKey.DP_DOWN)
    J4_MINUS = (True, c.JOGKey.DN_DOWN)
    RAIL_PLUS = (True, c.JOGKey.EP_DOWN)
    RAIL_MINUS = (True, c.JOGKey.EN_DOWN)

    @property
    def word(self) -> str:
        """The word for it: "x+", "j2-", "l+" along the rail."""
        axis, _, way = self.name.partition("_")
        return f"{'l' if axis == 'RAIL' else axis.lower()}{'+' if way == 'PLUS' else '-'}"

    @classmethod
    def of(cls, direction: Jog | str) -> Jog:
        """Return a direction, of itself or of its word.

        Raises:
            ValueError: There is no such word; the message lists them.
            TypeError: It is neither.
        """
        if isinstance(direction, cls):
            return direction

        if not isinstance(direction, str):
            raise TypeError(f"direction must be a Jog or its word, not {direction!r}")

        words = {each.word: each for each in cls}
        if direction.lower() not in words:
            raise ValueError(f"direction must be one of {' '.join(words)}, not {direction!r}")

        return words[direction.lower()]


LIMITS = frozenset(range(0x40, 0x4A))
STRETCHED, FOLDED = 0x48, 0x49
OWN_LIMITS = {
    Jog.J1_PLUS: {0x40},
    Jog.J1_MINUS: {0x41},
    Jog.J2_PLUS: {0x42, STRETCHED},
    Jog.J2_MINUS: {0x43, FOLDED},
    Jog.J3_PLUS: {0x44, FOLDED},
    Jog.J3_MINUS: {0x45, STRETCHED},
    Jog.J4_PLUS: {0x46},
    Jog.J4_MINUS: {0x47},
    Jog.RAIL_PLUS: set[int](),
    Jog.RAIL_MINUS: set[int](),
}
"""The alarms of limits that each joint jogs into; the tool may jog into any."""


def check_limits(direction: Jog, before: Iterable[Alarm], after: Iterable[Alarm]) -> None:
    """Raise ArmAlarm if a jog has ended at a limit, or with another alarm that was not set before it."""
    had = {alarm.code for alarm in before}
    met = [
        alarm for alarm in after if alarm.code not in had or alarm.code in OWN_LIMITS.get(direction, LIMITS) & LIMITS
    ]
    if met:
        raise ArmAlarm(f"the jog ended early: {'; '.join(map(str, met))}", met)
