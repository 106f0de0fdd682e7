"""The scene of a simulated cell, as pages are shown it: what stands where, and what was drawn."""

from __future__ import annotations

import asyncio
from typing import Any

from dobot_async.panel.messages import Hub
from dobot_async.simulator.scene import Belt, Scene

__all__ = ["show_scene"]

PERIOD = 0.2
MOST_POINTS = 2000  # of strokes in one message


async def show_scene(scene: Scene, hub: Hub) -> None:
    """Tell pages what is in a scene, until it is cancelled."""
    while True:
        await hub.watched.wait()
        hub.publish("scene", table=scene.table, things=things(scene), drawing=strokes(scene))
        await asyncio.sleep(PERIOD)


def things(scene: Scene) -> list[dict[str, Any]]:
    """Return what stands in it."""
    found = [
        {
            "name": piece.name,
            "kind": "piece",
            "at": piece.position,
            "size": piece.piece.size,
            "yaw": piece.yaw,
            "color": piece.color,
            "on": piece.on,
        }
        for piece in scene.pieces.values()
    ]
    found += [
        {
            "name": each.name,
            "kind": "belt" if isinstance(each, Belt) else "block",
            "at": each.at,
            "size": each.size,
            "yaw": each.yaw,
            "color": "",
            "on": "",
        }
        for each in scene.fixtures
    ]
    found += [
        {"name": f"sensor {number}", "kind": "sensor", "at": each.at, "to": each.to}
        for number, each in enumerate(scene.sensors, 1)
    ]
    return found


def strokes(scene: Scene) -> list[Any]:
    """Return what was drawn, the newest strokes if it is too much."""
    found: list[Any] = []
    points = 0
    for stroke in reversed(scene.drawing):
        points += len(stroke)
        if points > MOST_POINTS:
            break

        found.append([[round(each, 1) for each in place] for place in stroke])

    return found[::-1]
