"""Every command row and parameter type of the myCobot family; see `dobot_async.arms.mycobot.commands`."""

from dobot_async.arms.mycobot.commands import *
