"""An arm in one process, the program that moves it in another one; on two machines it is the same.

    python examples/zenoh_two_processes.py [URL of an arm]

On the machine with the arm, this is `dobot-async serve --name left --listen tcp/0.0.0.0:7447 serial:///dev/ttyUSB0`,
and on the other one `zenoh://left?connect=tcp/that-machine:7447` is a URL like any other.
"""

import asyncio
import json
import sys
from asyncio.subprocess import PIPE

import zenoh

from dobot_async import Magician


async def main(arm_url: str) -> None:
    """Starts the server, moves its arm, and writes down what is published meanwhile."""
    server = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "dobot_async", "serve", "--name", "left", "--listen", "tcp/127.0.0.1:0", arm_url),
        stdout=PIPE,
    )
    assert server.stdout
    url = (await server.stdout.readline()).decode().strip()
    print("served at", url.partition("?")[0])
    try:
        async with Magician.connect(url) as arm:
            poses = await asyncio.to_thread(Recorder, url.partition("connect=")[2])
            for x in (200, 230, 260):
                await arm.move_to(x, 0, 40)
                pose = await arm.get_pose()
                print(f"moved to ({pose.x:.0f}, {pose.y:.0f}, {pose.z:.0f})")

            last = await poses.until(260)
            print(f"published ({last['x']:.0f}, {last['y']:.0f}, {last['z']:.0f})")
    finally:
        server.terminate()
        await server.wait()


class Recorder:
    """A program that knows Zenoh and JSON, and nothing of arms; it would be a third process."""

    def __init__(self, endpoint: str) -> None:
        config = zenoh.Config.from_json5(
            json.dumps(
                {
                    "mode": "client",
                    "connect": {"endpoints": [endpoint]},
                    "scouting": {"multicast": {"enabled": False}},
                }
            )
        )
        self._session = zenoh.open(config)
        self._poses = self._session.declare_subscriber("dobot/*/pose")

    async def until(self, x: float) -> dict[str, float]:
        """Returns the first pose that is so far out."""
        while True:
            sample = await asyncio.to_thread(self._poses.recv)
            pose: dict[str, float] = json.loads(sample.payload.to_string())
            if abs(pose["x"] - x) < 0.5:
                return pose


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=5"))
