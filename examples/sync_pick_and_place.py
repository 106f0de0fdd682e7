"""Three parts are picked from one row and put down in another, by a program without asyncio.

    python sync_pick_and_place.py [serial:///dev/ttyUSB0 | udp://192.168.1.20 | ...]

Ctrl-C stops the arm where it is. Home the arm first, and see that nothing is in its way.
"""

from __future__ import annotations

import os
import sys

from dobot_async import PTPMode
from dobot_async.sync import Magician

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:?speed=20")
ABOVE, DOWN = 60.0, 20.0


def lower_and_switch(arm: Magician, x: float, y: float, *, on: bool) -> None:
    """Goes down at a place, sucks or lets go, and comes up again: one batch, so that nothing comes between."""
    with arm.queue.batch() as batch:
        batch.move_to(x, y, ABOVE)
        batch.move_to(x, y, DOWN, mode=PTPMode.MOVL_XYZ)
        batch.suction(on)
        batch.wait(0.3)
        lifted = batch.move_to(x, y, ABOVE, mode=PTPMode.MOVL_XYZ)

    lifted.wait()


with Magician.connect(URL) as arm:
    for number, y in enumerate((-40.0, 0.0, 40.0), 1):
        lower_and_switch(arm, 220.0, y, on=True)
        lower_and_switch(arm, 260.0, y, on=False)
        print(f"part {number} is in the other row", flush=True)
