"""What LeRobot asks of a robot and of a teleoperator, by LeRobot's own classes and discovery, on simulated arms."""

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
from lerobot_robot_mycobot import MyCobot, MyCobotConfig, MyCobotLeader, MyCobotLeaderConfig
from lerobot_robot_mycobot.config_mycobot import JOINTS

from dobot_async import DobotError
from dobot_async.sync import MyCobot as Arm
from dobot_async.sync import simulate

PATIENCE = 40.0  # seconds that an arm may take on a busy machine


def robot(tmp_path: Path, url: str, **options: Any) -> MyCobot:
    """A robot, made as LeRobot makes it."""
    made = make_robot_from_config(MyCobotConfig(id="test", calibration_dir=tmp_path, url=url, **options))
    assert isinstance(made, MyCobot)
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
        if all(abs(seen[name] - sent[name]) < 2 for name in sent if name.startswith("j")):
            return sent

    raise AssertionError(f"{seen} is not {sent}")


def test_lerobot_knows_the_types_by_their_names() -> None:
    assert RobotConfig.get_choice_class("mycobot") is MyCobotConfig
    assert TeleoperatorConfig.get_choice_class("mycobot_leader") is MyCobotLeaderConfig
    for wrong in ({"model": "yourcobot"}, {"gripper_speed": 0}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            MyCobotConfig(url="sim:", **wrong)  # type: ignore[arg-type]

    with pytest.raises(ValueError, match="model"):
        MyCobotLeaderConfig(url="sim:", model="yourcobot")


@pytest.mark.parametrize("model", JOINTS)
def test_each_model_has_the_joints_that_are_told_before_it_is_connected(tmp_path: Path, model: str) -> None:
    with simulate(model, speed=20) as sim, Arm.connect(sim.url, model=model) as arm:
        assert arm.model.joints == JOINTS[model]

    features = robot(tmp_path, "sim:", model=model, gripper=True).action_features
    assert list(features) == [*(f"j{number}.pos" for number in range(1, JOINTS[model] + 1)), "gripper.pos"]
    assert set(features.values()) == {float}


def test_nothing_is_done_before_it_is_connected(tmp_path: Path) -> None:
    arm = robot(tmp_path, "serial:///dev/nothing")
    assert arm.observation_features == arm.action_features
    assert arm.is_calibrated
    arm.calibrate()
    arm.configure()
    for call in (arm.get_observation, arm.disconnect, lambda: arm.send_action({})):
        with pytest.raises(DeviceNotConnectedError):
            call()

    with pytest.raises(DobotError):
        arm.connect()

    assert not arm.is_connected


def test_the_arm_goes_after_actions_and_stands_after_them(tmp_path: Path) -> None:
    with simulate("mycobot280") as sim:
        arm = robot(tmp_path, sim.url, max_turn=200)
        with arm:
            with pytest.raises(DeviceAlreadyConnectedError):
                arm.connect()

            assert arm.get_observation().keys() == arm.observation_features.keys()
            action = {f"j{number}.pos": 5.0 * number for number in range(1, 7)}
            assert reach(arm, action) == action
            for _ in range(3):
                arm.send_action(action | {"j1.pos": 60.0})

        assert not arm.is_connected
        assert not sim.arm.device.moving
        assert abs(sim.arm.device.joints[0] - 60) > 1


def test_what_was_sent_is_told(tmp_path: Path) -> None:
    with simulate("mycobot280") as sim:
        arm = robot(tmp_path, sim.url)
        with arm:
            before = arm.get_observation()
            sent = arm.send_action(before | {"j1.pos": 500.0})
            assert 160 <= sent["j1.pos"] < 180
            with pytest.raises(ValueError, match=r"j2\.pos"):
                arm.send_action({"j1.pos": 0.0})

            with pytest.raises(ValueError, match="finite"):
                arm.send_action(before | {"j1.pos": float("inf")})


def test_the_gripper_opens_as_far_as_it_is_told(tmp_path: Path) -> None:
    with simulate("mycobot280") as sim:
        arm = robot(tmp_path, sim.url, gripper=True)
        with arm:
            start = arm.get_observation()
            wanted = start | {"gripper.pos": 30.4}
            assert arm.send_action(wanted)["gripper.pos"] == 30
            deadline = time.monotonic() + PATIENCE
            while time.monotonic() < deadline:
                arm.send_action(wanted)
                if arm.get_observation()["gripper.pos"] == pytest.approx(30, abs=3):
                    break
            else:
                pytest.fail("the gripper is not where it was told to be")

            assert arm.send_action(start | {"gripper.pos": 300.0})["gripper.pos"] == 100


def test_a_failure_is_raised_once_and_leaves_nothing_behind(tmp_path: Path) -> None:
    with simulate("mycobot280") as sim:
        arm = robot(tmp_path, sim.url)
        arm.connect()
        start = arm.get_observation()
        sim.unplug()
        with pytest.raises(DobotError):
            until_it_fails(arm, start)

        arm.disconnect()
        arm.connect()
        arm.send_action(start)
        arm.disconnect()


def test_an_arm_that_is_led_leads(tmp_path: Path) -> None:
    with simulate("mycobot280") as leading, simulate("mycobot280") as following:
        config = MyCobotLeaderConfig(id="l", calibration_dir=tmp_path, url=leading.url)
        leader = make_teleoperator_from_config(config)
        assert isinstance(leader, MyCobotLeader)
        assert leader.feedback_features == {}
        with pytest.raises(DeviceNotConnectedError):
            leader.get_action()

        arm = robot(tmp_path, following.url)
        assert leader.action_features == arm.action_features
        with Arm.connect(leading.url) as before:
            before.power_on()

        with leader, arm:
            assert leading.arm.released
            leading.arm.guide_to(10, 10, 10, 10, 10, 10)
            sent = reach(arm, leader.get_action())
            assert list(sent.values()) == pytest.approx([10] * 6, abs=0.2)
            leader.send_feedback({})

        assert not leading.arm.released
        assert following.arm.device.joints[0] == pytest.approx(10, abs=3)
