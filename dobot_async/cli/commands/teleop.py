"""`teleop`: leads an arm by the keys of a terminal, by lines from a program, or along a trajectory in a file.

terminal    w s x, a d y, r f z, q e the last angle: hold a key, and the arm goes; x or Esc ends
pipe        a line of numbers is a target, the newest wins; the arm rests when no more come, and at the end
--play      lines of seconds and a target
"""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncIterator, Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dobot_async.cli.failures import StepRefused, WrongFile
from dobot_async.cli.params import ABOVE_ZERO
from dobot_async.cli.session import CommandSession, run
from dobot_async.following import RATE, Follow

if TYPE_CHECKING:
    from dobot_async.arms.base import Arm

__all__ = ["teleop"]

KEYS = {"w": (0, 1), "s": (0, -1), "a": (1, 1), "d": (1, -1), "r": (2, 1), "f": (2, -1), "q": (-1, 1), "e": (-1, -1)}
"""The place among the numbers of the target, and the way, of each key."""

ENDS = frozenset("x\x1b\x03\x04")
HELD = 0.2  # seconds for which a key counts as held down
TURN = 45.0  # degrees/s of the keys
CHUNK = 4096


@click.command()
@click.option("--rate", type=ABOVE_ZERO, default=RATE, show_default=True, help="Setpoints/s at the most.")
@click.option("--max-speed", type=ABOVE_ZERO, default=50.0, show_default=True, help="mm/s.")
@click.option("--joints", is_flag=True, help="The numbers are joint angles, in degrees; not with keys.")
@click.option("--play", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="Follow a trajectory.")
@click.pass_obj
def teleop(session: CommandSession, rate: float, max_speed: float, joints: bool, play: Path | None) -> None:
    """Lead the arm by keys, or by targets from a pipe.

    On a terminal: w s go along x, a d along y, r f along z, q e turn; the arm goes while a key is held, and x or Esc
    ends. From a pipe each line is a target, x y z and angles; the newest wins, and the arm rests when no more come. A
    file of --play has lines of seconds and a target. The arm stops at the end, and with Ctrl-C.
    """
    points = read_points(play) if play else None
    keys = points is None and sys.stdin is not None and sys.stdin.isatty()
    if keys and joints:
        raise click.UsageError("--joints: keys lead the tool")

    async def led(arm: Arm) -> int:
        async with arm.following(rate=rate, max_speed=max_speed) as follow:
            if points is not None:
                await played(follow, points, joints=joints)
            elif keys:
                session.output.say("w s x, a d y, r f z, q e turn: hold a key; x or Esc ends")
                await by_keys(follow, sys.stdin.fileno(), rate, max_speed)
            else:
                await by_lines(follow, sys.stdin.fileno(), joints=joints)

            return int(follow.sent)

    async def question() -> tuple[int, Any]:
        async with session.connect() as arm:
            return await led(arm), await session.family.pose(arm)

    sent, pose = run(question())
    session.output.answer({"sent": sent, "pose": pose.value}, f"{sent} setpoints; {pose.text}")


def read_points(path: Path) -> list[tuple[float, list[float]]]:
    """The points of a trajectory: a line has seconds, and a target; raise WrongFile for another one."""
    points: list[tuple[float, list[float]]] = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        try:
            numbers = numbers_of(line)
        except ValueError:
            raise WrongFile(f"{path}, line {number}: not numbers: {line[:60]!r}") from None

        if numbers:
            points.append((numbers[0], numbers[1:]))

    if not points:
        raise WrongFile(f"{path}: there is no point in it")

    return points


def numbers_of(line: str) -> list[float]:
    """The numbers of a line, apart by blanks or commas; what is behind # counts for nothing."""
    return [float(word) for word in line.partition("#")[0].replace(",", " ").split()]


async def played(follow: Follow, points: Sequence[tuple[float, list[float]]], *, joints: bool) -> None:
    """Follow a trajectory."""
    try:
        await follow.play(points, joints=joints)
    except ValueError as error:
        raise StepRefused(f"the trajectory was not begun: {error}") from None


async def by_lines(follow: Follow, descriptor: int, *, joints: bool) -> None:
    """Follow the newest of the lines that come in, until there are no more."""
    rest, number = b"", 0
    async for data in chunks(descriptor):
        *lines, rest = (rest + data).split(b"\n")
        for line in lines:
            number += 1
            try:
                if numbers := numbers_of(line.decode("utf-8", "replace")):
                    setattr(follow, "joints" if joints else "target", numbers)
            except ValueError as error:
                raise StepRefused(f"line {number}: {error}") from None


async def by_keys(follow: Follow, descriptor: int, rate: float, max_speed: float) -> None:
    """Lead the tool while keys are held."""
    now = asyncio.get_running_loop().time
    held: dict[str, float] = {}
    with one_by_one(descriptor):
        leading = asyncio.create_task(lead_by_keys(follow, held, rate, max_speed))
        try:
            async for data in chunks(descriptor):
                pressed = set(data.decode("utf-8", "replace").lower())
                held.update(dict.fromkeys(KEYS.keys() & pressed, now() + HELD))
                if ENDS & pressed or leading.done():
                    break
        finally:
            leading.cancel()
            await asyncio.wait([leading])

    if not leading.cancelled():
        leading.result()


async def lead_by_keys(follow: Follow, held: Mapping[str, float], rate: float, max_speed: float) -> None:
    """Move the target on for each key that is held, at `max_speed`; at the edge of the reach it stays."""
    now = asyncio.get_running_loop().time
    wanted: list[float] = []
    while True:
        await asyncio.sleep(1 / rate)
        down = [KEYS[key] for key, until in held.items() if until > now()]
        if not down or not wanted:
            wanted = list(follow.here.numbers) if follow.here else []
            continue

        before = list(wanted)
        for place, way in down:
            wanted[place] += way * (TURN if place < 0 else max_speed) / rate

        try:
            follow.target = wanted
        except ValueError:
            wanted = before


@contextmanager
def one_by_one(descriptor: int) -> Generator[None]:
    """While this is entered a terminal gives each key at once, and does not show it."""
    try:
        import termios
        import tty
    except ImportError:
        raise click.UsageError("keys need a POSIX terminal; give targets by a pipe") from None

    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


async def chunks(descriptor: int) -> AsyncIterator[bytes]:
    """Yield what comes in at a file descriptor, until its end."""
    loop = asyncio.get_running_loop()
    came: asyncio.Queue[bytes] = asyncio.Queue()

    def read() -> None:
        data = os.read(descriptor, CHUNK)  # which does not wait: the loop has said so in this very turn
        came.put_nowait(data)
        if not data:
            loop.remove_reader(descriptor)

    try:
        loop.add_reader(descriptor, read)
    except PermissionError:  # a file on a disk: all of it is there
        while data := os.read(descriptor, CHUNK):
            came.put_nowait(data)

        came.put_nowait(b"")
    except NotImplementedError:
        raise click.UsageError("the loop of this system reads no standard input; use --play") from None

    try:
        while data := await came.get():
            yield data
    finally:
        with suppress(OSError, ValueError):
            loop.remove_reader(descriptor)
