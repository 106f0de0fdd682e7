"""`demo`: homes an arm and lets it carry pieces to and fro; without --url a simulated one behind a pseudo-terminal.

    PIECES at the right  --->  at the left  --->  at the right  ...      one direction each cycle

Each piece is a batch, queued while the arm still carries the one before it. Link and arm count what the summary tells.
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import AsyncGenerator, Callable, Coroutine, Iterator, Mapping
from contextlib import AsyncExitStack, asynccontextmanager, nullcontext
from dataclasses import dataclass
from typing import Any

import anyio
import click

from dobot_async._core.queue.motion import Motion
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.params import Pose, PTPMode
from dobot_async.cli.arms.magician import joint_words, tool_words
from dobot_async.cli.params import ABOVE_ZERO
from dobot_async.cli.session import CommandSession, run

__all__ = ["demo"]

PIECES = (180.0, 210.0, 240.0)
"""Where the pieces lie: x, mm."""

SIDE, UP, DOWN = 100.0, 60.0, 0.0
"""How far to either side they lie, and how high they are carried and picked up: y and z, mm."""

GRIP = 0.2  # seconds that the cup takes to hold
SPEED = 5.0
REDRAW = 0.1
LINE = PTPMode.MOVL_XYZ


@dataclass(frozen=True, slots=True)
class Summary:
    """What a demo came to.

    Attributes:
        url: The arm's.
        pieces: How many were carried.
        commands: How many the arm executed; a simulated arm's own count.
        seconds: How long it took.
        speed: How much faster than a real arm it is simulated; 1 for a real one.
        round_trips: Requests that were answered.
        repeated: Requests that had to be sent again.
        junk_bytes: Bytes that belong to no frame.
        bad_frames: Frames with a wrong checksum.
        pose: Where the arm is in the end.
    """

    url: str
    pieces: int
    commands: int
    seconds: float
    speed: float
    round_trips: int
    repeated: int
    junk_bytes: int
    bad_frames: int
    pose: Pose

    def __str__(self) -> str:
        rate = self.round_trips / self.seconds
        return "\n".join(
            (
                f"pieces       {self.pieces} carried at {self.url}",
                f"commands     {self.commands} executed",
                f"duration     {self.seconds:.1f} s"
                + (f", {self.speed:g} times real speed" if self.speed != 1 else ""),
                f"round trips  {self.round_trips} ({rate:.0f} per second), {self.repeated} repeated",
                f"junk bytes   {self.junk_bytes}, {self.bad_frames} bad frames",
            )
        )


class DemoCycle:
    """The demo's own commands, and how far they are."""

    def __init__(self, arm: Magician, cycles: int, say: Callable[[str], None]) -> None:
        self.motions: list[Motion] = []
        self.phase: str = "homing"
        self.pieces: int = cycles * len(PIECES)
        self._arm = arm
        self._cycles = cycles
        self._say = say

    async def perform(self) -> None:
        """Homes the arm and carries all pieces; each is queued while the arm still carries the one before it."""
        await self._tell("homing")
        home = await self._arm.queue.home()
        self.motions.append(home)
        await home
        carried = home
        for number, (source, target) in enumerate(ways(self._cycles)):
            last = await self._queue(source, target)
            await carried
            await self._tell(f"{number} of {self.pieces} pieces carried")
            carried = last

        await carried
        await self._arm.suction(on=False, pump=False)
        await self._tell(f"{self.pieces} of {self.pieces} pieces carried")

    def rows(self, pose: Pose) -> Mapping[str, str]:
        """What a person wants to see of it."""
        done = sum(motion.done for motion in self.motions)
        return {
            "tool": tool_words(pose),
            "joints": joint_words(pose),
            "queue": f"{self._arm.queue.pending} commands",
            "done": f"{done} commands",
            "work": self.phase,
        }

    async def _tell(self, phase: str) -> None:
        self.phase = phase
        rows = self.rows(await self._arm.get_pose())
        self._say("  |  ".join([phase, *(f"{name} {rows[name]}" for name in ("tool", "queue", "done"))]))

    async def _queue(self, source: tuple[float, float], target: tuple[float, float]) -> Motion:
        """Queues what carries one piece; returns its last motion."""
        async with self._arm.queue.batch() as batch:
            for place, hold in ((source, True), (target, False)):
                batch.move_to(*place, UP)
                batch.move_to(*place, DOWN, mode=LINE)
                batch.suction(hold)
                batch.wait(GRIP)
                last = batch.move_to(*place, UP, mode=LINE)

        self.motions.extend(batch.motions)
        return last


def ways(cycles: int) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    """Yields from where to where each piece is carried: x and y."""
    for cycle in range(cycles):
        side = -SIDE if cycle % 2 == 0 else SIDE
        for x in PIECES:
            yield (x, side), (x, -side)


@click.command()
@click.option(
    "--cycles", type=click.IntRange(1), default=2, show_default=True, help="How often all pieces are carried."
)
@click.option(
    "--speed",
    type=ABOVE_ZERO,
    help=f"Simulated seconds per second.  [default: {SPEED:g}]",
)
@click.option("--yes", is_flag=True, help="Do not ask before a real arm moves.")
@click.pass_obj
def demo(session: CommandSession, cycles: int, speed: float | None, yes: bool) -> None:
    """Let a simulated arm pick and place.

    It is reached through a (pseudo) serial port. With --url that arm does it, after a question, for it really moves;
    DOBOT_URL is not used here.
    """
    session.only("magician")
    # An arm that happens to be in the environment must not move because somebody wants to see a demo.
    url = session.url if "url" in session.given else None
    if url and speed:
        raise click.UsageError("--speed is for the simulated arm, not for one with a --url")

    if url and not yes and not url.startswith("sim:"):
        confirm(url)

    output = session.output
    with output.panel() if output.terminal else nullcontext() as draw:
        summary = run(perform(session, url, cycles, speed or SPEED, draw))

    output.answer(summary, str(summary))


def confirm(url: str) -> None:
    """Asks whether a real arm may move; raises if it may not."""
    if not sys.stdin or not sys.stdin.isatty():
        raise click.UsageError(f"the arm at {url} would move: say --yes if it may")

    space = f"x {PIECES[0]:g} to {PIECES[-1]:g}, y {-SIDE:g} to {SIDE:g}, z {DOWN:g} to {UP:g} mm"
    if not click.confirm(f"The arm at {url} will home, then move within {space}. Is the space free?", err=True):
        raise click.ClickException("nothing was moved")


async def perform(
    session: CommandSession,
    url: str | None,
    cycles: int,
    speed: float,
    draw: Callable[[Mapping[str, str]], None] | None,
) -> Summary:
    """Runs the demo on the arm at a URL, or on a simulated one."""
    from dobot_async.simulator import simulate

    async with AsyncExitStack() as stack:
        simulation = None
        if url is None:
            simulation = await stack.enter_async_context(simulate(session.arm, listen="pty", speed=speed))
            url = simulation.url

        started = time.monotonic()
        arm = await stack.enter_async_context(session.connect(url))
        work = DemoCycle(arm, cycles, (lambda _: None) if draw else session.output.say)
        async with alongside(watch(arm, work, draw)) if draw else nullcontext():
            await work.perform()

        pose = await arm.get_pose()
        if draw:
            draw(work.rows(pose))

        stats = arm.link.stats
        return Summary(
            url=url,
            pieces=work.pieces,
            commands=len(simulation.arm.executed) if simulation else sum(motion.done for motion in work.motions),
            seconds=time.monotonic() - started,
            speed=speed if simulation else 1.0,
            round_trips=stats.received - stats.unexpected,
            repeated=stats.repeated,
            junk_bytes=stats.junk_bytes,
            bad_frames=stats.bad_frames,
            pose=pose,
        )


async def watch(arm: Magician, work: DemoCycle, draw: Callable[[Mapping[str, str]], None]) -> None:
    """Draws how far the work is, until it is cancelled."""
    while True:
        draw(work.rows(await arm.get_pose()))
        await anyio.sleep(REDRAW)


@asynccontextmanager
async def alongside(work: Coroutine[Any, Any, None]) -> AsyncGenerator[None]:
    """Lets work go on beside a block, and ends it with the block; raises what it failed with if the block did not."""
    task = asyncio.create_task(work)
    try:
        yield
    finally:
        task.cancel()
        await asyncio.wait([task])
        failure = None if task.cancelled() else task.exception()

    if failure:
        raise failure
