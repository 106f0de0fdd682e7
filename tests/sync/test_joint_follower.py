"""An arm that goes after joints, for loops at a fixed rate."""

from __future__ import annotations

import math
import time
from typing import Any

import pytest

from dobot_async import CommandRejected, ConnectFailed, DobotError
from dobot_async.sync import Magician, MyCobot, Simulation, simulate
from dobot_async.sync.joints import JointFollower, limits_of_cobot, limits_of_magician

PATIENCE = 40.0  # seconds that an arm may take on a busy machine


def follower(sim: Simulation[Any], **options: float) -> JointFollower[Magician]:
    """A Magician that is not connected yet."""
    return JointFollower(lambda: Magician.connect(sim.url), limits_of_magician, **options)


def reach(arm: JointFollower[Magician] | JointFollower[MyCobot], joints: tuple[float, ...]) -> None:
    """Sends joints until they are reached."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        sent = arm.go(joints)
        if math.dist(arm.joints(), sent) < 2:
            return

    raise AssertionError(f"{arm.joints()} is not {sent}")


def test_it_goes_after_the_newest_joints_and_stands_at_the_end() -> None:
    with simulate(homed=True) as sim:
        arm = follower(sim, max_turn=300)
        arm.connect()
        reach(arm, (10, 40, 45, 5))
        for _ in range(3):
            assert arm.go((90, 40, 45, 5)) == (90, 40, 45, 5)

        arm.disconnect()
        assert not arm.connected
        assert sim.arm.device.idle
        assert sim.arm.pose.j1 < 60


def test_joints_beyond_limits_are_clipped_and_impossible_ones_are_not_followed() -> None:
    with simulate(homed=True) as sim:
        arm = follower(sim)
        arm.connect()
        assert arm.go((500, 45, 45, -500)) == (125, 45, 45, -150)
        assert arm.go((0, 90, -15, 0)) == (125, 45, 45, -150)
        for wrong in ((1, 2, 3), (1, 2, 3, math.nan)):
            with pytest.raises(ValueError, match="4 finite"):
                arm.go(wrong)

        arm.disconnect()


def test_without_new_joints_it_rests() -> None:
    with simulate(homed=True) as sim:
        arm = follower(sim, stale=0.05, max_turn=5)
        arm.connect()
        arm.go((100, 45, 45, 0))
        moving = (sim.arm.device.moving for _ in iter(int, 1))
        while not next(moving):
            arm.go((100, 45, 45, 0))

        while next(moving):
            arm.joints()

        assert sim.arm.pose.j1 < 50
        arm.disconnect()


def test_another_family() -> None:
    with simulate("mycobot280", speed=2) as sim:
        arm = JointFollower(lambda: MyCobot.connect(sim.url), limits_of_cobot, max_turn=200)
        arm.connect(lambda found: found.power_on())
        reach(arm, (10, 10, 10, 10, 10, 10))
        arm.disconnect()
        assert not sim.arm.device.moving


def test_what_fails_while_it_is_connected_leaves_nothing_behind() -> None:
    with simulate(homed=True) as sim:
        arm = follower(sim)
        with pytest.raises(ZeroDivisionError):
            arm.connect(lambda _: 1 / 0)

        with pytest.raises(CommandRejected):
            arm.connect(lambda found: found.queue.move_to(220, 150, 40))

        assert not arm.connected
        with pytest.raises(RuntimeError, match="connect"):
            arm.go((0, 45, 45, 0))

        with pytest.raises(RuntimeError, match="connect"):
            arm.joints()

        arm.disconnect()

    with pytest.raises(ConnectFailed):
        JointFollower(lambda: Magician.connect("serial:///dev/nothing"), limits_of_magician).connect()


def test_a_failure_is_told_once() -> None:
    with simulate(homed=True) as sim:
        arm = follower(sim)
        arm.connect()
        sim.unplug()
        with pytest.raises(DobotError):
            for _ in range(10_000):
                arm.go((0, 45, 45, 0))

        arm.disconnect()
        arm.connect()
        sim.unplug()
        with pytest.raises(DobotError):  # nobody was told before
            while arm.joints():
                pass

        with pytest.raises(DobotError):
            arm.disconnect()

        assert not arm.connected
