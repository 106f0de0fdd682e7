"""Every command row and parameter type of the ultraArm P340; see `dobot_async.arms.ultraarm.commands`."""

from dobot_async.arms.ultraarm.commands import *
