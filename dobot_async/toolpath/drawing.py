"""An arm draws, or engraves, a toolpath.

    toolpath --moves--> checked against the reach --program--> commands --batches--> arm.queue --> done
                        before a byte is sent                            a full queue makes them wait

1. All of it is checked first: a place out of reach is an error before anything moves.
2. Commands follow each other without a WAIT and without another one between them, so that the arm's look-ahead sees a
   path and no points. Another program that uses the same queue meanwhile comes in between batches.
3. A stroke is done when the arm has done it. What fails tells the stroke with which to go on.
4. The drawing belongs to who awaits it: on every way out but the good end the arm is stopped and its laser is off.
"""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, SupportsFloat

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.arguments import check_duration
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.errors import DobotError, MotionStopped, another
from dobot_async.magician.arm import Magician
from dobot_async.mycobot.arm import MyCobot
from dobot_async.toolpath.moves import Move, Tool, approach, check_moves
from dobot_async.toolpath.plane import Place, WorkPlane
from dobot_async.toolpath.programs import Instruction, Pace, check_tool, program_for
from dobot_async.toolpath.reach import reach_of
from dobot_async.toolpath.schedule import (
    RATE,
    TOLERANCE,
    above_zero,
    batches,
    guess,
    planned,
    whole,
    whole_percent,
)
from dobot_async.toolpath.toolpath import Toolpath
from dobot_async.ultraarm.arm import UltraArm

__all__ = ["Drawing", "DrawingArm", "Progress", "draw", "engrave"]

logger = logging.getLogger("dobot_async.toolpath")
DrawingArm = Magician | UltraArm | MyCobot
LOOK = 0.5  # seconds between two questions how far the arm is, while commands are sent: each takes the line for a while
LEAST_KNOWN = 0.05  # of the time that was guessed, before how long it really takes is believed


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a drawing is.

    Attributes:
        strokes: How many are done, those before the one with which it began among them.
        of: How many there are.
        mm: How much was drawn, mm.
        of_mm: How much there is to draw.
        seconds_left: How long it will still take, by how long it has taken so far.
    """

    strokes: int
    of: int
    mm: float
    of_mm: float
    seconds_left: float


class Drawing:
    """A toolpath, an arm and a plane: checked when it is made, drawn by `run`, stopped by `stop`.

    Args:
        arm: A connected Magician, UltraArm or MyCobot; a Magician should know its tool (`set_end_effector`).
        toolpath: What to draw.
        plane: Where the paper lies.
        tool: "pen" is lifted between strokes, "laser" switched off.
        speed: mm/s; None takes each stroke's own, or 50 (pen) and 20 (laser). A myCobot knows none: see `percent`.
        tolerance: mm by which points that are left out may be missed; 0 leaves none out.
        acceleration: Of a Magician's continuous path, mm/s².
        percent: Of a myCobot's speed.
        rate: Commands per second that the line carries; where many short ways follow one another the speed of a
            Magician is made so low that the arm does not use up its queue. None does not look.
        progress: Called with a `Progress` when something was done.

    Attributes:
        next_stroke: The first stroke that is not known to be done: with it `run` goes on.

    Raises:
        UnreachableStroke: The arm cannot go there; it names stroke, point and reason.
        UnsupportedError: The arm has no such tool.
        ValueError: A number is out of range, or there is nothing to draw.
    """

    def __init__(
        self,
        arm: DrawingArm,
        toolpath: Toolpath,
        plane: WorkPlane,
        *,
        tool: Tool = "pen",
        speed: SupportsFloat | None = None,
        tolerance: SupportsFloat = TOLERANCE,
        acceleration: SupportsFloat = 100.0,
        percent: int = 20,
        rate: SupportsFloat | None = RATE,
        progress: Callable[[Progress], None] | None = None,
    ) -> None:
        check_tool(arm, tool)
        if speed is not None and isinstance(arm, MyCobot):
            raise ValueError("a myCobot knows no speed in mm/s: give percent= (1 to 100) instead")

        if not toolpath.strokes:
            raise ValueError("there is nothing to draw: the toolpath has no strokes")

        self._arm = arm
        self._plane = plane
        self._tool = tool
        self._reach = reach_of(arm)
        self._pace = Pace(above_zero(acceleration, "acceleration"), whole_percent(percent))
        path = toolpath.simplify(check_duration(tolerance, "tolerance"))
        self._strokes = planned(path, plane, tool, speed, rate if isinstance(arm, Magician) else None)
        self._lengths = [stroke.length for stroke in path]
        self._guess = [guess(moves) for moves in self._strokes]
        check_moves((move for moves in self._strokes for move in moves), self._reach)
        self._progress = progress
        self._running: asyncio.Task[Any] | None = None
        self._stopped = False
        self._epoch = Epoch()
        self._began = 0.0
        self._taken = (0.0, 0.0)  # seconds that what is done has taken, and was guessed to take
        self.next_stroke = 0

    @property
    def progress(self) -> Progress:
        """How far it is."""
        done, total, guessed = self.next_stroke, sum(self._lengths), sum(self._guess[self.next_stroke :])
        taken, of = self._taken
        slower = taken / of if of > LEAST_KNOWN * sum(self._guess) else 1.0
        return Progress(done, len(self._strokes), sum(self._lengths[:done]), total, guessed * slower)

    async def run(self, *, first: int | None = None) -> None:
        """Draw, from `next_stroke` on; return when the arm has done all of it.

        A stroke in which it was interrupted is drawn again from its start. Before the first stroke the tool is lifted.

        Args:
            first: The stroke, from 0, to begin with.

        Raises:
            UnreachableStroke: The way from where the arm is to the first stroke is out of reach; nothing was sent.
            DobotError: As `arm.queue.put` and `Motion.wait`, with a note that tells the stroke. The arm was stopped.
            RuntimeError: It is being drawn already.
        """
        if self._running:
            raise RuntimeError("it is being drawn already")

        if first is not None:
            self.next_stroke = whole(first, len(self._strokes))

        if self.next_stroke == len(self._strokes):
            return

        self._running, self._stopped, self._taken = asyncio.current_task(), False, (0.0, 0.0)
        self._epoch = self._arm.queue.epoch  # which a stop by anybody ends
        try:
            here, program = await program_for(self._arm, self._tool, self._pace)
            moves = self._moves(here)
            check_moves(moves, self._reach, here)
            await self._draw(list(program.instructions(moves)))
        finally:
            self._running = None

    async def stop(self) -> None:
        """Stop the arm now; `run` raises MotionStopped, and can go on from `next_stroke`."""
        self._stopped = True
        await self._arm.stop()

    def _moves(self, here: Place) -> list[Move]:
        """All moves that are still to be made."""
        moves = [move for some in self._strokes[self.next_stroke :] for move in some]
        return approach(here, moves, self._plane) + moves

    async def _draw(self, instructions: Sequence[Instruction]) -> None:
        """Put all commands, and wait until they are done; on another way out, stop."""
        pending: deque[tuple[Motion, int]] = deque()
        self._began = asyncio.get_running_loop().time()
        watcher = asyncio.create_task(self._watch(pending), name="dobot_async progress of a drawing")
        try:
            await self._put(instructions, pending)
            while pending:
                await pending[0][0]
                self._count(pending)
        except BaseException as error:
            cleanup = self._arm.link.cleanup
            failure = await cleanup.finish(cleanup.start(self._arm.leave(), "the end of a drawing"))
            self._count(pending)
            error.add_note(
                f"stroke {self.next_stroke} of {len(self._strokes)} (from 0) is not known to be done; "
                f"first={self.next_stroke} goes on with it"
            )
            if failure:
                error.add_note(f"it is not known whether the arm stands, and its laser is off: {failure}")

            raise
        finally:
            await cancel_and_join(watcher)

    async def _put(self, instructions: Sequence[Instruction], pending: deque[tuple[Motion, int]]) -> None:
        """Put commands in batches; note the last one of each stroke."""
        motions: list[Motion] = []
        for some in batches(instructions):
            self._check_stop()
            async with self._arm.queue.batch() as batch:
                motions = [batch.put(each.row, each.value) for each, _ in some]

            pending.extend(
                (motion, each.move.stroke)
                for motion, (each, ends) in zip(motions, some, strict=True)
                if ends and each.move
            )
            if failure := self._count(pending):
                raise another(failure)

        pending.append((motions[-1], len(self._strokes) - 1))

    def _check_stop(self) -> None:
        """Raise MotionStopped if a stop came since `run` began: nothing is awaited between this and the next batch."""
        if self._stopped:
            raise MotionStopped("the drawing was stopped")

        self._epoch.check()

    async def _watch(self, pending: deque[tuple[Motion, int]]) -> None:
        """Ask now and then how far the arm is: no more often, for each question takes the line for a while."""
        while True:
            await asyncio.sleep(LOOK)
            with suppress(DobotError):  # whoever puts and waits hears of it
                await self._arm.queue.update()

            self._count(pending)

    def _count(self, pending: deque[tuple[Motion, int]]) -> DobotError | None:
        """Count the strokes that are done; return what the first one that is not has failed with."""
        before, failure = self.next_stroke, None
        while pending and pending[0][0].ended and not failure:
            motion, stroke = pending[0]
            failure = motion.exception()
            if not failure:
                pending.popleft()
                self.next_stroke = max(self.next_stroke, stroke + 1)

        if self.next_stroke > before:
            now = asyncio.get_running_loop().time()
            guessed = self._taken[1] + sum(self._guess[before : self.next_stroke])
            self._taken = now - self._began, guessed
            if self._progress:
                try:
                    self._progress(self.progress)
                except Exception:
                    logger.exception("progress= of a drawing failed")

        return failure


async def draw(arm: DrawingArm, toolpath: Toolpath, plane: WorkPlane, *, first: int = 0, **options: Any) -> None:
    """Draw a toolpath with a pen, and return when the arm has done it; see `Drawing`, which can be stopped.

    Args:
        arm: A connected Magician, UltraArm or MyCobot.
        toolpath: What to draw.
        plane: Where the paper lies.
        first: The stroke, from 0, to begin with.
        options: As for `Drawing`: speed, tolerance, acceleration, percent, rate, progress.
    """
    await Drawing(arm, toolpath, plane, tool="pen", **options).run(first=first)


async def engrave(arm: DrawingArm, toolpath: Toolpath, plane: WorkPlane, *, first: int = 0, **options: Any) -> None:
    """Engrave a toolpath with a laser, which is off on every way out; see `draw`.

    The plane is that of the focus: the laser is moved in it, and lifted on the way to the first stroke alone. A dot is
    a line of 0.1 mm.
    """
    await Drawing(arm, toolpath, plane, tool="laser", **options).run(first=first)
