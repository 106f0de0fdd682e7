"""The families that can be discovered: their USB chips, and the probe that identifies each.

A USB id is that of the chip between USB and the arm's board, not of the arm: several families use the same ones, and so
do many other devices. Only a probe tells what is behind it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from dobot_async.arms.info import DeviceInfo
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.registry import Each
from dobot_async.arms.ultraarm.arm import UltraArm
from dobot_async.errors import CommandRejected, ConnectFailed

__all__ = ["CH340", "CH9102", "CP210X", "FAMILIES", "MAGICIAN", "MYCOBOT", "ULTRAARM", "DiscoverableFamily"]

CP210X = 0x10C4, 0xEA60
CH340 = 0x1A86, 0x7523
CH9102 = 0x1A86, 0x55D4
ONE_FOR_EACH_NUMBER_OF_JOINTS = ("mycobot280", "myarm300", "mypalletizer260")


@dataclass(frozen=True, slots=True)
class DiscoverableFamily:
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


async def probe_mycobot(url: str, timeout: float) -> DeviceInfo:
    """Asks an arm of the myCobot family who it is. It tells the version of its firmware alone.

    No read of its protocol tells a name, a serial number or the model. The first model answers for all that have as
    many joints.
    """
    loop = asyncio.get_running_loop()
    deadline = loop.time() + timeout
    problem = ConnectFailed(f"no time was left to ask {url}")
    for model in ONE_FOR_EACH_NUMBER_OF_JOINTS:
        if (left := deadline - loop.time()) <= 0:
            break  # a silent line has taken it all

        try:
            async with MyCobot.connect(url, model=model, control=False, timeout=left) as arm:
                return await arm.get_info()
        except ConnectFailed as error:
            problem = error

    raise problem


async def probe_ultraarm(url: str, timeout: float) -> DeviceInfo:
    """Asks an ultraArm who it is. It tells the version of its firmware alone, if that."""
    async with UltraArm.connect(url, control=False, timeout=timeout) as arm:
        try:
            version = await arm.get_version(timeout=timeout)
        except CommandRejected:  # older firmware does not know the question
            version = ""

    return DeviceInfo(serial_number="", name="", version=version)


MAGICIAN = DiscoverableFamily("magician", frozenset({CP210X, CH340, CH9102}), probe_magician)
MYCOBOT = DiscoverableFamily("mycobot", frozenset({CP210X, CH9102}), probe_mycobot)
ULTRAARM = DiscoverableFamily("ultraarm", frozenset({CH340}), probe_ultraarm)
FAMILIES: Each[DiscoverableFamily] = Each("discovery")
"""In the order in which they are tried."""
