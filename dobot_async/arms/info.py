"""Who an arm is, for all families."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["DeviceInfo"]


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Who an arm is; "" where the arm does not tell.

    Attributes:
        serial_number: The vendor's.
        name: The user's.
        version: Of the firmware, "3.2.1".
    """

    serial_number: str
    name: str
    version: str
