"""The server: resources and tools of a site's arms.

    resource    scene://site, arm://NAME/state, /pose, /alarms, /reach        read alone
    tool        get_state, plan                                               read alone
    tool        home, move, pick, place, grip, draw, recover, stop            only where motion is allowed

A tool that moves an arm ends with its call: cancelled, or when its client is gone, the arm is stopped.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Awaitable, Callable, Generator
from contextlib import contextmanager
from typing import Any
from urllib.parse import quote

from mcp.server.mcpserver import MCPServer

from dobot_async.errors import DobotError
from dobot_async.mcp_server.tools import add_motion_tools, add_reading_tools
from dobot_async.remote import RemoteArm, Works, reach_told, scene_told, state_told

__all__ = ["ArmServer", "Messages", "make_server"]

INSTRUCTIONS = """\
Desktop robot arms. Lengths are mm, angles degrees, times seconds, speeds percent. x points forward from an arm's base,
y to its left, z up. Read arm://NAME/reach and the state of an arm before it moves, and plan several steps before they
are done. A tool that moves an arm returns when the arm has done it, and says where it is; when it fails the arm stands.
After an alarm read its remedy, then call recover. An arm has to be homed once after it was switched on. People may be
near.
"""
READING = """\
Only reading and planning are allowed here.
"""


class Messages:
    """Messages of one client: received from `incoming`, sent to `outgoing`.

    Attributes:
        incoming: What it says; ends when it is gone.
        outgoing: What it is told.
    """

    def __init__(self, incoming: Any, outgoing: Any) -> None:
        self.incoming = incoming
        self.outgoing = outgoing


class ArmServer(MCPServer[None]):
    """An MCP server of arms; made by `make_server`.

    Attributes:
        works: What goes on with the arms.
    """

    works: Works

    async def serve(self, messages: Messages) -> None:
        """Serve one client until it is gone."""
        server = self._lowlevel_server
        await server.run(messages.incoming, messages.outgoing, server.create_initialization_options())


def make_server(works: Works, *, name: str = "dobot-async") -> ArmServer:
    """Return a server of the arms of a site.

    Args:
        works: What is done with the arms; `Works(site)`.
        name: What clients are told.
    """
    site = works.site
    instructions = INSTRUCTIONS + ("" if site.moves else READING)
    with logging_as_it_is():
        server = ArmServer(name, instructions=instructions, log_level="WARNING")

    server.works = works
    add_resource(server, "scene://site", "scene", "Arms, where they stand, their limits, zones.", told(works, scene))
    for on in site:
        add_arm(server, works, on)

    add_reading_tools(server, works)
    if site.moves:
        add_motion_tools(server, works)

    return server


def add_arm(server: ArmServer, works: Works, on: RemoteArm) -> None:
    """Add the resources of one arm."""

    async def state() -> dict[str, Any]:
        return await state_told(on, works.doing(on.name))

    async def pose() -> dict[str, Any]:
        return dict((await state())["pose"])

    async def alarms() -> dict[str, Any]:
        return {"alarms": (await state())["alarms"]}

    async def reach() -> dict[str, Any]:
        return reach_told(on)

    rows: tuple[tuple[str, str, Callable[[], Awaitable[dict[str, Any]]]], ...] = (
        ("state", "Pose, alarms, queue and link", state),
        ("pose", "Where the tool is, mm and degrees", pose),
        ("alarms", "What keeps it from moving, with cause and remedy", alarms),
        ("reach", "Where its tool may go, how fast, and what it grips with", reach),
    )
    for what, text, read in rows:
        add_resource(server, f"arm://{quote(on.name, safe='')}/{what}", f"{on.name} {what}", f"{text}.", read)


def add_resource(
    server: ArmServer, uri: str, name: str, text: str, read: Callable[[], Awaitable[dict[str, Any]]]
) -> None:
    """Add something to be read, as JSON."""

    async def resource() -> str:
        try:
            return json.dumps(await read())
        except DobotError as error:
            return json.dumps({"error": str(error)})

    server.resource(uri, name=name, description=text, mime_type="application/json")(resource)


def told(works: Works, what: Callable[[Works], dict[str, Any]]) -> Callable[[], Awaitable[dict[str, Any]]]:
    """What is told without asking an arm."""

    async def read() -> dict[str, Any]:
        return what(works)

    return read


def scene(works: Works) -> dict[str, Any]:
    """The arms of a site, and what each of them does."""
    return {**scene_told(works.site), "doing": {on.name: works.doing(on.name) for on in works.site}}


@contextmanager
def logging_as_it_is() -> Generator[None]:
    """Leave the root logger as the program has it: making a server would give it a handler."""
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    try:
        yield
    finally:
        root.handlers[:] = handlers
        root.setLevel(level)
