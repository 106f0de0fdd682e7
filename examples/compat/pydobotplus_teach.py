"""pydobotplus: records places to which the arm is guided by hand, and then carries a part from the first to the last.

One line differs from a program of pydobotplus: the import. The arm's port, or a URL, is the first argument, the number
of places the second one. Hold the key on the forearm, guide the cup to a place, let go, and press Enter.
"""

import sys

from dobot_async.compat.pydobotplus import MODE_PTP, Dobot  # was: from pydobotplus.dobotplus import MODE_PTP, Dobot

PORT = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
COUNT = int(sys.argv[2]) if len(sys.argv) > 2 else 0
UP = 40

device = Dobot(port=PORT)
places = []
while len(places) < COUNT:
    input(f"place {len(places) + 1}: guide the arm there, then press Enter\n")
    places.append(device.get_pose().position)

for number, place in enumerate(places):
    device.move_to(place.x, place.y, place.z + UP, place.r, mode=MODE_PTP.MOVJ_XYZ)
    device.move_to(place.x, place.y, place.z, place.r, mode=MODE_PTP.MOVL_XYZ)
    if number in (0, len(places) - 1):
        device.suck(number == 0)
        device.wait_for_cmd(device.wait(300))
    device.move_rel(z=UP)
    print("was at place", number + 1)

device.close()
