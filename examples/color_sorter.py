"""Sorts pieces from a conveyor belt by colour, with infrared and colour sensors of the second version (V2).

On a real arm, whose URL is the argument: home it, and set the places to yours. The belt is on stepper 1, the infrared
sensor on GP4, and the colour sensor, which looks up at the piece in the cup, on GP2.
"""

import asyncio
import sys

from dobot_async import ColorPort, InfraredPort, Magician, PTPMode, SuctionCup
from dobot_async.magician import commands as c

URL = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
BELT, LOOK = (220, 120, 0), (200, -60, -40)  # where a piece is taken, and where it is looked at, mm
BOXES = {(1, 0, 0): (120, -200, -10), (0, 1, 0): (190, -150, -10), (0, 0, 1): (240, -60, -10)}  # dropped into
STEP, STEPS = 800, 40  # pulses, about 5 mm; after 200 mm without a piece there are no more


async def next_piece(arm: Magician) -> bool:
    """Moves the belt in steps, so that no line is too slow to stop it, until a piece is at the sensor."""
    for _ in range(STEPS):
        if await arm.get_infrared(InfraredPort.GP4):
            return True
        await arm.conveyor(8000, distance=STEP)
    return False


async def reach(arm: Magician, place: tuple[float, float, float], *, suck: bool) -> None:
    """Lifts the cup, goes to a place from above, and sucks or lets go."""
    await arm.move_to(*place, mode=PTPMode.JUMP_XYZ)
    await arm.suction(suck)
    await arm.wait(0.3)


async def main() -> None:
    """Sorts until the belt is empty."""
    async with Magician.connect(URL) as arm:
        await arm.set_end_effector(SuctionCup())
        await arm.request(c.SET_INFRARED_SENSOR, c.InfraredSensor(True, InfraredPort.GP4, c.AccessoryVersion.V2))
        await arm.request(c.SET_COLOR_SENSOR, c.ColorSensor(True, ColorPort.GP2, c.AccessoryVersion.V2))
        while await next_piece(arm):
            await reach(arm, BELT, suck=True)
            await arm.move_to(*LOOK, mode=PTPMode.JUMP_XYZ)
            color = await arm.get_color()
            await reach(arm, BOXES[color.r, color.g, color.b], suck=False)
            print(f"sorted a piece of {color}")


asyncio.run(main())
