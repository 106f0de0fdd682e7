"""Draws an SVG path (M, L, C and Z, absolute) with a pen, each stroke as one continuous path (CP).

On a real arm: home it, put in the pen, and set PAPER to the z at which it touches. The picture is seen from behind the
arm, with its (0, 0) at CORNER. Arguments are the arm's URL and the path.
"""

import asyncio
import re
import sys

from dobot_async import Magician, Pen, PTPMode

URL = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
HEART = "M 30 20 C 30 10 45 0 52 10 C 60 22 42 40 30 52 C 18 40 0 22 8 10 C 15 0 30 10 30 20 Z M 20 57 L 40 57"
PAPER, LIFT, CORNER = -40.0, 15.0, (260.0, 30.0)


def strokes(path: str) -> list[list[complex]]:
    """Returns the points of each stroke of a path, curves as 24 lines each."""
    found: list[list[complex]] = []
    for word, rest in re.findall(r"([MLCZ])([^MLCZ]*)", path):
        n = [float(each) for each in re.findall(r"-?[\d.]+", rest)]
        points = [complex(x, y) for x, y in zip(n[::2], n[1::2], strict=True)]
        if word == "M":
            found.append(points)
        elif word == "C":
            a, (b, c, d) = found[-1][-1], points
            for t, u in ((step / 24, 1 - step / 24) for step in range(1, 25)):
                found[-1].append(u**3 * a + 3 * t * u**2 * b + 3 * t**2 * u * c + t**3 * d)
        else:
            found[-1] += points or [found[-1][0]]
    return found


async def main() -> None:
    """Draws stroke by stroke, with the pen up between them."""
    async with Magician.connect(URL) as arm:
        await arm.set_end_effector(Pen())
        for stroke in strokes(sys.argv[2] if len(sys.argv) > 2 else HEART):
            places = [(CORNER[0] - point.imag, CORNER[1] - point.real) for point in stroke]
            await arm.move_to(*places[0], PAPER + LIFT)
            await arm.move_to(*places[0], PAPER, mode=PTPMode.MOVL_XYZ)
            for x, y in places[1:]:
                await arm.queue.path_to(x, y, PAPER)
            await arm.move_by(z=LIFT)
            print(f"drew {len(places)} points")


asyncio.run(main())
