"""The sdist is whole and builds the same wheel as the repository does; the wheel runs with nothing of the repository.

They are built without isolation and without a network, by the setuptools that is here.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[2]
BUILD = "import setuptools.build_meta as b, sys; print(getattr(b, 'build_' + sys.argv[1])(sys.argv[2]))"
MADE = {"PKG-INFO", "setup.cfg"}


def tracked() -> list[str]:
    """The files of the repository, those that are new and not committed yet as well."""
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("this is no repository, so nothing tells which files belong to it")

    command = ["git", "-C", str(ROOT), "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return [name for name in listed.split("\0") if name and (ROOT / name).is_file()]


def build(what: str, source: Path, into: Path) -> Path:
    """Builds a wheel or an sdist; returns the file."""
    command = [sys.executable, "-W", "ignore", "-c", BUILD, what, str(into)]
    ran = subprocess.run(command, cwd=source, capture_output=True, text=True, check=False, timeout=140)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return into / ran.stdout.splitlines()[-1]


@pytest.fixture(scope="module")
def files() -> list[str]:
    return tracked()


@pytest.fixture(scope="module")
def clone(files: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The repository as somebody else has it: nothing but its files."""
    found = tmp_path_factory.mktemp("clone")
    for name in files:
        target = found / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, target)

    return found


@pytest.fixture(scope="module")
def unpacked(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sdist, unpacked."""
    folder = tmp_path_factory.mktemp("sdist")
    with tarfile.open(build("sdist", clone, folder)) as archive:
        archive.extractall(folder, filter="data")

    (found,) = [path for path in folder.iterdir() if path.is_dir()]
    return found


@pytest.fixture(scope="module")
def wheel(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build("wheel", clone, tmp_path_factory.mktemp("wheel"))


def contents(wheel: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_the_sdist_has_every_file_and_no_other(files: list[str], unpacked: Path) -> None:
    inside = {path.relative_to(unpacked).as_posix() for path in unpacked.rglob("*") if path.is_file()}
    inside = {name for name in inside if ".egg-info/" not in name} - MADE
    expected = {name for name in files if name != ".gitignore"}
    assert expected - inside == set(), "MANIFEST.in leaves it out"
    assert inside - expected == set(), "MANIFEST.in takes in what does not belong to the repository"


def test_the_sdist_builds_the_same_wheel(unpacked: Path, wheel: Path, tmp_path: Path) -> None:
    again = build("wheel", unpacked, tmp_path)
    assert again.name == wheel.name
    assert contents(again) == contents(wheel)


def test_the_wheel_has_the_package_alone(files: list[str], wheel: Path) -> None:
    package = {name for name in files if name.startswith("dobot_async/")}
    inside = {name for name in contents(wheel) if ".dist-info/" not in name}
    assert inside == package


def test_the_wheel_runs_with_nothing_of_the_repository(wheel: Path, tmp_path: Path) -> None:
    installed = tmp_path / "installed"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(installed)

    environment = {name: value for name, value in os.environ.items() if not name.startswith("DOBOT_")}
    environment["PYTHONPATH"] = str(installed)

    def run(*arguments: str) -> str:
        command = [sys.executable, *arguments]
        ran = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False, timeout=140
        )
        assert ran.returncode == 0, ran.stdout + ran.stderr
        return ran.stdout

    where = "import dobot_async; dobot_async.Magician; dobot_async.MyCobot; print(dobot_async.__file__)"
    assert Path(run("-c", where).strip()).is_relative_to(installed)
    assert "pose" in run("-m", "dobot_async", "--url", "sim:?speed=20", "pose", "--help").lower()
    assert run("-m", "dobot_async", "demo")
