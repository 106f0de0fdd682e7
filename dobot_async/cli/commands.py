"""The commands that ask one thing, or do one thing, and end: info, pose, alarms, home, move, jog, suction, stop."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

import click

from dobot_async.cli.output import joint_words, tool_words
from dobot_async.cli.session import Session
from dobot_async.magician.alarms import Alarm
from dobot_async.magician.arm import Jog, Magician
from dobot_async.magician.params import Pose, PTPMode

__all__ = ["COMMANDS", "MODES", "ON_OFF"]

MODES = {mode.name.lower().removesuffix("_xyz").replace("_", "-"): mode for mode in PTPMode}
"""The ways to move, by the words for them: movj, movl, jump, ..., movj-angle, movl-inc, ..."""

DIRECTIONS = {each.name.lower().replace("_plus", "+").replace("_minus", "-"): each for each in Jog}
ON_OFF = {"on": True, "off": False}


@click.command()
@click.pass_obj
def info(session: Session) -> None:
    """Tell serial number, name and firmware version."""
    found = session.ask(Magician.get_info, control=False)
    text = f"serial number  {found.serial_number}\nname           {found.name}\nfirmware       {found.version}"
    session.output.answer(found, text)


@click.command()
@click.pass_obj
def pose(session: Session) -> None:
    """Tell where tool and joints are, in mm and degrees."""
    answer_pose(session, session.ask(Magician.get_pose, control=False))


@click.command()
@click.option("--clear", is_flag=True, help="Clear them. The queue is left as it is.")
@click.pass_obj
def alarms(session: Session, clear: bool) -> None:
    """Tell the alarms, with cause and remedy."""

    async def question(arm: Magician) -> tuple[Alarm, ...]:
        if clear:
            await arm.clear_alarms()

        return await arm.get_alarms()

    found = session.ask(question, control=clear, queue="keep", on_error="leave")
    session.output.answer({"alarms": found}, "\n".join(map(str, found)) or "no alarms")


@click.command()
@click.pass_obj
def home(session: Session) -> None:
    """Drive home, which calibrates the arm.

    Needed after power-up; takes tens of seconds. What an earlier program left in the arm's queue is thrown away.
    """
    move_and_answer(session, "homing", Magician.home)


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("x", type=float)
@click.argument("y", type=float)
@click.argument("z", type=float)
@click.argument("r", type=float, default=0.0)
@click.option(
    "--mode",
    type=click.Choice(list(MODES), case_sensitive=False),
    default="movj",
    show_default=True,
    help="movj moves the joints, movl the tool along a straight line, jump lifts it. "
    "-angle: the numbers are joint angles, -inc: increments.",
)
@click.pass_obj
def move(session: Session, x: float, y: float, z: float, r: float, mode: str) -> None:
    """Move the tool to a point.

    X Y Z are mm, R is degrees, 0 unless given. Ends when the arm is there. What an earlier program left in the
    arm's queue is thrown away.
    """
    move_and_answer(session, "moving", lambda arm: arm.move_to(x, y, z, r, mode=MODES[mode]))


@click.command()
@click.argument("direction", type=click.Choice(list(DIRECTIONS), case_sensitive=False), metavar="DIRECTION")
@click.argument("seconds", type=click.FloatRange(min=0))
@click.pass_obj
def jog(session: Session, direction: str, seconds: float) -> None:
    """Jog in a direction for a time.

    DIRECTION is one of x+ x- y+ y- z+ z- r+ r-, j1+ j1- to j4-, rail+ rail-. What an earlier program left in the
    arm's queue is thrown away.
    """
    move_and_answer(session, "jogging", lambda arm: arm.jog(DIRECTIONS[direction], seconds))


@click.command()
@click.argument("state", type=click.Choice(list(ON_OFF)))
@click.pass_obj
def suction(session: Session, state: str) -> None:
    """Switch the suction cup.

    On sucks, off lets go and stops the pump. Takes effect at once; what is in the arm's queue goes on.
    """
    on = ON_OFF[state]
    session.ask(lambda arm: arm.suction(on, pump=on), queue="keep", on_error="leave")
    session.output.answer({"suction": on}, f"suction {state}")


@click.command()
@click.pass_obj
def stop(session: Session) -> None:
    """Stop the arm now, and empty its queue."""
    session.ask(Magician.stop, queue="keep")
    session.output.answer({"stopped": True}, "stopped")


COMMANDS = (info, pose, alarms, home, move, jog, suction, stop)


def move_and_answer(session: Session, what: str, motion: Callable[[Magician], Awaitable[None]]) -> None:
    """Waits for a motion, and answers with the pose in which it ended."""

    async def question(arm: Magician) -> Pose:
        await motion(arm)
        return await arm.get_pose()

    with session.output.working(what):
        reached = session.ask(question)

    answer_pose(session, reached)


def answer_pose(session: Session, found: Pose) -> None:
    """Answers with a pose."""
    session.output.answer(found, f"{tool_words(found)}  |  {joint_words(found)}")
