"""Runs a G-code file on an ultraArm P340, or a square if none is given: checked as a whole first, told line by line.

    python ultraarm_gcode.py [serial:///dev/ttyUSB0 | ...] [part.gcode]

On a real arm: clear the space of your file. It homes the arm first, before which no coordinate is right. The square is
40 mm wide, from (200, -20) to (240, 20), at z 60 mm. Ctrl-C stops the arm, which may take the power off its motors.
"""

from __future__ import annotations

import asyncio
import os
import sys

from dobot_async import DobotError, UltraArm

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:?speed=20")
SQUARE = ["G90", "G0 X200 Y-20 Z60 F100", "X240", "Y20", "X200", "Y-20"]


async def main() -> None:
    """Checks, homes, runs."""
    program = sys.argv[2] if len(sys.argv) > 2 else SQUARE
    async with UltraArm.connect(URL) as arm:
        await arm.run_gcode(program, dry_run=True)
        await arm.home()
        async for line in arm.run_gcode(program):
            print(f"done: {line}")

        here = await arm.get_coords()
        print(f"at x {here.x:.2f} y {here.y:.2f} z {here.z:.2f}")


try:
    asyncio.run(main())
except ValueError as error:
    sys.exit(f"nothing was sent: {error}")
except DobotError as error:
    sys.exit(f"stopped: {error}")
