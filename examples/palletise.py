"""Takes parts from a feeder, looks at their colour, and stacks the red ones on one pallet and the others on another.

    python palletise.py [URL]

On a real arm: home it, and set the corners to yours. The colour sensor, of the second version (V2), is on GP2 and looks
up at the part in the cup. A sensor of your own tells `pick` whether there is a part: check=lambda: arm.get_input(5).
"""

import asyncio
import sys

from dobot_async import AccessoryVersion, ColorPort, Magician, PTPMode, SuctionCup
from dobot_async.grid import Grid, GridPlace
from dobot_async.handling import PartMissing, pick, place

URL = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
TABLE, PART = -78.5, 25  # the arm's z where the cup touches the table, and how high a part is, mm
LOOK = (200, -60, -40)
FEEDER = Grid([(230, -20, TABLE + PART), (230, 20, TABLE + PART), (270, -20, TABLE + PART)], rows=2, columns=3)


def pallet(x: float, y: float) -> list[GridPlace]:
    """The places of a pallet with the corner (x, y), two by one, and two on one another."""
    z = TABLE + PART
    return list(Grid([(x, y, z), (x + 40, y, z), (x, y + 40, z)], rows=1, columns=2, layers=2, layer_height=PART))


async def main() -> None:
    """Empties the feeder."""
    red, others = pallet(120, 180), pallet(120, -220)
    async with Magician.connect(URL) as arm:
        await arm.set_end_effector(SuctionCup())
        await arm.set_color_sensor(ColorPort.GP2, version=AccessoryVersion.V2)
        for source in FEEDER:
            try:
                await pick(arm, source, tool="suction", travel_z=20)
            except PartMissing as error:
                print(error)
                continue
            await arm.move_to(*LOOK, mode=PTPMode.JUMP_XYZ)
            color = await arm.get_color()
            free = red if color.name == "red" else others
            print(f"{'stacks' if free else 'puts back'} a part, {color.name or 'of no colour'}")
            await place(arm, free.pop(0) if free else source, tool="suction", travel_z=20)


asyncio.run(main())
