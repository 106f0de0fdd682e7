"""Values as JSON can hold them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any, TypeGuard

__all__ = ["is_row", "is_table", "plain"]


def is_table(value: object) -> TypeGuard[dict[Any, Any]]:
    """Return whether a value is a dict, of whatever; a type checker knows nothing of what is in one otherwise."""
    return isinstance(value, dict)


def is_row(value: object) -> TypeGuard[Sequence[Any]]:
    """Return whether a value is a list or a tuple, of whatever."""
    return isinstance(value, (list, tuple))


def plain(value: Any) -> Any:
    """Return a value as JSON can hold it: dataclasses as objects, enums by name, bytes as hex."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}

    if is_table(value):
        return {key: plain(each) for key, each in value.items()}

    if is_row(value):
        return [plain(each) for each in value]

    if isinstance(value, Enum):
        return value.name

    if isinstance(value, bytes):
        return value.hex(" ")

    # JSON has no word for these.
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
