"""Docstrings of this package, made fit for reStructuredText.

They are written for readers of the source: a block that is indented behind a blank line is code or a drawing, and a
name between single backticks is a name, an ending such as in "`Motion`s" behind it or not. The first and the ending are
told to docutils here; the name is `default_role` in conf.py. And what the verbs return, `T` in the source, becomes
what it stands for on the arm, on its queue, and in a batch.
"""

from __future__ import annotations

import inspect
import re
from pydoc import locate
from typing import Any, Generic, TypeVar, get_args, get_origin

from sphinx.application import Sphinx
from sphinx.util.typing import stringify_annotation

__all__ = ["literal_blocks", "register", "return_type"]

INDENTED = re.compile(r" {4,}\S")
ENDING = re.compile(r"(?<![`\w:])(`[^`\s]+`)(?=\w)")
BEFORE_NAPOLEON = 400


def literal_blocks(lines: list[str]) -> list[str]:
    """Put `::` before each indented block that follows a blank line, as long as it belongs to no section or list."""
    found: list[str] = []
    inside = False
    for number, line in enumerate(lines):
        if line and not line.startswith(" "):
            inside = False
        elif INDENTED.match(line) and not inside and (number == 0 or not lines[number - 1]):
            before = next((each for each in reversed(found) if each), "")
            if not before.startswith((" ", "- ", "* ")) and not before.endswith("::"):
                found += ["::", ""]

            inside = True

        found.append(line)

    return found


def return_type(kind: type[Any]) -> str | None:
    """What the parameter T of a class's verbs stands for; None where it has none."""
    for each in kind.__mro__:
        for base in vars(each).get("__orig_bases__", ()):
            found = get_args(base)
            if get_origin(base) is not Generic and len(found) == 1 and not isinstance(found[0], TypeVar):
                return stringify_annotation(found[0], "smart")

    return None


def process_docstring(_app: Sphinx, what: str, _name: str, obj: object, _options: object, lines: list[str]) -> None:
    """What Sphinx asks for each docstring; that of a constant's class says nothing about the constant."""
    if what == "data" and lines and lines[0] and (inspect.getdoc(type(obj)) or "").startswith(lines[0]):
        lines.clear()

    lines[:] = [ENDING.sub(r"\1\\ ", line) for line in literal_blocks(lines)]


def process_signature(
    _app: Sphinx, _what: str, name: str, _obj: object, _options: object, signature: str | None, returned: str | None
) -> tuple[str, str] | None:
    """What Sphinx asks for each signature: the verbs' T is told by the class that they are on."""
    if not returned or not signature or returned.rpartition(".")[2].strip("~") not in {"T", "T_co"}:
        return None

    kind = locate(name.rpartition(".")[0])
    found = return_type(kind) if isinstance(kind, type) else None
    return (signature, found) if found else None


def register(app: Sphinx) -> None:
    """Listen for docstrings, before napoleon does, and for signatures."""
    app.connect("autodoc-process-docstring", process_docstring, priority=BEFORE_NAPOLEON)
    app.connect("autodoc-process-signature", process_signature)
