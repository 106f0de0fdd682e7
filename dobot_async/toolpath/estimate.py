"""How long a drawing takes: it is drawn in the simulator, in no time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, SupportsFloat

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as m
from dobot_async.arms.magician import frame as magician_frame
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.kinematics import Kinematics
from dobot_async.arms.mycobot import frame as cobot_frame
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.models import MODELS, CobotModel
from dobot_async.arms.ultraarm import commands as u
from dobot_async.arms.ultraarm import frame as ultraarm_frame
from dobot_async.arms.ultraarm.arm import UltraArm
from dobot_async.errors import UnsupportedError
from dobot_async.simulator.magician.arm import MAGICIAN, SimulatedMagician
from dobot_async.simulator.mycobot.arm import SimulatedMyCobot
from dobot_async.simulator.mycobot.body import MYCOBOT
from dobot_async.simulator.ultraarm.arm import ULTRAARM, SimulatedUltraArm, UltraArmQuirks
from dobot_async.toolpath.moves import MoveKind, Tool, approach
from dobot_async.toolpath.plane import Place, WorkPlane
from dobot_async.toolpath.programs import CobotProgram, DrawingPace, DrawingProgram, MagicianProgram, UltraArmProgram
from dobot_async.toolpath.schedule import RATE, TOLERANCE, planned
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["Estimate", "estimate"]

ROOM = 1_000_000
HOMING = 1e3  # seconds in which an arm is at home
BETWEEN = 0.14  # seconds from the end of a myCobot's motion until it was seen to stand, and the next one begins
END = 1e9  # seconds; by then every drawing is done


@dataclass(frozen=True, slots=True)
class Estimate:
    """How long a drawing takes.

    Attributes:
        seconds: From where the arm stands after it was switched on to the end.
        drawn: mm along strokes.
        travel: mm beside them.
        stroke_ends: For each stroke, after how many seconds it is done.
    """

    seconds: float
    drawn: float
    travel: float
    stroke_ends: tuple[float, ...]


class Clock:
    """The time of a simulation, which is set.

    Attributes:
        now: Seconds.
    """

    def __init__(self) -> None:
        self.now: float = 0.0

    def __call__(self) -> float:
        return self.now


class Bench:
    """A simulated arm that is told what to do by its bytes.

    Attributes:
        arm: The simulated arm.
        here: Where it stands.
        program: How it is told.
        between: Seconds that pass between two motions of an arm that is given one at a time.
    """

    def __init__(
        self,
        arm: Any,
        encode: Callable[[Command[Any, Any], bytes], bytes],
        here: Place,
        program: DrawingProgram,
        between: float = 0.0,
    ) -> None:
        self.arm = arm
        self.between = between
        self.here = here
        self.program = program
        self._encode = encode
        self._session = arm.session()

    def put(self, row: Command[Any, Any], value: Any) -> None:
        """Queue a command."""
        self._session.receive(self._encode(row, row.request.encode(value)))


def estimate(
    toolpath: Toolpath,
    plane: WorkPlane,
    *,
    arm: Any = "magician",
    tool: Tool = "pen",
    speed: SupportsFloat | None = None,
    tolerance: SupportsFloat = TOLERANCE,
    acceleration: float = 100.0,
    percent: int = 20,
    constant_speed: bool = False,
    rate: SupportsFloat | None = RATE,
) -> Estimate:
    """Return how long a drawing takes, by drawing it with a simulated arm. It takes two seconds for 10,000 points.

    The arm is taken to have its usual speeds for moves above the paper (`PTPCommonParams` 50 % of a Magician).

    Args:
        toolpath: What to draw.
        plane: Where the paper lies.
        arm: A connected arm; or "magician", "ultraarm", or a myCobot's model.
        tool: "pen" or "laser".
        speed: As for `Drawing`; so are the others.
        tolerance: mm.
        acceleration: mm/s².
        percent: Of a myCobot's speed.
        constant_speed: Of an ultraArm whose firmware takes the ramps away when it is told to.
        rate: Commands per second.

    Raises:
        ValueError: The simulated arm cannot draw it: it tells the stroke.
        TypeError: There is no simulator for this.
    """
    clock = Clock()
    path = toolpath.simplify(tolerance)
    strokes = planned(path, plane, tool, speed, rate) if path.strokes else []
    moves = [move for some in strokes for move in some]
    if not moves:
        return Estimate(0.0, 0.0, 0.0, ())

    bench = bench_of(arm, clock, tool, DrawingPace(acceleration, percent, bool(constant_speed)), moves[0].place)

    instructions = list(bench.program.instructions(approach(bench.here, moves, plane) + moves))
    begun, before = clock.now, len(bench.arm.executed)
    for each in instructions:
        bench.put(each.row, each.value)

    clock.now = END
    done = bench.arm.executed[before:]
    ends: dict[int, float] = {}
    for number, (each, record) in enumerate(zip(instructions, done, strict=False)):
        stroke = each.move.stroke if each.move else None
        if record.outcome != "done":
            raise ValueError(f"stroke {stroke} cannot be drawn by the simulated arm")

        if each.move and each.move.kind in {MoveKind.DRAW, MoveKind.LIFT}:
            ends[each.move.stroke] = record.finished - begun + number * bench.between

    if len(done) < len(instructions):
        raise ValueError(f"stroke {len(ends)} cannot be drawn by the simulated arm")

    seconds = done[-1].finished - begun + len(done) * bench.between
    return Estimate(seconds, path.length, path.travel, tuple(ends.values()))


def magician(kinematics: Kinematics, clock: Clock, tool: Tool, pace: DrawingPace) -> Bench:
    """A Magician with its tool, at home."""
    arm = SimulatedMagician(clock, replace(MAGICIAN, capacity=ROOM, keep=None), limits=kinematics.limits)
    bias = m.EndEffectorParams(kinematics.x_bias, kinematics.y_bias, kinematics.z_bias)
    arm.perform(m.SET_END_EFFECTOR_PARAMS, bias)
    pose = arm.pose
    program = MagicianProgram(kinematics, pose.j4, tool, pace)
    return Bench(arm, lambda row, data: bytes(magician_frame.request(row, data, queued=True)), place_of(pose), program)


def ultraarm(clock: Clock, tool: Tool, pace: DrawingPace) -> Bench:
    """An ultraArm that has been at home."""
    quirks = UltraArmQuirks(constant_speed=pace.constant_speed)
    arm = SimulatedUltraArm(clock, replace(ULTRAARM, capacity=ROOM, keep=None), quirks=quirks)

    def encode(row: Command[Any, Any], data: bytes) -> bytes:
        return bytes(ultraarm_frame.encode(row, data, queued=True))

    arm.session().receive(encode(u.HOME, u.HOME.request.encode(None)))
    clock.now += HOMING
    return Bench(arm, encode, place_of(arm.pose), UltraArmProgram(tool, pace))


def cobot(model: CobotModel, clock: Clock, pace: DrawingPace, first: Place) -> Bench:
    """A myCobot that stands above the first stroke, with a hand that looks down."""
    arm = SimulatedMyCobot(clock, replace(MYCOBOT, capacity=ROOM, keep=None), model=model.name)
    rotation = (180.0, 0.0, 0.0) if len(model.reach) == 6 else (0.0,)
    joints = arm.ways.solver.inverse((*first, *rotation), arm.joints, arm.ways.limits)
    if joints is None:
        where = ", ".join(f"{number:.1f}" for number in first)
        raise ValueError(
            f"stroke 0 cannot be drawn by the simulated arm: ({where}) is out of reach of a hand that looks down"
        )

    arm.place(*joints)

    def encode(row: Command[Any, Any], data: bytes) -> bytes:
        return bytes(cobot_frame.request(model.row(row), data, queued=True))

    return Bench(arm, encode, first, CobotProgram(rotation, pace), BETWEEN)


def place_of(pose: Any) -> Place:
    """Where a tool is."""
    return pose.x, pose.y, pose.z


def bench_of(arm: Any, clock: Clock, tool: Tool, pace: DrawingPace, first: Place) -> Bench:
    """A simulated arm like another one."""
    if isinstance(arm, (Magician, Kinematics)) or arm == "magician":
        return magician(
            arm if isinstance(arm, Kinematics) else getattr(arm, "kinematics", Kinematics()), clock, tool, pace
        )

    if isinstance(arm, UltraArm) or arm == "ultraarm":
        return ultraarm(clock, tool, pace)

    model = arm.model if isinstance(arm, MyCobot) else arm if isinstance(arm, CobotModel) else MODELS.get(arm)
    if model is None:
        raise ValueError(f"nothing estimates a drawing of {arm!r}; there are: magician, ultraarm, {', '.join(MODELS)}")

    if tool == "laser":
        raise UnsupportedError(f"a {model.title} has no laser")

    return cobot(model, clock, pace, first)
