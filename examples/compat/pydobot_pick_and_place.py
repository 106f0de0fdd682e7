"""pydobot: carries three parts from one row to another with the suction cup.

One line differs from a program of pydobot: the import. The arm's port, or a URL, is the argument.
"""

import sys

from dobot_async.compat.pydobot import Dobot  # was: from pydobot import Dobot

PORT = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
ABOVE, DOWN = 20, -53.5  # mm; the cup is some 60 mm below
PARTS = [(230, -60), (250, 0), (230, 60)]
PLACES = [(190, -80), (190, -20), (190, 40)]


def carry(device, start, end):
    x, y = start
    device.move_to(x, y, ABOVE, 0, wait=False)
    device.move_to(x, y, DOWN, 0, wait=False)
    device.suck(True)
    device.wait(300)
    device.move_to(x, y, ABOVE, 0, wait=False)
    x, y = end
    device.move_to(x, y, ABOVE, 0, wait=False)
    device.move_to(x, y, DOWN, 0, wait=False)
    device.suck(False)
    device.wait(300)
    device.move_to(x, y, ABOVE, 0, wait=True)


device = Dobot(port=PORT, verbose=False)
x, y, z, r, j1, j2, j3, j4 = device.pose()
print(f"x:{x:.1f} y:{y:.1f} z:{z:.1f} r:{r:.1f}")
device.speed(100, 100)

for number, (start, end) in enumerate(zip(PARTS, PLACES), 1):
    carry(device, start, end)
    print("placed part", number)

device.close()
