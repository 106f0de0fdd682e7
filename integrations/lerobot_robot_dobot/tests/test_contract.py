"""What LeRobot asks of a robot and of a teleoperator, by its own classes and discovery, on a simulated Magician."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest
from lerobot.robots import Robot, RobotConfig
from lerobot.robots.utils import make_robot_from_config
from lerobot.teleoperators import TeleoperatorConfig
from lerobot.teleoperators.utils import make_teleoperator_from_config
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError
from lerobot_robot_dobot import Dobot, DobotConfig, DobotLeader, DobotLeaderConfig

from dobot_async import CommandRejected, DobotError
from dobot_async.sync import simulate

TOOLS = [("suction", "SetEndEffectorSuctionCup"), ("gripper", "SetEndEffectorGripper")]
NAMES = ["j1.pos", "j2.pos", "j3.pos", "j4.pos"]

PATIENCE = 40.0  # seconds that an arm may take on a busy machine


def robot(tmp_path: Path, url: str, **options: Any) -> Dobot:
    """A robot, made as LeRobot makes it."""
    made = make_robot_from_config(DobotConfig(id="test", calibration_dir=tmp_path, url=url, **options))
    assert isinstance(made, Dobot)
    return made


def until_it_fails(arm: Robot, action: dict[str, Any]) -> None:
    """Sends an action again and again."""
    for _ in range(10_000):
        arm.send_action(action)


def reach(arm: Robot, action: dict[str, Any]) -> dict[str, Any]:
    """Sends an action until the arm is there; returns what was sent."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        sent = arm.send_action(action)
        seen = arm.get_observation()
        if all(abs(seen[name] - sent[name]) < 1 for name in sent if name.startswith("j")):
            return sent

    raise AssertionError(f"{seen} is not {sent}")


def test_lerobot_knows_the_types_by_their_names() -> None:
    assert RobotConfig.get_choice_class("dobot") is DobotConfig
    assert TeleoperatorConfig.get_choice_class("dobot_leader") is DobotLeaderConfig
    with pytest.raises(ValueError, match="suction"):
        DobotConfig(url="sim:", tool="hammer")


def test_features_are_known_before_anything_is_connected(tmp_path: Path) -> None:
    arm = robot(tmp_path, "serial:///dev/nothing", tool="suction")
    assert list(arm.action_features) == [*NAMES, "suction.pos"]
    assert arm.observation_features == arm.action_features
    assert set(arm.action_features.values()) == {float}
    assert arm.is_calibrated
    assert not arm.is_connected
    arm.calibrate()
    arm.configure()
    for call in (arm.get_observation, arm.disconnect, lambda: arm.send_action({})):
        with pytest.raises(DeviceNotConnectedError):
            call()

    with pytest.raises(DobotError):
        arm.connect()

    assert not arm.is_connected


def test_the_arm_goes_after_actions_and_stands_after_them(tmp_path: Path) -> None:
    with simulate(homed=True) as sim:
        arm = robot(tmp_path, sim.url, max_turn=200)
        with arm:
            with pytest.raises(DeviceAlreadyConnectedError):
                arm.connect()

            assert arm.get_observation().keys() == arm.observation_features.keys()
            action = dict(zip(NAMES, (10.0, 40.0, 45.0, 5.0), strict=True))
            assert reach(arm, action) == action
            for _ in range(3):
                arm.send_action(action | {"j1.pos": 60.0})

        assert not arm.is_connected
        assert sim.arm.device.idle
        assert [round(angle) for angle in sim.arm.pose.joints[1:]] == [40, 45, 5]


def test_what_was_sent_is_told(tmp_path: Path) -> None:
    with simulate(homed=True) as sim:
        arm = robot(tmp_path, sim.url)
        with arm:
            before = arm.get_observation()
            sent = arm.send_action(before | {"j1.pos": 500.0})
            assert sent["j1.pos"] == 125
            impossible = before | {"j2.pos": 90.0, "j3.pos": -15.0}  # each may be, both may not
            assert arm.send_action(impossible) == sent
            with pytest.raises(ValueError, match=r"j2\.pos"):
                arm.send_action({"j1.pos": 0.0})

            with pytest.raises(ValueError, match="finite"):
                arm.send_action(before | {"j1.pos": float("nan")})

            assert arm.send_action(before) == pytest.approx(before)


@pytest.mark.parametrize(("tool", "command"), TOOLS)
def test_the_tool_is_switched_when_it_changes(tmp_path: Path, tool: str, command: str) -> None:
    name = f"{tool}.pos"
    with simulate(homed=True) as sim:
        arm = robot(tmp_path, sim.url, tool=tool)
        with arm:
            start = arm.get_observation()
            for wanted in (100.0, 80.0, 20.0, 0.0, 60.0):
                sent = arm.send_action(start | {name: wanted})
                assert sent[name] == arm.get_observation()[name] == (100.0 if wanted >= 50 else 0.0)

        told = [each for each in sim.arm.executed if each.name == command]
        assert len(told) == (3 if start[name] == 0 else 2)


def test_a_failure_is_raised_once_and_leaves_nothing_behind(tmp_path: Path) -> None:
    with simulate(homed=True) as sim:
        arm = robot(tmp_path, sim.url)
        arm.connect()
        start = arm.get_observation()
        sim.unplug()
        with pytest.raises(DobotError):
            until_it_fails(arm, start)

        arm.disconnect()
        assert not arm.is_connected
        arm.connect()
        arm.send_action(start)
        arm.disconnect()


def test_an_arm_that_is_busy_is_refused(tmp_path: Path) -> None:
    with simulate(homed=True) as sim:
        arm = robot(tmp_path, sim.url)
        arm._follower._open_arm = busy(arm._follower._open_arm)  # type: ignore[method-assign]
        with pytest.raises(CommandRejected):
            arm.connect()

        assert not arm.is_connected


def busy(open_arm: Any) -> Any:
    """Connects, and queues a long motion."""
    from contextlib import contextmanager

    @contextmanager
    def opened() -> Any:
        with open_arm() as arm:
            arm.queue.move_to(220, 150, 40)
            yield arm

    return opened


def test_a_guided_arm_leads(tmp_path: Path) -> None:
    with simulate(homed=True) as leading, simulate(homed=True) as following:
        leader = make_teleoperator_from_config(DobotLeaderConfig(id="l", calibration_dir=tmp_path, url=leading.url))
        assert isinstance(leader, DobotLeader)
        assert leader.feedback_features == {}
        with pytest.raises(DeviceNotConnectedError):
            leader.get_action()

        arm = robot(tmp_path, following.url)
        assert leader.action_features == arm.action_features
        with leader, arm:
            leading.arm.guide_to(200, 40, 30)
            sent = reach(arm, leader.get_action())
            assert sent == pytest.approx(leader.get_action())
            leader.send_feedback({})

        assert not leading.arm.executed
        assert following.arm.pose.y == pytest.approx(40, abs=6)
