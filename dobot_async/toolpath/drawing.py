"""An arm draws, or engraves, a toolpath.

    toolpath --moves--> checked against the reach --program--> commands --batches--> arm.queue --> done
                        before a byte is sent                            a full queue makes them wait

1. All of it is checked first: a place out of reach is an error before anything moves.
2. Commands follow each other without a WAIT and without another one between them, so that the arm's look-ahead sees a
   path and no points. Another program that uses the same queue meanwhile comes in between batches.
3. A stroke is done when the arm has done it. What fails tells where to go on: a pen at the start of the stroke, a
   laser where it was stopped, for what is burnt twice is darker.
4. The drawing belongs to who awaits it: on every way out but the good end the arm is stopped and its laser is off.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, SupportsFloat

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.util.tasks import cancel_and_join, run_shielded
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.ultraarm.arm import UltraArm
from dobot_async.errors import ArmAlarm, DobotError, MotionStopped, another
from dobot_async.toolpath.joints import check_joints
from dobot_async.toolpath.moves import Tool, ToolpathMove, approach, check_moves, from_point
from dobot_async.toolpath.plane import Place, WorkPlane
from dobot_async.toolpath.position import Sent, StrokePosition, along, stand_of
from dobot_async.toolpath.programs import DrawingPace, Instruction, back_to_ramps, check_tool, program_for
from dobot_async.toolpath.progress import Progress, ProgressMeter
from dobot_async.toolpath.reach import reach_of
from dobot_async.toolpath.schedule import (
    RATE,
    TOLERANCE,
    above_zero,
    batches,
    guess,
    planned,
    position_in,
    simplified,
    whole_percent,
)
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["Drawing", "DrawingArm"]

DrawingArm = Magician | UltraArm | MyCobot
LOOK = 0.5  # seconds between two questions how far the arm is, while commands are sent: each takes the line for a while
LOCATING = 1.5  # seconds after the error, in which an arm has stopped and told where it stands, or is not waited for


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
        constant_speed: Of an ultraArm: run without ramps (M16 S0), as the vendor's player runs programs, and go back to
            ramps behind it. What that does to its motions nobody has measured.
        rate: Commands per second that the line carries; where many short ways follow one another the speed of a
            Magician is made so low that the arm does not use up its queue. None does not look.
        progress: Called with a `Progress` when something was done.

    Raises:
        UnreachableStroke: The arm cannot go there, or not in its workspace; it names stroke, point and reason.
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
        constant_speed: bool = False,
        rate: SupportsFloat | None = RATE,
        progress: Callable[[Progress], None] | None = None,
    ) -> None:
        check_tool(arm, tool)
        if speed is not None and isinstance(arm, MyCobot):
            raise ValueError("a myCobot knows no speed in mm/s: give percent= (1 to 100) instead")

        if constant_speed and not isinstance(arm, UltraArm):
            raise ValueError("constant_speed is for an ultraArm alone: others have no such mode")

        self._arm = arm
        self._plane = plane
        self._tool: Tool = tool
        self._reach = reach_of(arm)
        self._pace = DrawingPace(above_zero(acceleration, "acceleration"), whole_percent(percent), bool(constant_speed))
        path = simplified(toolpath, tolerance)
        self._strokes = planned(path, plane, tool, speed, rate if isinstance(arm, Magician) else None)
        lengths, guesses = [stroke.length for stroke in path], [guess(moves) for moves in self._strokes]
        self._meter = ProgressMeter(lengths, guesses, progress)
        check_moves((move for moves in self._strokes for move in moves), self._reach, bounds=arm.queue.bounds)
        self._running: asyncio.Task[Any] | None = None
        self._stopped = False
        self._epoch = Epoch()
        self._position = StrokePosition(0)

    @property
    def next_stroke(self) -> int:
        """The first stroke that is not known to be done: with it `run` goes on."""
        return self._position.stroke

    @property
    def next_point(self) -> float:
        """How far a laser was in it, in points: 7.25 is a quarter of the way from point 7 to point 8. 0 for a pen."""
        return self._position.point

    @property
    def progress(self) -> Progress:
        """How far it is."""
        return self._meter.progress(self.next_stroke)

    async def run(self, *, first: int | None = None, point: SupportsFloat = 0.0) -> None:
        """Draw, from `next_stroke` and `next_point` on; return when the arm has done all of it.

        A stroke in which it was interrupted is drawn again from its start by a pen; a laser goes on where it was
        stopped. Before the first stroke the tool is lifted.

        Args:
            first: The stroke, from 0, to begin with.
            point: Of a laser: how far in this stroke, as `next_point` of the same toolpath with the same tolerance.

        Raises:
            UnreachableStroke: The way from where the arm is to the first stroke is out of reach, or from there a limit
                of a myCobot's joints is in the way of a stroke; nothing has moved.
            DobotError: As `arm.queue.put` and `Motion.wait`, with a note that tells the stroke. The arm was stopped.
            RuntimeError: It is being drawn already.
        """
        if self._running:
            raise RuntimeError("it is being drawn already")

        if first is not None:
            self._position = position_in(self._strokes, first, point, self._tool)

        if self.next_stroke == len(self._strokes):
            return

        self._running, self._stopped = asyncio.current_task(), False
        self._epoch = self._arm.queue.epoch  # which a stop by anybody ends
        try:
            here, program = await program_for(self._arm, self._tool, self._pace)
            moves = self._moves(here)
            check_moves(moves, self._reach, here, self._arm.queue.bounds)
            if isinstance(self._arm, MyCobot):
                await check_joints(self._arm, moves, here)

            await self._draw(list(program.instructions(moves)), here)
        finally:
            self._running = None

    async def stop(self) -> None:
        """Stop the arm now; `run` raises MotionStopped, and can go on from `next_stroke`."""
        self._stopped = True
        await self._arm.stop()

    def how_to_go_on(self) -> str:
        """Return the arguments with which the rest is drawn, for the note on an error."""
        return f"first={self.next_stroke}" + (f", point={self.next_point}" if self.next_point else "")

    def _moves(self, here: Place) -> list[ToolpathMove]:
        """All moves that are still to be made."""
        strokes = self._strokes[self.next_stroke :]
        moves = from_point(strokes[0], self.next_point) + [move for some in strokes[1:] for move in some]
        return approach(here, moves, self._plane) + moves

    async def _draw(self, instructions: Sequence[Instruction], here: Place) -> None:
        """Put all commands, and wait until they are done; on another way out, stop."""
        pending: deque[Sent] = deque()
        self._meter.begin(asyncio.get_running_loop().time())
        watcher = asyncio.create_task(self._watch(pending), name="dobot_async progress of a drawing")
        try:
            await self._put(instructions, here, pending)
            while pending:
                await next(each.motion for each in pending if each.ends)
                self._count(pending)
        except BaseException as error:
            try:
                await run_shielded(self._end(error, pending))  # which takes no longer than a way out may
            except asyncio.CancelledError as again:  # of who was cancelled once more meanwhile
                for note in getattr(error, "__notes__", ()):
                    again.add_note(note)

                raise

            raise
        finally:
            await cancel_and_join(watcher)

    async def _end(self, error: BaseException, pending: deque[Sent]) -> None:
        """Stop the arm, find out how far it was, and tell it with the error."""
        cleanup, deadline = self._arm.link.cleanup, asyncio.get_running_loop().time() + LOCATING
        failure = await cleanup.finish(cleanup.start(self._arm.leave(), "the end of a drawing"))
        self._count(pending)
        # After an alarm nothing tells which of the commands failed that the arm has ticked off.
        if pending and not failure and not isinstance(error, ArmAlarm):
            await cleanup.finish(
                cleanup.start(self._locate(pending, deadline), "the search where a drawing was stopped")
            )

        if self._pace.constant_speed:
            cleanup.start(back_to_ramps(self._arm), "going back to ramps")

        error.add_note(self._note())
        if failure:
            error.add_note(f"it is not known whether the arm stands, and its laser is off: {failure}")

    def _note(self) -> str:
        """What is said of the rest."""
        if self.next_stroke == len(self._strokes):
            return "all strokes are done" + ("; the pen may still be down" if self._tool == "pen" else "")

        which = f"stroke {self.next_stroke} (of {len(self._strokes)}, from 0)"
        return f"{which} is not known to be done; {self.how_to_go_on()} draws the rest"

    async def _locate(self, pending: deque[Sent], deadline: float) -> None:
        """Find out how far a stopped arm was, if the way out has left time for it."""
        with suppress(DobotError, TimeoutError):
            async with asyncio.timeout_at(deadline):
                if stand := await stand_of(self._arm):
                    self._reached(along(pending, stand, self._position))

    async def _put(self, instructions: Sequence[Instruction], here: Place, pending: deque[Sent]) -> None:
        """Put commands in batches."""
        place = here
        for some in batches(instructions):
            self._check_stop()
            async with self._arm.queue.batch() as batch:
                for each, ends in some:  # noted before they are sent: whoever interrupts that asks what became of them
                    pending.append(Sent(batch.put(each.row, each.value), each.move, place, ends))
                    place = each.move.place if each.move else place

            if failure := self._count(pending):
                raise another(failure)

    def _check_stop(self) -> None:
        """Raise MotionStopped if a stop came since `run` began: nothing is awaited between this and the next batch."""
        if self._stopped:
            raise MotionStopped("the drawing was stopped")

        self._epoch.check()

    async def _watch(self, pending: deque[Sent]) -> None:
        """Ask now and then how far the arm is: no more often, for each question takes the line for a while."""
        while True:
            await asyncio.sleep(LOOK)
            with suppress(DobotError):  # whoever puts and waits hears of it
                await self._arm.queue.update()

            self._count(pending)

    def _count(self, pending: deque[Sent]) -> DobotError | None:
        """Count what is done; return what the first command that is not has failed with."""
        position, failure = self._position, None
        while pending and pending[0].motion.ended and not failure:
            failure = pending[0].motion.exception()
            if not failure:
                position = pending.popleft().passed(position)

        self._reached(position)
        return failure

    def _reached(self, position: StrokePosition) -> None:
        """Note how far it is, and tell it if strokes were done."""
        before = self.next_stroke
        self._position = position if self._tool == "laser" else StrokePosition(position.stroke)
        self._meter.reached(before, self.next_stroke, asyncio.get_running_loop().time())
