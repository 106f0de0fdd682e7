"""pydobot: draws a square, and a circle in it, with the pen.

One line differs from a program of pydobot: the import. The arm's port, or a URL, is the argument.
"""

import math
import sys

from dobot_async.compat.pydobot import Dobot  # was: from pydobot import Dobot

PORT = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
X, Y, PAPER, UP = 230, 0, -40, -20  # mm
SIDE, RADIUS, CORNERS = 40, 15, 36


def draw(device, points):
    device.move_to(*points[0], UP, 0)
    for x, y in points:
        device.move_to(x, y, PAPER, 0)
    device.move_to(*points[-1], UP, 0, wait=True)


square = [(X + dx * SIDE / 2, Y + dy * SIDE / 2) for dx, dy in ((1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1))]
angles = [2 * math.pi * n / CORNERS for n in range(CORNERS + 1)]
circle = [(X + RADIUS * math.cos(a), Y + RADIUS * math.sin(a)) for a in angles]

device = Dobot(PORT)
try:
    for name, points in (("square", square), ("circle", circle)):
        draw(device, points)
        print("drew the", name)
finally:
    device.close()
