"""pydobotplus: takes parts from a conveyor belt, and sorts them by their colour.

One line differs from a program of pydobotplus: the import. The arm's port, or a URL, is the argument. The belt is on
stepper 1, the infrared sensor (V1) on GP4, and the colour sensor (V2), which looks up at the part in the cup, on GP2.
"""

import sys

from dobot_async.compat.pydobotplus import CustomPosition, Dobot  # was: from pydobotplus import CustomPosition, Dobot

PORT = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
BELT, LOOK = CustomPosition(220, 120, 0, 0), CustomPosition(200, -60, -40, 0)
BOXES = [CustomPosition(120, -200, -10, 0), CustomPosition(190, -150, -10, 0), CustomPosition(240, -60, -10, 0)]
NAMES = ["red", "green", "blue"]
UP = 50


def next_part(device):
    for _ in range(50):  # steps of 5 mm without a part: there are no more
        if device.get_ir(Dobot.PORT_GP4):
            return True
        device.wait_for_cmd(device.conveyor_belt_distance(50, 5))
    return False


def go(device, place):
    device.move_to(z=UP)
    device.move_to(place.x, place.y, UP)
    device.move_to(position=place)


def suck(device, on):
    device.suck(on)
    device.wait_for_cmd(device.wait(300))


device = Dobot(PORT)
device.set_ir(True, Dobot.PORT_GP4)
device.set_color(True, Dobot.PORT_GP2, version=1)
device.wait_for_cmd(device.wait(300))

while next_part(device):
    go(device, BELT)
    suck(device, True)
    go(device, LOOK)
    device.wait_for_cmd(device.wait(500))
    color = device.get_color(Dobot.PORT_GP2, version=1).index(True)
    go(device, BOXES[color])
    suck(device, False)
    print("sorted a", NAMES[color], "part")

device.move_to(200, 0, UP)
device.close()
