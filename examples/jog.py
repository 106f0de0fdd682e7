"""Jogs: moves in a direction for as long as it is told to, as the keys of a teach pendant do.

    python jog.py [serial:///dev/ttyUSB0 | udp://192.168.1.20 | ...]

On a real arm: it rises for 0.4 s, then turns its base for as long as the program reads three poses, each at 10 percent
of the jog speed: a few millimetres and degrees, if there is room above it.
"""

from __future__ import annotations

import asyncio
import os
import sys

from dobot_async import Jog, Magician
from dobot_async.magician import commands as c

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:")


async def main() -> None:
    """Jogs for a time, then for the length of a block."""
    async with Magician.connect(URL) as arm:
        await arm.request(c.SET_JOG_JOINT_PARAMS, c.JOGJointParams((50, 50, 50, 50), (100, 100, 100, 100)))
        await arm.request(c.SET_JOG_COORDINATE_PARAMS, c.JOGCoordinateParams((60, 60, 60, 60), (100, 100, 100, 100)))
        await arm.request(c.SET_JOG_COMMON_PARAMS, c.JOGCommonParams(velocity_ratio=10, acceleration_ratio=100))

        before = await arm.get_pose()
        await arm.jog(Jog.Z_PLUS, 0.4)
        after = await arm.get_pose()
        print(f"z  {before.z:.2f} -> {after.z:.2f} mm")

        # However this block ends, by an error or Ctrl-C too, the jog ends with it.
        async with arm.jogging(Jog.J1_PLUS):
            for _ in range(3):
                await asyncio.sleep(0.1)
                print(f"j1 {(await arm.get_pose()).j1:.2f} degrees")


asyncio.run(main())
