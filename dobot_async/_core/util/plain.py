"""Values as JSON can hold them."""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

__all__ = ["plain"]


def plain(value: Any) -> Any:
    """Return a value as JSON can hold it: dataclasses as objects, enums by name, bytes as hex."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}

    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}

    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]

    if isinstance(value, Enum):
        return value.name

    if isinstance(value, bytes):
        return value.hex(" ")

    # JSON has no word for these.
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
