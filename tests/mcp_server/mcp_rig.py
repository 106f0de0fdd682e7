"""What the tests of the MCP server share: a simulated arm, its server, and what the arm has recorded."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

from bridge_rig import until
from mcp import Client
from mcp_types import CallToolResult, TextContent, TextResourceContents

from dobot_async import Magician, Workspace
from dobot_async.arms.magician import commands as c
from dobot_async.fleet import Member
from dobot_async.mcp_server import ArmServer, make_server
from dobot_async.remote import Site, Works, open_site
from dobot_async.simulator import Simulation, simulate

__all__ = ["FAR", "IN_TIME", "Rig", "called", "moves", "rig", "stands", "started", "text_of", "until"]

IN_TIME = 30.0
FAR = {"x": 0.0, "y": -250.0, "z": 60.0}
"""A place that a simulated arm needs some seconds to reach."""


@dataclass
class Rig:
    """A simulated arm and its server."""

    sim: Simulation[Any]
    site: Site
    works: Works
    server: ArmServer


@asynccontextmanager
async def rig(
    *, allow_motion: bool = True, speed: float = 20.0, fastest: float = 50.0, workspace: Workspace | None = None
) -> AsyncIterator[Rig]:
    async with simulate("magician", speed=speed) as sim:
        member = Member(sim.url, Magician)
        async with open_site(member, allow_motion=allow_motion, speed=fastest, workspace=workspace) as site:
            works = Works(site)
            yield Rig(sim, site, works, make_server(works))


def moves(sim: Simulation[Any], outcome: str | None = None) -> list[tuple[float, float, float]]:
    """The targets of all motions that the arm has executed, or begun."""
    return [
        (each.value.x, each.value.y, each.value.z)
        for each in sim.arm.executed
        if each.command is c.SET_PTP_CMD and outcome in {None, each.outcome}
    ]


async def started(sim: Simulation[Any]) -> None:
    """Return when the arm moves."""
    before = sim.arm.pose
    await until(lambda: sim.arm.pose != before)


async def stands(sim: Simulation[Any]) -> None:
    """Return when the arm has nothing to do any more, and stays; fail if it has come to where it was to go."""
    await until(lambda: sim.arm.device.idle)
    pose = sim.arm.pose
    await asyncio.sleep(0.2)
    assert sim.arm.pose == pose
    assert (FAR["x"], FAR["y"], FAR["z"]) not in moves(sim, "done")


def text_of(result: CallToolResult) -> str:
    """What a tool said first."""
    first = result.content[0]
    assert isinstance(first, TextContent)
    return first.text


async def called(client: Client, tool: str, **arguments: Any) -> dict[str, Any]:
    """What a tool returned; fails if it was an error."""
    result = await client.call_tool(tool, arguments)
    assert not result.is_error, text_of(result)
    found: dict[str, Any] = json.loads(text_of(result))
    return found


async def read(client: Client, uri: str) -> dict[str, Any]:
    """What a resource says."""
    (content,) = (await client.read_resource(uri)).contents
    assert isinstance(content, TextResourceContents)
    found: dict[str, Any] = json.loads(content.text)
    return found
