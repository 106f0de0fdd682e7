"""Three arms pick parts from one conveyor, which only one of them at a time may reach into.

    python conveyor_three_arms.py [URL URL URL]

The arms stand side by side along the belt, 150 mm apart. Parts come one after the other; whichever arm is free gets
the next one. To pick, an arm needs the zone of the belt, which it gets in the order of asking; to put the part into
its own box it does not, so the others pick meanwhile. The first arm also drives the belt's motor.

On real arms: home them one after the other, and check the places with low speed.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence

from dobot_async import Fleet, Magician
from dobot_async.fleet import BaseFrame, Box, Member

URLS: Sequence[str] = sys.argv[1:4] if len(sys.argv) > 3 else ["sim:?speed=10"] * 3
ARMS = {
    f"arm {number}": Member(url, Magician, base=BaseFrame(y=150 * (number - 2)), guard="wait", clearance=10)
    for number, url in enumerate(URLS, 1)
}
BELT = Box(x=(220, 330), z=(0, 70))
PARTS = 9
STEP = 1600  # pulses, about 10 mm of belt


async def work(fleet: Fleet[Magician], name: str, parts: asyncio.Queue[int]) -> list[int]:
    """Picks parts until there are none; returns which."""
    arm, picked = fleet[name], []
    while not parts.empty():
        async with fleet.zone("belt"):
            if parts.empty():
                break

            part = parts.get_nowait()
            await arm.move_to(250, 0, 60)
            await arm.move_to(250, 0, 20)
            await arm.suction(True)
            await arm.move_to(250, 0, 60)
            await arm.move_to(190, 100, 70)
            await fleet["arm 1"].queue.conveyor(4000, distance=STEP)

        picked.append(part)
        print(f"{name} has picked part {part}")
        await arm.move_to(190, 100, 40)
        await arm.suction(False)
        await arm.move_to(190, 100, 70)

    return picked


async def main() -> None:
    """Lets all three work until the parts are used up; if one fails, all stop."""
    parts: asyncio.Queue[int] = asyncio.Queue()
    for part in range(1, PARTS + 1):
        parts.put_nowait(part)

    async with Fleet.connect(ARMS, zones={"belt": BELT}) as fleet:
        for name in fleet:
            await fleet[name].move_to(190, 100, 70)

        done = await fleet.run({name: work(fleet, name, parts) for name in fleet})
        print("; ".join(f"{name}: {len(picked)} parts" for name, picked in done.items()))


asyncio.run(main())
