"""A fleet of blocking arms: each program has a thread, and is to the fleet what a task is."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from dobot_async import MotionStopped
from dobot_async.fleet import BarrierBroken
from dobot_async.simulator import SimulatedMagician
from dobot_async.sync import Fleet, Magician, Member, MyCobot, Simulation, UltraArm, simulate


@contextmanager
def two_arms(speed: float = 20) -> Iterator[tuple[Fleet[Magician], Simulation[SimulatedMagician]]]:
    """A fleet of two Magicians, and the first one as it is simulated."""
    with (
        simulate(speed=speed, homed=True) as left,
        simulate(speed=speed, homed=True) as right,
        Fleet.connect({"left": left.url, "right": right.url}, zones={"middle": None}) as fleet,
    ):
        yield fleet, left


def test_arms_of_three_families_do_the_same() -> None:
    members: dict[str, Member[Any]] = {
        "one": Member("sim:?homed=true", Magician),
        "two": Member("sim:?homed=true", UltraArm),
        "three": Member("sim:", MyCobot),
    }
    with Fleet.connect(members) as fleet:
        assert [type(fleet[name]) for name in fleet] == [Magician, UltraArm, MyCobot]
        assert round(fleet.each("get_pose")["one"].x) == 259
        names = fleet.each(lambda arm: (threading.current_thread().name, len(arm.get_joints())))
        assert {threads for threads, _ in names.values()} == {"dobot_async.sync function"}
        assert [joints for _, joints in names.values()] == [4, 4, 6]
        assert fleet.arm("three", MyCobot).model.joints == 6
        with pytest.raises(TypeError):
            fleet.arm("three", Magician)

    with pytest.raises(TypeError, match=r"dobot_async\.sync"):
        Member("sim:", int)


def test_programs_hold_zones_and_meet_at_barriers() -> None:
    held: list[list[str]] = []
    with two_arms() as (fleet, _):

        def program(name: str) -> float:
            with fleet.zone("middle"):
                held.append(fleet.holders("middle"))
                fleet[name].move_by(z=10)

            fleet.barrier("both were there")
            assert len(held) == 2
            return fleet[name].get_pose().z

        found = fleet.run({"left": lambda: program("left"), "right": lambda: program("right")})
        assert found.keys() == {"left", "right"}
        assert sorted(held) == [["program left"], ["program right"]]


def test_a_program_that_fails_ends_the_others_in_their_calls() -> None:
    told: list[str] = []
    with two_arms(speed=2) as (fleet, left):

        def fails() -> None:
            while not left.arm.device.moving:
                fleet["right"].get_pose()

            raise ZeroDivisionError("mine")

        def goes_on() -> None:
            try:
                while True:
                    fleet["left"].move_to(220, 100, 40)
                    fleet["left"].move_to(220, -100, 40)
            except asyncio.CancelledError:
                told.append("cancelled")
                fleet["left"].get_pose()  # it may clean up
                told.append("cleaned up")
                raise

        with pytest.raises(ZeroDivisionError, match="mine"):
            fleet.run({"left": goes_on, "right": fails})

        assert told == ["cancelled", "cleaned up"]
        assert left.arm.device.idle


def test_a_program_that_is_in_nobodys_call_is_told_by_its_next_one() -> None:
    told: list[BaseException] = []
    go_on = threading.Event()
    with two_arms() as (fleet, left):

        def fails() -> None:
            raise ZeroDivisionError

        def computes() -> None:
            go_on.wait()
            try:
                fleet["left"].move_to(220, 100, 40)
            except BaseException as error:
                told.append(error)
                raise

        with pytest.raises(ZeroDivisionError):
            fleet.run({"left": computes, "right": fails})

        go_on.set()
        while not told:
            fleet["right"].get_pose()

        assert isinstance(told[0], asyncio.CancelledError)
        assert not [each for each in left.arm.executed if each.name == "SetPTPCmd"]


def test_a_stop_of_the_fleet_ends_programs_wherever_they_are() -> None:
    with two_arms(speed=2) as (fleet, left):

        def moves() -> None:
            fleet["left"].move_to(220, 150, 40)

        def stops() -> None:
            while not left.arm.device.moving:
                fleet["right"].get_pose()

            fleet.stop()

        with pytest.raises(MotionStopped):
            fleet.run({"left": moves, "right": stops})

        assert left.arm.device.idle


def test_arms_start_together() -> None:
    with two_arms() as (fleet, left):
        with fleet.together("left", "right") as together:
            motion = together["left"].move_to(220, 0, 40)
            together["right"].move_to(220, 0, 40)
            with pytest.raises(RuntimeError):
                _ = together.skew

        together.wait()
        assert motion.done
        assert together.skew >= 0
        assert together.start
        assert left.arm.pose.x == 220
        assert not fleet.failures


def test_an_error_in_the_block_stops_all_arms() -> None:
    with simulate(speed=2, homed=True) as left, simulate(speed=2, homed=True) as right:
        with pytest.raises(KeyboardInterrupt), Fleet.connect({"left": left.url, "right": right.url}) as fleet:
            for name in fleet:
                fleet[name].queue.move_to(220, 150, 40)

            raise KeyboardInterrupt

        assert left.arm.device.idle
        assert right.arm.device.idle


def test_a_program_that_ends_breaks_the_barrier_of_the_other() -> None:
    with two_arms() as (fleet, _), pytest.raises(BarrierBroken):
        fleet.run({"left": lambda: None, "right": lambda: fleet.barrier("never")})
