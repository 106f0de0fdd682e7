"""How long modules and functions are, and that a class name is found once; docs/decisions/0062."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "dobot_async"
MODULE_LINES = 320
FUNCTION_LINES = 60
"""Without the docstring, which says what each argument is."""

GENERATED = "Written by tests/sync/write_sync.py"
FAMILIES = {"magician", "mycobot", "ultraarm"}
CONTRACTS = {"Frame", "Parser"}
"""What a family brings under the name that its contract in `_core/protocol` has."""

PUBLIC = {"DeviceInfo", "Kinematics", "Place"}
"""Public names of two packages: a value of all arms and a row of the Magician's manual; a place and an action."""

MODULES = sorted(PACKAGE.rglob("*.py"))
Function = ast.FunctionDef | ast.AsyncFunctionDef


def parsed(module: Path) -> ast.Module:
    return ast.parse(module.read_text(encoding="utf-8"))


def generated(module: Path) -> bool:
    return GENERATED in (ast.get_docstring(parsed(module)) or "")


def lines_of(function: Function) -> int:
    """How long a function is, from `def` to its end, without its docstring."""
    assert function.end_lineno
    first, lines = function.body[0], function.end_lineno - function.lineno + 1
    if ast.get_docstring(function, clean=False) is None:
        return lines

    assert first.end_lineno
    return lines - (first.end_lineno - first.lineno + 1)


def families(module: Path) -> set[str]:
    """The family whose folder, or module, this is."""
    return FAMILIES & set(module.relative_to(PACKAGE).with_suffix("").parts)


def places(name: str, modules: list[Path]) -> list[str]:
    """Where a name is defined besides the places that may share it."""
    if name in CONTRACTS:
        modules = [module for module in modules if "_core" not in module.parts]

    own = [family for module in modules for family in families(module)]
    if len(own) == len(modules) and len(set(own)) == len(own):
        return []

    return [str(module.relative_to(PACKAGE)) for module in modules]


def classes() -> Iterator[tuple[str, list[Path]]]:
    """The names of classes, but for those that have the names of asynchronous ones, or of other libraries."""
    found: defaultdict[str, list[Path]] = defaultdict(list)
    for module in MODULES:
        if module.relative_to(PACKAGE).parts[0] not in {"sync", "compat"}:
            for node in ast.walk(parsed(module)):
                if isinstance(node, ast.ClassDef):
                    found[node.name].append(module)

    yield from found.items()


def test_no_module_is_longer_than_it_may_be() -> None:
    long = {
        str(module.relative_to(PACKAGE)): lines
        for module in MODULES
        if (lines := len(module.read_text(encoding="utf-8").splitlines())) > MODULE_LINES and not generated(module)
    }
    assert not long


def test_no_function_is_longer_than_it_may_be() -> None:
    long = {
        f"{module.relative_to(PACKAGE)}: {node.name}": lines
        for module in MODULES
        for node in ast.walk(parsed(module))
        if isinstance(node, Function) and (lines := lines_of(node)) > FUNCTION_LINES
    }
    assert not long


def test_a_class_name_is_found_once() -> None:
    twice = {name: found for name, modules in classes() if len(modules) > 1 and (found := places(name, modules))}
    assert twice.keys() == PUBLIC, twice


@pytest.mark.parametrize(
    ("source", "lines"), [("def f():\n    '''A.\n\n    B.'''\n    g()", 2), ("def f():\n    g()", 2)]
)
def test_a_docstring_does_not_count(source: str, lines: int) -> None:
    function = ast.parse(source).body[0]
    assert isinstance(function, Function)
    assert lines_of(function) == lines
