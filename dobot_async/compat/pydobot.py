"""pydobot's names: `from dobot_async.compat.pydobot import Dobot`.

    device = Dobot(port="COM3")
    (x, y, z, r, j1, j2, j3, j4) = device.pose()
    device.move_to(x + 20, y, z, r, wait=False)
    device.move_to(x, y, z, r, wait=True)
    device.close()

`Dobot` has pydobotplus's methods as well; where the two differ it does what pydobot does. As pydobot it sets all
velocities to 200 and the ratios to 100 percent when it connects. docs/compat.md has the table.
"""

from __future__ import annotations

from types import SimpleNamespace

from dobot_async.arms.magician.commands import PTPMode
from dobot_async.compat._dobot import BaseDobot
from dobot_async.compat._dobot_types import Alarm, Joints, Pose, Position
from dobot_async.errors import DobotError

__all__ = ["MODE_PTP", "Alarm", "Dobot", "DobotException", "Joints", "PTPMode", "Pose", "Position", "enums"]

DobotException = DobotError
MODE_PTP = PTPMode
enums: SimpleNamespace = SimpleNamespace(PTPMode=PTPMode)
"""pydobot's module of numbers."""


class Dobot(BaseDobot):
    """A Magician, by the names of pydobot.

    Args:
        port: A port's name ("COM3", "/dev/ttyUSB0"), an address or a URL; nothing for the first arm that there is.
        verbose: Not used: the link logs by `logging`, as "dobot_async.link".

    Raises:
        ConnectFailed: No arm answered.
    """

    def __init__(self, port: str | None = None, verbose: bool = False) -> None:  # noqa: ARG002
        super().__init__(port)

    def move_to(
        self,
        x: float,
        y: float,
        z: float,
        r: float = 0.0,
        wait: bool = False,
        mode: int = PTPMode.MOVL_XYZ,
    ) -> int:
        """Move in a straight line, in its turn.

        Args:
            x: mm.
            y: mm.
            z: mm.
            r: Degrees.
            wait: Return when it is done, and not once the arm has accepted it.
            mode: Another way there.

        Returns:
            Its index.

        Raises:
            DobotError: It was not done, or what was queued before.
        """
        return self._set_ptp_cmd(x, y, z, r, mode, wait)

    def pose(self) -> tuple[float, float, float, float, float, float, float, float]:
        """Return x, y, z (mm), r and the four joints (degrees)."""
        (x, y, z, r), (j1, j2, j3, j4) = self.get_pose()
        return x, y, z, r, j1, j2, j3, j4
