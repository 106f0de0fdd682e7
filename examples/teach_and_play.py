"""Teaches an arm to carry a part, keeps that in a file, and lets it carry the part back, and there again.

    python teach_and_play.py [URL [FILE]]

On a real arm: home it, and set the places to yours; a hand on its forearm does for `teach` what `move_to` does here.
"""

import asyncio
import sys
import tempfile
from pathlib import Path

from dobot_async import Magician, SuctionCup
from dobot_async.teaching import Recorder, Recording, load_recording, play, save_recording

URL = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
FILE = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(tempfile.gettempdir(), "dobot_async_taught.json")
HERE, THERE = (250, 0), (200, 100)
UP, DOWN = 20, -53.5  # mm; the cup is 59.5 mm lower


async def teach(arm: Magician) -> Recording:
    """Goes through it once, and takes down each place, with what the cup does there."""
    recorder = Recorder(arm, tool="suction cup")
    for (x, y), suck in ((HERE, True), (THERE, False)):
        await arm.move_to(x, y, UP)
        await recorder.point()
        await arm.move_to(x, y, DOWN)
        await recorder.point(mode="line")
        await recorder.suction(suck)
        await arm.move_to(x, y, UP)
        await recorder.point(mode="line")
    return recorder.recording


async def main() -> None:
    """Teaches, then plays what is in the file."""
    async with Magician.connect(URL) as arm:
        await arm.set_end_effector(SuctionCup())
        save_recording(await teach(arm), FILE)
        recording = load_recording(FILE)
        print(f"taught {len(recording.steps)} steps")
        await play(arm, recording, reverse=True)
        await play(arm, recording, speed=50)


asyncio.run(main())
