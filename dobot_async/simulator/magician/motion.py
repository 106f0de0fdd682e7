"""How a simulated Magician moves: from a command's parameters, the registers and where the arm is, to an Activity.

Joint vectors have five numbers: the four joints in degrees and the place on the rail in mm. The rail goes beside the
arm; both set out together. Faults carry the alarm's code.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

from dobot_async.arms.magician import commands as c
from dobot_async.simulator.device.curve import LineSegment, arc, between, circle
from dobot_async.simulator.device.device import Device
from dobot_async.simulator.device.path import Segment, curve_segment, joint_segment, jump, travel
from dobot_async.simulator.device.profile import SpeedLimits, trapezoid
from dobot_async.simulator.device.work import Activity, DeviceFault, Vector
from dobot_async.simulator.magician.reach import Reach
from dobot_async.simulator.magician.state import HOME_JOINTS, HOME_POINT, State

__all__ = ["RAIL", "AnyPTP", "Motions", "along", "clipped", "standing"]

AnyPTP = c.PTPCmd | c.PTPWithLCmd | c.PTPPOCmd | c.PTPPOWithLCmd

RAIL = (0.0, 1000.0)
"""The ends of the rail, mm."""

BEYOND_LIMIT = 0x12
LOSE_STEP = range(0x50, 0x54)
HOMING = trapezoid(1.0, 0.25, 0.25)  # five seconds
NO_LIMIT = 1e6  # degrees/s and degrees/s² of a turn that the path's own speed decides about
STANDSTILL = trapezoid(0.0, 0.0, 0.0)


class Motions:
    """The motions of one arm. Each plans with the registers as they are when it begins."""

    def __init__(self, state: State) -> None:
        self._state = state
        self._passing = (-math.inf, 0.0)  # when the last point of a continuous path was passed, and at how many mm/s

    @property
    def reach(self) -> Reach:
        """Where the arm can go with its end effector."""
        return Reach(self._state.kinematics)

    def ptp(self, value: AnyPTP, device: Device) -> Activity:
        """A point-to-point motion, with the rail's and with outputs on the way if it has any."""
        joints = device.joints
        segments = self.ptp_legs(value, joints)
        rail = standing(joints[4])
        if isinstance(value, (c.PTPWithLCmd, c.PTPPOWithLCmd)) and self._state.has_rail:
            rail = self._rail_leg(joints[4], value.rail)

        outputs = value.outputs if isinstance(value, (c.PTPPOCmd, c.PTPPOWithLCmd)) else ()
        switches = [
            (
                self._time_at(segments, output.ratio),
                partial(self._state.set, c.SET_IODO, c.IODO(output.address, output.level)),
            )
            for output in outputs
        ]
        return along(segments, rail, on_the_way=switches)

    def ptp_legs(self, value: AnyPTP, joints: Vector) -> list[Segment]:
        """The arm's own way of a point-to-point motion."""
        meaning, way = PTP_MODES[value.ptp_mode]
        start, reach = joints[:4], self.reach
        target = meaning(reach, start, (value.x, value.y, value.z, value.r))
        return way(self, reach, start, target)

    def cp(self, value: c.CPCmd | c.CPLECmd, device: Device) -> Activity:
        """The next line of a continuous path; the arm halts at its end only if no other line is queued by then."""
        joints, reach = device.joints, self.reach
        start = reach.forward(joints[:4])
        place = (value.x, value.y, value.z)
        if value.cp_mode is c.CPMode.RELATIVE:
            place = (start[0] + value.x, start[1] + value.y, start[2] + value.z)

        turn = start[3]
        if not self._state.get(c.SET_CPR_HOLD_ENABLE):
            turn = joints[3] + reach.base_angle(*place)

        limits, ratios = self._state.get(c.SET_CP_PARAMS), self._state.get(c.SET_CP_COMMON_PARAMS)
        velocity, acceleration = limits.junction_vel * clipped(ratios.velocity_ratio), limits.plan_acc
        passed_at, passed_with = self._passing
        segment = curve_segment(
            LineSegment(start, (*place, turn)),
            joints[:4],
            reach,
            SpeedLimits((velocity, NO_LIMIT), (acceleration * clipped(ratios.acceleration_ratio), NO_LIMIT)),
            enter=passed_with if passed_at == device.now else 0.0,
            leave=velocity if goes_on(device) else 0.0,
        )
        length = math.dist(start[:3], place)
        return along([segment], standing(joints[4]), end=lambda: self._pass(device.now, segment.profile.leave * length))

    def arc(self, value: c.ARCCmd, device: Device) -> Activity:
        """An arc from where the arm is."""
        joints, reach = device.joints, self.reach
        curve = arc(reach.forward(joints[:4]), point_of(value.cir_point), point_of(value.to_point))
        return along([curve_segment(curve, joints[:4], reach, self._arc_pace)], standing(joints[4]))

    def circle(self, value: c.CircleCmd, device: Device) -> Activity:
        """Whole circles from where the arm is. They are all the same, so the reach is looked at on the first."""
        joints, reach = device.joints, self.reach
        points = reach.forward(joints[:4]), point_of(value.cir_point), point_of(value.to_point)
        segment = curve_segment(circle(*points, count=1), joints[:4], reach, self._arc_pace)
        if not segment.fault:
            segment = curve_segment(
                circle(*points, count=value.count), joints[:4], reach, self._arc_pace, every=math.inf
            )

        return along([segment], standing(joints[4]))

    def home(self, device: Device) -> Activity:
        """Homing: the steps that were lost are found again, of the rail as well if there is one.

        The arm drives to its switches, wherever it believes to be; then it knows, and its pose changes at once.
        """
        state, joints, reach = self._state, device.joints, self.reach
        place = state.get(c.SET_HOME_PARAMS)
        target = HOME_JOINTS if place == HOME_POINT else reach.inverse((place.x, place.y, place.z, place.r))
        there = (*target, RAIL[0] if state.has_rail else state.true(joints)[4])
        believed = tuple(end - astray for end, astray in zip(there, state.astray, strict=True))

        def end() -> None:
            state.found()
            device.place((*target, there[4] - state.astray[4]))
            device.clear_alarms(LOSE_STEP)

        arm = Segment(lambda share: between(joints[:4], believed[:4], share), HOMING)
        return along([arm], Segment(lambda share: between(joints[4:], believed[4:], share), HOMING), end=end)

    # The three ways of a point-to-point motion.

    def by_joints(self, _: Reach, start: Vector, target: Vector) -> list[Segment]:
        """All joints together."""
        return [joint_segment(start, target, self._joint_pace)]

    def by_line(self, reach: Reach, start: Vector, target: Vector) -> list[Segment]:
        """The tool on a straight line."""
        line = LineSegment(reach.forward(start), reach.forward(target))
        return [curve_segment(line, start, reach, self._tool_pace)]

    def by_jump(self, reach: Reach, start: Vector, target: Vector, *, straight: bool = False) -> list[Segment]:
        """Up, across and down."""
        point = reach.forward(target)
        lift_start, lift_end, ceiling = self._state.lift
        low, high = reach.forward(start)[2], point[2]
        return jump(
            start,
            point,
            reach,
            height=max(low + lift_start, high + lift_end) - max(low, high),
            ceiling=ceiling,
            vertical=self._tool_pace,
            across=self._tool_pace if straight else self._joint_pace,
            straight=straight,
        )

    @property
    def _joint_pace(self) -> SpeedLimits:
        limits, ratios = self._state.get(c.SET_PTP_JOINT_PARAMS), self._state.get(c.SET_PTP_COMMON_PARAMS)
        return paced(SpeedLimits(limits.velocity, limits.acceleration), ratios)

    @property
    def _tool_pace(self) -> SpeedLimits:
        return tool_pace(self._state.get(c.SET_PTP_COORDINATE_PARAMS), self._state.get(c.SET_PTP_COMMON_PARAMS))

    @property
    def _arc_pace(self) -> SpeedLimits:
        return tool_pace(self._state.get(c.SET_ARC_PARAMS), self._state.get(c.SET_ARC_COMMON_PARAMS))

    def _rail_leg(self, start: float, end: float) -> Segment:
        """The rail's way; raises Fault if it is not that long."""
        if not RAIL[0] <= end <= RAIL[1]:
            raise DeviceFault(BEYOND_LIMIT)

        limits, ratios = self._state.get(c.SET_PTPL_PARAMS), self._state.get(c.SET_PTP_COMMON_PARAMS)
        return joint_segment((start,), (end,), paced(SpeedLimits((limits.velocity,), (limits.acceleration,)), ratios))

    def _time_at(self, segments: Sequence[Segment], percent: float) -> float:
        """After how many seconds the tool has gone so much of its way."""
        forward = self.reach.forward
        lengths = [
            math.dist(forward(segment.joints(0.0))[:3], forward(segment.joints(1.0))[:3]) for segment in segments
        ]
        left = sum(lengths) * clipped(percent)
        before = 0.0
        for segment, length in zip(segments, lengths, strict=True):
            if left <= length and length > 0:
                return before + segment.profile.time(left / length)

            left -= length
            before += segment.duration

        return before * clipped(percent) if not sum(lengths) else before

    def _pass(self, now: float, velocity: float) -> None:
        self._passing = now, velocity


def along(
    segments: Sequence[Segment],
    rail: Segment,
    *,
    on_the_way: Sequence[tuple[float, Callable[[], None]]] = (),
    end: Callable[[], None] = lambda: None,
) -> Activity:
    """The arm and the rail side by side; where the arm's way ends by a fault, so does the rail's."""
    arm = travel(segments, end)
    duration = sum(segment.duration for segment in segments)
    if not segments[-1].fault:
        duration = max(duration, rail.duration)

    def at(elapsed: float) -> Vector:
        joints = arm.at(elapsed)
        assert joints is not None
        return (*joints, *rail.at(elapsed))

    reached = sorted((event for event in on_the_way if event[0] <= duration), key=lambda event: event[0])
    return Activity(duration, at, arm.end, reached)


def standing(place: float) -> Segment:
    """A rail that stays where it is."""
    return Segment(lambda _: (place,), STANDSTILL)


def clipped(percent: float) -> float:
    """A ratio as a factor: more than 100 percent counts as 100."""
    return min(max(percent, 0.0), 100.0) / 100


def paced(pace: SpeedLimits, ratios: c.PTPCommonParams | c.ARCCommonParams | c.JOGCommonParams) -> SpeedLimits:
    """A pace with its ratios."""
    return pace.scaled(clipped(ratios.velocity_ratio), clipped(ratios.acceleration_ratio))


def tool_pace(
    limits: c.PTPCoordinateParams | c.ARCParams, ratios: c.PTPCommonParams | c.ARCCommonParams
) -> SpeedLimits:
    """The pace of length and turn."""
    velocities, accelerations = (
        (limits.xyz_velocity, limits.r_velocity),
        (limits.xyz_acceleration, limits.r_acceleration),
    )
    return paced(SpeedLimits(velocities, accelerations), ratios)


def point_of(point: c.ARCPoint) -> Vector:
    """A point of an arc as a vector."""
    return point.x, point.y, point.z, point.r


def goes_on(device: Device) -> bool:
    """Whether the next command of the queue continues the path."""
    following = device.following
    return following is not None and isinstance(following.value, (c.CPCmd, c.CPLECmd))


def plus(a: Vector, b: Vector) -> Vector:
    """The sum of two vectors."""
    return tuple(p + q for p, q in zip(a, b, strict=True))


def point(reach: Reach, _: Vector, numbers: Vector) -> Vector:
    """Coordinates."""
    return reach.inverse(numbers)


def angles(reach: Reach, _: Vector, numbers: Vector) -> Vector:
    """Joint angles."""
    return reach.check(numbers)


def more_angles(reach: Reach, start: Vector, numbers: Vector) -> Vector:
    """Increments of the joints."""
    return reach.check(plus(start, numbers))


def more_point(reach: Reach, start: Vector, numbers: Vector) -> Vector:
    """Increments of the coordinates."""
    return reach.inverse(plus(reach.forward(start), numbers))


PTP_MODES: Mapping[
    c.PTPMode,
    tuple[Callable[[Reach, Vector, Vector], Vector], Callable[[Motions, Reach, Vector, Vector], list[Segment]]],
] = {
    c.PTPMode.JUMP_XYZ: (point, Motions.by_jump),
    c.PTPMode.MOVJ_XYZ: (point, Motions.by_joints),
    c.PTPMode.MOVL_XYZ: (point, Motions.by_line),
    c.PTPMode.JUMP_ANGLE: (angles, Motions.by_jump),
    c.PTPMode.MOVJ_ANGLE: (angles, Motions.by_joints),
    c.PTPMode.MOVL_ANGLE: (angles, Motions.by_line),
    c.PTPMode.MOVJ_INC: (more_angles, Motions.by_joints),
    c.PTPMode.MOVL_INC: (more_point, Motions.by_line),
    c.PTPMode.MOVJ_XYZ_INC: (more_point, Motions.by_joints),
    c.PTPMode.JUMP_MOVL_XYZ: (point, partial(Motions.by_jump, straight=True)),
}
"""For each mode what the four numbers mean, as the joints that they lead to, and which way the arm takes."""
