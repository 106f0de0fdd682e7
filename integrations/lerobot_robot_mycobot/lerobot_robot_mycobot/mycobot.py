"""An arm of the myCobot family as a robot of LeRobot: joints in degrees, and the gripper from 0 to 100."""

from __future__ import annotations

from functools import cached_property, partial
from typing import Any

from lerobot.cameras.utils import make_cameras_from_configs
from lerobot.robots import Robot
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError

from dobot_async.mycobot import commands as c
from dobot_async.sync import MyCobot as Arm
from dobot_async.sync.joints import JointFollower, limits_of_cobot
from lerobot_robot_mycobot.config_mycobot import MyCobotConfig, joints_of

__all__ = ["MyCobot"]

GRIPPER = "gripper.pos"


class MyCobot(Robot):
    """Goes after the joints of actions, and rests where it stands when they end.

    Features are "j1.pos", "j2.pos", ... in degrees, as many as the model has joints; with a gripper "gripper.pos", 0
    (closed) to 100 (open).
    """

    config_class = MyCobotConfig
    name = "mycobot"

    def __init__(self, config: MyCobotConfig) -> None:
        super().__init__(config)
        self.config = config
        self.cameras = make_cameras_from_configs(config.cameras)
        self.joints = joints_of(config.model)
        self._gripper: int | None = None
        self._follower: JointFollower[Arm] = JointFollower(
            partial(Arm.connect, config.url, model=config.model, timeout=config.timeout),
            limits_of_cobot,
            rate=config.rate,
            max_turn=config.max_turn,
            stale=config.stale,
        )

    @cached_property
    def action_features(self) -> dict[str, Any]:
        """The joints, and the gripper."""
        joints: dict[str, Any] = {f"{name}.pos": float for name in self.joints}
        return joints | {GRIPPER: float} if self.config.gripper else joints

    @cached_property
    def observation_features(self) -> dict[str, Any]:
        """The same, and the cameras' pictures."""
        pictures = {name: (each.height, each.width, 3) for name, each in self.config.cameras.items()}
        return {**self.action_features, **pictures}

    @property
    def is_connected(self) -> bool:
        """Whether the arm is connected."""
        return self._follower.connected

    @property
    def is_calibrated(self) -> bool:
        """True: its joints have absolute encoders."""
        return True

    def connect(self, calibrate: bool = True) -> None:  # noqa: ARG002 - as LeRobot calls it
        """Connects, gives it power if that was asked for, and follows from now on.

        Args:
            calibrate: Without effect.

        Raises:
            DeviceAlreadyConnectedError: It is connected.
            DobotError: No arm answers, or it gets no power.
        """
        if self.is_connected:
            raise DeviceAlreadyConnectedError

        self._follower.connect(self._prepare)
        try:
            for camera in self.cameras.values():
                camera.connect()
        except BaseException:
            self._follower.disconnect()
            raise

    def calibrate(self) -> None:
        """Does nothing."""

    def configure(self) -> None:
        """Does nothing."""

    def get_observation(self) -> dict[str, Any]:
        """Returns where the joints are, how far the gripper is open, and the cameras' latest pictures.

        Raises:
            DeviceNotConnectedError: It is not connected.
            DobotError: The arm does not tell.
        """
        self._check()
        found: dict[str, Any] = {
            f"{name}.pos": angle for name, angle in zip(self.joints, self._follower.joints(), strict=True)
        }
        if self.config.gripper:
            found[GRIPPER] = float(self._follower.arm.get_gripper())

        return found | {name: camera.async_read() for name, camera in self.cameras.items()}

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        """Goes after joints, and returns at once.

        Args:
            action: A value for each of `action_features`.

        Returns:
            What is followed: within the arm's limits; the joints before, if it cannot have these together.

        Raises:
            DeviceNotConnectedError: It is not connected.
            ValueError: Something is missing, or not finite; nothing is followed.
            DobotError: The arm has failed, or does not follow.
        """
        self._check()
        missing = self.action_features.keys() - action.keys()
        if missing:
            raise ValueError(f"the action has no {', '.join(sorted(missing))}")

        sent = self._follower.go([float(action[f"{name}.pos"]) for name in self.joints])
        followed = {f"{name}.pos": angle for name, angle in zip(self.joints, sent, strict=True)}
        if self.config.gripper:
            percent = round(min(max(float(action[GRIPPER]), 0.0), 100.0))
            self._grip(percent)
            followed[GRIPPER] = float(percent)

        return followed

    def disconnect(self) -> None:
        """Lets the arm stand, and ends the connection; the gripper stays as it is.

        Raises:
            DeviceNotConnectedError: It is not connected.
            DobotError: The following has failed, and `send_action` has not told it.
        """
        self._check()
        try:
            self._follower.disconnect()
        finally:
            for camera in self.cameras.values():
                camera.disconnect()

    def _check(self) -> None:
        if not self.is_connected:
            raise DeviceNotConnectedError

    def _prepare(self, arm: Arm) -> None:
        """Gives the motors power if that was asked for."""
        if self.config.power_on:
            arm.power_on()

    def _grip(self, percent: int) -> None:
        """Opens the gripper so far, if that changes something; does not wait until it is there."""
        if percent != self._gripper:
            value = c.SetGripperValue(percent, self.config.gripper_speed, None)
            self._follower.arm.request(c.SET_GRIPPER_VALUE, value)
            self._gripper = percent
