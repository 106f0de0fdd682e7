"""The distributions in integrations/: their own tests, where what they are for is installed."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DISTRIBUTIONS = sorted(path.parent for path in (ROOT / "integrations").glob("*/pyproject.toml"))
missing = not find_spec("lerobot") and not os.environ.get("DOBOT_REQUIRE_LEROBOT")


@pytest.mark.skipif(missing, reason="lerobot is not installed: make lerobot")
@pytest.mark.parametrize("folder", DISTRIBUTIONS, ids=lambda folder: folder.name)
def test_contract(folder: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:anyio",
        "--rootdir",
        str(folder),
    ]
    paths = os.pathsep.join([str(ROOT), str(folder), os.environ.get("PYTHONPATH", "")])
    ran = subprocess.run(
        [*command, str(folder / "tests")],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": paths},
        check=False,
        timeout=140,
    )
    assert ran.returncode == 0, ran.stdout


@pytest.mark.parametrize("folder", DISTRIBUTIONS, ids=lambda folder: folder.name)
def test_the_distribution_has_the_name_by_which_lerobot_finds_it(folder: Path) -> None:
    project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["name"] == folder.name
    assert folder.name.startswith("lerobot_robot_")
    assert (folder / folder.name / "__init__.py").is_file()
    assert any(each.startswith("dobot-async") for each in project["dependencies"])
    assert (folder / "README.md").is_file()


def test_both_stand_in_for_the_same_packages() -> None:
    texts = {(folder / "tests" / "conftest.py").read_text(encoding="utf-8") for folder in DISTRIBUTIONS}
    assert len(texts) == 1
