"""DobotLab: puts parts on a pallet, two by two, one layer on the other.

One line differs from a program of DobotLab: the import. In DobotLab `magician` is the arm that is connected; here it is
the one of the environment variable DOBOT_URL, or the first one on USB.
"""

from dobot_async.compat.dobotlab import magician  # was: from DobotEDU import *

STOCK = [(230, -20), (230, 20), (270, -20), (270, 20), (230, -60), (230, 60)]
PALLET, STEP, LAYER = (150, 120), 30, 25  # mm
DOWN, TOP = -53.5, 60


def suck(on):
    magician.set_endeffector_suctioncup(enable=True, on=on)
    magician.wait(second=0.3)


magician.set_home()
magician.motion_params = 100, 100
magician.jump_params = 100, 60  # zlimit, height
for number, (x, y) in enumerate(STOCK):
    magician.ptp(mode=0, x=x, y=y, z=DOWN, r=0)
    suck(True)
    layer, place = divmod(number, 4)
    row, column = divmod(place, 2)
    z = DOWN + layer * LAYER
    magician.ptp(mode=1, x=x, y=y, z=TOP, r=0)
    magician.ptp(mode=1, x=PALLET[0] + row * STEP, y=PALLET[1] + column * STEP, z=TOP, r=0)
    magician.ptp(mode=2, x=PALLET[0] + row * STEP, y=PALLET[1] + column * STEP, z=z, r=0)
    suck(False)
    pose = magician.get_pose()
    print("stacked part", number + 1, "at", round(pose["x"]), round(pose["y"]), round(pose["z"], 1))
    magician.ptp(mode=2, x=pose["x"], y=pose["y"], z=TOP, r=0)
