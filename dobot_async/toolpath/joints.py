"""The joints of a myCobot along a drawing: each straight way is walked from where the arm stands, and nothing is sent.

Lengths of these arms are known to some mm only (`simulator/mycobot/kinematics`). What the arm tells of its joints and
its hand shows whether they are its own; where they are not, or its tool or its base was given a frame, the joints are
left to the arm, and the log says so.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Sequence

from dobot_async.arms.mycobot import commands as b
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.models import CobotModel
from dobot_async.simulator.mycobot.kinematics import KINEMATICS, InverseSolver
from dobot_async.toolpath.moves import ToolpathMove, check_moves
from dobot_async.toolpath.plane import Place

__all__ = ["JointWalk", "check_joints"]

logger: logging.Logger = logging.getLogger("dobot_async.toolpath")
OWN = 15.0  # mm by which the place that the joints give may miss the one that the arm tells
NEAR = 1.0  # mm; a place that is nearer to the last one needs no look of its own
TURN = 30.0  # degrees that a joint may turn from one place to the next one: beyond that the arm is at a singularity
WIDE = (-360.0, 360.0)
BETWEEN = 10  # moves that are looked at without a break for others


class JointWalk:
    """The joints of an arm whose hand goes along straight ways and keeps its rotation.

    Args:
        model: The arm, with its limits.
        joints: Where it begins, degrees.
        coords: Where its hand is then, x, y, z in mm and its rotation.
    """

    def __init__(self, model: CobotModel, joints: Sequence[float], coords: Sequence[float]) -> None:
        self._model = model
        self._solver: InverseSolver = KINEMATICS[model.name]
        self._joints = tuple(joints)
        self._last = tuple(coords[:3])
        self._rotation = tuple(coords[3:])

    @property
    def knows_the_arm(self) -> bool:
        """Whether the joints give the place that the arm has told."""
        return math.dist(self._solver.forward(self._joints)[:3], self._last) <= OWN

    def go(self, place: Place) -> None:
        """Walk on to a place; raise ValueError with the joint if the arm cannot go there from the last one."""
        if math.dist(place, self._last) < NEAR:
            return

        point = (*place, *self._rotation)
        found = self._solver.inverse(point, self._joints, self._model.joint_limits, seeds=False)
        if found is None:
            raise ValueError(self._reason(point))

        turns = [abs(after - before) for before, after in zip(self._joints, found, strict=True)]
        if max(turns) > TURN:
            joint = turns.index(max(turns)) + 1
            raise ValueError(f"joint {joint} would have to turn by {max(turns):.0f} degrees on a few mm")

        self._joints, self._last = found, place

    def _reason(self, point: Sequence[float]) -> str:
        """Why there are no joints for a place."""
        free = self._solver.inverse(point, self._joints, [WIDE] * self._model.joints, seeds=False)
        for joint, angle in enumerate(free or (), 1):
            low, high = self._model.joint_limits[joint - 1]
            if not low <= angle <= high:
                return f"joint {joint} would be at {angle:.2f} degrees, beyond {low:g} to {high:g}"

        rotation = ", ".join(f"{angle:.0f}" for angle in self._rotation)
        return f"no joints bring the hand there with its rotation ({rotation} degrees)"


async def check_joints(arm: MyCobot, moves: Sequence[ToolpathMove], here: Place) -> None:
    """Walk all moves of a drawing from where an arm stands.

    Args:
        arm: Where it stands is read from it.
        moves: What it is to do.
        here: Where its hand is.

    Raises:
        UnreachableStroke: A joint's limit is in the way; it names stroke, point and joint. Nothing has moved.
        DobotError: The arm does not say where it stands.
    """
    coords = await arm.request(b.GET_COORDS, None)
    walk = JointWalk(arm.model, await arm.get_joints(), tuple(float(number) for number in coords))
    if not walk.knows_the_arm:
        logger.warning(
            "the joints of this drawing are not looked at: the place that the arm tells is not the one that its joints "
            "give by the lengths of a %s; was its tool or its base given a frame?",
            arm.model.title,
        )
        return

    for number, move in enumerate(moves):
        check_moves([move], walk.go, here)
        here = move.place
        if number % BETWEEN == 0:
            await asyncio.sleep(0)
