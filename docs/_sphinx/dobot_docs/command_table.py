"""The directive `command-table`: every row of a family's table, in its order, under the headings of its source.

    ```{command-table} dobot_async.magician.commands
    ```

What a row's values mean, with their units, is the first sentence of the value's class, or the comment at the end of the
row's own line. Each row can be referred to as `dobot_async.magician.commands.GET_POSE`.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any, ClassVar, cast

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.domains.python import PythonDomain
from sphinx.util.docutils import SphinxDirective

from dobot_async import Command
from dobot_docs.command_rows import Row, rows
from dobot_docs.names import full_name
from dobot_docs.wire_formats import Described

__all__ = ["register"]

HEAD = ("Row", "ID", "Sent", "Answered", "Meaning and units", "Queue", "Section")
WIDTHS = (20, 5, 20, 20, 22, 8, 5)


def lacking(command: Command[Any, Any], models: Mapping[str, Any]) -> str:
    """Which models do not have a row, or have it under another ID."""
    without = [model.title for model in models.values() if command in model.lacks]
    other = {
        f"{own.id:#04x}": model.title
        for model in models.values()
        if (own := model.rows.get(command)) and own.id != command.id
    }
    parts = ["Not on " + ", ".join(without) + "."] if without else []
    parts += [f"ID {number} on all but the myArm 300." for number in other]
    return " ".join(parts)


class CommandTable(SphinxDirective):
    """See the module."""

    required_arguments = 1
    option_spec: ClassVar[dict[str, Any]] = {"models": str, "id": str}

    def run(self) -> list[nodes.Node]:
        """Make one table for each group."""
        module = import_module(self.arguments[0])
        self.env.note_dependency(str(module.__file__))
        models = import_module(self.options["models"]).MODELS if "models" in self.options else {}
        found: list[nodes.Node] = []
        group, body = None, nodes.tbody()
        for row in rows(module):
            if row.group != group:
                group, body = row.group, nodes.tbody()
                found += [nodes.rubric(text=group), table(body)] if group else [table(body)]

            body += self.row_node(module.__name__, row, lacking(row.command, models))

        return found

    def row_node(self, module: str, row: Row, models: str) -> nodes.row:
        """One line of a table, which can be referred to."""
        full_name = f"{module}.{row.constant}"
        number = row.command.name if self.options.get("id") == "word" else f"{row.command.id}"
        if self.options.get("id") == "hex":
            number = f"{row.command.id:#04x}"

        name = nodes.paragraph("", "", nodes.literal(text=row.constant))
        if row.command.name != number:
            name += [nodes.Text(" "), nodes.emphasis(text=row.command.name)]

        meaning = " ".join(part for part in (row.meaning, models) if part)
        cells = [
            name,
            nodes.paragraph(text=number),
            layout_node(row.sent),
            layout_node(row.answered),
            nodes.paragraph(text=meaning.replace("`", "")),
            nodes.paragraph(text=row.command.queueing.value),
            nodes.paragraph(text=row.command.section),
        ]
        found = nodes.row("", *[nodes.entry("", cell) for cell in cells], ids=[full_name])
        cast("PythonDomain", self.env.get_domain("py")).note_object(full_name, "data", full_name, location=found)
        return found


def layout_node(found: Described) -> nodes.paragraph:
    """The class of a value, which leads to its description, and how it lies on the wire."""
    paragraph = nodes.paragraph()
    if found.kind and found.kind is not bool:
        name = nodes.literal(text=found.kind.__name__)
        target = full_name(found.kind)
        reference = addnodes.pending_xref("", name, refdomain="py", reftype="class", reftarget=target)
        paragraph += [reference, nodes.Text(": ")]

    paragraph += nodes.Text(found.text or "nothing")
    return paragraph


def table(body: nodes.tbody) -> nodes.table:
    """A table with its head and nothing in it so far."""
    columns = [nodes.colspec(colwidth=width) for width in WIDTHS]
    head = nodes.thead("", nodes.row("", *[nodes.entry("", nodes.paragraph(text=each)) for each in HEAD]))
    return nodes.table("", nodes.tgroup("", *columns, head, body, cols=len(HEAD)), classes=["command-table"])


def register(app: Sphinx) -> None:
    """Make the directive known."""
    app.add_directive("command-table", CommandTable)
