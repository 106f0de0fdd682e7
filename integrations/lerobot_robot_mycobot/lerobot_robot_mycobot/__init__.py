"""The myCobot family for LeRobot: `--robot.type=mycobot`, and led by hand as `--teleop.type=mycobot_leader`."""

from lerobot_robot_mycobot.config_mycobot import MyCobotConfig, MyCobotLeaderConfig
from lerobot_robot_mycobot.mycobot import MyCobot
from lerobot_robot_mycobot.mycobot_leader import MyCobotLeader

__all__ = ["MyCobot", "MyCobotConfig", "MyCobotLeader", "MyCobotLeaderConfig"]
