"""The dissector for Wireshark: `dissector.lua` with the command tables of all families in it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib import resources
from typing import Any

from dobot_async._core.protocol.layouts import Lenient, Text
from dobot_async._core.protocol.wire import Field, Layout, Number, Record
from dobot_async._core.util.plain import is_row, is_table
from dobot_async.arms.magician import commands as magician
from dobot_async.arms.mycobot.layouts import Packed, Value
from dobot_async.arms.mycobot.models import DEFAULT, MODELS
from dobot_async.arms.ultraarm import commands as ultraarm

__all__ = ["dissector"]

Spec = list[dict[str, Any]] | None
"""The parameters of a request or a reply, in their order; None where their layout is none of plain fields."""


def dissector() -> str:
    """Returns the source, in Lua."""
    source = resources.files("dobot_async.cli").joinpath("dissector.lua").read_text(encoding="utf-8")
    return source.replace("--@TABLES@", "\n".join(tables()))


def tables() -> Iterator[str]:
    """Yields the tables, as Lua has them."""
    rows = {
        row.id * 2 + row.write: {
            "name": row.name,
            "section": row.section,
            "request": little(row.request),
            "reply": little(row.reply),
        }
        for row in magician.ALL
    }
    yield f"local MAGICIAN = {lua(rows)}"
    cobots = {
        name: {
            number: {"name": row.name, "request": big(row.request), "reply": big(row.reply)}
            for number, row in ((number, model.row(row)) for number, row in model.by_id.items())
        }
        for name, model in MODELS.items()
    }
    yield f"local MYCOBOT = {lua(cobots)}"
    names = sorted(MODELS, key=lambda name: name != DEFAULT)
    # Wireshark has for each choice: its number, its name, its text.
    yield f"local MODELS = {lua([[place, name, place] for place, name in enumerate(names, 1)])}"
    yield f"local ULTRAARM = {lua({row.name: row.section for row in ultraarm.ALL})}"


def little(layout: Layout[Any]) -> Spec:
    """The fields of a Magician's layout."""
    if isinstance(layout, Lenient):
        return little(layout.layout)

    if isinstance(layout, Text):
        return [{"name": "value", "code": "s"}]

    if isinstance(layout, Number):
        return list(scalars("value", layout.field))

    if isinstance(layout, Record) and not layout.tail:
        return [each for name, field in layout.fields.items() for each in inner(name, field)]

    return None


def inner(name: str, field: Field | Record[Any]) -> Iterator[dict[str, Any]]:
    """Yields the numbers of one field, and those of a record in it by their own names."""
    if isinstance(field, Record):
        for each, part in field.fields.items():
            yield from inner(f"{name}.{each}", part)
    else:
        yield from scalars(name, field)


def scalars(name: str, field: Field) -> Iterator[dict[str, Any]]:
    """Yields the numbers of one field."""
    scalar = field.scalar
    for place in range(scalar.count):
        yield {"name": name if scalar.count == 1 else f"{name}{place + 1}", "code": scalar.code}


def big(layout: Layout[Any]) -> Spec:
    """The fields of a layout of the myCobot family."""
    if not isinstance(layout, (Packed, Value)):
        return None

    found: list[dict[str, Any]] = []
    for name, fixed, _ in layout.parts:
        if fixed.optional or (fixed.count and fixed.count not in layout.sizes):
            return None

        count = layout.sizes[fixed.count] if fixed.count else 1
        for place in range(count):
            scale = fixed.scale(place)
            shown = f"{name}{place + 1}" if fixed.count else name
            found.append({"name": shown, "code": fixed.code, **({"scale": scale} if scale != 1 else {})})

    return found


def lua(value: Any) -> str:
    """A value as Lua writes it."""
    if is_table(value):
        items = (f"[{lua(key)}] = {lua(each)}" for key, each in value.items() if each is not None)
        return "{ " + ", ".join(items) + " }"

    if is_row(value):
        return "{ " + ", ".join(map(lua, value)) + " }"

    return str(value) if isinstance(value, int) else json.dumps(value)
