"""An arm follows a target that moves, as the hand of somebody who teleoperates it does; then a recorded trajectory.

    python follow_target.py [serial:///dev/ttyUSB0 | udp://192.168.1.20 | ...]

On a real arm: home it first. It goes round a circle of 40 mm about a place in front of it, at 40 mm above its base.
"""

from __future__ import annotations

import asyncio
import math
import os
import sys

from dobot_async import Magician

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:")
X, Y, Z, RADIUS = 220.0, 0.0, 40.0, 20.0


def on_circle(angle: float) -> tuple[float, float, float]:
    """A place on the circle, mm."""
    return X + RADIUS * math.cos(angle), Y + RADIUS * math.sin(angle), Z


async def main() -> None:
    """Follows a circle for two rounds, then plays a part of it with times."""
    async with Magician.connect(URL) as arm:
        await arm.home()
        await arm.set_speed(100)
        async with arm.following(rate=30, max_speed=100) as follow:
            await follow.reach(on_circle(0))
            loop = asyncio.get_running_loop()
            began = loop.time()
            while (elapsed := loop.time() - began) < 4:
                follow.target = on_circle(math.pi * elapsed)
                await asyncio.sleep(1 / 30)

            print(f"followed with {follow.sent} setpoints")
            await follow.play([(step / 10, on_circle(math.pi * step / 10)) for step in range(11)])

        pose = await arm.get_pose()
        print(f"stands at ({pose.x:.0f}, {pose.y:.0f}, {pose.z:.0f})")


asyncio.run(main())
