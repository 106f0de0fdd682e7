"""DobotDllType: each time that a part stands at the light barrier, a lamp goes on, and the arm takes the part away.

One line differs from a program of the vendor's DobotDllType.py: the import. The arm's port, or a URL, is the first
argument, the number of parts the second one. The barrier is at pin 4, the lamp at pin 2.
"""

import sys

import dobot_async.compat.DobotDllType as dType  # was: import DobotDllType as dType

PORT = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
COUNT = int(sys.argv[2]) if len(sys.argv) > 2 else 0
LAMP, BARRIER = 2, 4
ABOVE, DOWN = 20, -53.5
PART, PLACES = (250, 0), [(190, -80), (190, -20), (190, 40)]


def wait_for(index):
    while index[0] > dType.GetQueuedCmdCurrentIndex(api)[0]:
        dType.dSleep(5)


api = dType.load()
state = dType.ConnectDobot(api, PORT, 115200)[0]
if state != dType.DobotConnect.DobotConnect_NoError:
    sys.exit("no arm")

dType.SetIOMultiplexing(api, LAMP, dType.GPIOType.GPIOTypeDO, isQueued=1)
wait_for(dType.SetIOMultiplexing(api, BARRIER, dType.GPIOType.GPIOTypeDI, isQueued=1))
for x, y in PLACES[:COUNT]:
    dType.SetPTPCmd(api, dType.PTPMode.PTPMOVJXYZMode, *PART, ABOVE, 0, isQueued=1)
    dType.SetTRIGCmd(
        api, BARRIER, dType.TRIGMode.TRIGInputIOMode, dType.TRIGInputIOCondition.TRIGInputIOEqual, 1, isQueued=1
    )
    dType.SetIODO(api, LAMP, 1, isQueued=1)
    for (px, py), suck in ((PART, 1), ((x, y), 0)):
        dType.SetPTPCmd(api, dType.PTPMode.PTPMOVJXYZMode, px, py, ABOVE, 0, isQueued=1)
        dType.SetPTPCmd(api, dType.PTPMode.PTPMOVLXYZMode, px, py, DOWN, 0, isQueued=1)
        dType.SetEndEffectorSuctionCup(api, 1, suck, isQueued=1)
        dType.SetWAITCmd(api, 300, isQueued=1)
        dType.SetPTPCmd(api, dType.PTPMode.PTPMOVLXYZMode, px, py, ABOVE, 0, isQueued=1)
    wait_for(dType.SetIODO(api, LAMP, 0, isQueued=1))
    print("took a part; barrier", dType.GetIODI(api, BARRIER)[0], "lamp", dType.GetIODO(api, LAMP)[0])

dType.DisconnectDobot(api)
