"""The names that users rely on: this list changes only on purpose."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import dobot_async

NAMES = [
    "AccessoryVersion",
    "Alarm",
    "Arm",
    "ArmAlarm",
    "Box",
    "CobotAlarm",
    "CobotInfo",
    "CobotModel",
    "CobotPose",
    "Color",
    "ColorPort",
    "Command",
    "CommandRejected",
    "ConnectFailed",
    "ConnectionLost",
    "Coords",
    "Cylinder",
    "DeviceInfo",
    "DiscoveryProblem",
    "DobotError",
    "EndEffectorParams",
    "EndType",
    "Fleet",
    "Found",
    "Gripper",
    "GripperType",
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
    "MoveMode",
    "MyCobot",
    "OutsideWorkspace",
    "PTPMode",
    "Pen",
    "PinMode",
    "Pose",
    "ProtocolError",
    "ReferenceFrame",
    "ReplyTimeout",
    "SuctionCup",
    "TriggerADCCondition",
    "UltraArm",
    "UltraArmAngles",
    "UltraArmCoords",
    "UltraArmJog",
    "UltraArmLimits",
    "UltraArmPose",
    "Unexpected",
    "Unreachable",
    "UnsupportedError",
    "Workspace",
    "discover",
    "open_transport",
]


def test_the_public_names_are_pinned() -> None:
    assert sorted(dobot_async.__all__) == NAMES
    assert len(set(dobot_async.__all__)) == len(dobot_async.__all__)


def test_type_checkers_see_each_name_where_it_is_at_home() -> None:
    stub = ast.parse(Path(dobot_async.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    seen = {alias.name: node.module for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert seen == vars(dobot_async)["homes"]()


def test_the_package_alone_imports_nothing_of_an_arm() -> None:
    program = "import dobot_async, sys; print(*sys.modules)"
    modules = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert {name for name in modules if name.startswith("dobot_async")} == {"dobot_async"}
    assert not {"anyio", "bleak", "serial"} & set(modules)


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
    assert len(ours) == 10
    assert all(issubclass(error, dobot_async.DobotError) for error in ours)
