"""Sorts pieces from a conveyor belt by colour, with infrared and colour sensors of the second version (V2).

On a real arm, whose URL is the argument: home it, and set the places to yours. The belt is on stepper 1 (motor 0), the
infrared sensor on GP4, and the colour sensor, which looks up at the piece in the cup, on GP2.
"""

import asyncio
import sys

from dobot_async import AccessoryVersion, ColorPort, InfraredPort, Magician, PTPMode, SuctionCup

URL = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
BELT, LOOK = (220, 120, 0), (200, -60, -40)  # where a piece is taken, and where it is looked at, mm
BOXES = {"red": (120, -200, -10), "green": (190, -150, -10), "blue": (240, -60, -10)}  # dropped into
STEP, STEPS = 5, 40  # mm; after 200 mm without a piece there are no more
PULSES_PER_MM = 160  # measure yours


async def next_piece(arm: Magician) -> bool:
    """Moves the belt in steps, so that no line is too slow to stop it, until a piece is at the sensor."""
    for _ in range(STEPS):
        if await arm.get_infrared(InfraredPort.GP4):
            return True
        await arm.conveyor_mm(50, pulses_per_mm=PULSES_PER_MM, distance=STEP)
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
        await arm.set_infrared_sensor(InfraredPort.GP4, version=AccessoryVersion.V2)
        await arm.set_color_sensor(ColorPort.GP2, version=AccessoryVersion.V2)
        while await next_piece(arm):
            await reach(arm, BELT, suck=True)
            await arm.move_to(*LOOK, mode=PTPMode.JUMP_XYZ)
            color = await arm.wait_for_color(timeout=5)
            await reach(arm, BOXES[color.name], suck=False)
            print(f"sorted a {color.name} piece")


asyncio.run(main())
