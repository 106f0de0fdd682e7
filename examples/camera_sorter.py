"""Finds coloured parts in a picture of the table, from a camera that looks aslant, and sorts them onto two pallets.

    python camera_sorter.py [URL [PICTURE MARKS]]

MARKS is JSON, [[u, v, x, y], ...]: touch six marks on the table with the tool, and write down where the camera sees
each, and where the arm is. Without files it draws a picture itself. On a real arm: home it, and set heights and pallets
to yours. Needs `pip install 'dobot-async[draw]'` for Pillow and NumPy.
"""

import asyncio
import json
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from dobot_async import Magician, SuctionCup
from dobot_async.calibration import Calibration
from dobot_async.grid import Grid
from dobot_async.handling import pick_and_place

URL, *FILES = sys.argv[1:] or ["sim:?speed=50"]
Z = -78.5 + 25  # the arm's z where the cup touches a part on the table, mm
PALLETS = {"red": (0, (150, 170)), "blue": (2, (150, -210))}  # which of red, green, blue it is; the pallet's corner
LEAST = 30  # pixels of a part


def read(files: list[str]) -> tuple[Image.Image, list[list[float]]]:
    """Returns picture and marks; without files one with a red and a blue part, 2 pixels a mm."""
    if files:
        return Image.open(files[0]), json.loads(Path(files[1]).read_bytes())
    picture = Image.new("RGB", (640, 480), "grey")
    for u, v, color in ((200, 200, "red"), (400, 260, "blue")):
        ImageDraw.Draw(picture).rectangle((u - 18, v - 18, u + 18, v + 18), fill=color)
    return picture, [[u, v, 110 + v / 2, u / 2 - 160] for u in (20, 300, 620) for v in (30, 450)]


def spots(picture: NDArray[np.uint8], channel: int) -> list[tuple[float, float]]:
    """Returns the middles of the spots in which one of red, green, blue is far above the others."""
    others = np.delete(picture, channel, axis=2).max(axis=2).astype(int)
    left = {(int(v), int(u)) for v, u in np.argwhere(picture[..., channel].astype(int) - others > 90)}
    found = []
    while left:
        spot, edge = [], [left.pop()]
        while edge:
            v, u = edge.pop()
            spot.append((u + 0.5, v + 0.5))
            beside = {(v + 1, u), (v - 1, u), (v, u + 1), (v, u - 1)} & left
            left -= beside
            edge += beside
        if len(spot) >= LEAST:
            found.append((sum(u for u, _ in spot) / len(spot), sum(v for _, v in spot) / len(spot)))
    return sorted(found)


async def main() -> None:
    """Sorts what is in the picture."""
    picture, marks = read(FILES)
    camera = Calibration.from_points([mark[:2] for mark in marks], [mark[2:] for mark in marks])
    print(f"the camera is off by {camera.error:.2f} mm")
    pixels = np.asarray(picture.convert("RGB"))
    async with Magician.connect(URL) as arm:
        await arm.set_end_effector(SuctionCup())
        for color, (channel, (x, y)) in PALLETS.items():
            pallet = Grid([(x, y, Z), (x + 40, y, Z), (x, y + 40, Z)], rows=1, columns=2, layers=2, layer_height=25)
            for pixel, place in zip(spots(pixels, channel), pallet, strict=False):
                part = camera.to_arm(pixel)
                await pick_and_place(arm, (*part, Z), place, tool="suction", travel_z=20)
                print(f"sorted a {color} part from ({part[0]:.0f}, {part[1]:.0f})")


asyncio.run(main())
