"""Carries three parts from one row to another with the suction cup, a batch of commands for each part.

    python pick_and_place.py [serial:///dev/ttyUSB0 | udp://192.168.1.20 | ...]

On a real arm: home it first (`dobot-async home`). It goes from where it is to (220, -40, 60), then works between x 220
and 260, y -40 and 40, z 20 and 60 mm, at 30 percent speed, with the air pump on. The tip of the cup is about 60 mm
below z: clear that space, or raise DOWN and UP.
"""

from __future__ import annotations

import asyncio
import os
import sys

from dobot_async import DobotError, Magician, Motion, PTPMode, SuctionCup

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:?speed=20")
UP, DOWN = 60, 20
PICK = [(220, -40), (220, 0), (220, 40)]
PLACE = [(260, -40), (260, 0), (260, 40)]


async def carry(arm: Magician, pick: tuple[int, int], place: tuple[int, int]) -> Motion:
    """Queues all that carrying one part takes, in one burst; returns its last motion."""
    async with arm.queue.batch() as batch:
        for (x, y), suck in ((pick, True), (place, False)):
            batch.move_to(x, y, UP)
            batch.move_to(x, y, DOWN, mode=PTPMode.MOVL_XYZ)
            batch.suction(suck)
            batch.wait(0.3)
            lifted = batch.move_to(x, y, UP, mode=PTPMode.MOVL_XYZ)

    return lifted


async def main() -> None:
    """Queues everything ahead, then follows the parts."""
    async with Magician.connect(URL, check_reach=True) as arm:
        await arm.set_end_effector(SuctionCup())
        await arm.set_speed(30)

        cycles = [await carry(arm, pick, place) for pick, place in zip(PICK, PLACE, strict=True)]
        for number, cycle in enumerate(cycles, start=1):
            await cycle
            print(f"part {number} is in its place")

        await arm.suction(False, pump=False)


try:
    asyncio.run(main())
except DobotError as error:
    # Leaving the block stopped the arm. The cup still holds what it held: nothing falls because of an error.
    sys.exit(f"stopped: {error}")
