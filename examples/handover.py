"""Hands parts over between two arms that face each other, 500 mm apart.

    python handover.py [LEFT RIGHT]

The left arm takes a part from its side and puts it down in the middle; the right arm fetches it from there. The middle
is a zone, so that only one of them is ever in it, and at the barrier the right arm waits until there is a part to
fetch. Both are guarded: a motion into the zone waits while the other arm is in it, even if a program forgot to ask.

On real arms: set them up face to face, home them one after the other, and check the places with low speed. The places
are those of the cell; each arm's base frame turns them into its own.
"""

from __future__ import annotations

import asyncio
import sys

from dobot_async import Fleet, Magician
from dobot_async.fleet import BaseFrame, Box, Member

LEFT, RIGHT = sys.argv[1:3] if len(sys.argv) > 2 else ("sim:?speed=10", "sim:?speed=10")
ARMS = {
    "left": Member(LEFT, Magician, guard="wait"),
    "right": Member(RIGHT, Magician, base=BaseFrame(x=500, yaw=180), guard="wait"),
}
MIDDLE = Box(x=(220, 280), y=(-40, 40), z=(0, 80))
SOURCE, HANDOVER, TARGET = (200.0, -130.0, 20.0), (250.0, 0.0, 20.0), (300.0, 130.0, 20.0)
PARTS = 3


async def carry(fleet: Fleet[Magician], name: str, start: tuple[float, ...], end: tuple[float, ...]) -> None:
    """Takes a part at one place of the cell and puts it down at another."""
    arm = fleet[name]
    for place, holds in ((start, True), (end, False)):
        x, y, z, _ = fleet.to_arm(name, *place)
        await arm.move_to(x, y, z + 60)
        await arm.move_to(x, y, z)
        await arm.suction(holds)
        await arm.move_to(x, y, z + 60)


async def clear(fleet: Fleet[Magician], name: str, place: tuple[float, float, float]) -> None:
    """Drives out of the others' way."""
    x, y, z, _ = fleet.to_arm(name, *place)
    await fleet[name].move_to(x, y, z + 60)


async def give(fleet: Fleet[Magician]) -> None:
    """The left arm's program."""
    for part in range(1, PARTS + 1):
        async with fleet.zone("middle"):
            await carry(fleet, "left", SOURCE, HANDOVER)
            await clear(fleet, "left", SOURCE)

        print(f"left has put down part {part}")
        await fleet.barrier("put down")
        await fleet.barrier("fetched")


async def take(fleet: Fleet[Magician]) -> None:
    """The right arm's program."""
    for part in range(1, PARTS + 1):
        await fleet.barrier("put down")
        async with fleet.zone("middle"):
            await carry(fleet, "right", HANDOVER, TARGET)

        print(f"right has fetched part {part}")
        await fleet.barrier("fetched")


async def main() -> None:
    """Runs both programs side by side; if one fails, both arms stop."""
    async with Fleet.connect(ARMS, zones={"middle": MIDDLE}) as fleet:
        await clear(fleet, "left", SOURCE)
        await clear(fleet, "right", TARGET)
        await fleet.run({"left": give(fleet), "right": take(fleet)})


asyncio.run(main())
