"""An arm as the panel shows and moves it: what is the same for all families, and what each has to say of itself."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import AsyncGenerator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from typing import Any, ClassVar

from dobot_async.panel.problems import PanelRefusal
from dobot_async.teaching.registry import taught
from dobot_async.toolpath import reach_of

__all__ = ["ArmView", "Part", "Point", "Tools"]

Point = tuple[float, float, float]
DIRECTION = re.compile(r"(?P<axis>[a-z]+\d?)(?P<way>[+-])")
JOINT = re.compile(r"j(\d)")
STEPS = {"mm": [0.1, 1.0, 10.0, 50.0], "degrees": [0.1, 1.0, 5.0, 15.0]}
EVERY_ARM = ("home", "jog", "move_to", "move_joints", "check", "pause", "alarms", "recover", "follow", "teach", "draw")


@dataclass(frozen=True, slots=True)
class Part:
    """What stands between two neighbouring points of `ArmView.points`, as a picture has it.

    Attributes:
        name: Such as "forearm".
        kind: "cylinder" or "box".
        radius: Half of its thickness, mm.
    """

    name: str
    kind: str
    radius: float


@dataclass(slots=True)
class Tools:
    """What the arm was told of its tools through this panel; None where nothing was.

    Attributes:
        suction: Whether the cup sucks.
        gripper: Percent open.
        laser: Whether it is on.
        conveyor: Pulses/s of each motor that runs.
        outputs: The levels of pins.
    """

    suction: bool | None = None
    gripper: float | None = None
    laser: bool | None = None
    conveyor: dict[int, int] | None = None
    outputs: dict[int, bool] | None = None

    def stopped(self) -> None:
        """A stop switches off what burns or turns."""
        self.laser = False if self.laser is not None else None
        self.conveyor = {} if self.conveyor is not None else None

    @property
    def dangerous(self) -> bool:
        """Whether something burns or turns."""
        return bool(self.laser or self.conveyor)


class ArmView(ABC):
    """See the module.

    Attributes:
        arm: The arm.
        tools: What its tools were told.
        percent: Of the arm's speed, for motions; None leaves it as it is.
    """

    family: ClassVar[str]
    features: ClassVar[tuple[str, ...]] = ()
    """What it has beside `EVERY_ARM`."""

    parts: Sequence[Part]
    jogs_at = "percent"
    pins: ClassVar[Mapping[str, Sequence[int]]] = {"outputs": (), "inputs": ()}

    def __init__(self, arm: Any) -> None:
        self.arm = arm
        self.tools: Tools = Tools()
        self.percent: float | None = None
        self._taught = taught(arm)
        self._jogs_at: float | None = None
        self._jogs = AsyncExitStack()

    @property
    @abstractmethod
    def title(self) -> str:
        """What people call it."""

    @property
    @abstractmethod
    def joint_limits(self) -> Sequence[tuple[float, float]]:
        """Least and greatest of each joint, degrees."""

    @property
    @abstractmethod
    def words(self) -> Sequence[str]:
        """The directions in which it jogs."""

    @abstractmethod
    def points(self, joints: Sequence[float]) -> list[Point]:
        """Return where foot, joints and tool are, mm in the arm's coordinates."""

    @abstractmethod
    async def move_to(self, place: Mapping[str, float], *, line: bool) -> None:
        """Move the tool; coordinates that are not given stay."""

    @property
    def model(self) -> str:
        """Which model of its family it is."""
        return self._taught.model or self.family

    @property
    def axes(self) -> Sequence[str]:
        """The names of its coordinates."""
        return tuple(self._taught.limits.axes)

    @property
    def modes(self) -> Sequence[str]:
        """How a taught step is reached, the usual one first."""
        first = self._taught.mode
        return (first, *(each for each in self._taught.limits.modes if each not in {first, "arc"}))

    def describe(self) -> dict[str, Any]:
        """Return what a page has to know of it before it shows anything."""
        joint = [word for word in self.words if JOINT.match(word)]
        return {
            "family": self.family,
            "model": self.model,
            "title": self.title,
            "joints": [
                {"name": f"j{number}", "min": low, "max": high}
                for number, (low, high) in enumerate(self.joint_limits, 1)
            ],
            "axes": [{"name": axis, "unit": "mm" if axis in "xyz" else "degrees"} for axis in self.axes],
            "jog": {"tool": [word for word in self.words if word not in joint], "joint": joint},
            "steps": STEPS,
            "features": [*EVERY_ARM, *self.features],
            "pins": {use: list(pins) for use, pins in self.pins.items()},
            "shape": [{"kind": part.kind, "radius": part.radius, "name": part.name} for part in self.parts],
            "jogs_at": self.jogs_at,
            "gripper": "percent" if "gripper_to" in self.features else "switch",
            "modes": list(self.modes),
        }

    def pose(self, pose: Any) -> dict[str, float]:
        """Return the coordinates of a pose."""
        return {axis: float(getattr(pose, axis)) for axis in self.axes}

    def check_place(self, place: Mapping[str, float], now: Mapping[str, float]) -> None:
        """Raise ValueError for a place that the arm cannot reach; what is not given is as it is now."""
        self._taught.limits.check_pose([place.get(axis, now.get(axis, 0.0)) for axis in self.axes])

    def check_joints(self, joints: Sequence[float]) -> None:
        """Raise ValueError for joints that it cannot take."""
        if len(joints) != len(self.joint_limits):
            raise ValueError(f"this arm has {len(self.joint_limits)} joints, not {len(joints)}")

        self._taught.limits.check_joints(joints)

    def reaches(self, x: float, y: float, z: float) -> bool:
        """Return whether the tool can be at a place, however it is turned."""
        try:
            reach_of(self.arm)((x, y, z))
        except ValueError:
            return False

        return True

    def is_harmless(self, alarm: object) -> bool:  # noqa: ARG002 - most arms tell nothing else
        """Return whether an alarm keeps the arm from nothing."""
        return False

    async def begin(self) -> None:  # noqa: B027 - most arms have no queue of their own
        """Let nothing that an earlier program has left in the arm's own queue begin to move."""

    async def move_joints(self, joints: Sequence[float]) -> None:
        """Move the joints."""
        await self.arm.move_joints(*joints)

    async def step(self, direction: str, size: float) -> None:
        """Go one step, mm or degrees."""
        found = DIRECTION.fullmatch(direction)
        if not found or direction not in self.words:
            raise ValueError(f"direction must be one of {' '.join(self.words)}, not {direction!r}")

        way = size if found["way"] == "+" else -size
        if joint := JOINT.fullmatch(found["axis"]):
            joints = list(await self.arm.get_joints())
            joints[int(joint[1]) - 1] += way
            await self.move_joints(joints)
        else:
            await self.arm.move_by(**{found["axis"]: way})

    @asynccontextmanager
    async def jogging(self, direction: str, percent: float) -> AsyncGenerator[None, None]:
        """Jog until the block ends, at so many percent of the arm's speed of jogs.

        The speed is set once, and set back by `end_jogs`: between a press and the motion there is no time for it.
        """
        if self._jogs_at != percent:
            await self.end_jogs()
            await self._jogs.enter_async_context(self._taught.jogs(percent))
            self._jogs_at = percent

        async with self._taught.jogging(direction, percent):
            yield

    async def end_jogs(self) -> None:
        """Set back what jogs have set."""
        self._jogs_at = None
        await self._jogs.aclose()

    def following(self, max_speed: float) -> AbstractAsyncContextManager[Any]:
        """Follow a target until the block ends."""
        block: AbstractAsyncContextManager[Any] = self.arm.following(max_speed=max_speed)
        return block

    async def set_speed(self, percent: float) -> None:
        """Set how fast motions are from here on."""
        self.percent = percent

    async def suction(self, on: bool) -> None:
        """Suck, or let go."""
        await self.arm.suction(on)
        self.tools.suction = on

    async def gripper(self, closed: bool) -> None:
        """Close or open the gripper."""
        await self.arm.gripper(closed)
        self.tools.gripper = 0.0 if closed else 100.0

    async def gripper_to(self, percent: float) -> None:
        """Open the gripper to a percentage."""
        await self.arm.gripper_to(percent)
        self.tools.gripper = percent

    async def laser(self, on: bool) -> None:
        """Switch the laser."""
        self.tools.laser = on or self.tools.laser
        await self.arm.laser(on)
        self.tools.laser = on

    async def conveyor(self, speed: int, motor: int) -> None:  # noqa: ARG002 - where there is one
        """Run a belt's motor, pulses/s."""
        raise PanelRefusal("unsupported", f"{self.title} has no motor for a belt")

    async def rail(self, on: bool) -> None:  # noqa: ARG002 - as above
        """Declare that the arm stands on a rail."""
        raise PanelRefusal("unsupported", f"{self.title} has no rail")

    async def move_rail(self, mm: float) -> None:  # noqa: ARG002 - as above
        """Drive along the rail."""
        raise PanelRefusal("unsupported", f"{self.title} has no rail")

    async def configure_pin(self, pin: int, use: str) -> None:  # noqa: ARG002 - as above
        """Say what a pin is used for."""
        raise PanelRefusal("unsupported", f"{self.title} has no pins")

    async def output(self, pin: int, level: bool) -> None:  # noqa: ARG002 - as above
        """Set an output."""
        raise PanelRefusal("unsupported", f"{self.title} has no outputs")

    async def input(self, pin: int) -> bool:  # noqa: ARG002 - as above
        """Return the level of an input."""
        raise PanelRefusal("unsupported", f"{self.title} has no inputs")

    async def end_effector(self, tool: str) -> None:  # noqa: ARG002 - as above
        """Say which tool is on the arm."""
        raise PanelRefusal("unsupported", f"{self.title} is not told of its tool")

    async def power(self) -> None:
        """Let the motors hold."""
        raise PanelRefusal("unsupported", f"the motors of {self.title} always hold")

    async def rail_place(self) -> float | None:
        """Return where the arm stands on its rail; None if it has none."""
        return None

    def drawing_options(self, speed: float | None) -> dict[str, Any]:
        """Return what `Drawing` takes for a speed in mm/s."""
        return {} if speed is None else {"speed": speed}
