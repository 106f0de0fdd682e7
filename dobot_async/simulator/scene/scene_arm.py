"""An arm in a scene: the place of its tool, what it grips and releases, its collisions, its drawing.

A family says by a `SceneArm` what a scene has to know of a simulated arm, in the arm's own coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from dobot_async.simulator.device.device import Device
from dobot_async.simulator.scene.geometry import Place3, Placement
from dobot_async.simulator.scene.stock import RunningBelt, Standing, Stock, Workpiece
from dobot_async.simulator.scene.things import ColorSpot, CupTool, GripperTool, LightBeam, Mount, PenTool, Tool

__all__ = ["Event", "SceneArm", "ScenePlace"]

FINGERS = 0.5  # mm by which a gripper has to be wider than a piece to let it go


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened in a scene.

    Attributes:
        time: Simulated seconds.
        kind: What.
        arm: The arm's name; "" for what no arm did.
        what: The piece; of a crash, what was run into.
        place: Where the tip of the tool was; of a piece that a belt lost, where it landed.
    """

    time: float
    kind: Literal["picked", "dropped", "crash", "off the belt"]
    arm: str
    what: str
    place: Place3


class SceneArm(Protocol):
    """What a scene asks of a simulated arm, and does to it."""

    @property
    def arm(self) -> Any:
        """The simulated arm itself."""
        ...

    @property
    def device(self) -> Device:
        """Its device."""
        ...

    @property
    def due(self) -> float:
        """When the next thing happens by itself: a command ends, or a tool follows one; infinity if nothing does."""
        ...

    @property
    def moving(self) -> bool:
        """Whether anything of it moves, its gripper included."""
        ...

    @property
    def rail(self) -> float:
        """Where it stands on its rail, mm; 0 without one."""
        ...

    @property
    def sucks(self) -> bool:
        """Whether its pump makes a cup suck."""
        ...

    @property
    def opening(self) -> float:
        """How far its gripper is open, 0 to 1."""
        ...

    @property
    def switches(self) -> Any:
        """How its sensors are switched; when that changes, it is told again what they see."""
        ...

    def tip(self, tool: Tool) -> Placement:
        """Returns where the tip of a tool is now, in the arm's own coordinates."""
        ...

    def crash(self) -> None:
        """Ends what moves, as what the arm has run into does, with the alarm that this kind of arm has for it."""

    def pulses(self, motor: int) -> int:
        """Returns how many pulses a stepper has made; raises ValueError if the arm has no such stepper."""
        ...

    def turns(self, motor: int) -> bool:
        """Returns whether a stepper turns."""
        ...

    def sees(self, sensor: LightBeam, seen: bool) -> None:
        """Tells it what a light beam sees; raises ValueError if it cannot have one."""

    def sees_color(self, sensor: ColorSpot, flags: tuple[int, int, int]) -> None:
        """Tells it what a colour sensor sees; raises ValueError if it cannot have one."""


class ScenePlace:
    """An arm in a scene; as a carrier it is the tip of the arm's tool.

    Attributes:
        arm: The simulated arm, as its family shows it.
        mount: How it stands.
        held: The piece that it holds.
        moved: Whether it moved when it was looked at last.
    """

    def __init__(self, arm: Any, mount: Mount, stock: Stock, note: Callable[[Event], None]) -> None:
        self.arm: SceneArm = arm
        self.mount = mount
        self.held: Workpiece | None = None
        self.moved: bool = False
        self._stock = stock
        self._note = note
        self._gone: Placement | None = None
        self._tip = self.placement
        self._grip = self.grip
        self._switches = self.arm.switches
        self._drawing: list[Place3] | None = None

    @property
    def name(self) -> str:
        """What a piece that it holds says of its place."""
        return f"tool of {self.mount.name}".rstrip()

    @property
    def placement(self) -> Placement:
        """Where the tip of its tool is, in the scene."""
        if self._gone:
            return self._gone

        mount = Placement(self.mount.x, self.mount.y, self.mount.z, self.mount.yaw)
        if self.mount.rail_yaw is not None:
            along = Placement(yaw=self.mount.rail_yaw).then(Placement(self.arm.rail))
            mount = mount.then(along._replace(yaw=0.0))

        return mount.then(self.arm.tip(self.mount.tool))

    @property
    def grip(self) -> float:
        """The width between its fingers, mm; of a cup 0 while it sucks, else infinity; a pen takes nothing."""
        match self.mount.tool:
            case CupTool(on=on):
                sucks = on(self.arm.arm) if on else self.arm.sucks
                return 0.0 if sucks else math.inf
            case GripperTool(opening=opening):
                return self.arm.opening * opening
            case PenTool():
                return math.inf

    @property
    def changed(self) -> bool:
        """Whether it was switched since it was looked at last; fingers on their way are looked at anyway."""
        if self.arm.switches != self._switches:
            return True

        if isinstance(self.mount.tool, GripperTool) and self.arm.moving:
            return False

        return self.grip != self._grip

    def stand(self) -> None:
        """Takes an arm that does not move to be where it is, however it came there."""
        if not self.moved and not self.arm.moving:
            self._tip = self.placement

    def leave(self) -> None:
        """Lets the arm stay where it is for good."""
        self._gone = self.placement

    def look(self, time: float, draw: Callable[[Place3, list[Place3] | None], list[Place3] | None]) -> None:
        """Takes what has happened since the last look."""
        before, now = self._tip, self.placement
        moves = self.arm.moving
        if moves or self.moved:
            self._run_into(before, now, time)

        self.moved = moves
        self._tip = now
        self._switches = self.arm.switches
        self._take_and_let_go(now, time)
        if isinstance(self.mount.tool, PenTool):
            down = now.z - self._stock.surface(now.place) <= self.mount.tool.touch
            self._drawing = draw(now.place, self._drawing) if down else None

    def _run_into(self, before: Placement, now: Placement, time: float) -> None:
        """Ends the motion if the tool, or what it holds, has run into something."""
        ways = list(self._ways(before, now))
        for each in (*self._stock.fixed, *self._stock.others(self.held)):
            if self._is_between_fingers(each, now):
                continue

            if any(each.solid.is_entered(start, end, self.mount.tool.give) for start, end in ways):
                self._note(Event(time, "crash", self.mount.name, each.name, now.place))
                self.arm.crash()
                return

    def _ways(self, before: Placement, now: Placement) -> Iterator[tuple[Place3, Place3]]:
        """The ways of what can run into something: the tip, and the lower face of what it holds."""
        yield before.place, now.place
        if self.held:
            length, width, _ = self.held.piece.size
            for x, y in ((0, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
                corner = self.held.offset.then(Placement(x * length / 2, y * width / 2))
                yield before.then(corner).place, now.then(corner).place

    def _is_between_fingers(self, each: Standing | RunningBelt | Workpiece, tip: Placement) -> bool:
        """Whether open fingers go down beside a piece, and not onto it."""
        if not isinstance(each, Workpiece) or not isinstance(self.mount.tool, GripperTool):
            return False

        return self.grip > width(each) and self._is_near_axis(each, tip)

    def _is_near_axis(self, piece: Workpiece, tip: Placement) -> bool:
        local = piece.placement.locate(tip)
        return max(abs(local.x), abs(local.y)) <= self.mount.tool.give

    def _take_and_let_go(self, tip: Placement, time: float) -> None:
        """Takes the piece that the tool has closed on, or lets go of the one that it holds."""
        before, self._grip = self._grip, self.grip
        if self.held:
            if self._grip > width(self.held) + FINGERS:
                self._stock.settle(self.held, self.held.placement)
                self._note(Event(time, "dropped", self.mount.name, self.held.name, tip.place))
                self.held = None

            return

        within = [each for each in self._stock.pieces.values() if self._takes(each, tip, before)]
        if within:
            self.held = min(within, key=lambda each: abs(each.solid.top - tip.z))
            self.held.hang(self, self.held.placement)
            self._note(Event(time, "picked", self.mount.name, self.held.name, tip.place))

    def _takes(self, piece: Workpiece, tip: Placement, before: float) -> bool:
        """Whether the tool takes a piece now; `before` is how wide it was."""
        if self._grip > width(piece) or isinstance(piece.carrier, ScenePlace):
            return False

        solid, give = piece.solid, self.mount.tool.give
        if isinstance(self.mount.tool, CupTool):
            return abs(tip.z - solid.top) <= give and solid.covers(tip.x, tip.y)

        return before > width(piece) and solid.base.z - give <= tip.z <= solid.top and self._is_near_axis(piece, tip)


def width(piece: Workpiece) -> float:
    """How wide it is between the fingers of a gripper."""
    return min(piece.piece.size[:2])
