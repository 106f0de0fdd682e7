"""What LeRobot is told of an arm of the myCobot family."""

from __future__ import annotations

from dataclasses import dataclass, field

from lerobot.cameras import CameraConfig
from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig

__all__ = ["MyCobotConfig", "MyCobotLeaderConfig", "joints_of"]

JOINTS = {
    "mycobot": 6,
    "mycobot280": 6,
    "mycobot280pi": 6,
    "mycobot320": 6,
    "myarm300": 7,
    "mecharm270": 6,
    "mypalletizer260": 4,
}
"""How many joints each model has: LeRobot asks before anything is connected."""


def joints_of(model: str) -> tuple[str, ...]:
    """Returns the names of a model's joints; raises ValueError for one that there is not."""
    if model not in JOINTS:
        raise ValueError(f"model must be one of {', '.join(JOINTS)}, not {model!r}")

    return tuple(f"j{number}" for number in range(1, JOINTS[model] + 1))


@RobotConfig.register_subclass("mycobot")
@dataclass(kw_only=True)
class MyCobotConfig(RobotConfig):
    """An arm that goes after actions.

    Attributes:
        url: Where it is: "serial:///dev/ttyUSB0", "tcp://host:port", "sim:", or any other of dobot_async.
        model: "mycobot280" (or "mycobot"), "mycobot280pi", "mycobot320", "myarm300", "mecharm270", "mypalletizer260".
        gripper: Whether there is one; it has an action and an observation of its own.
        gripper_speed: Percent, 1 to 100.
        power_on: Give the motors power when it is connected.
        rate: Setpoints per second at the most, above 0 to 200.
        max_turn: Degrees/s at which a joint goes after an action, above 0.
        stale: Seconds after which the arm rests if no action came, above 0.
        timeout: Seconds until the arm must have answered.
        cameras: LeRobot's.
    """

    url: str
    model: str = "mycobot280"
    gripper: bool = False
    gripper_speed: int = 80
    power_on: bool = True
    rate: float = 30.0
    max_turn: float = 90.0
    stale: float = 0.5
    timeout: float = 5.0
    cameras: dict[str, CameraConfig] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        joints_of(self.model)
        if not 1 <= self.gripper_speed <= 100:
            raise ValueError(f"gripper_speed must be 1 to 100 percent, not {self.gripper_speed!r}")


@TeleoperatorConfig.register_subclass("mycobot_leader")
@dataclass(kw_only=True)
class MyCobotLeaderConfig(TeleoperatorConfig):
    """An arm that is led by hand: its joints are let go while it is connected, and it falls unless it is held.

    Attributes:
        url: Where it is.
        model: As of the robot.
        gripper: Whether to tell how far its gripper is open.
        timeout: Seconds until the arm must have answered.
    """

    url: str
    model: str = "mycobot280"
    gripper: bool = False
    timeout: float = 5.0

    def __post_init__(self) -> None:
        joints_of(self.model)
