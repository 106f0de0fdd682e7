"""Pick and place, for an arm of any family; see docs/handling.md."""

from dobot_async.handling.pick_and_place import (
    HandlingError,
    PartMissing,
    PartStuck,
    Tool,
    gripper_holds,
    pick,
    pick_and_place,
    place,
)

__all__ = ["HandlingError", "PartMissing", "PartStuck", "Tool", "gripper_holds", "pick", "pick_and_place", "place"]
