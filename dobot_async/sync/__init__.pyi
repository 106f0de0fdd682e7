# The names of __init__.py, for type checkers.

from dobot_async.sync.fleet import Fleet, Member
from dobot_async.sync.follow import Follow
from dobot_async.sync.link import Link
from dobot_async.sync.magician import Magician
from dobot_async.sync.motion import Motion
from dobot_async.sync.mycobot import MyCobot
from dobot_async.sync.portal import run
from dobot_async.sync.simulation import Simulation, simulate
from dobot_async.sync.together import Together
from dobot_async.sync.ultraarm import UltraArm

__all__ = [
    "Fleet",
    "Follow",
    "Link",
    "Magician",
    "Member",
    "Motion",
    "MyCobot",
    "Simulation",
    "Together",
    "UltraArm",
    "run",
    "simulate",
]
