"""What pyproject.toml, the README and the files beside them say of the package agrees, and holds where it goes."""

from __future__ import annotations

import re
import runpy
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))


def test_the_metadata_are_valid() -> None:
    from validate_pyproject import api

    whole = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert api.Validator()(whole) == whole


def test_the_version_stands_in_one_place() -> None:
    version = PROJECT["version"]
    again = [
        path for path in (ROOT / "dobot_async").rglob("*.py") if f'"{version}"' in path.read_text(encoding="utf-8")
    ]
    assert not again, "importlib.metadata knows the version"
    assert CITATION["version"] == version


def test_the_citation_names_the_same() -> None:
    assert CITATION["title"].startswith(PROJECT["name"])
    assert [each["name"] for each in CITATION["authors"]] == [each["name"] for each in PROJECT["authors"]]
    assert CITATION["license"] == PROJECT["license"]
    assert CITATION["repository-code"] == PROJECT["urls"]["Repository"]
    assert CITATION["url"] == PROJECT["urls"]["Documentation"]


def test_the_pythons_that_are_named_are_those_that_are_tested() -> None:
    prefix = "Programming Language :: Python :: 3."
    named = [each.removeprefix(prefix) for each in PROJECT["classifiers"] if each.startswith(prefix)]
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "test.yml").read_text(encoding="utf-8"))
    assert workflow["jobs"]["test"]["strategy"]["matrix"]["python"] == [f"3.{minor}" for minor in named]
    assert PROJECT["requires-python"] == f">=3.{named[0]}"


def test_the_description_names_each_family() -> None:
    assert all(arm in PROJECT["description"] for arm in ("Magician", "myCobot", "myArm", "ultraArm"))


@pytest.fixture
def description(monkeypatch: pytest.MonkeyPatch) -> str:
    """What the package index shows: what setup.py hands over."""
    given: dict[str, Any] = {}
    monkeypatch.setattr("setuptools.setup", lambda **details: given.update(details))
    runpy.run_path(str(ROOT / "setup.py"))
    assert given["long_description_content_type"] == "text/markdown"
    found: str = given["long_description"]
    return found


def test_the_readme_renders_on_the_package_index(description: str) -> None:
    from readme_renderer import markdown

    rendered = markdown.render(description)
    assert rendered is not None
    assert "<table>" in rendered
    assert "<h1" in rendered


def test_the_readme_has_no_link_that_is_relative_there(description: str) -> None:
    links = re.findall(r"\]\(([^)\s]+)\)", description)
    assert len(links) > 30
    assert not [link for link in links if not re.match(r"https://|#", link)]
    repository = PROJECT["urls"]["Repository"]
    files = [link.removeprefix(f"{repository}/blob/main/") for link in links if link.startswith(repository)]
    assert all((ROOT / file.partition("#")[0]).exists() for file in files)


def test_paths_of_the_map_exist() -> None:
    """The map of CONTRIBUTING.md, and the paths that it names elsewhere."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:dobot_async|tests|docs|examples|benchmarks)(?:/[\w./]+)?)`", text)
    assert len(named) > 20
    missing = [each for each in named if not (ROOT / each).exists()]
    assert not missing, f"CONTRIBUTING.md names {missing}"
    folders = {path.name for path in (ROOT / "dobot_async").iterdir() if path.is_dir() and path.name != "__pycache__"}
    unnamed = {folder for folder in folders if f"`dobot_async/{folder}" not in text}
    assert not unnamed, f"the map of CONTRIBUTING.md does not name {sorted(unnamed)} of dobot_async"
