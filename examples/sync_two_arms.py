"""Two arms take turns in the zone between them, each in a program of its own, without asyncio.

python sync_two_arms.py [URL URL]
"""

from __future__ import annotations

import sys
from functools import partial

from dobot_async.sync import Fleet, Magician

URLS = sys.argv[1:3] if len(sys.argv) > 2 else ["sim:?speed=20&homed=true"] * 2


def visits(fleet: Fleet[Magician], name: str) -> int:
    """Goes three times into the middle, where one arm at a time may be."""
    arm = fleet[name]
    for _ in range(3):
        with fleet.zone("middle"):
            arm.move_to(280, 0, 40)
            arm.move_to(200, 0, 40)

    fleet.barrier("done")
    return round(arm.get_pose().x)


with Fleet.connect(dict(zip(("left", "right"), URLS, strict=True)), zones={"middle": None}) as fleet:
    for name, x in fleet.run({name: partial(visits, fleet, name) for name in fleet}).items():
        print(f"{name} stands at x {x}")
