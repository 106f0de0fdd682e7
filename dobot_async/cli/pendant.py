"""The terminal as a teach pendant: keys jog the arm while they are held, take points, and switch the tool."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass, field
from typing import Any

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.cli.keys import Key, KeyReader
from dobot_async.errors import ArmAlarm, CommandRejected, MotionStopped, UnsupportedError
from dobot_async.teaching import Recorder, TaughtStep, play
from dobot_async.teaching.base import TaughtArm

__all__ = ["HELP", "Pendant"]

HELP = """\
arrows, page up/down   jog the tool along x, y, z while held      [ ]     turn it
tab                    the same keys jog joints 1 to 3            1 to 7  the joint that [ ] jog then
space                  take this point       l  go to the next ones by lines, or not
g  gripper   s  suction, where the arm stands       w  stay 0.5 s longer at the last point
u  undo   p  play it, h  drive home (any key stops)   c  recover from alarms
?  this   q  save, and end"""

TOOL = {"up": "x+", "down": "x-", "left": "y+", "right": "y-", "pageup": "z+", "pagedown": "z-"}
JOINTS = {"up": "j2+", "down": "j2-", "left": "j1+", "right": "j1-", "pageup": "j3+", "pagedown": "j3-"}
TURNS = {"]": "+", "[": "-"}
LONGER = 0.5
RECENTLY = 1.0
TOLD = (ArmAlarm, CommandRejected, MotionStopped, UnsupportedError, ValueError)
"""What is told, and does not end the teaching: the arm stands, and the next key may be another one."""


@dataclass(slots=True)
class Pendant:
    """What the keys do.

    Attributes:
        recorder: What takes the points.
        taught: The arm, as teaching knows it.
        keys: Of the terminal.
        say: Tells a line.
        speed: Percent, of jogs and of what is played.
        by_joints: Whether the keys jog joints.
        joint: Which one [ and ] jog then.
        by_lines: Whether points are to be reached by straight lines.
        tools: What they were told last.
    """

    recorder: Recorder
    taught: TaughtArm
    keys: KeyReader
    say: Callable[[str], None]
    speed: float
    by_joints: bool = False
    joint: int = 4
    by_lines: bool = False
    tools: dict[str, bool] = field(default_factory=dict[str, bool])

    async def run(self) -> None:
        """Do what the keys say, until q, or until the terminal is closed."""
        self.say(HELP)
        while (key := await self.keys.next()) and key.name != "q":
            try:
                await self.press(key)
            except TOLD as error:
                self.say(f"{type(error).__name__}: {error}")

    async def press(self, key: Key) -> None:
        """Do what one key says."""
        direction = self.direction(key.name)
        if direction:
            await self.jog(key, direction)
        elif key.name.isdigit():
            self.joint = int(key.name)
            self.say(f"[ and ] jog joint {self.joint}, where the keys jog joints")
        elif key.name in ACTIONS:
            await ACTIONS[key.name](self, key)

    def direction(self, name: str) -> str:
        """Return the word of the jog that a key is for; "" if it is for none."""
        if name in TURNS:
            axis = f"j{self.joint}" if self.by_joints else self.taught.turn
            return f"{axis}{TURNS[name]}" if axis else ""

        return (JOINTS if self.by_joints else TOOL).get(name, "")

    async def jog(self, key: Key, direction: str) -> None:
        """Jog while a key is held; one that was typed ahead does nothing."""
        if self.keys.is_fresh(key):
            async with self.taught.jogging(direction, self.speed):
                await self.keys.released(key)

    async def take(self, _: Key) -> None:
        """Take the point where the arm is."""
        self.tell(await self.recorder.point(mode="line" if self.by_lines else None))

    async def switch_gripper(self, _: Key) -> None:
        """Close it, or open it."""
        await self.switch("gripper", self.recorder.gripper)

    async def switch_suction(self, _: Key) -> None:
        """Suck, or let go."""
        await self.switch("suction", self.recorder.suction)

    async def switch(self, tool: str, verb: Callable[[bool], Awaitable[None]]) -> None:
        """Switch a tool to what it was not told last."""
        wanted = not self.tools.get(tool, False)
        await verb(wanted)
        self.tools[tool] = wanted
        self.tell(self.recorder.recording.steps[-1])

    async def undo(self, _: Key) -> None:
        """Take the last point back."""
        step = self.recorder.undo()
        self.say(f"took back point {self.count + 1}" if step else "there is nothing to take back")

    async def stay(self, _: Key) -> None:
        """Stay longer at the last point."""
        steps = self.recorder.recording.steps
        if steps:
            self.tell(self.recorder.change_last(pause=steps[-1].pause + LONGER))

    async def toggle_joints(self, _: Key) -> None:
        """Jog joints, or the tool."""
        self.by_joints = not self.by_joints
        self.say(f"the keys jog {'joints' if self.by_joints else 'the tool'}")

    async def toggle_lines(self, _: Key) -> None:
        """Reach the next points by lines, or not."""
        self.by_lines = not self.by_lines
        self.say(f"points are reached {'by lines' if self.by_lines else 'as the joints like'}")

    async def help(self, _: Key) -> None:
        """Tell what the keys do."""
        self.say(HELP)

    async def recover(self, _: Key) -> None:
        """Get the arm out of its alarms."""
        await self.recorder.arm.recover()
        self.say("recovered")

    async def play(self, key: Key) -> None:
        """Play what was taken; any key stops the arm."""
        if not self.keys.is_fresh(key, RECENTLY):
            return

        await self.watched(play(self.recorder.arm, self.recorder.recording, speed=self.speed), "played")

    async def home(self, key: Key) -> None:
        """Drive home; any key stops the arm."""
        if self.keys.is_fresh(key, RECENTLY):
            await self.watched(self.recorder.arm.home(), "home")

    async def watched(self, motion: Coroutine[Any, Any, None], done: str) -> None:
        """Do something that any key stops."""
        moving, pressing = asyncio.create_task(motion), asyncio.create_task(self.keys.next())
        try:
            await asyncio.wait([moving, pressing], return_when=asyncio.FIRST_COMPLETED)
            ended = moving.done()
        finally:
            await cancel_and_join(moving)
            await cancel_and_join(pressing)

        if ended:
            moving.result()

        self.say(done if ended else "stopped")

    def tell(self, step: TaughtStep) -> None:
        """Tell what the last point is."""
        axes = zip(self.taught.limits.axes, step.pose, strict=True)
        words = [f"{axis} {value:.1f}" for axis, value in axes]
        words += [step.mode] if step.mode != self.taught.mode else []
        words += [] if step.suction is None else [f"suction {'on' if step.suction else 'off'}"]
        words += [] if step.gripper is None else [f"gripper {step.gripper:g}"] if step.gripper != "off" else []
        words += [f"stay {step.pause:g} s"] if step.pause else []
        self.say(f"point {self.count}: {'  '.join(words)}")

    @property
    def count(self) -> int:
        """How many points there are."""
        return len(self.recorder.recording.steps)


ACTIONS: dict[str, Callable[[Any, Key], Awaitable[None]]] = {
    "space": Pendant.take,
    "g": Pendant.switch_gripper,
    "s": Pendant.switch_suction,
    "u": Pendant.undo,
    "w": Pendant.stay,
    "l": Pendant.toggle_lines,
    "p": Pendant.play,
    "h": Pendant.home,
    "c": Pendant.recover,
    "tab": Pendant.toggle_joints,
    "?": Pendant.help,
}
