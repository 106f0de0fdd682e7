"""How the arms of a panel are reached: lent by a program or a fleet, or connected by the panel itself."""

from __future__ import annotations

import math
from collections.abc import AsyncGenerator, Callable, Coroutine, Mapping
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeGuard, cast
from urllib.parse import urlsplit

from dobot_async import Box, Cylinder, Fleet
from dobot_async._core.util.urls import hidden
from dobot_async.fleet.member import Member
from dobot_async.transports import SCHEMES

__all__ = ["Source", "sources_of"]

Edge = float | None


@dataclass(frozen=True)
class Source:
    """How an arm is reached.

    Attributes:
        connect: Connects it, or lends the one that there is, for the length of a block.
        url: Where it is.
        owned: The panel has connected it, and may connect it anew.
        base: Where it stands in its cell: x, y, z and yaw.
        limits: Where in the cell its tool may be; None leaves it to the arm.
        recover: Makes it ready again, if that is more than its own.
    """

    connect: Callable[[], AbstractAsyncContextManager[Any]]
    url: str
    owned: bool
    base: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    limits: Any = None
    recover: Callable[[], Coroutine[Any, Any, None]] | None = None


def sources_of(arms: Any) -> tuple[dict[str, Source], list[dict[str, Any]], Fleet[Any] | None]:
    """Return how each arm is reached, the zones of the cell, and its fleet."""
    if is_fleet(arms):
        zones = [zone(name, shape) for name, shape in arms.zones.items()]
        return {name: of_fleet(arms, name) for name in arms}, zones, arms

    named = dict(cast("Mapping[str, Any]", arms)) if isinstance(arms, Mapping) else {"arm": arms}
    if not named:
        raise ValueError("a panel has at least one arm")

    return {name: source_of(each) for name, each in named.items()}, [], None


def source_of(arm: Any) -> Source:
    """Return how an arm is reached."""
    return of_member(arm) if is_member(arm) else of_arm(arm)


def is_fleet(arms: object) -> TypeGuard[Fleet[Any]]:
    """Whether it is a fleet."""
    return isinstance(arms, Fleet)


def is_member(arm: object) -> TypeGuard[Member[Any]]:
    """Whether it is an arm that is to be connected."""
    return isinstance(arm, Member)


@asynccontextmanager
async def lent(arm: Any) -> AsyncGenerator[Any, None]:
    """Use an arm that belongs to somebody else."""
    yield arm


def of_arm(arm: Any) -> Source:
    """A connected arm."""
    if not hasattr(arm, "link"):
        raise TypeError(f"expected a connected arm, a fleet, or Members by name, not {arm!r}")

    return Source(partial(lent, arm), arm.link.url, owned=False)


def of_fleet(fleet: Fleet[Any], name: str) -> Source:
    """An arm of a fleet."""
    member, arm = fleet.member(name), fleet[name]
    base = member.base
    return Source(
        partial(lent, arm),
        member.url,
        owned=False,
        base=(base.x, base.y, base.z, base.yaw),
        limits=member.limits,
        recover=fleet.recover,
    )


def of_member(member: Member[Any]) -> Source:
    """An arm that is to be connected.

    Nothing of its queue is touched until somebody takes its lease, and a link that ends in good order leaves it as it
    is: the panel itself stops what it has begun.
    """
    if urlsplit(member.url).scheme not in SCHEMES:
        forms = "; ".join(form for _, form in SCHEMES.values())
        raise ValueError(f"{hidden(member.url)!r} has no scheme that leads to an arm; use one of: {forms}")

    options = {"queue": "keep", "on_error": "leave", **member.options}
    base = member.base
    connect = partial(member.kind.connect, member.url, **options)
    return Source(connect, member.url, owned=True, base=(base.x, base.y, base.z, base.yaw), limits=member.limits)


def zone(name: str, shape: Box | Cylinder | None) -> dict[str, Any]:
    """A zone as pages are told of it; what has no end is null."""
    if shape is None:
        return {"name": name, "kind": "name"}

    if isinstance(shape, Box):
        return {"name": name, "kind": "box", "x": edges(shape.x), "y": edges(shape.y), "z": edges(shape.z)}

    return {"name": name, "kind": "cylinder", "x": shape.x, "y": shape.y, "radius": shape.radius, "z": edges(shape.z)}


def edges(span: tuple[float, float]) -> list[Edge]:
    """The ends of a range."""
    return [each if math.isfinite(each) else None for each in span]
