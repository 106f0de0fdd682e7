"""What an arm was taught: steps one after the other, or a path in time. Immutable, and independent of any arm.

    steps    TaughtStep, ...    a place, the way to it, and there: the tool, then a pause
    path     PathSample, ...    where a led arm was at each time

Lengths are mm, angles degrees, times seconds.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, SupportsFloat, cast, get_args

from dobot_async._core.util.arguments import check_choice, check_duration, to_float

__all__ = ["MODES", "Gripper", "Mode", "PathSample", "Recording", "TaughtStep", "said_once"]

Mode = Literal["point", "line", "joints", "jump", "arc"]
MODES: tuple[str, ...] = get_args(Mode)
Gripper = float | Literal["off"]
MOST_NUMBERS = 7
FULLY_OPEN = 100.0
TOOLS = ("suction", "gripper")
BEFORE: Mapping[tuple[str, Any], Any] = {("suction", True): False, ("gripper", 0.0): FULLY_OPEN}
"""What a tool that is first told to take did before that."""


def numbers(values: Any, name: str) -> tuple[float, ...]:
    """Return finite numbers; raise ValueError or TypeError for others."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise TypeError(f"{name} must be numbers, not {values!r}")

    found = tuple(to_float(each, f"each of {name}") for each in cast("Iterable[SupportsFloat]", values))
    if len(found) > MOST_NUMBERS or not all(map(math.isfinite, found)):
        raise ValueError(f"{name} must be at most {MOST_NUMBERS} finite numbers, not {found!r}")

    return found


def word(value: object, name: str) -> None:
    """Raise TypeError or ValueError for what is no text of one line."""
    if not isinstance(value, str):
        raise TypeError(f"{name} must be text, not {value!r}")

    if not value.isprintable():
        raise ValueError(f"{name} must be printable and on one line, not {value!r}")


@dataclass(frozen=True, slots=True)
class TaughtStep:
    """A place, how the arm gets there, and what it does there.

    Attributes:
        pose: Of the tool, in the order of the arm's axes: x, y, z and r; x, y, z, rx, ry and rz; x, y, z and e.
        joints: All joints; () where they are not known.
        mode: "point" moves the joints, to the pose; "line" the tool along a straight line; "joints" the joints, to the
            joints; "jump" lifts the tool, travels and lowers it; "arc" goes along the arc through `via`. The last two
            are a Magician's.
        via: Where an arc goes through, as `pose`; () for the other modes.
        suction: Whether the cup sucks from here on; None leaves it.
        gripper: From here on: percent open, 0 is closed; "off" takes the air from a Magician's; None leaves it.
        pause: Seconds that the arm stays, behind the tool's own time.
        name: What the place is called; "" if it has no name.

    Raises:
        ValueError: A number is out of range, or not finite; there is no such mode.
        TypeError: Something is of the wrong type.
    """

    pose: tuple[float, ...]
    joints: tuple[float, ...] = ()
    mode: Mode = "point"
    via: tuple[float, ...] = ()
    suction: bool | None = None
    gripper: Gripper | None = None
    pause: float = 0.0
    name: str = ""

    def __post_init__(self) -> None:
        check_choice("mode", self.mode, *MODES)
        for each in ("pose", "joints", "via"):
            object.__setattr__(self, each, numbers(getattr(self, each), each))

        if not (self.joints if self.mode == "joints" else self.pose):
            raise ValueError(
                f"a step with the mode {self.mode!r} needs {'joints' if self.mode == 'joints' else 'a pose'}"
            )

        if (self.mode == "arc") != bool(self.via) or (self.via and len(self.via) != len(self.pose)):
            raise ValueError("via is for the mode 'arc', which needs it, with as many numbers as the pose")

        if self.suction is not None:
            object.__setattr__(self, "suction", bool(self.suction))

        if self.gripper is not None and self.gripper != "off":
            percent = to_float(self.gripper, "gripper")
            if not 0 <= percent <= FULLY_OPEN:
                raise ValueError(f"gripper must be 0 (closed) to 100 (open) percent or 'off', not {self.gripper!r}")

            object.__setattr__(self, "gripper", percent)

        object.__setattr__(self, "pause", check_duration(self.pause, "pause"))
        word(self.name, "name")

    @property
    def uses_tool(self) -> bool:
        """Whether it switches a tool."""
        return self.suction is not None or self.gripper is not None


@dataclass(frozen=True, slots=True)
class PathSample:
    """Where an arm was at a time.

    Attributes:
        time: Seconds since the path began.
        joints: All joints.
        pose: Of the tool, as in `TaughtStep`.
    """

    time: float
    joints: tuple[float, ...]
    pose: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", check_duration(self.time, "time"))
        for each in ("joints", "pose"):
            object.__setattr__(self, each, numbers(getattr(self, each), each))

        if not self.joints:
            raise ValueError("a sample needs joints")


@dataclass(frozen=True, slots=True)
class Recording:
    """What an arm was taught.

    Attributes:
        family: "magician", "mycobot" or "ultraarm".
        model: Of a myCobot, such as "mycobot280".
        tool: What was on the arm, in your words.
        tool_offset: What a Magician was told of its tool: mm from the wrist forward, to the left, up; () if not known.
        steps: One after the other.
        path: In time; a recording has steps or a path.
        remarks: What the reader of a file has to say of it; of no effect.

    Raises:
        ValueError: It has both, or the samples are not in the order of their times, or differ in their joints.
    """

    family: str
    model: str = ""
    tool: str = ""
    tool_offset: tuple[float, ...] = ()
    steps: tuple[TaughtStep, ...] = ()
    path: tuple[PathSample, ...] = ()
    remarks: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        for each in ("family", "model", "tool"):
            word(getattr(self, each), each)

        object.__setattr__(self, "tool_offset", numbers(self.tool_offset, "tool_offset"))
        object.__setattr__(self, "steps", tuple(self.steps))
        object.__setattr__(self, "path", tuple(self.path))
        if self.steps and self.path:
            raise ValueError("a recording has steps or a path, not both")

        for number, (one, other) in enumerate(zip(self.path, self.path[1:], strict=False), 2):
            if other.time <= one.time or len(other.joints) != len(one.joints):
                raise ValueError(f"sample {number} of the path must be later than the one before, with as many joints")

    @property
    def duration(self) -> float:
        """Seconds that the path took; 0 for steps."""
        return self.path[-1].time - self.path[0].time if self.path else 0.0

    def reversed(self) -> Recording:
        """Return it from its end to its beginning: the same ways, and the tool as it was before each step.

        Where a part was taken it is put down, and the other way round. A tool that first sucks or closes is taken to
        have been off or open before; else it stays as it is there.
        """
        if self.path:
            end = self.path[-1].time
            return replace(self, path=tuple(replace(each, time=end - each.time) for each in reversed(self.path)))

        before: list[dict[str, Any]] = []
        first = {
            tool: next((now for step in self.steps if (now := getattr(step, tool)) is not None), None) for tool in TOOLS
        }
        state = {tool: BEFORE.get((tool, now)) for tool, now in first.items()}
        for step in self.steps:
            changes = {tool: getattr(step, tool) for tool in state if getattr(step, tool) is not None}
            before.append({tool: state[tool] if tool in changes else None for tool in state})
            state.update(changes)

        found: list[TaughtStep] = []
        for number in range(len(self.steps) - 1, -1, -1):
            # The way to a step, seen from its end, is the way to the step before it.
            way = self.steps[number + 1] if number + 1 < len(self.steps) else None
            found.append(by_way(self.steps[number], way, before[number]))

        return replace(self, steps=tuple(found))

    def thinned(self, tolerance: float = 0.2) -> Recording:
        """Return a path of fewer samples: between two of them each joint goes evenly, to so many degrees.

        Times count: where the arm was held still, or slowed down, a sample stays.

        Args:
            tolerance: Degrees, 0 or more.

        Raises:
            ValueError: It is out of range.
        """
        limit = check_duration(tolerance, "tolerance")
        path = self.path
        if len(path) < 3:
            return self

        kept, spans = {0, len(path) - 1}, [(0, len(path) - 1)]
        while spans:
            start, end = spans.pop()
            misses = [
                (_miss(path[start], each, path[end]), at) for at, each in enumerate(path[start + 1 : end], start + 1)
            ]
            if misses and max(misses)[0] > limit:
                _, at = max(misses)
                kept.add(at)
                spans += [(start, at), (at, end)]

        return replace(self, path=tuple(path[at] for at in sorted(kept)))


def by_way(step: TaughtStep, way: TaughtStep | None, tools: Mapping[str, Any]) -> TaughtStep:
    """Return a step that is reached as another one was, if it can be; from anywhere if that is None."""
    mode: Mode = way.mode if way else "point" if step.pose else "joints"
    if mode == "joints" and not step.joints:
        mode = "point"
    elif mode != "joints" and not step.pose:
        mode = "joints"

    if not way and step.mode == "joints":
        mode = "joints"

    return replace(step, mode=mode, via=way.via if way and mode == "arc" else (), **tools)


def _miss(start: PathSample, each: PathSample, end: PathSample) -> float:
    """By how many degrees a joint is beside an even motion between two samples."""
    share = (each.time - start.time) / (end.time - start.time)
    between = (a + share * (b - a) for a, b in zip(start.joints, end.joints, strict=True))
    return max(abs(here - there) for here, there in zip(each.joints, between, strict=True))


def said_once(steps: Sequence[TaughtStep]) -> tuple[TaughtStep, ...]:
    """Return steps in which the state of a tool is given where it changes, and nowhere else."""
    state: dict[str, Any] = dict.fromkeys(TOOLS)
    found: list[TaughtStep] = []
    for step in steps:
        repeated: dict[str, Any] = {}
        for tool, before in state.items():
            now = getattr(step, tool)
            if now is not None and now == before:
                repeated[tool] = None
            elif now is not None:
                state[tool] = now

        found.append(replace(step, **repeated))

    return tuple(found)
