"""The directives that describe the package's names.

    ```{public-names} dobot_async            every name of a module that no other module describes, of one kind if
    :kind: errors                            `:kind:` says so; what else it offers is listed below
    ```
    ```{held-class} Magician queue           the class of what a connected arm holds: its queue, or what that makes
    ```
    ```{other-modules}                       each public module that no page of the reference describes
    ```
    ```{examples}                            each program of examples/, with what it says of itself
    ```

A new public name needs nothing here: it is described by its kind.
"""

from __future__ import annotations

import ast
import asyncio
import enum
import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import is_dataclass
from functools import cache
from importlib import import_module
from typing import Any, ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import dobot_async
from dobot_docs.names import ROOT, TOP, modules, owned_names, page_modules, shared_names

__all__ = ["HELD", "KINDS", "kind_of", "register"]


def is_error(value: object) -> bool:
    """Whether it is an exception."""
    return isinstance(value, type) and issubclass(value, BaseException)


def is_arm(value: object) -> bool:
    """Whether it is an arm, or what all arms are."""
    return value is dobot_async.Arm or hasattr(value, "connect")


def is_enum(value: object) -> bool:
    """Whether it is an enumeration."""
    return isinstance(value, type) and issubclass(value, enum.Enum)


def is_value(value: object) -> bool:
    """Whether it is a record of data."""
    return isinstance(value, type) and (is_dataclass(value) or issubclass(value, tuple))


KINDS: Mapping[str, Callable[[object], bool]] = {
    "arms": is_arm,
    "errors": is_error,
    "functions": inspect.isroutine,
    "enums": is_enum,
    "values": is_value,
    "objects": inspect.isclass,
    "data": lambda _: True,
}
"""The kinds of names; the first that fits is the one."""

HELD: Mapping[str, Callable[[Any], Any]] = {
    "queue": lambda arm: arm.queue,
    "batch": lambda arm: arm.queue.batch(),
    "following": lambda arm: arm.following(),
    "wifi": lambda arm: arm.wifi,
    "link": lambda arm: arm.link,
}
"""What a connected arm holds, or makes for a block."""


INSIDE = ("perform", "perform_from_goal", "greet", "leave")
"""Methods by which the parts of an arm call each other."""


def kind_of(value: object) -> str:
    """The kind of what a name stands for."""
    return next(kind for kind, fits in KINDS.items() if fits(value))


def directive_of(value: object) -> str:
    """How autodoc is told of it."""
    if isinstance(value, type):
        return "autoexception" if is_error(value) else "autoclass"

    return "autofunction" if inspect.isroutine(value) else "autodata"


def entry(name: str, value: object) -> Iterator[str]:
    """The lines that describe one name."""
    yield f".. {directive_of(value)}:: {name}"
    if isinstance(value, type):
        yield "   :members:"
        yield "   :undoc-members:"
        yield f"   :inherited-members: {', '.join(foreign(value)) or 'object'}"
        yield f"   :exclude-members: {', '.join(INSIDE)}"

    yield ""


def foreign(kind: type[Any]) -> list[str]:
    """The classes of Python, and of other libraries, that a class comes from: their members are described elsewhere."""
    return [each.__name__ for each in kind.__mro__ if each.__module__.partition(".")[0] != TOP]


class Described(SphinxDirective):
    """A directive that writes reStructuredText."""

    def parse(self, lines: list[str]) -> list[nodes.Node]:
        """Read what was written; the page around is Markdown."""
        return self.parse_text_to_nodes("\n".join(["````{eval-rst}", *lines, "````"]), allow_section_headings=True)


class PublicNames(Described):
    """See the module."""

    required_arguments = 1
    option_spec: ClassVar[dict[str, Any]] = {"kind": str}

    def run(self) -> list[nodes.Node]:
        """Describe the names."""
        return self.parse(list(lines_for(self.arguments[0], self.options.get("kind"))))


def lines_for(name: str, kind: str | None) -> Iterator[str]:
    """The lines that describe a module's names, all or those of a kind."""
    module = import_module(name)
    for each in sorted(owned_names(name), key=str.lower):
        value = getattr(module, each)
        if kind is None or kind_of(value) == kind:
            yield from entry(f"{name}.{each}", value)

    if shared := shared_names(name):
        yield "The module also offers " + ", ".join(f":py:obj:`~{each}`" for each in shared) + "."


class OtherModules(Described):
    """See the module."""

    def run(self) -> list[nodes.Node]:
        """Describe each module."""
        found: list[nodes.Node] = []
        for name in modules():
            if name not in page_modules() and owned_names(name):
                section = nodes.section(ids=[nodes.make_id(name)])
                section += nodes.title("", "", nodes.literal(text=name))
                section += self.parse([f".. automodule:: {name}", "", *lines_for(name, None)])
                found.append(section)

        return found


class HeldClass(Described):
    """See the module."""

    required_arguments = 2

    def run(self) -> list[nodes.Node]:
        """Describe the class."""
        kind = held(self.arguments[0])[self.arguments[1]]
        return self.parse(list(entry(f"{kind.__module__}.{kind.__qualname__}", kind)))


@cache
def held(arm: str) -> Mapping[str, type[Any]]:
    """The classes of what an arm of a name in `dobot_async` holds, found by connecting to a simulated one."""

    async def look() -> dict[str, type[Any]]:
        found = {}
        async with getattr(dobot_async, arm).connect("sim:?speed=100") as connected:
            for word, get in HELD.items():
                try:
                    value = get(connected)
                except AttributeError:
                    continue

                if hasattr(value, "__aenter__"):
                    async with value as value:
                        found[word] = type(value)
                else:
                    found[word] = type(value)

        return found

    return asyncio.run(look())


class Examples(SphinxDirective):
    """See the module."""

    def run(self) -> list[nodes.Node]:
        """Show each program."""
        return self.parse_text_to_nodes("\n".join(self.lines()), allow_section_headings=True)

    def lines(self) -> Iterator[str]:
        """The Markdown of all of them."""
        for path in sorted((ROOT / "examples").glob("*.py")):
            self.env.note_dependency(str(path))
            said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
            yield from (f"## {path.name}", "", said.partition("\n\n")[0], "")
            yield from (f"```{{literalinclude}} /../examples/{path.name}", ":language: python", "```", "")


def register(app: Sphinx) -> None:
    """Make the directives known."""
    app.add_directive("examples", Examples)
    app.add_directive("public-names", PublicNames)
    app.add_directive("other-modules", OtherModules)
    app.add_directive("held-class", HeldClass)
