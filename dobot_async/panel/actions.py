"""All that a page can ask for, by its word; docs/panel-protocol.md is this table in words."""

from __future__ import annotations

from collections.abc import Coroutine, Mapping
from functools import partial
from typing import Any

from dobot_async._core.util.text import printable
from dobot_async.panel import file_actions as files
from dobot_async.panel import motion_actions as motions
from dobot_async.panel import tool_actions as tools
from dobot_async.panel.arms import ArmView
from dobot_async.panel.calls import Action, Call, told_of_tools, verb
from dobot_async.panel.works import Work

__all__ = ["ACTIONS"]


def take_lease(call: Call) -> Coroutine[Any, Any, Any]:
    """Take the lease, from somebody else if that is wanted."""
    takeover = call.given.flag("takeover", default=False)
    call.given.end()
    return call.station.lease.take(call.session, takeover=takeover)


def release_lease(call: Call) -> Coroutine[Any, Any, Any]:
    """Give it back."""
    call.given.end()
    return call.station.lease.end(call.session, "it was given back")


def stop(call: Call) -> Coroutine[Any, Any, Any]:
    """Stop one arm, or all."""
    if call.at:
        return call.at.stop(call.session)

    return call.session.desk.stop_all(call.session)


def recover(call: Call) -> Coroutine[Any, Any, Any]:
    """Make the arm ready again."""
    whole = call.station.source.recover

    async def recovered(view: ArmView, _: Work) -> None:
        await (whole() if whole else view.arm.recover())

    return call.work("recover", recovered)


def set_name(call: Call) -> None:
    """Say who one is."""
    name = printable(call.given.text("name").strip(), 40)
    if name:
        call.session.rename(name)


ACTIONS: Mapping[str, Action] = {
    "stop": Action(stop, lease="", arm=False, urgent=True),
    "check": Action(motions.check, lease=""),
    "outline": Action(motions.outline_at, lease=""),
    "preview": Action(files.preview, lease=""),
    "name": Action(set_name, lease="", arm=False),
    "ping": Action(lambda _: {}, lease="", arm=False),
    "take_lease": Action(take_lease, lease="may"),
    "release_lease": Action(release_lease, lease="may"),
    "home": verb("home", lambda view: view.arm.home()),
    "recover": Action(recover),
    "pause": Action(partial(told_of_tools, text="pause", do=lambda view: view.arm.pause())),
    "resume": Action(partial(told_of_tools, text="resume", do=lambda view: view.arm.resume())),
    "power": verb("power", lambda view: view.power()),
    "move_to": Action(motions.move_to),
    "move_joints": Action(motions.move_joints),
    "step": Action(motions.step),
    "jog": Action(motions.jog),
    "beat": Action(motions.beat),
    "release": Action(motions.release),
    "follow": Action(motions.follow),
    "target": Action(motions.target),
    "suction": Action(tools.suction),
    "gripper": Action(tools.gripper),
    "gripper_to": Action(tools.gripper_to),
    "arm_laser": Action(tools.arm_laser),
    "laser": Action(tools.laser),
    "conveyor": Action(tools.conveyor),
    "configure_pin": Action(tools.configure_pin),
    "output": Action(tools.output),
    "watch_inputs": Action(tools.watch_inputs),
    "rail": Action(tools.rail),
    "move_rail": Action(motions.move_rail),
    "end_effector": Action(tools.end_effector),
    "speed": Action(motions.speed),
    "teach_take": Action(files.teach_take),
    "teach_remove": Action(files.teach_remove),
    "teach_move": Action(files.teach_move),
    "teach_edit": Action(files.teach_edit),
    "teach_clear": Action(files.teach_clear),
    "teach_load": Action(files.teach_load),
    "teach_play": Action(files.teach_play),
    "draw": Action(files.draw),
}
"""By their words."""
