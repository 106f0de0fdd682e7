"""Carries pieces from a tray at one end of the sliding rail to a rack at the other.

    python rail_pick_and_place.py [serial:///dev/ttyUSB0 | udp://192.168.1.20 | ...]

On a real arm: set the places to yours, and clear its way home. `l` is where the arm stands on the rail, in mm.
"""

import asyncio
import sys

from dobot_async import Magician, PTPMode, SuctionCup

URL = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
TRAY, RACK, UP = 100, 700, 60
PLACES = [(200, -60), (230, 0), (200, 60)]
DOWN = -53  # where the cup touches a piece


async def reach(arm: Magician, x: float, y: float, rail: float, *, suck: bool) -> None:
    """Drives to a place on the rail, goes down, sucks or lets go, and comes up again."""
    async with arm.queue.batch() as batch:
        batch.move_to(x, y, UP, l=rail)
        batch.move_to(z=DOWN, mode=PTPMode.MOVL_XYZ)
        batch.suction(suck)
        batch.wait(0.3)
        lifted = batch.move_to(z=UP, mode=PTPMode.MOVL_XYZ)
    await lifted


async def main() -> None:
    """Empties the tray."""
    async with Magician.connect(URL) as arm:
        await arm.set_end_effector(SuctionCup())
        await arm.set_rail()
        await arm.home()  # which finds the end of the rail as well, now that the arm knows of it
        for number, (x, y) in enumerate(PLACES, 1):
            await reach(arm, x, y, TRAY, suck=True)
            await reach(arm, x, y, RACK, suck=False)
            print(f"piece {number} is in the rack, at {await arm.get_rail():.0f} mm")


asyncio.run(main())
