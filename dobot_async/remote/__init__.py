"""Arms for callers who are not to be trusted with all of them: language models, and whoever is at a message broker.

    caller --> Action (checked: types, ranges, reach, workspace, speed) --> Works (one at a time) --> arm

What MCP and MQTT have in common: which arms there are, what may be done with them, and within which limits.
"""

from dobot_async.remote.actions import Action, parse_action
from dobot_async.remote.drawing import Draw
from dobot_async.remote.moves import Grip, Home, Move, Pick, Place, Recover
from dobot_async.remote.reports import reach_told, scene_told, state_told
from dobot_async.remote.site import RemoteArm, Site, open_site
from dobot_async.remote.works import Busy, Works

__all__ = [
    "Action",
    "Busy",
    "Draw",
    "Grip",
    "Home",
    "Move",
    "Pick",
    "Place",
    "Recover",
    "RemoteArm",
    "Site",
    "Works",
    "open_site",
    "parse_action",
    "reach_told",
    "scene_told",
    "state_told",
]
