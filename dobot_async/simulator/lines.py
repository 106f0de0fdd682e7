"""Bad lines by name, for tests: what a busy Wi-Fi, Bluetooth and a bad cable do to messages.

The figures are what such lines can be like, and no measurement of one. A line that is given another `Faults` is as bad
as you like.
"""

from __future__ import annotations

from collections.abc import Mapping

__all__ = ["LINES", "ORDERED_LINES"]

LINES: Mapping[str, Mapping[str, float]] = {
    "bad": {"loss": 0.05, "corrupt": 0.05, "dup": 0.05, "latency": 0.001, "jitter": 0.005},
    "wifi": {"loss": 0.03, "dup": 0.005, "latency": 0.003, "jitter": 0.01, "stall": 0.002, "stall_time": 0.3},
    "ble": {"latency": 0.03, "split": 0.5, "merge": 0.1, "stall": 0.005, "stall_time": 0.5},
    "cable": {"loss": 0.01, "corrupt": 0.02, "noise": 0.02, "split": 0.3, "latency": 0.002},
}
"""What `Faults` takes for a Magician, by the line's name; "bad" has a bit of everything. Its Wi-Fi is datagrams."""

ORDERED_LINES: Mapping[str, Mapping[str, float]] = {
    "bad": {"loss": 0.02, "latency": 0.001, "stall": 0.005, "stall_time": 0.3},
    "wifi": {"latency": 0.003, "stall": 0.005, "stall_time": 0.3},
    "ble": {"latency": 0.03, "stall": 0.005, "stall_time": 0.5},
    "cable": {"loss": 0.01, "latency": 0.002},
}
"""The same for arms whose messages have no checksum and need their order: nobody could tell what was spoilt or doubled.

They are reached in a Wi-Fi through TCP, which loses nothing."""
