"""DobotLab: takes parts from a conveyor belt, and sorts them by their colour.

One line differs from a program of DobotLab: the import. In DobotLab `magician` is the arm that is connected; here it is
the one of the environment variable DOBOT_URL, or the first one on USB. The belt is on stepper 1, the infrared sensor
(V2) on GP4, and the colour sensor (V2), which looks up at the part in the cup, on GP2.
"""

from dobot_async.compat.dobotlab import magician  # was: from DobotEDU import *

BOXES = {"red": (120, -200, -10), "green": (190, -150, -10), "blue": (240, -60, -10)}
UP = 50
BELT = 100  # pulses/s: slow, for it is the program that stops the belt


def next_part():
    for _ in range(22):
        if magician.get_infrared_sensor(port=4)["status"] == 1:
            return True
        magician.set_converyor(index=magician.Stepper1, enable=True, speed=BELT)
        magician.wait(second=3)
        magician.set_converyor(index=magician.Stepper1, enable=False, speed=0)
    return False


def jump_to(x, y, z):
    pose = magician.get_pose()
    magician.ptp(mode=2, x=pose["x"], y=pose["y"], z=UP, r=0)
    magician.ptp(mode=1, x=x, y=y, z=UP, r=0)
    magician.ptp(mode=2, x=x, y=y, z=z, r=0)


def suck(on):
    magician.set_endeffector_suctioncup(enable=True, on=on)
    magician.wait(second=0.3)


magician.motion_params(100, 100)
magician.set_infrared_sensor(port=4, enable=True, version=1)
magician.set_color_sensor(port=2, enable=True, version=1)
magician.wait(second=0.5)
while next_part():
    jump_to(220, 120, 0)
    suck(True)
    jump_to(200, -60, -40)
    magician.wait(second=0.5)
    reading = magician.get_color_sensor()
    color = next(name for name in BOXES if reading.get(name) == 1)
    jump_to(*BOXES[color])
    suck(False)
    print("sorted a", color, "part")
