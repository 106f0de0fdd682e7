"""A cell of three families: a Magician, a myArm and an ultraArm, which start together and stop together.

    python mixed_cell.py [CELL_FILE]

The cell file has the arms' URLs; mixed_cell.toml beside this file has simulated ones. All arms have the same verbs for
what they all can do; `fleet.arm(name, MyCobot)` gives one with its own verbs, typed.

On real arms: the myArm is powered on and driven to 0 degrees, the others are homed. Keep clear.
"""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from dobot_async import Fleet, Magician, MyCobot, UltraArm

CELL = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("mixed_cell.toml")


async def main() -> None:
    """Homes all arms, moves them together, and meets in the middle of the table, one after the other."""
    async with Fleet.from_file(CELL) as fleet:
        magician = fleet.arm("magician", Magician)
        myarm = fleet.arm("myarm", MyCobot)
        ultraarm = fleet.arm("ultraarm", UltraArm)
        await myarm.power_on()
        await fleet.each("home")
        print(f"{len(fleet)} arms are home")

        async with fleet.together() as together:
            together["magician"].move_to(220, 0, 60)
            together["myarm"].move_joints(10, 10, 0, -20, 0, 10, 0)
            together["ultraarm"].move_to(220, 0, 100)

        await together.wait()
        print(f"they started within {1000 * together.skew:.1f} ms")

        async with fleet.zone("table"):
            await magician.move_to(250, 40, 60)

        async with fleet.zone("table"):
            await myarm.move_joint(1, 30)

        async with fleet.zone("table"):
            await ultraarm.move_to(240, 30, 90)

        print("each was in the middle")


asyncio.run(main())
