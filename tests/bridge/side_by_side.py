"""Two programs at one arm, through a bridge: an unmodified blocking library over a pty, and this package over TCP.

    python tests/bridge/side_by_side.py [10000]

Both read the analog inputs, the pose and the name, each at its own pace, so many requests in all; every answer is
checked. The library is pydobotlab.
"""

from __future__ import annotations

import asyncio
import sys
import time
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

import pydobotlab
import pytest
from bridge_rig import TCP, Rig, bridged
from pydobotlab import CommandID
from pydobotlab.protocol import pack_u8

from dobot_async import Magician
from dobot_async.arms.magician import commands as c

PINS = range(1, 21)
HOME = (259.104, 0, -8.485, 0, 0, 45, 45, 0)


class Figures(NamedTuple):
    """What came of it."""

    blocking: int
    asynchronous: int
    wrong: int
    seconds: float


def value_at(pin: int) -> int:
    """What is put in at a pin."""
    return 37 * pin + 5


def block(port: str, count: int, random: Random) -> int:
    """Reads with the blocking library; returns how many answers were wrong."""
    lab: Any = pydobotlab.Magician(port, via_broker=False, require_panel=False, verbose=False)
    lab.connect()
    wrong = 0
    try:
        for _ in range(count):
            pin = random.choice(PINS)
            match random.randrange(3):
                case 0:
                    answer = lab.read_command(CommandID.GET_IO_ADC, pack_u8(pin)).params
                    wrong += answer != bytes((pin,)) + value_at(pin).to_bytes(2, "little")
                case 1:
                    pose = lab.get_pose()
                    wrong += (*pose.as_xyzr(), *pose.as_joints()) != pytest.approx(HOME, abs=1e-2)
                case _:
                    wrong += lab.get_device_name() != "Dobot Magician"
    finally:
        lab.disconnect()

    return wrong


async def read(url: str, count: int, random: Random) -> int:
    """Reads with the driver, a few at a time; returns how many answers were wrong."""

    async def some(arm: Magician, count: int) -> int:
        wrong = 0
        for _ in range(count):
            pin = random.choice(PINS)
            match random.randrange(3):
                case 0:
                    wrong += await arm.get_adc(pin) != value_at(pin)
                case 1:
                    pose = await arm.get_pose()
                    seen = (pose.x, pose.y, pose.z, pose.r, pose.j1, pose.j2, pose.j3, pose.j4)
                    wrong += seen != pytest.approx(HOME, abs=1e-2)
                case _:
                    wrong += await arm.request(c.GET_DEVICE_NAME, None) != "Dobot Magician"

        return wrong

    async with Magician.connect(url, control=False) as arm:
        return sum(await asyncio.gather(*(some(arm, part) for part in shares(count, 4))))


async def side_by_side(requests: int, seed: int = 1) -> tuple[Figures, Rig]:
    """Runs both programs at the same time; returns what came of it."""
    async with bridged(["pty", TCP]) as rig:
        for pin in PINS:
            rig.sim.arm.state.set(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(pin, c.IOFunction.ADC))
            rig.sim.arm.set_adc(pin, value_at(pin))

        port = rig.bridge.urls[0].removeprefix("serial://")
        blocking, other = shares(requests, 2)
        began = time.monotonic()
        wrong = await asyncio.gather(
            asyncio.to_thread(block, port, blocking, Random(seed)), read(rig.bridge.urls[1], other, Random(-seed))
        )
        return Figures(blocking, other, sum(wrong), time.monotonic() - began), rig


def shares(count: int, parts: int) -> list[int]:
    """A number in parts that are as equal as can be."""
    return [(count + part) // parts for part in range(parts)]


if __name__ == "__main__":
    figures, ran = asyncio.run(side_by_side(int(sys.argv[1]) if sys.argv[1:] else 10_000))
    sys.stdout.write(f"{figures}\n{ran.sim.arm.counters}\n{ran.bridge.link.stats}\n")
    sys.exit(figures.wrong > 0)
