"""What the package imports is what pyproject.toml declares, and nothing is declared in vain: read from the source."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

import dobot_async

ROOT = Path(__file__).parents[2]
PACKAGE = Path(dobot_async.__file__).parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
FOR_DEVELOPERS = {"dev", "docs", "fuzz"}
"""Extras for tests and pages, of which the package itself imports nothing."""


def normalized(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def distribution(requirement: str) -> str:
    """The name of a requirement such as "bleak>=3.1,<4"."""
    found = re.match(r"[\w.-]+", requirement)
    assert found
    return normalized(found[0])


def imported(path: Path) -> Iterator[str]:
    """The top-level names that a file imports when it runs; what only type checkers read is left out."""
    unchecked = [ast.parse(path.read_text(encoding="utf-8"))]
    while unchecked:
        node: ast.AST = unchecked.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            unchecked += node.orelse  # type: ignore[arg-type]
            continue

        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.partition(".")[0]

        unchecked += ast.iter_child_nodes(node)  # type: ignore[arg-type]


def third_party() -> dict[str, set[str]]:
    """The distributions that the package imports, each with the files that do."""
    found: dict[str, set[str]] = {}
    known = packages_distributions()
    for path in sorted(PACKAGE.rglob("*.py")):
        for name in imported(path):
            if name not in sys.stdlib_module_names and name not in {"__future__", "dobot_async"}:
                candidates = {normalized(each) for each in known.get(name, [name])}
                declared = CORE.union(*OPTIONAL.values()) & candidates  # several distributions may share a name
                for each in declared or candidates:
                    found.setdefault(each, set()).add(str(path.relative_to(PACKAGE)))

    return found


CORE = {distribution(each) for each in PROJECT["dependencies"]}
EXTRAS = {
    extra: {distribution(each) for each in requirements} - {"dobot-async"}
    for extra, requirements in PROJECT["optional-dependencies"].items()
}
OPTIONAL = {name: each for name, each in EXTRAS.items() if name not in FOR_DEVELOPERS}


def test_what_is_imported_is_declared() -> None:
    declared = CORE.union(*OPTIONAL.values())
    missing = {name: files for name, files in third_party().items() if name not in declared}
    assert not missing, "declare it, as a dependency or in an extra"


@pytest.mark.full
def test_what_is_declared_is_imported() -> None:
    unused = CORE.union(*OPTIONAL.values()) - third_party().keys()
    assert not unused, "no module of the package imports it"


def test_a_library_is_in_one_place() -> None:
    twice = [name for name in CORE for extra in OPTIONAL.values() if name in extra]
    assert not twice


@pytest.mark.parametrize("extra", OPTIONAL)
def test_developers_have_each_extra(extra: str) -> None:
    (own,) = [each for each in PROJECT["optional-dependencies"]["dev"] if distribution(each) == "dobot-async"]
    assert extra in re.findall(r"[\w-]+", own.partition("[")[2])


def test_each_requirement_has_a_lowest_version() -> None:
    """`make test-minimum` runs the tests with these; stubs follow what they describe."""
    requirements = [
        *PROJECT["dependencies"],
        *(each for extra in PROJECT["optional-dependencies"].values() for each in extra),
    ]
    loose = [each for each in requirements if ">=" not in each and not each.startswith(("dobot-async[", "types-"))]
    assert not loose


@pytest.mark.parametrize("extra", OPTIONAL)
def test_an_extra_that_is_missing_is_named(extra: str) -> None:
    """Where a library of an extra is imported there is a message that says how to get it."""
    if extra == "pytest":
        return  # it is pytest that imports the plugin

    ways = f"dobot-async[{extra}]", f'needing("{extra}")'
    sources = [path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")]
    assert any(way in source for source in sources for way in ways)


@pytest.mark.full
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is no D-Bus to simulate")
def test_a_simulated_ble_module_names_its_extra() -> None:
    program = """
import asyncio, sys
sys.modules["dbus_fast"] = None
from dobot_async.simulator import simulate

async def main():
    async with simulate(listen="ble"):
        pass

asyncio.run(main())
"""
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=120)
    assert ran.stderr.splitlines()[-1].endswith("pip install 'dobot-async[ble-sim]'")
