"""What stands around simulated arms: pieces that they carry, belts, sensors, and what they can run into."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dobot_async._core.util.late import late

if TYPE_CHECKING:
    from dobot_async.simulator.scene.geometry import Place3
    from dobot_async.simulator.scene.scene import Scene
    from dobot_async.simulator.scene.scene_arm import Event, SceneArm
    from dobot_async.simulator.scene.stock import Workpiece
    from dobot_async.simulator.scene.things import (
        Belt,
        Block,
        ColorSpot,
        CupTool,
        GripperTool,
        LightBeam,
        Mount,
        PenTool,
        Piece,
    )
else:
    __getattr__ = late(
        __name__,
        {
            "geometry": ("Place3",),
            "scene": ("Scene",),
            "scene_arm": ("Event", "SceneArm"),
            "stock": ("Workpiece",),
            "things": (
                "Belt",
                "Block",
                "ColorSpot",
                "CupTool",
                "GripperTool",
                "LightBeam",
                "Mount",
                "PenTool",
                "Piece",
            ),
        },
    )

__all__ = [
    "Belt",
    "Block",
    "ColorSpot",
    "CupTool",
    "Event",
    "GripperTool",
    "LightBeam",
    "Mount",
    "PenTool",
    "Piece",
    "Place3",
    "Scene",
    "SceneArm",
    "Workpiece",
]
