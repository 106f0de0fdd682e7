"""The way to a connection over BLE: a URL, a search, and some attempts."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from urllib.parse import SplitResult, quote, unquote, urlencode

from dobot_async._core.protocol.transport import Transport
from dobot_async._core.util.tasks import run_shielded
from dobot_async.errors import ConnectFailed
from dobot_async.transports.ble.diagnostics import NEAR, NOT_FOUND, trouble
from dobot_async.transports.ble.lock import DeviceLock, lock_device
from dobot_async.transports.ble.scan import SeenDevice, Wanted, connected, listening
from dobot_async.transports.ble.transport import PACE, BleTransport
from dobot_async.transports.options import Option, number, options, words

__all__ = ["open_url"]

OPTIONS = {
    "pace": number(float, "seconds between two chunks", least=0, most=1),
    "adapter": Option(words, "a Bluetooth adapter of Linux, such as hci1"),
}
SCAN = 10.0  # seconds
NAMED = 5  # other devices that a message names
PAUSES = (0.1, 0.5, 1.0)
"""Between attempts to connect: on the air, the second one often does what the first one did not."""


async def open_url(url: SplitResult, *, arm: str) -> Transport:  # noqa: ARG001 - for `sim:`
    """Opens `ble://NAME`, `ble://ADDRESS` or `ble:`, with `?pace=` and, on Linux, `?adapter=hci1`."""
    given = options(url, OPTIONS)
    text = unquote(url.netloc + url.path)
    pace = given.get("pace", PACE)
    if "/" in text:
        raise ValueError("expected ble://NAME, ble://ADDRESS or ble: (a / in a name is %2F)")

    opening = Opening(url.geturl(), Wanted(text), pace, given.get("adapter"))
    try:
        return await opening.transport()
    except asyncio.CancelledError as error:
        error.add_note(opening.trouble)  # for whoever ran out of patience
        raise


class Opening:
    """The way to a connection: a search, and some attempts.

    Attributes:
        trouble: Why there is no connection yet, and what to do about it.
    """

    def __init__(self, url: str, wanted: Wanted, pace: float, adapter: str | None) -> None:
        self.trouble = f"no answer from the Bluetooth service; {NEAR}"
        self._url = url
        self._wanted = wanted
        self._pace = pace
        self._adapter = adapter
        self._tried: set[str] = set()
        self._lock = DeviceLock(None)

    async def transport(self) -> BleTransport:
        """Returns a connection, or raises ConnectFailed."""
        pauses = iter(PAUSES)
        while True:
            try:
                return await self._connected(await self._found())
            except ConnectFailed:
                raise
            except Exception as error:  # what bleak raises is whatever the operating system says
                problem = trouble(error)
                self.trouble = problem.text
                pause = next(pauses, None)
                if not problem.passing or pause is None:
                    raise ConnectFailed(f"cannot open {self._url}: {problem.text}") from error
            except BaseException:
                self._lock.drop()  # the arm may have been found just now, and not be connected to yet
                raise

            await asyncio.sleep(pause)

    async def _found(self) -> SeenDevice:
        """Returns the arm: one that is connected already, or the first one that is seen."""
        free, used = await connected(self._adapter)
        for seen in free:
            # Once only: what BlueZ says of a connection may be older than the connection's end.
            if seen.device.address not in self._tried and self._takes(seen):
                self._tried.add(seen.device.address)
                return seen

        in_use = [seen for seen in (*free, *used) if self._wanted.fits(seen)]
        others: dict[str, str] = {}
        async with listening(self._adapter) as heard:
            with suppress(TimeoutError):
                async with asyncio.timeout(SCAN):
                    while True:
                        self.trouble = self._nobody(others, in_use)
                        seen = await heard.get()
                        if seen.connected:
                            continue  # its connection has changed; it did not advertise

                        if self._takes(seen):
                            return seen

                        if self._wanted.fits(seen):
                            in_use.append(seen)

                        others[seen.device.address] = f"{seen.name or 'nameless'} ({seen.device.address})"

        raise ConnectFailed(f"cannot open {self._url}: {self._nobody(others, in_use)}")

    def _takes(self, seen: SeenDevice) -> bool:
        """Claims a device if it is the one that is wanted, and free."""
        taken = lock_device(seen.device.address) if self._wanted.fits(seen) else None
        self._lock = taken or self._lock
        return taken is not None

    def _nobody(self, others: dict[str, str], in_use: list[SeenDevice]) -> str:
        """Why nobody is found."""
        if in_use:
            address = in_use[0].device.address
            return f"something else on this computer uses {address}; end it first, or let it share the arm"

        who = f"{self._wanted.text} was not seen" if self._wanted.text else "no arm was seen"
        names = ", ".join(list(others.values())[:NAMED])
        count = f"{len(others)} other BLE device{'s' if len(others) > 1 else ''}"
        instead = f"only {count}, such as {names}" if others else "nor any other BLE device"
        return f"{who}, {instead}; {NOT_FOUND}"

    async def _connected(self, seen: SeenDevice) -> BleTransport:
        """Connects to a device."""
        self.trouble = f"{seen.name or seen.device.address} was seen, but the connection is not made yet; {NEAR}"
        given: dict[str, object] = {"pace": self._pace} if self._pace != PACE else {}
        if self._adapter:
            given["adapter"] = self._adapter

        url = f"ble://{quote(seen.device.address, safe=':')}" + (f"?{urlencode(given)}" if given else "")
        transport = BleTransport(seen, url=url, pace=self._pace, adapter=self._adapter, lock=self._lock)
        try:
            await transport.connect()
        except BaseException:
            await run_shielded(transport.aclose())
            raise

        return transport
