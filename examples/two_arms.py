"""Two arms in one task group: when one of them fails, the other one stops at once.

    python two_arms.py [URL URL]

On real arms: home them first. Each goes from where it is to (220, 0, 40), then to and fro within 30 mm of that. The
right one is soon told to go where it cannot: it raises an alarm without moving, and the left one stops on its way.
"""

from __future__ import annotations

import asyncio
import itertools
import os
import sys
from collections.abc import Iterable

from dobot_async import ArmAlarm, Magician

URL = os.environ.get("DOBOT_URL", "sim:?speed=20")
LEFT, RIGHT = sys.argv[1:3] if len(sys.argv) > 2 else (URL, "sim:?speed=20")
NEAR, FAR, TOO_FAR = (220, 0, 40), (240, 20, 40), (400, 0, 40)


async def work(name: str, url: str, targets: Iterable[tuple[int, int, int]]) -> None:
    """Goes to the targets, one after the other."""
    async with Magician.connect(url) as arm:
        try:
            for target in targets:
                await arm.move_to(*target)
                print(f"{name} reached {target}")
        except asyncio.CancelledError:
            print(f"{name} stopped at x = {(await arm.get_pose()).x:.1f}")
            raise


async def main() -> None:
    """Lets the left arm work for ever, and the right one until it fails."""
    try:
        async with asyncio.TaskGroup() as group:
            group.create_task(work("left", LEFT, itertools.cycle([NEAR, FAR])))
            group.create_task(work("right", RIGHT, [NEAR, FAR, NEAR, FAR, TOO_FAR, NEAR]))
    except* ArmAlarm as errors:
        for error in errors.exceptions:
            print(f"right failed: {error}")


asyncio.run(main())
