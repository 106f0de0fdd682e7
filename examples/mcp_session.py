"""What a language model's program does with an arm: starts the MCP server, plans, and lets the arm do it.

    python mcp_session.py [serial:///dev/ttyUSB0 | udp://192.168.1.20 | ...]

It needs the extra `mcp`. On a real arm: home it first. It writes two letters in the air, 60 mm above its base.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
from typing import Any

from mcp import Client, StdioServerParameters
from mcp_types import ImageContent, TextContent

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:?speed=20")
LIMITS = ["--allow-motion", "--speed", "50", "--workspace", "150", "280", "-120", "120", "20", "150"]
SERVER = StdioServerParameters(command=sys.executable, args=["-m", "dobot_async", "--url", URL, "mcp", *LIMITS])
STEPS: list[dict[str, Any]] = [
    {"do": "move", "x": 220, "y": -40, "z": 80},
    {"do": "draw", "x": 200, "y": -40, "z": 60, "text": "Hi", "height": 20, "rotate": 90},
    {"do": "move", "x": 400, "y": 0, "z": 80},
]


async def main() -> None:
    """Plan, be told what is wrong with the plan, and have the rest done."""
    async with Client(SERVER) as client:
        tools = sorted(tool.name for tool in (await client.list_tools()).tools)
        print("tools:", ", ".join(tools))
        planned = await client.call_tool("plan", {"steps": STEPS})
        told, picture = planned.content
        assert isinstance(told, TextContent)
        assert isinstance(picture, ImageContent)
        problems = json.loads(told.text)["problems"]
        print("planned with a picture;", ", ".join(f"step {each['step']} cannot be done" for each in problems))
        for step in STEPS[:2]:
            arguments = {name: value for name, value in step.items() if name != "do"}
            done = await client.call_tool(step["do"], arguments)
            assert not done.is_error
            assert done.structured_content
            print("done:", done.structured_content["done"])


asyncio.run(main())
