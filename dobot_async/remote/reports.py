"""Reports of an arm as JSON values: its pose, its alarms, its limits and its reach."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, is_dataclass
from typing import TYPE_CHECKING, Any, cast

from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.base import ArmPose

if TYPE_CHECKING:
    from dobot_async.remote.site import RemoteArm, Site

__all__ = ["alarms_told", "pose_told", "reach_told", "scene_told", "state_told"]

GRID = 10.0  # mm between two places that are looked at
HEIGHTS = range(-150, 451, 50)
FARTHEST = 600.0
PATIENCE = 3.0  # seconds for an answer


def pose_told(pose: ArmPose) -> dict[str, Any]:
    """Return where a tool is, in mm and degrees."""
    told: dict[str, Any] = {axis: round(float(getattr(pose, axis)), 2) for axis in "xyzr" if hasattr(pose, axis)}
    return {**told, "joints": [round(float(joint), 2) for joint in pose.joints]}


def alarms_told(alarms: tuple[object, ...]) -> list[dict[str, Any]]:
    """Return alarms with their causes and remedies."""
    told: list[dict[str, Any]] = []
    for each in alarms:
        more = asdict(each) if is_dataclass(each) and not isinstance(each, type) else {}
        told.append(plain({**more, "text": str(each)}))

    return told


def plain(value: Any) -> Any:
    """A value as JSON can hold it."""
    if isinstance(value, dict):
        return {str(key): plain(each) for key, each in cast(Mapping[Any, Any], value).items()}

    if isinstance(value, (list, tuple)):
        return [plain(each) for each in cast(Sequence[Any], value)]

    if isinstance(value, float) and not math.isfinite(value):
        return None

    return value if isinstance(value, (str, int, float, bool, type(None))) else str(value)


async def state_told(on: RemoteArm, doing: str | None = None) -> dict[str, Any]:
    """Return where an arm is, its alarms, its queue and its link.

    Args:
        on: The arm.
        doing: What is being done with it for others.

    Raises:
        DobotError: The arm does not answer.
    """
    pose = await on.arm.get_pose(timeout=PATIENCE)
    alarms = await on.arm.get_alarms(timeout=PATIENCE)
    return {
        "arm": on.name,
        "pose": pose_told(pose),
        "alarms": alarms_told(alarms),
        "pending": on.arm.queue.pending,
        "doing": doing,
        "link": on.arm.link.state.value.value,
    }


def reach_told(on: RemoteArm) -> dict[str, Any]:
    """Return where the tool of an arm may go: by heights, how near and how far straight in front of the arm.

    Args:
        on: The arm, with the bounds that it has here.
    """
    return {
        "arm": on.name,
        "family": on.traits.title,
        "units": "mm, in the coordinates of the arm: x forward, y to its left, z up",
        "workspace": shape_told(on.workspace) or "wherever the arm reaches",
        "fastest_percent": on.fastest,
        "tools": list(on.traits.tools),
        "in_front": [each for z in HEIGHTS for each in reach_at(on, float(z))],
    }


def reach_at(on: RemoteArm, z: float) -> Iterator[dict[str, float]]:
    """How near and how far the tool may be at a height, where y is 0."""
    count = int(FARTHEST / GRID)
    good = [number * GRID for number in range(count) if on.allows((number * GRID, 0.0, z))]
    if good:
        yield {"z": z, "x_from": good[0], "x_to": good[-1]}


def scene_told(site: Site) -> dict[str, Any]:
    """Return which arms there are, where they stand, what they share, and what may be done with them.

    Args:
        site: All arms that there are, and what they share.
    """
    return {
        "motion": "allowed" if site.moves else "not allowed: only reading and planning",
        "arms": {
            on.name: {
                "family": on.traits.title,
                "tools": list(on.traits.tools),
                "workspace": shape_told(on.workspace),
                "fastest_percent": on.fastest,
                "base": asdict(on.base) if on.base else None,
            }
            for on in site
        },
        "zones": {name: shape_told(shape) for name, shape in site.zones.items()},
    }


def shape_told(shape: object) -> Any:
    """A shape, or several, in words."""
    if isinstance(shape, Workspace):
        return {"allowed": [str(each) for each in shape.allowed], "forbidden": [str(each) for each in shape.forbidden]}

    return None if shape is None else str(shape)
