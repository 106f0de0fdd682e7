"""Which names are public, and under which of them each object is described: once, however many modules offer it.

Public are the names of `dobot_async`, and those of each module that the README, a page or an example imports from. A
new module needs nothing here: to write about it makes it public.
"""

from __future__ import annotations

import enum
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, get_args, get_type_hints

from dobot_docs.command_rows import rows

__all__ = ["ROOT", "TOP", "full_name", "modules", "owned_names", "page_modules", "public_names", "shared_names"]

ROOT = Path(__file__).parents[3]
REFERENCE = ROOT / "docs" / "reference"
TOP = "dobot_async"
IMPORT = re.compile(r"^ *from (dobot_async(?:\.\w+)*) import (\w+)", re.MULTILINE)
NAMED = re.compile(r"^```\{public-names\} (\S+)", re.MULTILINE)
INSIDE = frozenset({"adding-a-family.md"})
"""Pages for those who change the package itself, whose imports make nothing public."""


@cache
def modules() -> tuple[str, ...]:
    """Every public module: the package, those with a page of the reference, and then those that are written about."""
    return tuple(dict.fromkeys((TOP, *page_modules(), *sorted(written_about()))))


@cache
def page_modules() -> tuple[str, ...]:
    """The modules that a page of the reference describes."""
    texts = [path.read_text(encoding="utf-8") for path in sorted(REFERENCE.glob("*.md"))]
    return tuple(dict.fromkeys(name for text in texts for name in NAMED.findall(text)))


def written_about() -> Iterator[str]:
    """The modules that the README, the pages, the notebooks and the examples import from."""
    pages = [path for path in (ROOT / "docs").glob("*.md") if path.name not in INSIDE]
    for path in (ROOT / "README.md", *pages, *(ROOT / "examples").glob("*.py")):
        for module, name in IMPORT.findall(path.read_text(encoding="utf-8")):
            if "._" not in module:
                yield (
                    f"{module}.{name}" if isinstance(getattr(import_module(module), name, None), ModuleType) else module
                )


@cache
def public_names(module: str) -> tuple[str, ...]:
    """The names that a module offers: its `__all__`; of a table of commands, the types of its parameters."""
    found = import_module(module)
    if hasattr(found, "ALL"):
        return tuple(sorted({kind.__name__ for kind in parameter_types(found) if kind.__name__ in vars(found)}))

    return tuple(found.__all__) if hasattr(found, "__all__") else ()


def parameter_types(module: ModuleType) -> Iterator[type[Any]]:
    """The classes of all parameters of a table of commands, and those that are fields of others."""
    for row in rows(module):
        for described in (row.sent, row.answered):
            if described.kind and described.kind is not bool:
                yield from with_fields(described.kind)


def with_fields(kind: type[Any]) -> Iterator[type[Any]]:
    """A class, and the records and enums among its fields."""
    yield kind
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        for each in fields(kind):
            for part in (hints[each.name], *get_args(hints[each.name])):
                if isinstance(part, type) and (is_dataclass(part) or issubclass(part, enum.Enum)):
                    yield from with_fields(part)


@cache
def homes() -> dict[int, str]:
    """The name under which each class and function is described, by its identity."""
    found: dict[int, str] = {}
    for module in modules():
        for name in public_names(module):
            value = getattr(import_module(module), name)
            if callable(value) and not hasattr(value, "__metadata__"):
                found.setdefault(id(value), f"{module}.{name}")

    return found


def full_name(value: Any) -> str:
    """The name under which an object is described; where it is at home if it is not."""
    return homes().get(id(value), f"{value.__module__}.{value.__qualname__}")


def owned_names(module: str) -> list[str]:
    """The names of a module that are described there."""
    return [name for name in public_names(module) if described_at(module, name) == f"{module}.{name}"]


def shared_names(module: str) -> list[str]:
    """Where the other names of a module are described."""
    found = {name: described_at(module, name) for name in public_names(module)}
    return [home for name, home in found.items() if home != f"{module}.{name}"]


def described_at(module: str, name: str) -> str:
    """The name under which what a module offers by a name is described."""
    return homes().get(id(getattr(import_module(module), name)), f"{module}.{name}")
