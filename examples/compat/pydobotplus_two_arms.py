"""pydobotplus: two arms in two threads. One puts parts on a place between them, from which the other one takes them.

One line differs from a program of pydobotplus: the import. The arms' ports, or URLs, are the arguments. The second arm
stands opposite the first one, 500 mm away, turned round.
"""

import queue
import sys
import threading

from dobot_async.compat.pydobotplus import Dobot  # was: from pydobotplus import Dobot

PORTS = sys.argv[1:3] if len(sys.argv) > 2 else ["sim:?speed=50", "sim:?speed=50"]
MIDDLE = (250, 0)
STOCK, STORE = [(230, 80), (230, 120), (190, 120)], [(190, 80), (190, 120), (150, 150)]
ABOVE, DOWN = 20, -53.5

free, full, ended = queue.Queue(), queue.Queue(), queue.Queue()
free.put("the middle is free")


def take(device, x, y, on):
    device.move_to(x, y, ABOVE)
    device.move_to(x, y, DOWN)
    device.suck(on)
    device.wait_for_cmd(device.wait(300))
    device.move_to(x, y, ABOVE)


def first():
    device = Dobot(PORTS[0])
    for x, y in STOCK:
        take(device, x, y, True)
        free.get()
        take(device, *MIDDLE, False)
        device.move_to(200, 100, ABOVE)
        full.put("a part is in the middle")
    device.close()


def second():
    device = Dobot(PORTS[1])
    for x, y in STORE:
        full.get()
        take(device, *MIDDLE, True)
        take(device, x, y, False)
        free.put("the middle is free")
    device.close()


def work(job):
    try:
        job()
        ended.put(None)
    except Exception as error:
        ended.put(error)


for job in (first, second):
    threading.Thread(target=work, args=(job,), daemon=True).start()
for _ in (first, second):
    if error := ended.get():
        raise error
print("handed over", len(STOCK), "parts")
