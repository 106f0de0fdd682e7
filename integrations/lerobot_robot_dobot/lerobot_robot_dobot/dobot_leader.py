"""A Magician that is guided by hand, as a teleoperator of LeRobot."""

from __future__ import annotations

from contextlib import ExitStack
from functools import cached_property
from typing import Any

from lerobot.teleoperators import Teleoperator
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError

from dobot_async.sync import Magician
from lerobot_robot_dobot.config_dobot import JOINTS, DobotLeaderConfig

__all__ = ["DobotLeader"]


class DobotLeader(Teleoperator):
    """Tells where it is guided; its connection only reads, so that nothing can move it from here."""

    config_class = DobotLeaderConfig
    name = "dobot_leader"

    def __init__(self, config: DobotLeaderConfig) -> None:
        super().__init__(config)
        self.config = config
        self._stack = ExitStack()
        self._arm: Magician | None = None

    @cached_property
    def action_features(self) -> dict[str, Any]:
        """The joints."""
        return {f"{name}.pos": float for name in JOINTS}

    @property
    def feedback_features(self) -> dict[str, Any]:
        """None."""
        return {}

    @property
    def is_connected(self) -> bool:
        """Whether the arm is connected."""
        return self._arm is not None

    @property
    def is_calibrated(self) -> bool:
        """True: a Magician knows its joints once it was homed."""
        return True

    def connect(self, calibrate: bool = True) -> None:  # noqa: ARG002 - as LeRobot calls it
        """Connects.

        Args:
            calibrate: Without effect.

        Raises:
            DeviceAlreadyConnectedError: It is connected.
            DobotError: No arm answers.
        """
        if self.is_connected:
            raise DeviceAlreadyConnectedError

        block = Magician.connect(self.config.url, control=False, timeout=self.config.timeout)
        self._arm = self._stack.enter_context(block)

    def calibrate(self) -> None:
        """Does nothing."""

    def configure(self) -> None:
        """Does nothing."""

    def get_action(self) -> dict[str, Any]:
        """Returns where the joints are, degrees.

        Raises:
            DeviceNotConnectedError: It is not connected.
            DobotError: The arm does not tell.
        """
        if self._arm is None:
            raise DeviceNotConnectedError

        return {f"{name}.pos": angle for name, angle in zip(JOINTS, self._arm.get_joints(), strict=True)}

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Does nothing: a Magician has no way to push back."""

    def disconnect(self) -> None:
        """Ends the connection; raises DeviceNotConnectedError if there is none."""
        if not self.is_connected:
            raise DeviceNotConnectedError

        self._arm = None
        self._stack.close()
