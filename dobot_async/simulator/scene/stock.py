"""All that stands in a scene: what stands on what, what a piece falls on, what is in the way. Knows no arm.

A piece keeps its carrier (the table, a block, a belt, another piece, an arm's tool) and its placement as the carrier
sees it. So it goes with its carrier, whatever that does, and nothing has to be told.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Protocol

from dobot_async.simulator.scene.geometry import Place3, Placement, Solid
from dobot_async.simulator.scene.things import At, Belt, Block, Piece

__all__ = ["ABOVE_ALL", "Carrier", "RunningBelt", "Standing", "Stock", "Workpiece"]

WIDE, DEEP = 1e6, 1e3  # mm; the table has no end
ABOVE_ALL = 1e6  # mm
SUNK = 3.0  # mm that a piece may be pressed into what it is put on


class Carrier(Protocol):
    """What a piece stands on, or hangs at."""

    @property
    def name(self) -> str:
        """What it is called."""
        ...

    @property
    def placement(self) -> Placement:
        """Where it is now."""
        ...


@dataclass(frozen=True, slots=True)
class Standing:
    """What does not move: the table, a block."""

    name: str
    solid: Solid

    @property
    def placement(self) -> Placement:
        """Where it stands."""
        return self.solid.base


class RunningBelt:
    """A belt and how far it has run.

    Attributes:
        belt: What it is.
        solid: Where it stands.
    """

    def __init__(self, belt: Belt, base: Placement) -> None:
        self.belt = belt
        self.solid: Solid = Solid(base, belt.size)
        self._run = 0.0  # mm before the motor was plugged in
        self._pulses: Callable[[], int] | None = None
        self._from = 0

    @property
    def name(self) -> str:
        """What it is called."""
        return self.belt.name

    @property
    def run(self) -> float:
        """How far it has run, mm."""
        pulses = self._pulses() - self._from if self._pulses else 0
        return self._run + pulses * self.belt.mm_per_pulse

    @property
    def placement(self) -> Placement:
        """Where its cloth is, which pieces go with."""
        return self.solid.base.then(Placement(self.run))

    def plug(self, pulses: Callable[[], int] | None) -> None:
        """Lets a motor, which tells its pulses, drive it from now on; None: nothing does."""
        self._run = self.run
        self._pulses = pulses
        self._from = pulses() if pulses else 0

    def carries(self, placement: Placement) -> bool:
        """Whether the middle of a piece is above it."""
        return self.solid.covers(placement.x, placement.y)


class Workpiece:
    """A piece in a scene, as it is now.

    Attributes:
        piece: What it is.
        carrier: What it stands on, or hangs at.
        offset: Where it is, seen from its carrier.
    """

    def __init__(self, piece: Piece, carrier: Carrier, still: Callable[[], AbstractContextManager[None]]) -> None:
        self.piece = piece
        self.carrier: Carrier = carrier
        self.offset: Placement = Placement()
        self._time_stands_still = still
        self._still: Solid | None = None  # while it stands on what never moves, for most pieces do

    def __repr__(self) -> str:
        return f"<{self.name} at {tuple(round(each, 2) for each in self.position)} on {self.on or 'nothing'}>"

    @property
    def name(self) -> str:
        """What it is called."""
        return self.piece.name

    @property
    def color(self) -> str:
        """Its colour."""
        return self.piece.color

    @property
    def position(self) -> Place3:
        """Where the middle of its lower face is now: x, y, z in mm."""
        with self._time_stands_still():
            return self.placement.place

    @property
    def yaw(self) -> float:
        """How far it is turned about the vertical now, degrees from -180 up to 180."""
        with self._time_stands_still():
            return (self.placement.yaw + 180) % 360 - 180

    @property
    def on(self) -> str:
        """The name of what it stands on; of an arm that holds it, "tool of" and the arm's name."""
        with self._time_stands_still():
            return self.carrier.name

    @property
    def placement(self) -> Placement:
        """Where it was when the scene was last looked at."""
        return self._still.base if self._still else self.carrier.placement.then(self.offset)

    @property
    def solid(self) -> Solid:
        """What it fills."""
        return self._still or Solid(self.placement, self.piece.size)

    @property
    def below(self) -> Iterator[Carrier]:
        """All that it stands on, down to the table."""
        carrier: Carrier = self.carrier
        while isinstance(carrier, Workpiece):
            yield carrier
            carrier = carrier.carrier

        yield carrier

    def hang(self, carrier: Carrier, placement: Placement) -> None:
        """Gives it another carrier, with which it goes from now on."""
        self.carrier, self.offset = carrier, carrier.placement.locate(placement)
        self._still = Solid(placement, self.piece.size) if isinstance(carrier, Standing) else None


class Stock:
    """All that stands in one scene.

    Attributes:
        table: Where everything ends that falls beside all else.
        fixtures: The blocks and belts, each with the height at which it stands.
        belts: The belts.
        pieces: The pieces, by name.
    """

    def __init__(self, table: float, blocks: Iterable[Block], belts: Iterable[Belt]) -> None:
        self.table: Standing = Standing("table", Solid(Placement(z=table - DEEP), (WIDE, WIDE, DEEP)))
        blocks, belts = tuple(blocks), tuple(belts)
        self._blocks = [Standing(each.name, Solid(self._base(each.at, each.yaw), each.size)) for each in blocks]
        self.belts: Sequence[RunningBelt] = [RunningBelt(each, self._base(each.at, each.yaw)) for each in belts]
        self.fixtures: tuple[Block | Belt, ...] = (
            *(replace(each, at=self._base(each.at, each.yaw).place) for each in blocks),
            *(replace(each, at=self._base(each.at, each.yaw).place) for each in belts),
        )
        self.pieces: dict[str, Workpiece] = {}
        names = [each.name for each in self.fixed]
        if len(set(names)) < len(names):
            raise ValueError(f"each thing in a scene has a name of its own; there are {', '.join(names)}")

    @property
    def fixed(self) -> list[Standing | RunningBelt]:
        """All but the pieces."""
        return [self.table, *self._blocks, *self.belts]

    def add(self, piece: Piece, still: Callable[[], AbstractContextManager[None]]) -> Workpiece:
        """Puts a new piece where it is to be, and lets it fall; `still` is what it is read within."""
        if piece.name in self.pieces or piece.name in {each.name for each in self.fixed}:
            raise ValueError(f"there is something called {piece.name!r} in the scene already")

        found = Workpiece(piece, self.table, still)
        self.settle(found, Placement(*piece.at[:2], piece.at[2] if len(piece.at) > 2 else ABOVE_ALL, piece.yaw))
        self.pieces[piece.name] = found
        return found

    def settle(self, piece: Workpiece, placement: Placement) -> None:
        """Lets a piece fall from a placement, onto the highest thing below its middle."""
        ground = max(
            (
                each
                for each in (*self.fixed, *self.others(piece))
                if each.solid.covers(placement.x, placement.y) and each.solid.top <= placement.z + SUNK
            ),
            key=lambda each: each.solid.top,
            default=self.table,
        )
        piece.hang(ground, placement._replace(z=ground.solid.top))

    def others(self, piece: Workpiece | None) -> list[Workpiece]:
        """All pieces but this one and what stands on it."""
        if piece is None:
            return list(self.pieces.values())

        return [each for each in self.pieces.values() if each is not piece and piece not in each.below]

    def surface(self, place: Place3) -> float:
        """How high the highest thing is at, or below, a place."""
        x, y, z = place
        tops = (each.solid.top for each in (*self.fixed, *self.pieces.values()) if each.solid.covers(x, y))
        return max((top for top in tops if top <= z + SUNK), default=self.table.solid.top)

    def leave_belts(self) -> Iterator[Workpiece]:
        """Lets pieces fall that a belt has carried beyond its end; yields each."""
        for piece in self.pieces.values():
            belt = piece.carrier
            if isinstance(belt, RunningBelt) and not belt.carries(piece.placement):
                self.settle(piece, piece.placement)
                yield piece

    def seen(self, start: Place3, end: Place3) -> Workpiece | None:
        """The first piece on a straight line."""
        met = ((each.solid.is_crossed(start, end), each) for each in self.pieces.values())
        return min(
            ((share, each) for share, each in met if share is not None), key=lambda pair: pair[0], default=(0.0, None)
        )[1]

    def _base(self, at: At, yaw: float) -> Placement:
        """Where a block or belt stands."""
        return Placement(*at[:2], at[2] if len(at) > 2 else self.table.solid.top, yaw)
