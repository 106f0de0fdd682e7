"""A Dobot Magician for LeRobot: `--robot.type=dobot`, and guided by hand as `--teleop.type=dobot_leader`."""

from lerobot_robot_dobot.config_dobot import DobotConfig, DobotLeaderConfig
from lerobot_robot_dobot.dobot import Dobot
from lerobot_robot_dobot.dobot_leader import DobotLeader

__all__ = ["Dobot", "DobotConfig", "DobotLeader", "DobotLeaderConfig"]
