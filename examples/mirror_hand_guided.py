"""Mirrors an arm that is guided by hand (HHT) to a second one.

    python mirror_hand_guided.py [LEADER FOLLOWER]
    python mirror_hand_guided.py serial:///dev/ttyUSB0 ble://WH-BLE%20102

Hold the key on the leader's forearm and guide it: the follower goes where the leader goes, a moment later and at 30
percent of its speed. Its targets are the leader's joints with the base turned the other way, as in a mirror that stands
between two arms side by side. Ctrl-C ends it, and stops the follower.

The URLs may be of any kind. `dobot-async discover` lists those of the arms around, also `ble://`: over BLE a question
takes some hundredths of a second, and since the follower always gets the newest target, a slow link makes it cut
corners, but not fall behind. Without URLs both arms are simulated, and guided along a curve.

On real arms: home both, and keep clear of all that the follower can reach. It begins with a move to where the leader
is. A target that the follower cannot reach is left out.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack

from dobot_async import HHTTrigMode, Magician, Pose, Unreachable
from dobot_async.magician import commands as c
from dobot_async.simulator import Simulation, simulate

CURVE = [(200 + 5 * step, 4 * step, 40 + step) for step in range(1, 11)]


class Newest:
    """Holds the one pose that counts: the newest."""

    def __init__(self) -> None:
        self._pose: Pose | None = None
        self._news = asyncio.Event()

    def put(self, pose: Pose) -> None:
        """Replaces the pose that was not fetched yet."""
        self._pose = pose
        self._news.set()

    async def get(self) -> Pose:
        """Returns the newest pose that was not fetched yet."""
        await self._news.wait()
        self._news.clear()
        assert self._pose
        return self._pose


async def watch(leader: Magician, newest: Newest) -> None:
    """Asks the leader whether its key is held, and if so for its pose."""
    async for pose in leader.taught_points(HHTTrigMode.TRIGGERED_ON_PERIODIC_INTERVAL):
        newest.put(pose)


async def follow(follower: Magician, newest: Newest) -> AsyncIterator[Pose]:
    """Goes to the newest target, again and again; yields where the follower is then."""
    while True:
        pose = await newest.get()
        try:
            await follower.move_joints(-pose.j1, pose.j2, pose.j3, -pose.j4)
        except Unreachable as error:
            print(f"left out: {error}")
            continue

        yield await follower.get_pose()


async def mirror(leader_url: str, follower_url: str, hand: Simulation | None) -> None:
    """Connects to both arms, and mirrors until Ctrl-C, or until the simulated hand has done its curve."""
    async with (
        Magician.connect(leader_url, queue="keep", on_error="leave") as leader,
        Magician.connect(follower_url, check_reach=True) as follower,
        asyncio.TaskGroup() as group,
    ):
        # From here on the leader notices its key, not only once the first question has been asked.
        await leader.request(c.SET_HHT_TRIG_OUTPUT_ENABLED, value=True)
        await follower.set_speed(30)
        newest = Newest()
        newest.put(await leader.get_pose())
        watching = group.create_task(watch(leader, newest))
        curve = iter(CURVE)
        async for pose in follow(follower, newest):
            print(f"follower at ({pose.x:.1f}, {pose.y:.1f}, {pose.z:.1f})")
            if hand:
                point = next(curve, None)
                if point is None:
                    break

                hand.arm.guide_to(*point)

        watching.cancel()


async def main() -> None:
    """Takes the arms that were given, or makes two."""
    if len(sys.argv) > 2:
        await mirror(sys.argv[1], sys.argv[2], None)
        return

    async with AsyncExitStack() as stack:
        leader, follower = [await stack.enter_async_context(simulate(speed=20)) for _ in range(2)]
        await mirror(leader.url, follower.url, leader)


asyncio.run(main())
