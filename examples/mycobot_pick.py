"""Picks a part up with the gripper of a myCobot 280 and puts it down at the other side, a batch for each half.

    python mycobot_pick.py [serial:///dev/ttyUSB0 | ...]

On a real arm: the M5 in its base has to be set to Transponder, USB UART. It works between 30 degrees to the left and 30
to the right of its front, at 30 percent speed, and comes down by bending joint 2 by 20 degrees: clear that space.
"""

from __future__ import annotations

import asyncio
import os
import sys

from dobot_async import DobotError, Motion, MyCobot

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:?speed=20")
UP, DOWN = (-30, -60, 0, 0, 0), (-50, -60, 20, 0, 0)
LEFT, RIGHT = 30, -30
SPEED = 30


async def reach(arm: MyCobot, side: float, *, grip: bool) -> Motion:
    """Queues all that one half takes; returns its last motion."""
    async with arm.queue.batch() as batch:
        batch.move_joints(side, *UP, speed=SPEED)
        batch.move_joints(side, *DOWN, speed=SPEED)
        batch.gripper(grip)
        batch.wait(0.3)
        return batch.move_joints(side, *UP, speed=SPEED)


async def main() -> None:
    """Queues both halves, then follows them."""
    async with MyCobot.connect(URL, model="mycobot280") as arm:
        if not await arm.is_powered():
            await arm.power_on()

        await arm.gripper(False)
        picked = await reach(arm, LEFT, grip=True)
        placed = await reach(arm, RIGHT, grip=False)
        await picked
        print("picked up")
        await placed
        print("put down")
        print("joints ", "  ".join(f"{angle:.1f}" for angle in await arm.get_angles()))


try:
    asyncio.run(main())
except DobotError as error:
    # Leaving the block stopped the arm. The gripper still holds what it held.
    sys.exit(f"stopped: {error}")
