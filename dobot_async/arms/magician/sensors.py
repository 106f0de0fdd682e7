"""What a Magician reads: pins, the colour sensor, the infrared sensors; and waiting for what they see.

The arm's own wait (`wait_for_input`) knows pins alone. For its sensors one has to ask again and again, from here:
nothing is queued for that, and giving up stops nothing.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TypeVar

import anyio

from dobot_async._core.link.link import Link
from dobot_async._core.util.arguments import check_timeout
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.arguments import to_address, to_choice, to_flag
from dobot_async.arms.magician.declared import ANALOG, INPUT
from dobot_async.arms.magician.frame import Frame
from dobot_async.arms.magician.queue import MagicianQueue
from dobot_async.errors import ReplyTimeout

__all__ = ["Sensors"]

R = TypeVar("R")
LOOK = 0.02  # seconds between two looks at a sensor


class Sensors:
    """The part of a Magician that reads.

    Raises:
        ReplyTimeout: The arm does not answer in time; each `timeout` is in seconds.
        ConnectionLost: The link is gone.
        TypeError: An argument is of the wrong type; nothing was sent.
    """

    link: Link[Frame]
    queue: MagicianQueue

    async def get_input(self, address: int, *, timeout: float | None = None) -> bool:
        """Returns the level of a digital input (1 to 20). Manual 2.16.4.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            timeout: Seconds.

        Raises:
            ValueError: The pin is not configured as an input; see `configure_io`.
        """
        address = to_address(address)
        await self.queue.declared.check_pin(address, INPUT)
        return bool((await self.link.request(c.GET_IODI, address, timeout=timeout)).level)

    async def get_output(self, address: int, *, timeout: float | None = None) -> bool:
        """Returns the level that a digital output (1 to 20) was set to. Manual 2.16.2.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            timeout: Seconds.

        Raises:
            ValueError: An argument is out of range; nothing was sent.
        """
        return bool((await self.link.request(c.GET_IODO, to_address(address), timeout=timeout)).level)

    async def get_adc(self, address: int, *, timeout: float | None = None) -> int:
        """Returns an analog input (1 to 20), 0 to 4095. Manual 2.16.5.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            timeout: Seconds.

        Raises:
            ValueError: The pin is not configured as an analog input; see `configure_io`.
        """
        address = to_address(address)
        await self.queue.declared.check_pin(address, ANALOG)
        return (await self.link.request(c.GET_IOADC, address, timeout=timeout)).value

    async def set_color_sensor(
        self,
        port: c.ColorPort,
        *,
        on: bool = True,
        version: c.AccessoryVersion = c.AccessoryVersion.V1,
        timeout: float | None = None,
    ) -> None:
        """Switches the colour sensor at a port; it sees something some 0.2 s later.

        Args:
            port: Its socket.
            on: Whether it is to look; its lamp goes with it.
            version: Which hardware version it is. One that is taken for the other sees nothing.
            timeout: Seconds.

        Raises:
            ValueError: There is no such port or version.
        """
        value = c.ColorSensor(
            to_flag("on", on), to_choice("port", port, c.ColorPort), to_choice("version", version, c.AccessoryVersion)
        )
        await self.link.request(c.SET_COLOR_SENSOR, value, timeout=timeout)

    async def get_color(self, *, timeout: float | None = None) -> c.Color:
        """Returns the colour that the sensor sees; all 0 where there is none."""
        return await self.link.request(c.GET_COLOR_SENSOR, None, timeout=timeout)

    async def wait_for_color(self, name: str | None = None, *, timeout: float | None = None) -> c.Color:
        """Waits until the colour sensor, which has to be switched on, sees a colour.

        Args:
            name: "red", "green" or "blue"; any of them unless given.
            timeout: Seconds; None waits for ever.

        Returns:
            What it sees; `.name` is the colour's.

        Raises:
            ValueError: There is no such name.
            ReplyTimeout: It did not see any in time. Nothing is stopped.
        """
        if name not in {None, "red", "green", "blue"}:
            raise ValueError(f"name must be 'red', 'green' or 'blue', not {name!r}")

        what = f"the colour sensor has not seen {name or 'a colour'}"
        return await until(
            self.get_color, lambda color: color.name == name if name else bool(color.name), timeout, what
        )

    async def set_infrared_sensor(
        self,
        port: c.InfraredPort,
        *,
        on: bool = True,
        version: c.AccessoryVersion = c.AccessoryVersion.V1,
        timeout: float | None = None,
    ) -> None:
        """Switches the infrared sensor at a port; it sees something some 0.1 s later.

        Args:
            port: Its socket.
            on: Whether it is to look.
            version: Which hardware version it is. One that is taken for the other sees nothing.
            timeout: Seconds.

        Raises:
            ValueError: There is no such port or version.
        """
        value = c.InfraredSensor(
            to_flag("on", on),
            to_choice("port", port, c.InfraredPort),
            to_choice("version", version, c.AccessoryVersion),
        )
        await self.link.request(c.SET_INFRARED_SENSOR, value, timeout=timeout)

    async def get_infrared(self, port: c.InfraredPort, *, timeout: float | None = None) -> bool:
        """Returns whether the infrared sensor at a port sees something.

        Args:
            port: Its socket.
            timeout: Seconds.

        Raises:
            ValueError: There is no such port.
        """
        port = to_choice("port", port, c.InfraredPort)
        return await self.link.request(c.GET_INFRARED_SENSOR, port, timeout=timeout) != 0

    async def wait_for_infrared(self, port: c.InfraredPort, *, seen: bool = True, timeout: float | None = None) -> None:
        """Waits until the infrared sensor at a port, which has to be switched on, sees something.

        Args:
            port: Its socket.
            seen: False waits until it sees nothing.
            timeout: Seconds; None waits for ever.

        Raises:
            ReplyTimeout: That did not come about in time. Nothing is stopped.
        """
        port, seen = to_choice("port", port, c.InfraredPort), to_flag("seen", seen)
        what = (
            f"the infrared sensor at {port.name} has {'not seen anything' if seen else 'not ceased to see something'}"
        )
        await until(lambda: self.get_infrared(port), lambda found: found == seen, timeout, what)


async def until(look: Callable[[], Awaitable[R]], holds: Callable[[R], bool], timeout: float | None, what: str) -> R:
    """Look again and again until something holds; return what was seen.

    Raises:
        ReplyTimeout: It did not hold in time, or the arm did not answer.
    """
    seconds = check_timeout(timeout)
    deadline = asyncio.timeout(seconds)
    try:
        async with deadline:
            while True:
                found = await look()
                if holds(found):
                    return found

                await anyio.sleep(LOOK)
    except TimeoutError as error:
        if isinstance(error, ReplyTimeout) or not deadline.expired():
            raise

        raise ReplyTimeout(f"{what} within {seconds:.3g} s") from None
