"""The ten programs of examples/compat: the scene that each works in, and where every part belongs in the end."""

from __future__ import annotations

import asyncio
import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Coroutine, Mapping, Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from losing_line import LosingLine

from dobot_async import ColorPort, InfraredPort, Magician
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import SimulatedMagician, Simulation, simulate
from dobot_async.simulator.scene import Belt, Block, ColorSpot, LightBeam, Mount, PenTool, Piece, Scene, Workpiece

__all__ = ["EXAMPLES", "JOBS", "MOTIONS", "Job", "Run", "run"]

EXAMPLES = Path(__file__).parents[2] / "examples" / "compat"
MOTIONS = (c.SET_PTP_CMD, c.SET_PTP_WITH_L_CMD)
V1, V2 = c.AccessoryVersion
ROW = [(230, -60), (250, 0), (230, 60)]
CARRIED = {str(n): (*place, -138) for n, place in enumerate([(190, -80), (190, -20), (190, 40)])}
RAIL = [(200, -60), (230, 0), (200, 60)]
STOCK = [(230, -20), (230, 20), (270, -20), (270, 20), (230, -60), (230, 60)]
STACKED = [(150, 120), (150, 150), (180, 120), (180, 150)]
HANDED = [(230, 80), (230, 120), (190, 120)]
BOXES = {"red": (120, -200), "green": (190, -150), "blue": (240, -60)}
LONGEST = 120  # seconds that a program may take on a busy machine

Sim = Simulation[SimulatedMagician]
Help = Callable[["Run"], Coroutine[Any, Any, None]]


@dataclass
class Job:
    """A program, and what it is to do.

    Attributes:
        program: Its file.
        scene: Makes the scene.
        mounts: How its arms stand in it.
        arguments: What it is told beside its arms.
        speed: How many times faster than a real arm; where a belt is stopped by hand, less.
        help: What a person does meanwhile.
        places: Where each piece is in the end; None looks at `on`.
        on: What each piece is on in the end.
        motions: How many motions it makes at least before it is disturbed.
    """

    program: str
    scene: Callable[[], Scene]
    mounts: tuple[Mount, ...] = (Mount(),)
    arguments: tuple[str, ...] = ()
    speed: float = 40
    help: Help | None = None
    places: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    on: Mapping[str, str] = field(default_factory=dict)
    motions: int = 3

    def check(self, scene: Scene) -> None:
        """Everything is where it belongs, and nothing was run into."""
        assert not scene.crashes
        for name, place in self.places.items():
            assert scene.pieces[name].position == pytest.approx(place, abs=0.2)

        assert {name: scene.pieces[name].on for name in self.on} == self.on


@dataclass
class Run:
    """A program that runs.

    Attributes:
        job: What it does.
        scene: Where.
        sims: Its arms.
        lines: What loses replies between them and the program.
        process: It.
        output: What it has printed.
    """

    job: Job
    scene: Scene
    sims: list[Sim]
    lines: list[LosingLine]
    process: asyncio.subprocess.Process
    output: str = ""
    errors: str = ""

    @property
    def code(self) -> int | None:
        """How it has ended."""
        return self.process.returncode

    def motions(self) -> int:
        """How many motions its arms have made."""
        return sum(each.command in MOTIONS for sim in self.sims for each in sim.arm.executed)

    async def in_the_middle(self) -> None:
        """Wait until it is at work: its arms have made some motions, and one goes on."""
        begun = self.motions()
        await self.until(lambda: self.motions() >= begun + self.job.motions)

    async def until(self, holds: Callable[[], bool]) -> None:
        """Look at the arms again and again until something holds, or the program has ended."""
        while self.code is None and not holds():  # noqa: ASYNC110 - nobody tells when an arm has done something
            await asyncio.sleep(0.01)

    def interrupt(self) -> None:
        """Press Ctrl-C."""
        self.process.send_signal(signal.SIGINT)


async def guide(run: Run) -> None:
    """Guide the arm from place to place, and press Enter at each, as the teaching program asks."""
    assert run.process.stdin
    assert run.process.stdout
    for place in ((250, 0, -53.5), (220, 60, 20), (190, 100, -53.5)):
        line = await run.process.stdout.readline()
        assert b"press Enter" in line
        run.sims[0].arm.guide_to(*place)
        run.process.stdin.write(b"\n")


async def feed(run: Run) -> None:
    """Put the next part in front of the light barrier, each time that the last one was taken away."""
    for number in range(3):
        piece = run.scene.add(Piece(str(number), (250, 0)))
        await run.until(partial(is_at, piece, CARRIED[str(number)]))


def is_at(piece: Workpiece, place: tuple[float, float, float]) -> bool:
    return math.dist(piece.position, place) < 0.2


def row() -> Scene:
    return Scene(pieces=[Piece(str(n), place) for n, place in enumerate(ROW)])


def sorter(version: c.AccessoryVersion, length: float, colors: Sequence[str]) -> Callable[[], Scene]:
    """A belt with parts, the boxes for them, and the sensors, whose infrared one is of a version.

    A belt that the program itself has to stop is stopped later the slower the computer is: its parts are longer.
    """
    return lambda: Scene(
        pieces=[
            Piece(f"{n} {color}", (200 - (length + 5) * n, 120), (length, 20, 20), color)
            for n, color in enumerate(colors)
        ],
        blocks=[Block(f"{color} box", place, (50, 50, 2)) for color, place in BOXES.items()],
        belts=[Belt("belt", (100, 120), (320, 50, 58.5))],
        sensors=[
            LightBeam((230, 145, -70), (230, 95, -70), port=InfraredPort.GP4, version=version),
            ColorSpot((200, -60, -138), (200, -60, -110), port=ColorPort.GP2, version=V2),
        ],
    )


JOBS = {
    job.program: job
    for job in (
        Job("pydobot_pick_and_place.py", row, places=CARRIED),
        Job(
            "pydobot_drawing.py",
            lambda: Scene(blocks=[Block("board", (230, 0), (100, 100, 38.5))]),
            (Mount(tool=PenTool()),),
        ),
        Job(
            "pydobotplus_conveyor_sorter.py",
            sorter(V1, 20, ("blue", "red", "red")),
            speed=20,
            on={"0 blue": "blue box", "1 red": "red box", "2 red": "1 red"},
        ),
        Job(
            "pydobotplus_teach.py",
            lambda: Scene(pieces=[Piece("0", (250, 0))]),
            arguments=("3",),
            help=guide,
            places={"0": (190, 100, -138)},
        ),
        Job(
            "pydobotplus_two_arms.py",
            lambda: Scene(pieces=[Piece(str(n), place) for n, place in enumerate(HANDED)]),
            (Mount(name="one"), Mount(x=500, yaw=180, name="other")),
            places={"0": (310, -80, -138), "1": (310, -120, -138), "2": (350, -150, -138)},
        ),
        Job("dll_pick_and_place.py", row, places=CARRIED),
        Job(
            "dll_rail.py",
            lambda: Scene(pieces=[Piece(str(n), (x, y + 100)) for n, (x, y) in enumerate(RAIL)]),
            (Mount(rail_yaw=90),),
            places={str(n): (x, y + 700, -138) for n, (x, y) in enumerate(RAIL)},
        ),
        Job(
            "dll_io.py",
            lambda: Scene(sensors=[LightBeam((250, 40, -125), (250, -40, -125), pin=4)]),
            arguments=("3",),
            help=feed,
            places=CARRIED,
        ),
        Job(
            "dobotlab_palletise.py",
            lambda: Scene(pieces=[Piece(str(n), place) for n, place in enumerate(STOCK)]),
            places={str(n): (*STACKED[n % 4], -138 + n // 4 * 25) for n in range(6)},
        ),
        Job(
            "dobotlab_conveyor_sorter.py",
            sorter(V2, 30, ("red", "blue")),
            speed=10,
            on={"0 red": "red box", "1 blue": "blue box"},
        ),
    )
}
assert {job.program for job in JOBS.values()} == {path.name for path in EXAMPLES.glob("*.py")}


async def run(job: Job, disturb: Help | None = None, *, lose: int = 0) -> Run:
    """Run a program, as a process of its own, to its end; return what came of it.

    Args:
        job: The program.
        disturb: What happens to it meanwhile.
        lose: The first replies to so many motions are lost, every third one.
    """
    scene = job.scene()
    async with AsyncExitStack() as stack:
        sims = [
            await stack.enter_async_context(
                simulate(scene=scene, mount=mount, listen="tcp://127.0.0.1:0", speed=job.speed)
            )
            for mount in job.mounts
        ]
        for sim in sims:
            async with Magician.connect(sim.url) as arm:
                await arm.home()

        lines = [await stack.enter_async_context(LosingLine(sim.url, lose)) for sim in sims]
        urls = [line.url for line in lines]
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            *("-u", "-W", "error", str(EXAMPLES / job.program)),
            *(() if job.program.startswith("dobotlab") else urls),
            *job.arguments,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=os.environ | {"DOBOT_URL": urls[0]},
        )
        found = Run(job, scene, sims, lines, process)
        helpers = [asyncio.create_task(help_(found)) for help_ in (job.help, disturb) if help_]
        try:
            async with asyncio.timeout(LONGEST):
                await asyncio.gather(*helpers)
                output, errors = await process.communicate()
        except BaseException:
            process.kill()
            await process.communicate()
            raise
        finally:
            for helper in helpers:
                helper.cancel()

            await asyncio.gather(*helpers, return_exceptions=True)

        found.output, found.errors = output.decode(), errors.decode()
        for sim in sims:
            assert sim.arm.device.idle, "an arm goes on after its program has ended"

        scene.refresh()
        return found
