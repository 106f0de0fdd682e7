"""The results of a search, and the protocol of its sources."""

from __future__ import annotations

import re
from collections.abc import AsyncGenerator
from dataclasses import dataclass
from typing import Protocol

from dobot_async.arms.info import DeviceInfo

__all__ = ["DiscoveryProblem", "DiscoverySource", "Found", "natural", "printable"]

DIGITS = re.compile(r"(\d+)")


@dataclass(frozen=True, slots=True)
class Found:
    """A way to an arm, or to what may be one.

    Attributes:
        url: What to connect to.
        source: Which search found it: "serial", "wifi", "ble", "zenoh", or a source's own name.
        identity: What tells it from all others of its source: where it is plugged in, or its hardware address.
        description: What the adapter, or the radio module, says of itself.
        families: Which arms it can be, the likeliest first; after an answer to a probe, the one that it is.
        info: Serial number, name and firmware, if it was probed and answered.
        problem: Why a probe got no answer.
        also: Other URLs of the same arm; only a probe can tell.
    """

    url: str
    source: str
    identity: str
    description: str = ""
    families: tuple[str, ...] = ()
    info: DeviceInfo | None = None
    problem: str | None = None
    also: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class DiscoveryProblem:
    """A source that could not search, or not to the end; the others are not disturbed.

    Attributes:
        source: Its name.
        message: What went wrong, on one line.
        error: The exception.
    """

    source: str
    message: str
    error: Exception


class DiscoverySource(Protocol):
    """One way to search.

    Attributes:
        name: For messages, and to choose it by.
        probes_at_once: How many of the arms that it finds may be connected to at a time.
    """

    @property
    def name(self) -> str:
        """See above."""
        ...

    @property
    def probes_at_once(self) -> int:
        """See above."""
        ...

    def search(self, timeout: float) -> AsyncGenerator[Found, None]:
        """Yields what is found, at once; ends after `timeout` seconds, or when there is nothing more to find.

        What has the same `identity` as an earlier one takes its place. Any exception ends the search; what was
        yielded before it stays.
        """
        ...


def natural(text: str) -> tuple[list[tuple[int, str]], str]:
    """A key to sort by that puts ttyUSB2 before ttyUSB10, and 10.0.0.9 before 10.0.0.10."""
    pieces = DIGITS.split(text)
    return [(int(piece), "") if number % 2 else (0, piece) for number, piece in enumerate(pieces)], text


def printable(text: str) -> str:
    """What a device says of itself, without anything that a terminal would obey."""
    return "".join(character if character.isprintable() else "?" for character in text).strip()
