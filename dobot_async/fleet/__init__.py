"""Several arms as one: started together, stopped together, and kept out of each other's way."""

from dobot_async._core.util.shapes import Box, Cylinder
from dobot_async.fleet.errors import BarrierBroken, ZoneDeadlock, ZoneOccupied
from dobot_async.fleet.fleet import Fleet
from dobot_async.fleet.fleet_arm import Member
from dobot_async.fleet.frames import BaseFrame, Place
from dobot_async.fleet.together import Start, Together

__all__ = [
    "BarrierBroken",
    "BaseFrame",
    "Box",
    "Cylinder",
    "Fleet",
    "Member",
    "Place",
    "Start",
    "Together",
    "ZoneDeadlock",
    "ZoneOccupied",
]
