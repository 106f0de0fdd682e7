"""The names that users rely on: this list changes only on purpose."""

from __future__ import annotations

import pytest

import dobot_async

NAMES = [
    "Alarm",
    "ArmAlarm",
    "ColorPort",
    "Command",
    "CommandRejected",
    "ConnectFailed",
    "ConnectionLost",
    "DeviceInfo",
    "DobotError",
    "EndEffectorParams",
    "Gripper",
    "HHTTrigMode",
    "IOFunction",
    "InfraredPort",
    "Jog",
    "JointLimits",
    "Kinematics",
    "Laser",
    "Link",
    "LinkState",
    "LinkStats",
    "Magician",
    "Motion",
    "MotionStopped",
    "MotionUnknown",
    "PTPMode",
    "Pen",
    "Pose",
    "ProtocolError",
    "ReplyTimeout",
    "SuctionCup",
    "TriggerADCCondition",
    "Unexpected",
    "Unreachable",
    "open_transport",
]


def test_the_public_names_are_pinned() -> None:
    assert sorted(dobot_async.__all__) == NAMES
    assert len(set(dobot_async.__all__)) == len(dobot_async.__all__)


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_says_what_it_is(name: str) -> None:
    doc = getattr(dobot_async, name).__doc__
    # A dataclass without a docstring gets its signature for one.
    assert doc
    assert not doc.startswith(f"{name}(")
    assert doc.split("\n", 1)[0].endswith((".", ":"))


def test_errors_are_also_the_builtin_ones_that_users_catch() -> None:
    assert issubclass(dobot_async.ConnectFailed, ConnectionError)
    assert issubclass(dobot_async.ConnectionLost, ConnectionError)
    assert issubclass(dobot_async.ReplyTimeout, TimeoutError)
    errors = [getattr(dobot_async, name) for name in NAMES if isinstance(getattr(dobot_async, name), type)]
    ours = [error for error in errors if issubclass(error, Exception) and not issubclass(error, ValueError)]
    assert len(ours) == 9
    assert all(issubclass(error, dobot_async.DobotError) for error in ours)
