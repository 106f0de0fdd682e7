"""How a layout lies on the wire, in words: `describe(row.request)`.

One function for each class of layout, of all families; a class that is not known here is a TypeError, which the build
and a test show.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import singledispatch
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

from dobot_async._core.protocol import layouts as common
from dobot_async._core.protocol import wire
from dobot_async.arms.mycobot import dialects as cobot_variants
from dobot_async.arms.mycobot import layouts as cobot
from dobot_async.arms.mycobot import params as cobot_params
from dobot_async.arms.ultraarm import answers
from dobot_async.arms.ultraarm import layouts as words

__all__ = ["Described", "describe"]

CODES = {"B": "u8", "H": "u16", "I": "u32", "Q": "u64", "b": "i8", "h": "i16", "i": "i32", "q": "i64", "f": "f32"}


class Described(NamedTuple):
    """A layout in words.

    Attributes:
        text: The fields in the order of the wire, "" for nothing at all.
        kind: The class of the value, where it is one.
        bare: Whether it is a number without a name, whose unit the row's own note has to tell.
    """

    text: str
    kind: type[Any] | None = None
    bare: bool = False


@singledispatch
def describe(layout: object) -> Described:
    """Say how a layout lies on the wire; TypeError for a class of layouts that is not known here."""
    raise TypeError(f"{type(layout).__module__}.{type(layout).__qualname__} has no description")


@describe.register(type(common.NOTHING))
def _(_: object) -> Described:
    return Described("")


@describe.register
def _(layout: wire.Number) -> Described:  # type: ignore[type-arg]
    field = layout.field
    return Described(scalar(field.scalar), field.kind, bare=field.kind is None)


@describe.register(wire.Record)
@describe.register(cobot.Packed)
@describe.register(words.Words)
def _(layout: Any) -> Described:
    return Described(", ".join(members(layout.kind)), layout.kind)


@describe.register
def _(layout: words.Relative) -> Described:  # type: ignore[type-arg]
    inner = describe(layout.words)
    return inner._replace(text=f"lines G91, G0 {inner.text}, G90")


@describe.register
def _(layout: cobot.Axis) -> Described:  # type: ignore[type-arg]
    inner = describe(layout.mm)
    return inner._replace(text=f"{inner.text}; × 100 for the angles, axes 4 to 6")


@describe.register
def _(layout: common.Lenient) -> Described:  # type: ignore[type-arg]
    inner = describe(layout.layout)
    return inner._replace(
        text=f"{inner.text}; the arm needs the first {layout.least} bytes" if layout.least else inner.text
    )


@describe.register
def _(_: common.Count) -> Described:
    return Described("u32, or u64 from newer firmware", bare=True)


@describe.register
def _(layout: common.Counted) -> Described:  # type: ignore[type-arg]
    return Described(f"u8 count, then up to {layout.limit} of ({describe(layout.record).text})", layout.record.kind)


@describe.register
def _(layout: common.Text) -> Described:
    return Described(f"text of up to {layout.limit} bytes ({layout.encoding}), NUL")


@describe.register
def _(layout: common.Bytes) -> Described:
    return Described("any bytes" if layout.size is None else f"{layout.size} bytes")


@describe.register
def _(layout: cobot.Value) -> Described:  # type: ignore[type-arg]
    [(_, fixed, kind)] = layout.parts
    return Described(scaled(fixed), kind, bare=kind is None)


@describe.register
def _(layout: cobot.Octets) -> Described:
    return Described(f"{min(layout.lengths)} to {max(layout.lengths)} × u8", bare=True)


@describe.register
def _(_: cobot.Whole) -> Described:
    return Described("u8 or u16", bare=True)


@describe.register
def _(_: cobot.Acknowledgement) -> Described:
    return Described("nothing, or what newer firmware adds")


@describe.register
def _(_: cobot_variants.ServoRegister) -> Described:
    return Described("joint u8, address u8, value u8; or value u16 and u8 = 1", cobot_params.ServoData)


@describe.register
def _(_: cobot_variants.PositionLayout) -> Described:
    return Described("values 4 to 7 × i16, position u8 (first on a myArm)", cobot_params.InPosition)


@describe.register
def _(_: answers.ReceiptLayout) -> Described:
    return Described("any text, QUEUE SIZE[n]", answers.Receipt)


@describe.register
def _(_: answers.StatusLayout) -> Described:
    return Described("Moving end at rest, QUEUE SIZE[n], ENDSTOP[...]", answers.Status)


@describe.register
def _(layout: answers.Bracket) -> Described:  # type: ignore[type-arg]
    return Described(f"{layout.keyword}[number]", bare=True)


@describe.register
def _(layout: answers.Numbers) -> Described:  # type: ignore[type-arg]
    names = ", ".join(field.name for field in fields(layout.kind))
    return Described(f"{layout.keyword}[{names}]", layout.kind)


def members(kind: type[Any]) -> Iterator[str]:
    """Each field of a record, as "name format"."""
    hints = get_type_hints(kind, include_extras=True)
    for each in fields(kind):
        hint = hints[each.name]
        optional = [part for part in get_args(hint) if get_origin(part) is Annotated]
        annotation, mark = (optional[0], "?") if get_origin(hint) is not Annotated and optional else (hint, "")
        yield f"{each.name} {format_of(annotation)}{mark}"


def format_of(annotation: Any) -> str:
    """The format of one annotated field; that of a record inside of a record is in brackets."""
    if is_dataclass(annotation):
        return f"({', '.join(members(annotation))})" if isinstance(annotation, type) else ""

    mark = get_args(annotation)[1]
    if isinstance(mark, wire.Scalar):
        return scalar(mark)

    if isinstance(mark, cobot.Fixed):
        return scaled(mark)

    if isinstance(mark, words.Letter):
        return f"{mark.letter}{between(mark.low, mark.high) if abs(mark.low) < 9999 else ''}"

    return describe(mark).text


def scalar(found: wire.Scalar) -> str:
    """A number of the Magician's."""
    capacity = wire.Scalar(found.code)
    narrower = (found.low, found.high) != (capacity.low, capacity.high)
    many = f"{found.count} × " if found.count > 1 else ""
    return f"{many}{CODES[found.code]}{between(found.low, found.high) if narrower else ''}"


def scaled(found: cobot.Fixed) -> str:
    """A whole number of the myCobot family's, and by what the value is multiplied."""
    many = f"one for each of the {found.count.value}: " if found.count else ""
    scale = {
        (1,): "",
        (10, 10, 10, 100): " = mm × 10, degrees × 100",
    }.get(found.scales, f" = value × {found.scales[0]}")
    limits = between(found.low, found.high) if found.low > -1e9 else ""
    return f"{many}{CODES[found.code]}{scale}{limits}{'?' if found.optional else ''}"


def between(low: float, high: float) -> str:
    """A range, behind what has it."""
    return f" ({low:g} to {high:g})"
