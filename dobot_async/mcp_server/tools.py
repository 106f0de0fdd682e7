"""The tools: what a model may call, with the ranges and units of each argument.

What is wrong with an argument is a tool error in the caller's words, and nothing was sent. What an arm could not do is
one as well, with the alarms and their remedies.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Generator
from contextlib import contextmanager
from typing import Annotated, Any, Literal

from mcp.server.mcpserver import Context, Image, MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from mcp_types import ToolAnnotations
from pydantic import Field

from dobot_async.errors import DobotError
from dobot_async.mcp_server.planning import Step, plan_steps
from dobot_async.remote import Action, Draw, Grip, Home, Move, Pick, Place, Recover, Works, state_told

__all__ = ["GONE", "add_motion_tools", "add_reading_tools"]

GONE = "dobot_async.gone"
"""Where the scope of an HTTP request has the event that is set when its client is gone."""

READS = ToolAnnotations(read_only_hint=True, destructive_hint=False, idempotent_hint=True, open_world_hint=False)
MOVES = ToolAnnotations(read_only_hint=False, destructive_hint=True, idempotent_hint=False, open_world_hint=True)
AGAIN = ToolAnnotations(read_only_hint=False, destructive_hint=True, idempotent_hint=True, open_world_hint=True)
STOPS = ToolAnnotations(read_only_hint=False, destructive_hint=False, idempotent_hint=True, open_world_hint=True)


def number(text: str) -> Any:
    """A finite number, and no text that looks like one."""
    return Field(description=text, strict=True, allow_inf_nan=False)


Told = dict[str, Any]
Ctx = Context[Any, Any]
Arm = Annotated[str | None, Field(description="Which arm; may be left out where there is only one.")]
X = Annotated[float, number("mm, forward")]
Y = Annotated[float, number("mm, to the left")]
Z = Annotated[float, number("mm, up")]
SomeX = Annotated[float | None, number("mm, forward; stays unless given")]
SomeY = Annotated[float | None, number("mm, to the left; stays unless given")]
SomeZ = Annotated[float | None, number("mm, up; stays unless given")]
Speed = Annotated[float | None, number("percent of the arm's speed; as fast as is allowed unless given")]
Approach = Annotated[float, number("mm above the place where the way down begins and the way up ends")]
Flag = Annotated[bool, Field(strict=True)]
Hand = Annotated[Literal["suction", "gripper"], Field(description="with what; reach tells which the arm has")]


def doing(works: Works) -> Callable[[Ctx, str | None, Action], Awaitable[Told]]:
    """What does something for a call, and ends it with the call."""

    async def do(ctx: Ctx, arm: str | None, action: Action) -> Told:
        with told_to_the_model():
            return await works.do(works.site.named(arm), action, tell=teller(ctx), gone=gone_of(ctx))

    return do


def add_reading_tools(server: MCPServer[None], works: Works) -> None:
    """Add what moves nothing."""

    @server.tool(annotations=READS)
    async def get_state(arm: Arm = None) -> Told:
        """Tell where an arm is (mm, degrees), its alarms with causes and remedies, and what it is doing."""
        with told_to_the_model():
            on = works.site.named(arm)
            return await state_told(on, works.doing(on.name))

    @server.tool(annotations=READS, structured_output=False)
    async def plan(
        steps: Annotated[list[Step], Field(min_length=1, max_length=50)], arm: Arm = None
    ) -> list[str | Image]:
        """Try steps out without the arm: what could not be done and why, how long drawings take, and a picture.

        The picture is seen from above: x to the right, y up. Nothing is sent to the arm but the question where it is.
        """
        with told_to_the_model():
            on = works.site.named(arm)
            pose = await on.arm.get_pose()
            planned = await asyncio.to_thread(plan_steps, on, (pose.x, pose.y, pose.z), steps)
            text = json.dumps(planned.told)
            return [text, Image(data=planned.picture, format="png")] if planned.picture else [text]


def add_motion_tools(server: MCPServer[None], works: Works) -> None:
    """Add what moves an arm, and what stops it."""
    do = doing(works)

    @server.tool(annotations=AGAIN)
    async def home(ctx: Ctx, arm: Arm = None) -> Told:
        """Drive an arm home, where it finds its place: needed once after it was switched on. Takes tens of seconds."""
        return await do(ctx, arm, Home())

    @server.tool(annotations=MOVES)
    async def move(
        ctx: Ctx,
        x: SomeX = None,
        y: SomeY = None,
        z: SomeZ = None,
        r: Annotated[float | None, number("degrees, the tool's rotation; only of a Magician")] = None,
        straight: Annotated[Flag, Field(description="along a straight line")] = False,
        speed: Speed = None,
        arm: Arm = None,
    ) -> Told:
        """Move the tool to a point, and return where it is when it has arrived."""
        return await do(ctx, arm, Move(x=x, y=y, z=z, r=r, straight=straight, speed=speed))

    @server.tool(annotations=MOVES)
    async def pick(
        ctx: Ctx,
        x: X,
        y: Y,
        z: Z,
        tool: Hand = "suction",
        approach: Approach = 40.0,
        speed: Speed = None,
        arm: Arm = None,
    ) -> Told:
        """Pick a part up: from above the place straight down, take it, and straight up again."""
        return await do(ctx, arm, Pick(x=x, y=y, z=z, tool=tool, approach=approach, speed=speed))

    @server.tool(annotations=MOVES)
    async def place(
        ctx: Ctx,
        x: X,
        y: Y,
        z: Z,
        tool: Hand = "suction",
        approach: Approach = 40.0,
        speed: Speed = None,
        arm: Arm = None,
    ) -> Told:
        """Put down what the tool holds: from above the place straight down, let go, and straight up again."""
        return await do(ctx, arm, Place(x=x, y=y, z=z, tool=tool, approach=approach, speed=speed))

    add_drawing(server, works)
    add_standing(server, works)


def add_drawing(server: MCPServer[None], works: Works) -> None:
    """Add the tool that draws."""
    do = doing(works)

    @server.tool(annotations=MOVES)
    async def draw(
        *,
        ctx: Ctx,
        x: Annotated[float, number("mm: of the drawing's lower left corner, on the paper")],
        y: Annotated[float, number("mm: of that corner")],
        z: Annotated[float, number("mm: where the pen touches the paper")],
        text: Annotated[str | None, Field(description="to be written in single-stroke letters", max_length=500)] = None,
        svg: Annotated[str | None, Field(description="a picture, in place of a text", max_length=200_000)] = None,
        height: Annotated[float, number("mm, of a capital letter")] = 10.0,
        fit_width: Annotated[float | None, number("mm: make it so wide at the most")] = None,
        fit_height: Annotated[float | None, number("mm: make it so high at the most")] = None,
        rotate: Annotated[float, number("degrees, to the left about the corner; -90 is upright before the arm")] = 0.0,
        lift: Annotated[float, number("mm above the paper between strokes")] = 5.0,
        speed: Speed = None,
        arm: Arm = None,
    ) -> Told:
        """Draw a text, or an SVG picture, with a pen; all of it is checked before the arm moves."""
        action = Draw(
            x=x,
            y=y,
            z=z,
            text=text,
            svg=svg,
            height=height,
            fit_width=fit_width,
            fit_height=fit_height,
            rotate=rotate,
            lift=lift,
            speed=speed,
        )
        return await do(ctx, arm, action)


def add_standing(server: MCPServer[None], works: Works) -> None:
    """Add what does not move the tool: its grip, and what ends alarms and motions."""
    do = doing(works)

    @server.tool(annotations=MOVES)
    async def grip(
        ctx: Ctx,
        hold: Annotated[Flag, Field(description="true to hold, false to let go: what is held falls")],
        tool: Hand = "suction",
        arm: Arm = None,
    ) -> Told:
        """Let the tool hold, or let go, where it is."""
        return await do(ctx, arm, Grip(hold=hold, tool=tool))

    @server.tool(annotations=AGAIN)
    async def recover(ctx: Ctx, arm: Arm = None) -> Told:
        """Clear the alarms, and let the arm take new commands; it does not move. Do first what the remedies say."""
        return await do(ctx, arm, Recover())

    @server.tool(annotations=STOPS)
    async def stop(arm: Annotated[str | None, Field(description="Which arm; all unless given.")] = None) -> Told:
        """Stop an arm now, or all of them: whatever any client does with it ends."""
        with told_to_the_model():
            arms = list(works.site) if arm is None else [works.site.named(arm)]
            ends = await asyncio.gather(*map(works.stop, arms), return_exceptions=True)
            for end in ends:
                if isinstance(end, BaseException):
                    raise end

            return {"stopped": [on.name for on in arms]}


def teller(ctx: Ctx) -> Any:
    """What reports the progress of a call to its client."""

    async def tell(seconds: float, words: str) -> None:
        await ctx.report_progress(round(seconds, 2), message=words)

    return tell


def gone_of(ctx: Ctx) -> asyncio.Event | None:
    """What is set when the client of a call is gone, where the call itself would not end then: over HTTP."""
    request = ctx.request_context.request
    found = request.scope.get(GONE) if request is not None else None
    return found if isinstance(found, asyncio.Event) else None


@contextmanager
def told_to_the_model() -> Generator[None]:
    """What went wrong is for the model to read."""
    try:
        yield
    except (DobotError, ValueError, TypeError, ImportError) as error:
        notes = getattr(error, "__notes__", ())
        raise ToolError("; ".join([f"{type(error).__name__}: {error}", *notes])) from error
