"""All that a page can ask for, by its word; docs/panel-protocol.md is this table in words."""

from __future__ import annotations

from collections.abc import Coroutine, Mapping
from functools import partial
from typing import Any

from dobot_async._core.util.text import printable
from dobot_async.panel import file_actions as files
from dobot_async.panel import motion_actions as motions
from dobot_async.panel import tool_actions as tools
from dobot_async.panel.arm_tasks import ArmTask
from dobot_async.panel.arms import ArmView
from dobot_async.panel.requests import PageRequest, PanelAction, switch_tool, verb

__all__ = ["ACTIONS"]


def take_lease(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Take the lease, from somebody else if that is wanted."""
    takeover = call.given.flag("takeover", default=False)
    call.given.end()
    return call.station.lease.take(call.session, takeover=takeover)


def release_lease(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Give it back."""
    call.given.end()
    return call.station.lease.end(call.session, "it was given back")


def stop(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Stop one arm, or all."""
    if call.at:
        return call.at.stop(call.session)

    return call.session.state.stop_all(call.session)


def recover(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Make the arm ready again."""
    whole = call.station.source.recover

    async def recovered(view: ArmView, _: ArmTask) -> None:
        await (whole() if whole else view.arm.recover())

    return call.work("recover", recovered)


def set_name(call: PageRequest) -> None:
    """Say who one is."""
    name = printable(call.given.text("name").strip(), 40)
    if name:
        call.session.rename(name)


ACTIONS: Mapping[str, PanelAction] = {
    "stop": PanelAction(stop, lease="", arm=False, urgent=True),
    "check": PanelAction(motions.check, lease=""),
    "outline": PanelAction(motions.outline_at, lease=""),
    "preview": PanelAction(files.preview, lease=""),
    "name": PanelAction(set_name, lease="", arm=False),
    "ping": PanelAction(lambda _: {}, lease="", arm=False),
    "take_lease": PanelAction(take_lease, lease="may"),
    "release_lease": PanelAction(release_lease, lease="may"),
    "home": verb("home", lambda view: view.arm.home()),
    "recover": PanelAction(recover),
    "pause": PanelAction(partial(switch_tool, text="pause", do=lambda view: view.arm.pause())),
    "resume": PanelAction(partial(switch_tool, text="resume", do=lambda view: view.arm.resume())),
    "power": verb("power", lambda view: view.power()),
    "move_to": PanelAction(motions.move_to),
    "move_joints": PanelAction(motions.move_joints),
    "step": PanelAction(motions.step),
    "jog": PanelAction(motions.jog),
    "beat": PanelAction(motions.beat),
    "release": PanelAction(motions.release),
    "follow": PanelAction(motions.follow),
    "target": PanelAction(motions.target),
    "suction": PanelAction(tools.suction),
    "gripper": PanelAction(tools.gripper),
    "gripper_to": PanelAction(tools.gripper_to),
    "arm_laser": PanelAction(tools.arm_laser),
    "laser": PanelAction(tools.laser),
    "conveyor": PanelAction(tools.conveyor),
    "configure_pin": PanelAction(tools.configure_pin),
    "output": PanelAction(tools.output),
    "watch_inputs": PanelAction(tools.watch_inputs),
    "rail": PanelAction(tools.rail),
    "move_rail": PanelAction(motions.move_rail),
    "end_effector": PanelAction(tools.end_effector),
    "speed": PanelAction(motions.speed),
    "teach_take": PanelAction(files.teach_take),
    "teach_remove": PanelAction(files.teach_remove),
    "teach_move": PanelAction(files.teach_move),
    "teach_edit": PanelAction(files.teach_edit),
    "teach_clear": PanelAction(files.teach_clear),
    "teach_load": PanelAction(files.teach_load),
    "teach_play": PanelAction(files.teach_play),
    "draw": PanelAction(files.draw),
}
"""By their words."""
