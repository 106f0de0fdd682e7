"""Values for every row of the table, made from its layouts, for hypothesis."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from dobot_async._core.protocol.layouts import Nothing
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.dialects import PositionLayout, ServoRegister
from dobot_async.arms.mycobot.layouts import Acknowledgement, Axis, Fixed, Octets, Packed, Value, Whole

__all__ = ["values"]

RANGES = {"B": (0, 255), "H": (0, 65535), "h": (-32768, 32767)}


def one(fixed: Fixed, place: int, kind: Any) -> st.SearchStrategy[Any]:
    """One number of a field."""
    if kind is bool:
        return st.booleans()

    if kind is not None:
        return st.sampled_from(list(kind))

    scale = fixed.scale(place)
    low, high = RANGES[fixed.code]
    whole = st.integers(max(low, int(max(fixed.low, -1e6) * scale)), min(high, int(min(fixed.high, 1e6) * scale)))
    return whole if scale == 1 else whole.map(lambda number: number / scale)


def field(fixed: Fixed, kind: Any, sizes: Any) -> st.SearchStrategy[Any]:
    """One field."""
    if fixed.count is not None:
        return st.tuples(*(one(fixed, place, kind) for place in range(sizes[fixed.count])))

    found = one(fixed, 0, kind)
    return st.none() | found if fixed.optional else found


def values(layout: Any) -> st.SearchStrategy[Any]:
    """All values that a layout of one model can carry."""
    match layout:
        case Value():
            [(_, fixed, kind)] = layout.parts
            return field(fixed, kind, layout.sizes)
        case Packed():
            return st.builds(layout.kind, *(field(fixed, kind, layout.sizes) for _, fixed, kind in layout.parts))
        case Axis():
            return st.integers(1, 6).flatmap(
                lambda axis: values(layout.layout(axis)).map(lambda value: type(value)(axis, value.value, value.speed))
            )
        case PositionLayout():
            return st.sampled_from(c.Position).flatmap(
                lambda position: st.builds(c.InPosition, values(layout.layouts[position]), st.just(position))
            )
        case ServoRegister():
            joint, address = st.integers(1, 8), st.integers(0, 255)
            return st.builds(c.ServoData, joint, address, st.integers(0, 255)) | st.builds(
                c.ServoData, joint, address, st.integers(0, 65535), st.just(True)
            )
        case Whole():
            return st.integers(0, 65535)
        case Octets():
            return st.lists(st.integers(0, 255), min_size=min(layout.lengths), max_size=max(layout.lengths)).map(tuple)
        case Nothing() | Acknowledgement():
            return st.none()
        case _:
            raise AssertionError(layout)
