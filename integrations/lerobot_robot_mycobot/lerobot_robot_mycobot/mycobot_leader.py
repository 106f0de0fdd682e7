"""An arm of the myCobot family that is led by hand, as a teleoperator of LeRobot."""

from __future__ import annotations

from contextlib import ExitStack
from functools import cached_property
from typing import Any

from lerobot.teleoperators import Teleoperator
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError

from dobot_async.sync import MyCobot as Arm
from dobot_async.sync.twin import BlockingContext, same
from dobot_async.teaching import released
from lerobot_robot_mycobot.config_mycobot import MyCobotLeaderConfig, joints_of

__all__ = ["MyCobotLeader"]


class MyCobotLeader(Teleoperator):
    """Lets its joints go, and tells where it is led; at the end it holds itself again."""

    config_class = MyCobotLeaderConfig
    name = "mycobot_leader"

    def __init__(self, config: MyCobotLeaderConfig) -> None:
        super().__init__(config)
        self.config = config
        self.joints = joints_of(config.model)
        self._stack = ExitStack()
        self._arm: Arm | None = None

    @cached_property
    def action_features(self) -> dict[str, Any]:
        """The joints, and the gripper."""
        joints: dict[str, Any] = {f"{name}.pos": float for name in self.joints}
        return joints | {"gripper.pos": float} if self.config.gripper else joints

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
        """True: its joints have absolute encoders."""
        return True

    def connect(self, calibrate: bool = True) -> None:  # noqa: ARG002 - as LeRobot calls it
        """Connects, and lets the joints go: hold the arm.

        Args:
            calibrate: Without effect.

        Raises:
            DeviceAlreadyConnectedError: It is connected.
            DobotError: No arm answers, or it does not let go.
        """
        if self.is_connected:
            raise DeviceAlreadyConnectedError

        with ExitStack() as stack:
            arm = stack.enter_context(
                Arm.connect(self.config.url, model=self.config.model, timeout=self.config.timeout)
            )
            stack.enter_context(BlockingContext(lambda: released(arm.asynchronous), same, "released"))
            self._stack = stack.pop_all()

        self._arm = arm

    def calibrate(self) -> None:
        """Does nothing."""

    def configure(self) -> None:
        """Does nothing."""

    def get_action(self) -> dict[str, Any]:
        """Returns where the joints are, degrees, and how far the gripper is open.

        Raises:
            DeviceNotConnectedError: It is not connected.
            DobotError: The arm does not tell.
        """
        if self._arm is None:
            raise DeviceNotConnectedError

        found: dict[str, Any] = {
            f"{name}.pos": angle for name, angle in zip(self.joints, self._arm.get_joints(), strict=True)
        }
        if self.config.gripper:
            found["gripper.pos"] = float(self._arm.get_gripper())

        return found

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Does nothing: the joints are let go."""

    def disconnect(self) -> None:
        """Lets the arm hold itself, and ends the connection; raises DeviceNotConnectedError if there is none."""
        if not self.is_connected:
            raise DeviceNotConnectedError

        self._arm = None
        self._stack.close()
