"""What goes wrong, how the program hears of it, and how it goes on.

    python error_handling.py [serial:///dev/ttyUSB0 | udp://192.168.1.20 | ...]

On a real arm: home it first. It goes from where it is to (220, 0, 40) and stays within 30 mm of that. It is told to go
out of reach once, where it raises an alarm (red light) and does not move; the program clears that.
"""

from __future__ import annotations

import asyncio
import os
import sys

from dobot_async import ArmAlarm, ConnectFailed, Magician, MotionStopped, ReplyTimeout, Unreachable

URL = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL", "sim:?speed=20")


async def main() -> None:
    """Provokes one error after the other."""
    try:
        async with Magician.connect("serial:///dev/no-such-port"):
            pass
    except ConnectFailed as error:
        print(f"wrong port: {error}")

    # Asked to, the library refuses what the arm cannot reach, and says why; the arm hears nothing of it.
    async with Magician.connect(URL, check_reach=True) as arm:
        try:
            await arm.move_to(400, 0, 40)
        except Unreachable as error:
            print(f"checked before: {error}")

    async with Magician.connect(URL) as arm:
        await arm.move_to(220, 0, 40)

        # Otherwise the arm says so, by an alarm; it moves no more until that is cleared.
        try:
            await arm.move_to(400, 0, 40)
        except ArmAlarm as error:
            print(f"told by the arm: {error}")
            await arm.recover()

        # A timeout stops the arm: what an await gave up does not go on behind its back.
        try:
            await arm.wait(60, timeout=0.1)
        except ReplyTimeout as error:
            print(f"too slow: {error}")

        # A stop, from whichever task, ends all that is queued.
        async with asyncio.TaskGroup() as group:
            await arm.queue.wait(60)
            motion = await arm.queue.move_to(240, 20, 40)
            group.create_task(arm.stop())
            try:
                await motion
            except MotionStopped as error:
                print(f"stopped: {error}")

        await arm.move_to(220, 0, 40)
        print("and the arm goes on")


asyncio.run(main())
