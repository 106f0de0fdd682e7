"""All that a page can ask for, by its word: who may, and what is done. docs/panel-protocol.md is this table in words.

An action reads its arguments at once, so that what is wrong is told before anything is done, and returns a value, or
what is to be awaited. A motion is a `Work` of its arm.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from dobot_async._core.util.text import printable
from dobot_async.panel.arguments import Arguments
from dobot_async.panel.arms import ArmView
from dobot_async.panel.holding import Hold, held
from dobot_async.panel.problems import Refusal
from dobot_async.panel.reach import outline
from dobot_async.panel.works import Work
from dobot_async.toolpath import WorkPlane

if TYPE_CHECKING:
    from dobot_async.panel.session import Session
    from dobot_async.panel.station import Station

__all__ = ["ACTIONS", "Action", "Call"]

FAR = 2000.0  # mm and degrees; no arm of ours goes beyond
LONGEST_ARMED = 60.0  # seconds
FASTEST_FOLLOW = 300.0  # mm/s
TOOLS = ("pen", "laser")
FOLLOWING = -1
"""In place of the number of a press."""


@dataclass(frozen=True, slots=True)
class Call:
    """One message.

    Attributes:
        session: Who asks.
        at: Which arm, None where none was named.
        given: The arguments.
        number: The page's number for it.
    """

    session: Session
    at: Station | None
    given: Arguments
    number: int | None

    @property
    def station(self) -> Station:
        """Which arm."""
        assert self.at, "the action says that it needs an arm"
        return self.at

    def work(
        self, text: str, doing: Callable[[ArmView, Work], Coroutine[Any, Any, Any]], **manner: Any
    ) -> Coroutine[Any, Any, Any]:
        """Begin something that moves the arm; return what waits for its end."""
        self.given.end()
        work = Work(text, self.session.name, **manner)
        task = self.station.start(work, lambda view: doing(view, work), self.session)
        return ended(task)


async def ended(task: asyncio.Task[Any]) -> Any:
    """Wait for a work; who waits no more ends only the waiting, for the work is its lease's."""
    return await asyncio.shield(task)


@dataclass(frozen=True, slots=True)
class Action:
    """What can be asked for.

    Attributes:
        run: Does it: returns a value, or what is to be awaited.
        lease: "held": who asks has to hold the lease; "may": has to be an operator; "": anybody.
        arm: It is about one arm.
    """

    run: Callable[[Call], Any]
    lease: Literal["held", "may", ""] = "held"
    arm: bool = True


def verb(text: str, do: Callable[[ArmView], Coroutine[Any, Any, Any]]) -> Action:
    """Return an action without arguments."""
    return Action(lambda call: call.work(text, lambda view, _: do(view)))


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


def place_of(call: Call) -> dict[str, float]:
    """Return the coordinates that were given, by their names."""
    axes = call.station.view.axes
    place = {axis: call.given.number(axis, -FAR, FAR) for axis in axes if call.given.has(axis)}
    if not place:
        raise ValueError(f"give at least one of {', '.join(axes)}")

    return place


def joints_of(call: Call) -> list[float]:
    """Return the joints that were given."""
    count = len(call.station.view.joint_limits)
    found = call.given.numbers("joints", {count})
    assert found is not None
    return found


def check(call: Call) -> Mapping[str, Any]:
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


def outline_at(call: Call) -> Coroutine[Any, Any, Any]:
    """Tell what can be reached at a height."""
    view, height = call.station.view, call.given.number("z", -FAR, FAR)
    call.given.end()

    async def found() -> Mapping[str, Any]:
        return {"rings": await asyncio.to_thread(outline, view, height)}

    return found()


def move_to(call: Call) -> Coroutine[Any, Any, Any]:
    """Move the tool."""
    line, place = call.given.flag("line", default=False), place_of(call)
    call.station.view.check_place(place, call.station.pose)
    text = "move to " + ", ".join(f"{axis} {value:g}" for axis, value in place.items())
    return call.work(text, lambda view, _: view.move_to(place, line=line))


def move_joints(call: Call) -> Coroutine[Any, Any, Any]:
    """Move the joints."""
    joints = joints_of(call)
    call.station.view.check_joints(joints)
    text = f"move joints to {', '.join(f'{each:g}' for each in joints)}"
    return call.work(text, lambda view, _: view.move_joints(joints))


def step(call: Call) -> Coroutine[Any, Any, Any]:
    """Go one step."""
    direction, size = call.given.word("direction", call.station.view.words), call.given.number("size", 0.01, 100.0)
    return call.work(f"step {direction} {size:g}", lambda view, _: view.step(direction, size))


def new_hold(call: Call, press: int) -> Hold:
    """Return a hold for a press that is new, and that comes from a hand that holds now."""
    ticks = call.session.desk.ticks
    if not ticks.is_new(call.given.whole("tick", 0, 2**53)):
        raise Refusal("late", "this press is older than 0.3 s: the line to this page is too slow")

    return Hold(ticks, press)


def jog(call: Call) -> Coroutine[Any, Any, Any]:
    """Jog while beats come."""
    station, session = call.station, call.session
    direction = call.given.word("direction", station.view.words)
    percent, press = call.given.number("speed", 1, 100, 20), call.given.whole("press", 0, 2**53)
    hold = new_hold(call, press)
    session.check_press(press)

    def begun(_: None) -> None:
        session.tell("jog", arm=station.name, press=press, state="moving", why="")

    async def jogged(view: ArmView, _: Work) -> Mapping[str, str]:
        station.hold, why = hold, "stopped"
        try:
            why = await held(hold, lambda: view.jogging(direction, percent), begun)
        except Exception as error:
            why = printable(str(error), 500)
            raise
        finally:
            station.hold = None
            session.tell("jog", arm=station.name, press=press, state="ended", why=why)

        return {"why": why}

    return call.work(f"jog {direction}", jogged, alone=True)


def press_of(call: Call) -> int:
    """Return which press is meant; a following has no number."""
    return call.given.whole("press", FOLLOWING, 2**53, FOLLOWING)


def beat(call: Call) -> None:
    """It is still held."""
    press, tick, hold = press_of(call), call.given.whole("tick", 0, 2**53), call.station.hold
    call.given.end()
    if hold and hold.press == press:
        hold.beat(tick)


def release(call: Call) -> None:
    """It is held no more."""
    press, hold = press_of(call), call.station.hold
    call.given.end()
    if hold and hold.press == press:
        hold.end("released")


def follow(call: Call) -> Coroutine[Any, Any, Any]:
    """Follow targets while they come; the answer comes when the arm is ready."""
    station, session = call.station, call.session
    speed, hold = call.given.number("max_speed", 1, FASTEST_FOLLOW, 100), new_hold(call, FOLLOWING)
    ready: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    def begun(found: Any) -> None:
        station.follow = found
        ready.set_result(None)

    async def followed(view: ArmView, _: Work) -> None:
        station.hold, why = hold, "stopped"
        try:
            why = await held(hold, lambda: view.following(speed), begun)
        finally:
            station.hold = station.follow = None
            session.tell("follow", arm=station.name, state="ended", why=why)

    waiting = call.work("follow", followed, alone=True)

    async def begin() -> None:
        going = asyncio.ensure_future(waiting)
        await asyncio.wait({going, ready}, return_when=asyncio.FIRST_COMPLETED)
        if not ready.done():
            await going
            raise Refusal("late", "it was released before the arm was ready")

        going.add_done_callback(lambda task: None if task.cancelled() else task.exception())

    return begin()


def target(call: Call) -> None:
    """Go on to a target."""
    station = call.station
    numbers, tick = (
        call.given.numbers("target", range(3, len(station.view.axes) + 1)),
        call.given.whole("tick", 0, 2**53),
    )
    call.given.end()
    if station.follow and station.hold and station.hold.beat(tick):
        station.follow.target = numbers


def arm_laser(call: Call) -> None:
    """Allow the laser for a time."""
    seconds = call.given.number("seconds", 1, LONGEST_ARMED)
    call.given.end()
    if "laser" not in call.station.view.features:
        raise Refusal("unsupported", f"{call.station.view.title} has no laser")

    call.station.log(f"{call.session.name} arms the laser for {seconds:g} s", "warning")
    call.station.arm_laser(seconds)


def told_of_tools(call: Call, text: str, do: Callable[[ArmView], Coroutine[Any, Any, Any]]) -> Coroutine[Any, Any, Any]:
    """Switch something, also beside a jog, and tell everybody."""

    async def done(view: ArmView, _: Work) -> None:
        try:
            await do(view)
        finally:
            call.station.tools_changed()

    return call.work(text, done, beside=True)


def laser(call: Call) -> Coroutine[Any, Any, Any]:
    """Switch the laser, on only while it is armed."""
    on = call.given.flag("on")
    if on:
        call.station.check_armed()

    return told_of_tools(call, f"laser {'on' if on else 'off'}", lambda view: view.laser(on=on))


def suction(call: Call) -> Coroutine[Any, Any, Any]:
    """Suck, or let go."""
    on = call.given.flag("on")
    return told_of_tools(call, f"suction {'on' if on else 'off'}", lambda view: view.suction(on=on))


def gripper(call: Call) -> Coroutine[Any, Any, Any]:
    """Close or open the gripper."""
    closed = call.given.flag("closed")
    return told_of_tools(call, f"{'close' if closed else 'open'} the gripper", lambda view: view.gripper(closed=closed))


def gripper_to(call: Call) -> Coroutine[Any, Any, Any]:
    """Open it partly."""
    percent = call.given.number("percent", 0, 100)
    return told_of_tools(call, f"open the gripper to {percent:g} %", lambda view: view.gripper_to(percent))


def conveyor(call: Call) -> Coroutine[Any, Any, Any]:
    """Run a belt."""
    speed, motor = call.given.whole("speed", -100_000, 100_000), call.given.whole("motor", 0, 1, 0)
    return told_of_tools(call, f"belt at {speed} pulses/s", lambda view: view.conveyor(speed, motor))


def configure_pin(call: Call) -> Coroutine[Any, Any, Any]:
    """Say what a pin is for."""
    pin, use = call.given.whole("pin", 1, 64), call.given.word("use", ("input", "output"))
    return told_of_tools(call, f"pin {pin} is an {use}", lambda view: view.configure_pin(pin, use))


def output(call: Call) -> Coroutine[Any, Any, Any]:
    """Set an output."""
    pin, level = call.given.whole("pin", 1, 64), call.given.flag("level")
    return told_of_tools(call, f"output {pin} {'high' if level else 'low'}", lambda view: view.output(pin, level=level))


def watch_inputs(call: Call) -> Coroutine[Any, Any, Any]:
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

    return told_of_tools(call, "look at inputs", looked)


def rail(call: Call) -> Coroutine[Any, Any, Any]:
    """Declare the rail."""
    on = call.given.flag("on")

    async def declared(view: ArmView, _: Work) -> None:
        await view.rail(on=on)
        call.station.described()

    return call.work(f"rail {'on' if on else 'off'}", declared)


def move_rail(call: Call) -> Coroutine[Any, Any, Any]:
    """Drive along the rail."""
    mm = call.given.number("mm", 0, FAR)
    return call.work(f"along the rail to {mm:g}", lambda view, _: view.move_rail(mm))


def end_effector(call: Call) -> Coroutine[Any, Any, Any]:
    """Say which tool is on the arm."""
    tool = call.given.word("tool", ("suction", "gripper", "pen", "laser"))
    return call.work(f"tool: {tool}", lambda view, _: view.end_effector(tool))


def speed(call: Call) -> Coroutine[Any, Any, Any]:
    """Set how fast motions are."""
    percent = call.given.number("percent", 1, 100)
    return call.work(f"speed {percent:g} %", lambda view, _: view.set_speed(percent))


def recover(call: Call) -> Coroutine[Any, Any, Any]:
    """Make the arm ready again."""
    whole = call.station.source.recover

    async def recovered(view: ArmView, _: Work) -> None:
        await (whole() if whole else view.arm.recover())

    return call.work("recover", recovered)


def teach_take(call: Call) -> Coroutine[Any, Any, Any]:
    """Take a point."""
    taught, name = call.station.taught, call.given.text("name", "")
    mode = call.given.word("mode", call.station.view.modes) if call.given.has("mode") else None
    return call.work("take a point", lambda view, _: taught.take(view, mode=mode, name=name), beside=True)


def teach_remove(call: Call) -> None:
    """Take a point out."""
    call.station.taught.remove(call.given.whole("index", 0, 10_000))


def teach_move(call: Call) -> None:
    """Put it elsewhere in the list."""
    call.station.taught.move(call.given.whole("index", 0, 10_000), call.given.whole("to", 0, 10_000))


def teach_edit(call: Call) -> None:
    """Change it."""
    call.station.taught.edit(call.given.whole("index", 0, 10_000), call.given.mapping("changes"))


def teach_clear(call: Call) -> None:
    """Begin a new list."""
    call.station.taught.set(())


def teach_load(call: Call) -> None:
    """Take what is in a file."""
    file = call.given.text("file")
    call.given.end()
    call.station.taught.load(file)


def teach_play(call: Call) -> Coroutine[Any, Any, Any]:
    """Let the arm do it."""
    loops = call.given.number_or_none("loops", 1, 10_000, 1)
    options = {
        "speed": call.given.number_or_none("speed", 1, 100),
        "loops": None if loops is None else int(loops),
        "reverse": call.given.flag("reverse", default=False),
    }
    return call.work("play", lambda view, work: call.station.taught.play(view, work, **options), alone=True)


def plane_of(call: Call) -> WorkPlane:
    """Return where the paper lies."""
    given = Arguments(call.given.mapping("plane"))
    x, y, z = (given.number(axis, -FAR, FAR) for axis in "xyz")
    rotation = given.number("rotation", -360, 360, 0)
    lift, press = given.number("lift", 0, 100, 5), given.number("press", 0, 20, 0)
    given.end()
    return WorkPlane.flat(x, y, z, rotation=rotation, lift=lift, press=press)


def size_of(call: Call) -> tuple[float, float] | None:
    """Return how large the drawing is to be; None leaves it."""
    found = call.given.numbers("size", {2}, optional=True)
    if found is None:
        return None

    if not all(0.1 <= each <= FAR for each in found):
        raise ValueError("size must be a width and a height of 0.1 mm or more")

    return found[0], found[1]


def preview(call: Call) -> Coroutine[Any, Any, Any]:
    """Show a drawing at a place."""
    file, plane, size = call.given.text("file"), plane_of(call), size_of(call)
    tool = call.given.word("tool", TOOLS, "pen")
    call.given.end()
    return call.session.desk.drawings.preview(call.station.view, file, plane, size, tool)


def draw(call: Call) -> Coroutine[Any, Any, Any]:
    """Draw it."""
    station, drawings = call.station, call.session.desk.drawings
    file, plane, size = call.given.text("file"), plane_of(call), size_of(call)
    tool = call.given.word("tool", TOOLS, "pen")
    options: dict[str, Any] = {
        "tool": tool,
        "speed": call.given.number_or_none("speed", 1, 500),
        "first": call.given.whole("first", 0, 1_000_000, 0),
        "works": station.works,
    }
    if tool == "laser":
        station.check_armed()

    async def drawn(view: ArmView, work: Work) -> Mapping[str, Any]:
        return await drawings.draw(view, file, plane, size, **options, work=work)

    return call.work("engrave" if tool == "laser" else "draw", drawn, alone=True)


def set_name(call: Call) -> None:
    """Say who one is."""
    name = printable(call.given.text("name").strip(), 40)
    if name:
        call.session.rename(name)


ACTIONS: Mapping[str, Action] = {
    "stop": Action(stop, lease="", arm=False),
    "check": Action(check, lease=""),
    "outline": Action(outline_at, lease=""),
    "preview": Action(preview, lease=""),
    "name": Action(set_name, lease="", arm=False),
    "ping": Action(lambda _: {}, lease="", arm=False),
    "take_lease": Action(take_lease, lease="may"),
    "release_lease": Action(release_lease, lease="may"),
    "home": verb("home", lambda view: view.arm.home()),
    "recover": Action(recover),
    "pause": Action(partial(told_of_tools, text="pause", do=lambda view: view.arm.pause())),
    "resume": Action(partial(told_of_tools, text="resume", do=lambda view: view.arm.resume())),
    "power": verb("power", lambda view: view.power()),
    "move_to": Action(move_to),
    "move_joints": Action(move_joints),
    "step": Action(step),
    "jog": Action(jog),
    "beat": Action(beat),
    "release": Action(release),
    "follow": Action(follow),
    "target": Action(target),
    "suction": Action(suction),
    "gripper": Action(gripper),
    "gripper_to": Action(gripper_to),
    "arm_laser": Action(arm_laser),
    "laser": Action(laser),
    "conveyor": Action(conveyor),
    "configure_pin": Action(configure_pin),
    "output": Action(output),
    "watch_inputs": Action(watch_inputs),
    "rail": Action(rail),
    "move_rail": Action(move_rail),
    "end_effector": Action(end_effector),
    "speed": Action(speed),
    "teach_take": Action(teach_take),
    "teach_remove": Action(teach_remove),
    "teach_move": Action(teach_move),
    "teach_edit": Action(teach_edit),
    "teach_clear": Action(teach_clear),
    "teach_load": Action(teach_load),
    "teach_play": Action(teach_play),
    "draw": Action(draw),
}
"""By their words."""
