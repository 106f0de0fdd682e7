"""The commands that ask one thing, or do one thing, and end: info, pose, alarms, home, move, jog, suction, stop."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

import click

from dobot_async.cli.arms import FAMILIES, chosen
from dobot_async.cli.family import CommandAnswer
from dobot_async.cli.params import DURATION
from dobot_async.cli.session import CommandSession

if TYPE_CHECKING:
    from dobot_async.arms.base import Arm

__all__ = ["alarms", "home", "info", "jog", "move", "pose", "stop", "suction"]

ON_OFF = {"on": True, "off": False}


@click.command()
@click.pass_obj
def info(session: CommandSession) -> None:
    """Tell who the arm is.

    Serial number, name and firmware version, as far as it tells them.
    """
    answer(session, session.ask(session.family.info, control=False))


@click.command()
@click.pass_obj
def pose(session: CommandSession) -> None:
    """Tell where tool and joints are, in mm and degrees."""
    answer(session, session.ask(session.family.pose, control=False))


@click.command()
@click.option("--clear", is_flag=True, help="Clear them. The queue is left as it is.")
@click.pass_obj
def alarms(session: CommandSession, clear: bool) -> None:
    """Tell the alarms, with cause and remedy."""
    if not session.family.alarms:
        session.only(*(name for name, family in FAMILIES.items() if family.alarms))

    async def question(arm: Arm) -> tuple[object, ...]:
        if clear:
            await arm.clear_alarms()

        return tuple(await arm.get_alarms())

    found = session.ask(question, control=clear, queue="keep", on_error="leave")
    session.output.answer({"alarms": found}, "\n".join(map(str, found)) or "no alarms")


@click.command()
@click.pass_obj
def home(session: CommandSession) -> None:
    """Drive home, which calibrates the arm.

    Needed after power-up; takes tens of seconds. What an earlier program left in the arm's queue is thrown away.
    """
    move_and_answer(session, "homing", lambda arm: arm.home())


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("x", type=float)
@click.argument("y", type=float)
@click.argument("z", type=float)
@click.argument("rest", type=float, nargs=-1, metavar="[R]...")
@click.option(
    "--mode",
    help="magician: movj moves the joints, movl the tool along a straight line, jump lifts it. -angle: the numbers are "
    "joint angles, -inc: increments. ultraarm: to, by (increments) or joints (angles). "
    "mycobot and its models: to, linear or joints.  [default: movj, to]",
)
@click.pass_obj
def move(session: CommandSession, x: float, y: float, z: float, rest: tuple[float, ...], mode: str | None) -> None:
    """Move the tool to a point.

    X Y Z are mm, R is degrees, 0 unless given; an ultraarm's is the fourth joint, which stays unless given. A
    mycobot takes x y z rx ry rz, or one angle for each joint. Ends when the arm is there. What an earlier program
    left in the arm's queue is thrown away.
    """
    family = session.family
    way = chosen(mode, family.modes, "--mode")
    numbers = (x, y, z, *rest)
    if len(numbers) > family.numbers:
        raise click.UsageError(f"a move of this arm has at most {family.numbers} numbers, not {len(numbers)}")

    move_and_answer(session, "moving", lambda arm: family.move(arm, numbers, way))


@click.command()
@click.argument("direction")
@click.argument("seconds", type=DURATION)
@click.pass_obj
def jog(session: CommandSession, direction: str, seconds: float) -> None:
    """Jog in a direction for a time.

    DIRECTION is one of x+ x- y+ y- z+ z- r+ r-, j1+ j1- to j4-, rail+ rail- (an ultraarm has no r, j4 and rail; a
    mycobot has j1 to j7 and rx, ry, rz, as far as its model goes). What an earlier program left in the arm's queue is
    thrown away.
    """
    family = session.family
    way = family.directions[chosen(direction, list(family.directions), "DIRECTION")]
    move_and_answer(session, "jogging", lambda arm: family.jog(arm, way, seconds))


@click.command()
@click.argument("state", type=click.Choice(list(ON_OFF)))
@click.pass_obj
def suction(session: CommandSession, state: str) -> None:
    """Switch the suction cup.

    On sucks, off lets go and stops the pump. Takes effect at once; what is in the arm's queue goes on.
    """
    on = ON_OFF[state]
    if not session.family.pump:
        session.only(*(name for name, family in FAMILIES.items() if family.pump))

    session.ask(lambda arm: session.family.suction(arm, on), queue="keep", on_error="leave")
    session.output.answer({"suction": on}, f"suction {state}")


@click.command()
@click.pass_obj
def stop(session: CommandSession) -> None:
    """Stop the arm now, and empty its queue."""
    session.ask(lambda arm: arm.stop(), queue="keep")
    session.output.answer({"stopped": True}, "stopped")


def move_and_answer(session: CommandSession, what: str, motion: Callable[[Arm], Awaitable[None]]) -> None:
    """Waits for a motion, and answers with the pose in which it ended."""

    async def question(arm: Arm) -> CommandAnswer:
        await motion(arm)
        return await session.family.pose(arm)

    with session.output.working(what):
        reached = session.ask(question)

    answer(session, reached)


def answer(session: CommandSession, told: CommandAnswer) -> None:
    """Answers with what an arm told."""
    session.output.answer(told.value, told.text)
