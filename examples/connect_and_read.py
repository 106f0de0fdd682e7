"""Reads what an arm says of itself: name, pose, alarms, and how the link does.

    python connect_and_read.py [serial:///dev/ttyUSB0 | udp://192.168.1.20 | ...]

Nothing moves: `control=False` makes an observer of this program, which can only read.
"""

from __future__ import annotations

import asyncio
import os
import sys

from dobot_async import Magician

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:?speed=20")


async def main() -> None:
    """Reads and prints."""
    async with Magician.connect(URL, control=False) as arm:
        info = await arm.get_info()
        print(f"device    {info.name!r}, serial number {info.serial_number!r}, firmware {info.version}")

        pose = await arm.get_pose()
        print(f"joints    {pose.j1:.2f} {pose.j2:.2f} {pose.j3:.2f} {pose.j4:.2f} degrees")
        print(f"tool      {pose.x:.2f} {pose.y:.2f} {pose.z:.2f} mm, {pose.r:.2f} degrees")

        # An arm whose own numbers differ by more than a millimetre has been told of another tool than it carries.
        tool = arm.kinematics.forward(pose.j1, pose.j2, pose.j3, pose.j4)
        print(f"computed  {tool.x:.2f} {tool.y:.2f} {tool.z:.2f} mm, {tool.r:.2f} degrees")

        for alarm in await arm.get_alarms():
            print(f"alarm     {alarm}")

        stats = arm.link.stats
        print(f"link      {stats.sent} requests, {stats.received} replies, {stats.repeated} repeated")


asyncio.run(main())
