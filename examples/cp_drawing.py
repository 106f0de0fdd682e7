"""Draws a closed curve of 1,000 points as one continuous path (CP), without a halt between the points.

    python cp_drawing.py [serial:///dev/ttyUSB0 | udp://192.168.1.20 | ...]

On a real arm: home it first. It goes from where it is to (220, 0, 40) and draws 50 mm wide, 40 mm high around it, at a
constant z, and so in the air. To draw on paper, put in the pen, and set Z to where it touches.
"""

from __future__ import annotations

import asyncio
import math
import os
import sys

from dobot_async import Magician, Pen
from dobot_async.magician import commands as c

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:?speed=20")
X, Y, Z = 220.0, 0.0, 40.0
POINTS = 1000


async def main() -> None:
    """Streams the points through the arm's queue, which holds far fewer than there are."""
    async with Magician.connect(URL) as arm:
        await arm.set_end_effector(Pen())
        await arm.request(c.SET_CP_PARAMS, c.CPParams(plan_acc=100, junction_vel=50, acc=100))
        await arm.move_to(X, Y, Z)

        motions = []
        for number in range(1, POINTS + 1):
            angle = 2 * math.pi * number / POINTS
            x, y = X + 20 * math.sin(3 * angle), Y + 25 * math.sin(2 * angle)
            # Returns once the arm has accepted the point; while its queue is full, that is when it has drawn another.
            motions.append(await arm.queue.path_to(x, y, Z))

        print(f"accepted as numbers {motions[0].index} to {motions[-1].index}")
        await arm.queue.join()

        pose = await arm.get_pose()
        print(f"drawn; the pen is {math.dist((X, Y, Z), (pose.x, pose.y, pose.z)):.2f} mm from where it began")


asyncio.run(main())
