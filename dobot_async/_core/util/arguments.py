"""Arguments that many calls take, checked before a byte is sent."""

from __future__ import annotations

import math
from typing import SupportsFloat

__all__ = ["check_choice", "check_duration", "check_timeout"]


def check_timeout(timeout: SupportsFloat | None, name: str = "timeout") -> float | None:
    """Return seconds; None waits for ever, 0 for nothing.

    Raises:
        ValueError: They are below 0, or not a number.
        TypeError: It is no number at all.
    """
    if timeout is None:
        return None

    seconds = to_float(timeout, name)
    if not seconds >= 0:
        raise ValueError(f"{name} must be seconds, 0 or more, not {timeout!r}")

    return seconds


def check_duration(seconds: SupportsFloat, name: str = "seconds", most: float = math.inf) -> float:
    """Return seconds that are finite and not negative; raise ValueError or TypeError for others."""
    found = to_float(seconds, name)
    if not (0 <= found <= most and math.isfinite(found)):
        limit = "finite" if most == math.inf else f"at most {most:g}"
        raise ValueError(f"{name} must be 0 or more and {limit}, not {seconds!r}")

    return found


def check_choice(name: str, value: object, *choices: object) -> None:
    """Raise ValueError if a value is none of several."""
    if value not in choices:
        raise ValueError(f"{name} must be {' or '.join(map(repr, choices))}, not {value!r}")


def to_float(value: SupportsFloat, name: str) -> float:
    """A number; raises TypeError for anything else."""
    if not hasattr(value, "__float__") and not hasattr(value, "__index__"):
        raise TypeError(f"{name} must be a number, not {value!r}")

    return float(value)
