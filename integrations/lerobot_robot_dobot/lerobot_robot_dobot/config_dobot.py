"""What LeRobot is told of a Magician."""

from __future__ import annotations

from dataclasses import dataclass, field

from lerobot.cameras import CameraConfig
from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig

__all__ = ["JOINTS", "TOOLS", "DobotConfig", "DobotLeaderConfig"]

JOINTS = ("j1", "j2", "j3", "j4")
TOOLS = ("none", "suction", "gripper")


@RobotConfig.register_subclass("dobot")
@dataclass(kw_only=True)
class DobotConfig(RobotConfig):
    """A Magician that goes after actions.

    Attributes:
        url: Where it is: "serial:///dev/ttyUSB0", "udp://192.168.1.20", "sim:", or any other of dobot_async.
        tool: "none", "suction" or "gripper"; the others have an action and an observation of their own.
        home: Home the arm when it is connected; needed after power-up, and the arm moves for it.
        rate: Setpoints per second at the most, above 0 to 200.
        max_turn: Degrees/s at which a joint goes after an action, above 0.
        stale: Seconds after which the arm rests if no action came, above 0.
        timeout: Seconds until the arm must have answered.
        cameras: LeRobot's.
    """

    url: str
    tool: str = "none"
    home: bool = False
    rate: float = 30.0
    max_turn: float = 90.0
    stale: float = 0.5
    timeout: float = 5.0
    cameras: dict[str, CameraConfig] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tool not in TOOLS:
            raise ValueError(f"tool must be one of {', '.join(TOOLS)}, not {self.tool!r}")


@TeleoperatorConfig.register_subclass("dobot_leader")
@dataclass(kw_only=True)
class DobotLeaderConfig(TeleoperatorConfig):
    """A Magician that is guided by hand, while the key on its forearm is held.

    Attributes:
        url: Where it is.
        timeout: Seconds until the arm must have answered.
    """

    url: str
    timeout: float = 5.0
