"""Which arms there are to find: their USB chips, and how each is asked who it is.

A USB id is that of the chip between USB and the arm's board, not of the arm: several families use the same ones, and so
do many other devices. Only a probe tells what is behind it.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from dobot_async.magician.arm import DeviceInfo, Magician

__all__ = ["CH340", "CH9102", "CP210X", "FAMILIES", "Family"]

CP210X = 0x10C4, 0xEA60
CH340 = 0x1A86, 0x7523
CH9102 = 0x1A86, 0x55D4


@dataclass(frozen=True, slots=True)
class Family:
    """A family of arms.

    Attributes:
        name: As for `--arm`.
        usb: Vendor and product id of each USB chip that its arms have.
        probe: Asks the arm at a URL who it is, within so many seconds, with reads alone; None if nobody can ask yet.
    """

    name: str
    usb: frozenset[tuple[int, int]]
    probe: Callable[[str, float], Awaitable[DeviceInfo]] | None = None


async def probe_magician(url: str, timeout: float) -> DeviceInfo:
    """Asks a Magician who it is."""
    async with Magician.connect(url, control=False, timeout=timeout) as arm:
        return await arm.get_info(timeout=timeout)


FAMILIES = (
    Family("magician", frozenset({CP210X, CH340, CH9102}), probe_magician),
    Family("mycobot", frozenset({CP210X, CH9102})),
    Family("ultraarm", frozenset({CH340})),
)
"""In the order in which they are tried."""
