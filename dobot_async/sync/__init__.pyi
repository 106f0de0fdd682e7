# The names of __init__.py, for type checkers.

from dobot_async.sync.discovery import discover
from dobot_async.sync.figures import figures_of, read_figures
from dobot_async.sync.fleet import Fleet, Member
from dobot_async.sync.follow import Follow
from dobot_async.sync.handling import gripper_holds, pick, pick_and_place, place
from dobot_async.sync.link import Link
from dobot_async.sync.magician import Magician
from dobot_async.sync.motion import Motion
from dobot_async.sync.mycobot import MyCobot
from dobot_async.sync.portal import run
from dobot_async.sync.simulation import Simulation, simulate
from dobot_async.sync.teaching import Recorder, check_recording, play, released
from dobot_async.sync.together import Together
from dobot_async.sync.toolpath import Drawing, check_toolpath, draw, engrave, estimate, reach_of, reachable
from dobot_async.sync.ultraarm import UltraArm

__all__ = [
    "Drawing",
    "Fleet",
    "Follow",
    "Link",
    "Magician",
    "Member",
    "Motion",
    "MyCobot",
    "Recorder",
    "Simulation",
    "Together",
    "UltraArm",
    "check_recording",
    "check_toolpath",
    "discover",
    "draw",
    "engrave",
    "estimate",
    "figures_of",
    "gripper_holds",
    "pick",
    "pick_and_place",
    "place",
    "play",
    "reach_of",
    "reachable",
    "read_figures",
    "released",
    "run",
    "simulate",
]
