"""The workflows of .github: they cannot run here, but what can be read of them is looked at."""

from __future__ import annotations

import re
import runpy
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
PINNED = re.compile(r"[\w.-]+/[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def read(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return found


def named(path: Path) -> str:
    return path.stem


def test_there_is_one_for_tests_pages_and_releases() -> None:
    assert [path.stem for path in WORKFLOWS] == ["docs", "release", "test"]


@pytest.mark.parametrize("path", WORKFLOWS, ids=named)
def test_actions_are_pinned(path: Path) -> None:
    used = re.findall(r"uses: (.+)", path.read_text(encoding="utf-8"))
    assert used
    assert not [each for each in used if not PINNED.fullmatch(each)]


def test_an_action_has_one_version() -> None:
    used = {use for path in WORKFLOWS for use in re.findall(r"uses: (.+)", path.read_text(encoding="utf-8"))}
    assert len({use.partition("@")[0] for use in used}) == len(used)


@pytest.mark.parametrize("path", WORKFLOWS, ids=named)
def test_each_job_has_the_rights_that_it_needs_and_an_end(path: Path) -> None:
    workflow = read(path)
    assert workflow["permissions"] == {}
    for job in workflow["jobs"].values():
        assert job["permissions"]
        assert job["timeout-minutes"] <= 60


def test_three_systems_are_tested() -> None:
    matrix = read(ROOT / ".github" / "workflows" / "test.yml")["jobs"]["test"]["strategy"]["matrix"]
    assert {system.partition("-")[0] for system in matrix["system"]} == {"ubuntu", "macos", "windows"}


def test_nothing_that_was_built_with_rights_is_published() -> None:
    """What builds can write nowhere; what publishes runs nothing of the repository."""
    jobs = read(ROOT / ".github" / "workflows" / "release.yml")["jobs"]
    assert jobs["build"]["permissions"] == {"contents": "read"}
    assert not [step for step in jobs["publish"]["steps"] if "run" in step]
    assert jobs["publish"]["environment"]["name"] == "pypi"
    assert jobs["publish"]["permissions"] == {"id-token": "write", "attestations": "write"}


@pytest.mark.parametrize("target", ["docs", "dist", "sbom", "check", "test-minimum"])
def test_make_has_what_they_call(target: str) -> None:
    called = {
        target for path in WORKFLOWS for target in re.findall(r"run: make ([\w-]+)", path.read_text(encoding="utf-8"))
    }
    assert target in called
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)


def test_zizmor_finds_nothing() -> None:
    beside = Path(sys.executable).with_name("zizmor")
    program = str(beside) if beside.exists() else shutil.which("zizmor")
    if program is None:
        pytest.skip("zizmor is not installed")

    ran = subprocess.run(
        [program, "--offline", "--no-progress", "--persona=pedantic", str(ROOT / ".github")],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr


HERE = {
    "GITHUB_SERVER_URL": "https://github.com",
    "GITHUB_REPOSITORY": "somebody/dobot-async",
    "GITHUB_REF_NAME": "v0.1.0",
}
OWN = {
    "Homepage": "https://github.com/somebody/dobot-async",
    "Repository": "https://github.com/somebody/dobot-async",
    "Issues": "https://github.com/somebody/dobot-async/issues",
    "Changelog": "https://github.com/somebody/dobot-async/blob/main/CHANGELOG.md",
}


@pytest.mark.parametrize(
    ("version", "urls", "changelog", "words"),
    [
        ("0.1.0", {}, "## [0.1.0] - 2027-01-01", []),
        ("0.2.0", {}, "## [0.2.0] - 2027-01-01", ["the tag is v0.1.0"]),
        ("0.1.0", {}, "## [Unreleased]", ["no heading for 0.1.0"]),
        (
            "0.1.0",
            {"Issues": "https://github.com/another/dobot-async/issues"},
            "## [0.1.0]",
            ["Issues in pyproject.toml"],
        ),
        ("0.1.0", {"Repository": "https://github.com/somebody/dobot-async-2"}, "## [0.1.0]", ["Repository in"]),
    ],
)
def test_a_release_that_is_not_ready_is_refused(
    version: str, urls: dict[str, str], changelog: str, words: list[str]
) -> None:
    problems = runpy.run_path(str(ROOT / ".ci" / "check_release.py"))["problems"]
    found = list(problems({"version": version, "urls": OWN | urls}, changelog, HERE))
    assert len(found) == len(words)
    assert all(word in said for word, said in zip(words, found, strict=True))


def test_the_addresses_are_all_of_one_repository() -> None:
    problems = runpy.run_path(str(ROOT / ".ci" / "check_release.py"))["problems"]
    owner = PROJECT["urls"]["Repository"].removeprefix("https://github.com/")
    here = {**HERE, "GITHUB_REPOSITORY": owner, "GITHUB_REF_NAME": f"v{PROJECT['version']}"}
    assert not list(problems(PROJECT, f"## [{PROJECT['version']}]", here))


def test_a_fault_is_reported_with_a_trace() -> None:
    form = read(ROOT / ".github" / "ISSUE_TEMPLATE" / "fault.yml")
    (trace,) = [field for field in form["body"] if field.get("id") == "trace"]
    assert "--trace" in trace["attributes"]["description"]
    assert trace["validations"]["required"]


def test_the_hooks_before_a_commit_are_those_of_the_tests() -> None:
    hooks = [hook for repo in read(ROOT / ".pre-commit-config.yaml")["repos"] for hook in repo["hooks"]]
    assert {hook["id"] for hook in hooks} == {"ruff-check", "ruff-format", "mypy", "zizmor"}
    assert all(hook["language"] == "system" for hook in hooks)
