"""pydobotplus's names: `from dobot_async.compat.pydobotplus import Dobot, CustomPosition`.

    device = Dobot(port="COM3")
    device.move_to(x=200, y=50, z=50)
    device.suck(True)
    device.move_to(position=CustomPosition(x=200, y=-50, z=50))
    device.close()

As pydobotplus it sets velocities, and clears alarms, when it connects; which ones is in the log. docs/compat.md has the
table.
"""

from __future__ import annotations

import logging

from dobot_async.arms.magician.alarms import faults
from dobot_async.arms.magician.commands import PTPMode
from dobot_async.compat._dobot import BaseDobot
from dobot_async.compat._dobot_types import Alarm, CustomPosition, GPIOPort, Joints, Pose, Position, WrongParameter
from dobot_async.errors import DobotError

__all__ = [
    "MODE_PTP",
    "Alarm",
    "CustomPosition",
    "Dobot",
    "DobotException",
    "GPIOPort",
    "Joints",
    "PTPMode",
    "Pose",
    "Position",
]

DobotException = DobotError
MODE_PTP = PTPMode
logger: logging.Logger = logging.getLogger("dobot_async.compat")


class Dobot(BaseDobot):
    """A Magician, by the names of pydobotplus.

    Args:
        port: A port's name ("COM3", "/dev/ttyUSB0"), an address or a URL; nothing for the first arm that there is.

    Raises:
        ConnectFailed: No arm answered.
    """

    PORT_GP1, PORT_GP2, PORT_GP4, PORT_GP5 = GPIOPort

    def __init__(self, port: str | None = None) -> None:
        super().__init__(port)
        with self.session.opening():
            alarms = self.get_alarms()
            if alarms:
                level = logging.WARNING if faults(alarm.known for alarm in alarms) else logging.DEBUG
                logger.log(level, "%s: cleared %s", self.session.url, "; ".join(map(str, sorted(alarms))))
                self.clear_alarms()

    def move_to(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        r: float | None = 0,
        wait: bool = True,
        mode: int | None = None,
        position: CustomPosition | Position | None = None,
    ) -> int:
        """Move to a point; what is None stays as it is.

        Args:
            x: mm.
            y: mm.
            z: mm.
            r: Degrees.
            wait: Return when it is done, and not once the arm has accepted it.
            mode: How it gets there; MOVJ_XYZ unless given.
            position: The four of them, in place of x, y, z and r.

        Returns:
            Its index.

        Raises:
            WrongParameter: Nothing is given.
            DobotError: It was not done, or what was queued before.
        """
        if position is not None:
            x, y, z, r = position.x, position.y, position.z, position.r
        elif x is None and y is None and z is None:
            raise WrongParameter("nothing says where to move to: give x, y or z, or position=")

        if x is None or y is None or z is None or r is None:
            here = self.get_pose().position
            x, y, z = (now if new is None else new for new, now in zip((x, y, z), here, strict=False))
            r = here.r if r is None else r

        return self._set_ptp_cmd(x, y, z, r, PTPMode.MOVJ_XYZ if mode is None else mode, wait)

    def speed(self, velocity: float = 100.0, acceleration: float = 100.0) -> None:
        """Set percentages and mm/s (mm/s²) from the same numbers; return when the arm has them."""
        self.wait_for_cmd(self._set_speed(velocity, acceleration))
