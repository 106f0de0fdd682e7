"""What stands around simulated arms: pieces that they carry, a belt, sensors, a table and blocks to run into.

    Device.advance --> Scene.advance(clock) --> every arm's Device.run(t), all arms up to the same time
                                 |
                                 '--> look(t): what was run into, taken, let go, drawn, seen

The scene has no task and never sleeps. It looks at the exact time of each event of an arm (a motion ends, a command is
executed), when a tool grips otherwise than before, and every 10 simulated ms while something moves that concerns it.
How often somebody reads or writes changes nothing. A look costs a few steps of arithmetic for each piece and arm.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager
from functools import partial
from types import MappingProxyType
from typing import Any

from dobot_async.arms.registry import Parts
from dobot_async.simulator.scene.geometry import Place3, Placement
from dobot_async.simulator.scene.scene_arm import Event, SceneArm, ScenePlace
from dobot_async.simulator.scene.stock import ABOVE_ALL, RunningBelt, Stock, Workpiece
from dobot_async.simulator.scene.things import SEEN, Belt, Block, ColorSpot, LightBeam, Mount, Piece

__all__ = ["Scene"]

ARMS: Parts[Callable[[Any], SceneArm]] = Parts("scene")
"""What a scene has to know of a simulated arm, by the arm's name."""

STEP = 0.01  # simulated seconds between two looks
EVENTS = 10_000
SAME_POINT = 0.001  # mm
DARK = (0, 0, 0)


class Scene:
    """A scene, which one simulated arm works in, or several.

    `simulate(..., scene=scene, mount=Mount(...))` puts an arm into it. Arms of one scene share the clock, and so the
    speed, of the first one. Once all have left, others can come, and find everything where it was left.

    Args:
        pieces: What can be picked up. They are put down one after the other, so that one can stand on another.
        blocks: What stands where it is.
        belts: Conveyor belts.
        sensors: Light beams and colour sensors.
        table: How high the table is, mm; by default where it is seen from a Magician that stands on it.

    Raises:
        ValueError: Two things have one name, or the table is nowhere.
    """

    def __init__(
        self,
        *,
        pieces: Iterable[Piece] = (),
        blocks: Iterable[Block] = (),
        belts: Iterable[Belt] = (),
        sensors: Iterable[LightBeam | ColorSpot] = (),
        table: float = -138.0,
    ) -> None:
        if not math.isfinite(table):
            raise ValueError(f"table is a finite height in mm, not {table!r}")

        self._stock = Stock(table, blocks, belts)
        self._sensors = tuple(sensors)
        self._arms: list[ScenePlace] = []
        self._events: deque[Event] = deque(maxlen=EVENTS)
        self._strokes: list[list[Place3]] = []
        self._clock: Callable[[], float] = lambda: self._time
        self._speed = 1.0
        self._time = 0.0
        self._busy = self._stirred = False
        for piece in pieces:
            self.add(piece)

    # What can be seen of it.

    @property
    def time(self) -> float:
        """Simulated seconds of the arms in it."""
        self.refresh()
        return self._time

    @property
    def pieces(self) -> Mapping[str, Workpiece]:
        """The pieces by name: `scene.pieces["red"].position` is x, y, z of the middle of its lower face."""
        self.refresh()
        return MappingProxyType(self._stock.pieces)

    @property
    def fixtures(self) -> tuple[Block | Belt, ...]:
        """The blocks and belts, each `at` with its height."""
        return self._stock.fixtures

    @property
    def sensors(self) -> tuple[LightBeam | ColorSpot, ...]:
        """The light beams and colour sensors."""
        return self._sensors

    @property
    def table(self) -> float:
        """How high the table is, mm."""
        return self._stock.table.solid.top

    @property
    def events(self) -> tuple[Event, ...]:
        """What has happened so far, in order: picked, dropped, crash, off the belt; the last 10,000."""
        self.refresh()
        return tuple(self._events)

    @property
    def crashes(self) -> tuple[Event, ...]:
        """What arms have run into."""
        return tuple(each for each in self.events if each.kind == "crash")

    @property
    def drawing(self) -> tuple[tuple[Place3, ...], ...]:
        """What pens have drawn: a stroke for each time that one was down, with the true way of its tip."""
        self.refresh()
        return tuple(map(tuple, self._strokes))

    # What a hand does in it.

    def add(self, piece: Piece) -> Workpiece:
        """Puts a piece into the scene, such as the next one onto a belt; raises ValueError if its name is taken."""
        with self.still():
            self._stirred = True
            return self._stock.add(piece, self.still)

    def put(self, name: str, x: float, y: float, z: float | None = None) -> None:
        """Takes a piece and puts it elsewhere; it falls from z (mm) onto what is below it, by default from above all.

        Raises:
            KeyError: There is no such piece.
        """
        with self.still():
            piece = self._stock.pieces[name]
            self._take_out_of_hand(piece)
            self._stock.settle(piece, Placement(x, y, ABOVE_ALL if z is None else z, piece.placement.yaw))
            self._stirred = True

    def remove(self, name: str) -> None:
        """Takes a piece away; what stood on it falls.

        Raises:
            KeyError: There is no such piece.
        """
        with self.still():
            piece = self._stock.pieces.pop(name)
            self._take_out_of_hand(piece)
            for each in self._stock.pieces.values():
                if each.carrier is piece:
                    self._stock.settle(each, each.placement)

            self._stirred = True

    # What a simulation does.

    def share_clock(self, clock: Callable[[], float], speed: float) -> Callable[[], float]:
        """Returns the clock of the scene for a new arm: this one for the first, else that of the first.

        Raises:
            ValueError: The arms in it have another speed.
        """
        if not self._arms:
            self._clock, self._speed = clock, speed
            self._time = clock()
        elif speed != self._speed:
            raise ValueError(f"arms of one scene share their time: speed={self._speed!r}, as the first, not {speed!r}")

        return self._clock

    def attach(self, model: str, arm: Any, mount: Mount | None = None) -> Callable[[], None]:
        """Puts a simulated arm into the scene, at the origin if not told where; returns what takes it out again.

        Raises:
            ValueError: The name of the mount is taken, no scene is known for this model, or what is plugged into the
                arm does not fit into it.
        """
        if model not in ARMS:
            raise ValueError(f"a scene is made for {', '.join(ARMS)}, not for {model!r}")

        self.refresh()
        mount = mount or Mount()
        if mount.name in {scene_arm.mount.name for scene_arm in self._arms}:
            raise ValueError(f"an arm is called {mount.name!r} in the scene already: give each mount a name=")

        shown = ARMS[model](arm)
        for belt in self._belts_of(mount):
            shown.pulses(belt.belt.motor)

        scene_arm = ScenePlace(shown, mount, self._stock, self._events.append)
        self._tell(scene_arm)
        for belt in self._belts_of(mount):
            belt.plug(partial(shown.pulses, belt.belt.motor))

        self._arms.append(scene_arm)
        shown.device.scene = self
        return lambda: self._detach(scene_arm)

    def advance(self, until: float) -> None:
        """Brings all arms and everything else up to a simulated time; does nothing where an arm itself calls."""
        if self._busy:
            return

        self._busy = True
        try:
            for scene_arm in self._arms:
                scene_arm.stand()

            self._go(max(until, self._time))
        finally:
            self._busy = False

    def refresh(self) -> None:
        """Brings everything up to the clock."""
        self.advance(self._clock())

    @contextmanager
    def still(self) -> Generator[None]:
        """Brings everything up to the clock, and lets no time pass within a block: all that is read there fits."""
        self.refresh()
        busy, self._busy = self._busy, True
        try:
            yield
        finally:
            self._busy = busy

    def _go(self, until: float) -> None:
        while True:
            if any(scene_arm.changed for scene_arm in self._arms):
                self._look()

            event = min((scene_arm.arm.due for scene_arm in self._arms), default=math.inf)
            step = next_step(self._time) if self._stirs() else math.inf
            self._stirred = self._stirred or step < math.inf
            time = min(until, max(self._time, min(event, step)))
            for scene_arm in self._arms:
                scene_arm.arm.device.run(time)

            self._time = time
            if time in {event, step}:
                self._look()

            if time >= until:
                return

    def _stirs(self) -> bool:
        """Whether something moves that concerns the scene, or did at the last look."""
        if self._stirred or any(scene_arm.arm.moving for scene_arm in self._arms):
            return True

        return any(
            scene_arm.arm.turns(belt.belt.motor)
            for scene_arm in self._arms
            for belt in self._belts_of(scene_arm.mount)
            if any(belt in piece.below for piece in self._stock.pieces.values())
        )

    def _look(self) -> None:
        """Takes what has happened by now."""
        self._stirred = False
        for scene_arm in self._arms:
            scene_arm.look(self._time, self._draw)

        for piece in self._stock.leave_belts():
            self._events.append(Event(self._time, "off the belt", "", piece.name, piece.placement.place))

        for scene_arm in self._arms:
            self._tell(scene_arm)

    def _tell(self, scene_arm: ScenePlace) -> None:
        """Tells an arm what its sensors see."""
        for sensor in self._sensors:
            if sensor.arm == scene_arm.mount.name:
                seen = self._stock.seen(sensor.at, sensor.to)
                if isinstance(sensor, LightBeam):
                    scene_arm.arm.sees(sensor, seen is not None)
                else:
                    scene_arm.arm.sees_color(sensor, SEEN.get(seen.color, DARK) if seen else DARK)

    def _draw(self, tip: Place3, stroke: list[Place3] | None) -> list[Place3]:
        """Draws on from a stroke, or begins another one."""
        if stroke is None:
            self._strokes.append(stroke := [])

        if not stroke or math.dist(stroke[-1], tip) > SAME_POINT:
            stroke.append(tip)

        return stroke

    def _take_out_of_hand(self, piece: Workpiece) -> None:
        for scene_arm in self._arms:
            if scene_arm.held is piece:
                scene_arm.held = None

    def _belts_of(self, mount: Mount) -> list[RunningBelt]:
        return [belt for belt in self._stock.belts if belt.belt.arm == mount.name]

    def _detach(self, scene_arm: ScenePlace) -> None:
        """Takes an arm out; what it holds stays where it is."""
        with self.still():
            scene_arm.leave()
            for belt in self._belts_of(scene_arm.mount):
                belt.plug(None)

        scene_arm.arm.device.scene = None
        self._arms.remove(scene_arm)
        if not self._arms:
            self._clock = lambda: self._time


def next_step(time: float) -> float:
    """The first multiple of STEP after a time, whichever way its division is rounded."""
    number = math.floor(time / STEP)
    return next(number * STEP for number in (number, number + 1, number + 2) if number * STEP > time)
