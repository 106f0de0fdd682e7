"""Every command row and parameter type of the Dobot Magician; see `dobot_async.arms.magician.commands`."""

from dobot_async.arms.magician.commands import *
