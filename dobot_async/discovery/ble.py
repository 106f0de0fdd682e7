"""Arms with a BLE module: what advertises their service, or one of their names, or is connected already."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import suppress
from typing import TYPE_CHECKING

from dobot_async.discovery.found import Found, printable
from dobot_async.errors import ConnectFailed

if TYPE_CHECKING:
    from dobot_async.transports.ble.scan import SeenDevice

__all__ = ["BLEModules"]


class BLEModules:
    """Finds arms with a BLE module in range; one that a phone or another computer is connected to cannot be seen.

    Args:
        adapter: Which of several radios to search with, such as "hci1"; Linux only.
    """

    name = "ble"
    probes_at_once = 1  # a radio makes one connection at a time

    def __init__(self, adapter: str | None = None) -> None:
        self._adapter = adapter

    async def search(self, timeout: float) -> AsyncGenerator[Found, None]:
        """Yields each module, again if it tells its name later.

        Raises:
            ConnectFailed: There is no Bluetooth, or it is off, or may not be used; the message says what to do.
        """
        from dobot_async.transports.ble.diagnostics import trouble
        from dobot_async.transports.ble.scan import connected, listening

        end = asyncio.get_running_loop().time() + timeout
        names: dict[str, str] = {}
        try:
            free, used = await connected(self._adapter)
            for seen in (*free, *used):
                names[seen.device.address] = seen.name
                yield self._found(seen, "in use by another program" if seen in used else "")

            async with listening(self._adapter) as heard:
                while news := await next_of(heard, end):
                    address = news.device.address
                    if news.is_arm and (address not in names or news.name not in {"", names[address]}):
                        names[address] = news.name
                        yield self._found(news)
        except Exception as error:  # what bleak raises is whatever the operating system says
            raise ConnectFailed(trouble(error).text) from error

    def _found(self, seen: SeenDevice, remark: str = "") -> Found:
        address = seen.device.address
        option = f"?adapter={self._adapter}" if self._adapter else ""
        description = ", ".join(filter(None, (printable(seen.name), remark)))
        return Found(f"ble://{address}{option}", self.name, address, description, families=("magician",))


async def next_of(heard: asyncio.Queue[SeenDevice], until: float) -> SeenDevice | None:
    """Returns what is heard next, or None if there is nothing until a time of the loop."""
    with suppress(TimeoutError):
        async with asyncio.timeout_at(until):
            return await heard.get()

    return None
