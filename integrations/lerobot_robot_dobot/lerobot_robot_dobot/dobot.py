"""A Magician as a robot of LeRobot: joints in degrees, and the tool from 0 to 100."""

from __future__ import annotations

from functools import cached_property, partial
from typing import Any

from lerobot.cameras.utils import make_cameras_from_configs
from lerobot.robots import Robot
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError

from dobot_async.magician import commands as c
from dobot_async.sync import Magician
from dobot_async.sync.joints import JointFollower, limits_of_magician
from lerobot_robot_dobot.config_dobot import JOINTS, DobotConfig

__all__ = ["Dobot"]

ON, OFF = 100.0, 0.0
HALF = 50.0


class Dobot(Robot):
    """Goes after the joints of actions, and rests where it stands when they end.

    Features are "j1.pos" to "j4.pos" in degrees. With a tool there is "suction.pos" (100: it sucks) or "gripper.pos"
    (100: open); both know only on and off, and change at 50.
    """

    config_class = DobotConfig
    name = "dobot"

    def __init__(self, config: DobotConfig) -> None:
        super().__init__(config)
        self.config = config
        self.cameras = make_cameras_from_configs(config.cameras)
        self._tool = OFF
        self._follower: JointFollower[Magician] = JointFollower(
            partial(Magician.connect, config.url, timeout=config.timeout),
            limits_of_magician,
            rate=config.rate,
            max_turn=config.max_turn,
            stale=config.stale,
        )

    @cached_property
    def action_features(self) -> dict[str, Any]:
        """The joints, and the tool."""
        names = [*JOINTS] if self.config.tool == "none" else [*JOINTS, self.config.tool]
        return {f"{name}.pos": float for name in names}

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
        """True: a Magician knows its joints once it was homed."""
        return True

    def connect(self, calibrate: bool = True) -> None:  # noqa: ARG002 - as LeRobot calls it
        """Connects, homes if that was asked for, and follows from now on.

        Args:
            calibrate: Without effect.

        Raises:
            DeviceAlreadyConnectedError: It is connected.
            DobotError: No arm answers, or it cannot be homed.
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
        """Returns where the joints are, what the tool was told, and the cameras' latest pictures.

        Raises:
            DeviceNotConnectedError: It is not connected.
            DobotError: The arm does not tell.
        """
        self._check()
        found: dict[str, Any] = {
            f"{name}.pos": angle for name, angle in zip(JOINTS, self._follower.joints(), strict=True)
        }
        if self.config.tool != "none":
            found[f"{self.config.tool}.pos"] = self._tool

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

        sent = self._follower.go([float(action[f"{name}.pos"]) for name in JOINTS])
        followed = {f"{name}.pos": angle for name, angle in zip(JOINTS, sent, strict=True)}
        if self.config.tool != "none":
            self._switch(ON if float(action[f"{self.config.tool}.pos"]) >= HALF else OFF)
            followed[f"{self.config.tool}.pos"] = self._tool

        return followed

    def disconnect(self) -> None:
        """Lets the arm stand, and ends the connection; the tool stays as it is.

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

    def _prepare(self, arm: Magician) -> None:
        """Homes the arm if that was asked for, and finds out what the tool does."""
        if self.config.home:
            arm.home()

        if self.config.tool == "suction":
            self._tool = ON if arm.request(c.GET_END_EFFECTOR_SUCTION_CUP, None).is_sucked else OFF
        elif self.config.tool == "gripper":
            self._tool = OFF if arm.request(c.GET_END_EFFECTOR_GRIPPER, None).is_gripped else ON

    def _switch(self, wanted: float) -> None:
        """Switches the tool, if that changes something."""
        if wanted == self._tool:
            return

        if self.config.tool == "suction":
            self._follower.arm.suction(wanted == ON)
        else:
            self._follower.arm.gripper(wanted == OFF)

        self._tool = wanted
