"""What type checkers make of a user's program; mypy looks at it with the tests, and a test runs it."""

from __future__ import annotations

from collections.abc import Callable
from typing import assert_type

from dobot_async import CobotPose, LinkState, PTPMode
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import SimulatedMagician
from dobot_async.sync import Fleet, Follow, Magician, Motion, MyCobot, simulate


def program() -> None:
    """Some of everything."""
    with simulate(speed=50, homed=True) as sim, Magician.connect(sim.url, timeout=5) as arm:
        assert_type(sim.arm, SimulatedMagician)
        assert_type(arm, Magician)
        assert_type(arm.move_to(220, 0, 40, mode=PTPMode.MOVL_XYZ, timeout=20), None)
        assert_type(arm.get_pose(), c.Pose)
        assert_type(arm.request(c.GET_POSE, None), c.Pose)
        assert_type(arm.queue.move_to(200, 60, 40), Motion)
        assert_type(arm.link.state.value, LinkState)
        changes: Callable[[], LinkState] = iter(arm.link.state).__next__
        assert callable(changes)
        with arm.queue.batch() as batch:
            last = batch.wait(0.0)

        assert_type(last, Motion)
        last.wait()
        assert_type(last.done, bool)
        with arm.following(rate=30) as follow:
            assert_type(follow, Follow)
            follow.target = arm.get_pose()

    with MyCobot.connect("sim:?speed=50") as cobot:
        assert_type(cobot.get_pose(), CobotPose)

    with Fleet.connect({"left": "sim:?speed=50"}) as fleet:
        assert_type(fleet, Fleet[Magician])
        assert_type(fleet["left"].get_pose(), c.Pose)
        assert_type(fleet.each(Magician.get_joints), dict[str, tuple[float, ...]])
        assert_type(fleet.run({"left": arm_count}), dict[str, int])


def arm_count() -> int:
    """A program of a fleet."""
    return 1


if __name__ == "__main__":
    program()
