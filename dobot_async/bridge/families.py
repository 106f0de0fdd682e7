"""Which arms can be bridged, by their names."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from dobot_async.bridged import Bridged
from dobot_async.magician.bridged import BRIDGED as MAGICIAN
from dobot_async.mycobot.bridged import BRIDGED as COBOTS

__all__ = ["FAMILIES", "family_of"]

FAMILIES: Mapping[str, Bridged[Any]] = MappingProxyType(
    {"magician": MAGICIAN, "mycobot": COBOTS["mycobot280"], **COBOTS}
)
"""How each is bridged."""

NEVER: Mapping[str, str] = MappingProxyType(
    {
        "ultraarm": "an ultraArm cannot be bridged: its answers do not tell whose they are, and to say nothing, which "
        "is how a bridge refuses a command, is how some of its firmware accepts one; connect one program to it"
    }
)
"""What cannot be bridged, and why."""


def family_of(name: str) -> Bridged[Any]:
    """Returns how an arm is bridged; raises ValueError for one that cannot be."""
    if name in NEVER:
        raise ValueError(NEVER[name])

    if name not in FAMILIES:
        raise ValueError(f"no arm {name!r} to bridge; there are: {', '.join(FAMILIES)}")

    return FAMILIES[name]
