"""The actions of a page that switch something: tools, pins, belts, the laser; and settings of the arm."""

from __future__ import annotations

from collections.abc import Coroutine
from typing import Any

from dobot_async.panel.arm_tasks import ArmTask
from dobot_async.panel.arms import ArmView
from dobot_async.panel.problems import PanelRefusal
from dobot_async.panel.requests import PageRequest, switch_tool

__all__ = [
    "arm_laser",
    "configure_pin",
    "conveyor",
    "end_effector",
    "gripper",
    "gripper_to",
    "laser",
    "output",
    "rail",
    "suction",
    "watch_inputs",
]

LONGEST_ARMED = 60.0  # seconds
TOOLS = ("suction", "gripper", "pen", "laser")


def arm_laser(call: PageRequest) -> None:
    """Allow the laser for a time."""
    seconds = call.given.number("seconds", 1, LONGEST_ARMED)
    call.given.end()
    if "laser" not in call.station.view.features:
        raise PanelRefusal("unsupported", f"{call.station.view.title} has no laser")

    call.station.log(f"{call.session.name} arms the laser for {seconds:g} s", "warning")
    call.station.arm_laser(seconds)


def laser(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Switch the laser, on only while it is armed."""
    on = call.given.flag("on")
    if on:
        call.station.check_armed()

    return switch_tool(call, f"laser {'on' if on else 'off'}", lambda view: view.laser(on=on))


def suction(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Suck, or let go."""
    on = call.given.flag("on")
    return switch_tool(call, f"suction {'on' if on else 'off'}", lambda view: view.suction(on=on))


def gripper(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Close or open the gripper."""
    closed = call.given.flag("closed")
    return switch_tool(call, f"{'close' if closed else 'open'} the gripper", lambda view: view.gripper(closed=closed))


def gripper_to(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Open it partly."""
    percent = call.given.number("percent", 0, 100)
    return switch_tool(call, f"open the gripper to {percent:g} %", lambda view: view.gripper_to(percent))


def conveyor(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Run a belt."""
    speed, motor = call.given.whole("speed", -100_000, 100_000), call.given.whole("motor", 0, 1, 0)
    return switch_tool(call, f"belt at {speed} pulses/s", lambda view: view.conveyor(speed, motor))


def configure_pin(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Say what a pin is for."""
    pin, use = call.given.whole("pin", 1, 64), call.given.word("use", ("input", "output"))
    return switch_tool(call, f"pin {pin} is an {use}", lambda view: view.configure_pin(pin, use))


def output(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Set an output."""
    pin, level = call.given.whole("pin", 1, 64), call.given.flag("level")
    return switch_tool(call, f"output {pin} {'high' if level else 'low'}", lambda view: view.output(pin, level=level))


def watch_inputs(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Read some inputs from now on."""
    numbers = call.given.numbers("pins", range(9)) or []
    known = call.station.view.pins["inputs"]
    pins = tuple(int(each) for each in numbers)
    if not set(pins) <= set(known):
        raise ValueError(f"pins are of {', '.join(map(str, known))}")

    async def looked(view: ArmView) -> None:
        for pin in pins:
            await view.input(pin)

        call.station.watched_inputs = pins

    return switch_tool(call, "look at inputs", looked)


def rail(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Declare the rail."""
    on = call.given.flag("on")

    async def declared(view: ArmView, _: ArmTask) -> None:
        await view.rail(on=on)
        call.station.described()

    return call.work(f"rail {'on' if on else 'off'}", declared)


def end_effector(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Say which tool is on the arm."""
    tool = call.given.word("tool", TOOLS)
    return call.work(f"tool: {tool}", lambda view, _: view.end_effector(tool))
