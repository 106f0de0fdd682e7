"""Which arms can be bridged, by their names."""

from __future__ import annotations

from typing import Any

from dobot_async.arms.bridge_adapter import BridgeAdapter
from dobot_async.arms.registry import Parts

__all__ = ["FAMILIES", "family_of"]

FAMILIES: Parts[BridgeAdapter[Any]] = Parts("bridge")
"""How each is bridged."""


def family_of(name: str) -> BridgeAdapter[Any]:
    """Returns how an arm is bridged; raises ValueError for a name that there is not."""
    if name not in FAMILIES:
        raise ValueError(f"no arm {name!r} to bridge; there are: {', '.join(FAMILIES)}")

    return FAMILIES[name]
