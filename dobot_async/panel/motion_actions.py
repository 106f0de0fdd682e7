"""The actions of a page that move the arm: targets, joints, steps; jogs and followings while the operator holds."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Mapping
from contextlib import AbstractAsyncContextManager
from typing import TYPE_CHECKING, Any, TypeVar

from dobot_async._core.util.text import printable
from dobot_async.errors import DobotError
from dobot_async.panel.arm_tasks import ArmTask
from dobot_async.panel.arms import ArmView
from dobot_async.panel.hold_to_run import HoldToRun, held
from dobot_async.panel.problems import PanelRefusal
from dobot_async.panel.reach import outline
from dobot_async.panel.requests import PageRequest

if TYPE_CHECKING:
    from dobot_async.panel.station import Station

__all__ = [
    "beat",
    "check",
    "follow",
    "jog",
    "move_joints",
    "move_rail",
    "move_to",
    "outline_at",
    "release",
    "speed",
    "step",
    "target",
]

T = TypeVar("T")
FAR = 2000.0  # mm and degrees; no arm of ours goes beyond
FASTEST_FOLLOW = 300.0  # mm/s
FOLLOWING = -1
"""In place of the number of a press."""


def place_of(call: PageRequest) -> dict[str, float]:
    """Return the coordinates that were given, by their names."""
    axes = call.station.view.axes
    place = {axis: call.given.number(axis, -FAR, FAR) for axis in axes if call.given.has(axis)}
    if not place:
        raise ValueError(f"give at least one of {', '.join(axes)}")

    return place


def joints_of(call: PageRequest) -> list[float]:
    """Return the joints that were given."""
    count = len(call.station.view.joint_limits)
    found = call.given.numbers("joints", {count})
    assert found is not None
    return found


def check(call: PageRequest) -> Mapping[str, Any]:
    """Tell whether a place, or joints, can be reached."""
    view = call.station.view
    try:
        if call.given.has("joints"):
            view.check_joints(joints_of(call))
        else:
            view.check_place(place_of(call), call.station.pose)

        call.given.end()
    except ValueError as error:
        return {"ok": False, "problem": printable(str(error), 500)}

    return {"ok": True, "problem": ""}


def outline_at(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Tell what can be reached at a height."""
    view, height = call.station.view, call.given.number("z", -FAR, FAR)
    call.given.end()

    async def found() -> Mapping[str, Any]:
        return {"rings": await asyncio.to_thread(outline, view, height)}

    return found()


def move_to(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Move the tool."""
    line, place = call.given.flag("line", default=False), place_of(call)
    call.station.view.check_place(place, call.station.pose)
    text = "move to " + ", ".join(f"{axis} {value:g}" for axis, value in place.items())
    return call.work(text, lambda view, _: view.move_to(place, line=line))


def move_joints(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Move the joints."""
    joints = joints_of(call)
    call.station.view.check_joints(joints)
    text = f"move joints to {', '.join(f'{each:g}' for each in joints)}"
    return call.work(text, lambda view, _: view.move_joints(joints))


def step(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Go one step."""
    direction, size = call.given.word("direction", call.station.view.words), call.given.number("size", 0.01, 100.0)
    return call.work(f"step {direction} {size:g}", lambda view, _: view.step(direction, size))


def new_hold(call: PageRequest, press: int) -> HoldToRun:
    """Return a hold for a press that is new, and that comes from a hand that holds now."""
    ticks = call.session.state.ticks
    if not ticks.is_new(call.given.whole("tick", 0, 2**53)):
        raise PanelRefusal("late", "this press is older than 0.3 s: the line to this page is too slow")

    return HoldToRun(ticks, press)


async def hold_on(
    call: PageRequest,
    kind: str,
    hold: HoldToRun,
    block: Callable[[], AbstractAsyncContextManager[T]],
    begun: Callable[[T], None],
) -> Mapping[str, str]:
    """Move the arm as long as a hand holds; tell the page when that is over, and why."""
    station, why = call.station, "stopped"
    try:
        why = await held(hold, block, begun)
    except Exception as error:
        why = printable(str(error), 500)
        raise
    finally:
        forget(station, hold)
        call.session.tell(kind, arm=station.name, press=hold.press, state="ended", why=why)

    return {"why": why}


def begin_to_hold(
    call: PageRequest, hold: HoldToRun, begin: Callable[[], Coroutine[Any, Any, Any]]
) -> Coroutine[Any, Any, Any]:
    """Begin with a hold, at once or, if something else was held, when that has ended; beats count from now on."""
    station = call.station
    held_before = list(station.holds.values())
    for each in held_before:
        each.end("another press")

    station.holds[hold.press] = hold
    if station.works.alone is None or not held_before:
        try:
            return begin()
        except BaseException:
            forget(station, hold)
            raise

    async def after() -> Any:
        try:
            while going := station.works.alone:  # it may be another press that has been waiting for the same
                await asyncio.wait({going})

            return await begin()
        finally:
            forget(station, hold)

    return after()


def forget(station: Station, hold: HoldToRun) -> None:
    """Take a hold off its arm, if none has taken its place."""
    if station.holds.get(hold.press) is hold:
        del station.holds[hold.press]


def jog(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Jog while beats come."""
    station, session = call.station, call.session
    direction = call.given.word("direction", station.view.words)
    percent, press = call.given.number("speed", 1, 100, 20), call.given.whole("press", 0, 2**53)
    hold = new_hold(call, press)
    call.given.end()
    session.check_press(press)

    def begun(_: None) -> None:
        session.tell("jog", arm=station.name, press=press, state="moving", why="")

    def doing(view: ArmView, _: ArmTask) -> Coroutine[Any, Any, Any]:
        return hold_on(call, "jog", hold, lambda: view.jogging(direction, percent), begun)

    return begin_to_hold(call, hold, lambda: call.work(f"jog {direction}", doing, alone=True))


def press_of(call: PageRequest) -> int:
    """Return which press is meant; a following has no number."""
    return call.given.whole("press", FOLLOWING, 2**53, FOLLOWING)


def beat(call: PageRequest) -> None:
    """It is still held."""
    hold, tick = call.station.holds.get(press_of(call)), call.given.whole("tick", 0, 2**53)
    call.given.end()
    if hold:
        hold.beat(tick)


def release(call: PageRequest) -> None:
    """It is held no more."""
    hold = call.station.holds.get(press_of(call))
    call.given.end()
    if hold:
        hold.end("released")


def follow(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Follow targets while they come; the answer comes when the arm is ready."""
    station = call.station
    speed, hold = call.given.number("max_speed", 1, FASTEST_FOLLOW, 100), new_hold(call, FOLLOWING)
    call.given.end()
    ready: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    def begun(found: Any) -> None:
        station.follow = found
        ready.set_result(None)

    async def followed(view: ArmView, _: ArmTask) -> None:
        try:
            await hold_on(call, "follow", hold, lambda: view.following(speed), begun)
        finally:
            station.follow = None

    waiting = begin_to_hold(call, hold, lambda: call.work("follow", followed, alone=True))

    async def begin() -> None:
        going = asyncio.ensure_future(waiting)
        await asyncio.wait({going, ready}, return_when=asyncio.FIRST_COMPLETED)
        if not ready.done():
            await going
            raise PanelRefusal("late", "it was released before the arm was ready")

        going.add_done_callback(lambda task: None if task.cancelled() else task.exception())

    return begin()


def target(call: PageRequest) -> None:
    """Go on to a target."""
    station = call.station
    numbers, tick = (
        call.given.numbers("target", range(3, len(station.view.axes) + 1)),
        call.given.whole("tick", 0, 2**53),
    )
    call.given.end()
    hold = station.holds.get(FOLLOWING)
    if not (station.follow and hold and hold.beat(tick)):
        return

    try:
        station.follow.target = numbers
    except DobotError as error:  # the following has failed
        hold.end(printable(str(error), 500))
        raise


def speed(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Set how fast motions are."""
    percent = call.given.number("percent", 1, 100)
    return call.work(f"speed {percent:g} %", lambda view, _: view.set_speed(percent))


def move_rail(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Drive along the rail."""
    mm = call.given.number("mm", 0, FAR)
    return call.work(f"along the rail to {mm:g}", lambda view, _: view.move_rail(mm))
