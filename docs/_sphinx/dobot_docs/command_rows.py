"""The rows of a family's table, with what the source says beside them.

A row's group is the comment that stands above it on a line of its own; its note is the comment at the end of its line.
"""

from __future__ import annotations

import ast
import inspect
import io
import tokenize
from collections.abc import Iterator
from importlib import import_module
from types import ModuleType
from typing import Any, NamedTuple, cast

from dobot_async import Command
from dobot_docs.wire_formats import Described, describe

__all__ = ["Row", "rows"]


class Row(NamedTuple):
    """One row of a table, in words.

    Attributes:
        constant: Its name in the module.
        group: The heading that it stands under in the source.
        note: The comment at the end of its line.
    """

    constant: str
    command: Command[Any, Any]
    group: str
    note: str
    sent: Described
    answered: Described

    @property
    def meaning(self) -> str:
        """What its values are, with units; "" where nothing says it."""
        kinds = [each.kind for each in (self.sent, self.answered) if each.kind]
        said = [first_sentence(kind) for kind in dict.fromkeys(kinds)]
        return " ".join(part for part in (self.note and f"{self.note[0].upper()}{self.note[1:]}.", *said) if part)


def first_sentence(kind: type[Any]) -> str:
    """What the docstring of a class begins with; "" for bool, whose docstring speaks of Python."""
    return "" if kind is bool else (inspect.getdoc(kind) or "").partition("\n\n")[0].replace("\n", " ")


def rows(module: ModuleType) -> Iterator[Row]:
    """All rows of a module of commands, with what its source says beside them."""
    source = inspect.getsource(written_in(module))
    comments = {
        token.start[0]: (token.start[1] == 0, token.string.lstrip("# "))
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT
    }
    group = ""
    for statement in ast.parse(source).body:
        above, heading = comments.get(statement.lineno - 1, (False, ""))
        group = heading if above else group
        match statement:
            case ast.Assign(targets=[ast.Name(id=name)]) if isinstance(command := getattr(module, name), Command):
                _, note = comments.get(cast("int", statement.end_lineno), (False, ""))
                yield Row(name, command, group, note, describe(command.request), describe(command.reply))
            case _:
                pass


def written_in(module: ModuleType) -> ModuleType:
    """The module in which a table is written, which the public one may take whole from elsewhere."""
    for statement in ast.parse(inspect.getsource(module)).body:
        match statement:
            case ast.ImportFrom(module=str(name), names=[ast.alias(name="*")]) if hasattr(import_module(name), "ALL"):
                return written_in(import_module(name))
            case _:
                pass

    return module
