"""DobotDllType: homes the arm, queues a whole job, lets it run, and waits for its last command.

One line differs from a program of the vendor's DobotDllType.py: the import. The arm's port, or a URL, is the argument.
"""

import sys

import dobot_async.compat.DobotDllType as dType  # was: import DobotDllType as dType

PORT = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
CON_STR = {
    dType.DobotConnect.DobotConnect_NoError: "DobotConnect_NoError",
    dType.DobotConnect.DobotConnect_NotFound: "DobotConnect_NotFound",
    dType.DobotConnect.DobotConnect_Occupied: "DobotConnect_Occupied",
}
JOBS = [((230, -60), (190, -80)), ((250, 0), (190, -20)), ((230, 60), (190, 40))]
ABOVE, DOWN = 20, -53.5

api = dType.load()
state = dType.ConnectDobot(api, PORT, 115200)[0]
print("Connect status:", CON_STR[state])

if state == dType.DobotConnect.DobotConnect_NoError:
    dType.SetQueuedCmdStopExec(api)
    dType.SetQueuedCmdClear(api)
    dType.SetHOMEParams(api, 200, 0, 50, 0, isQueued=1)
    dType.SetPTPJointParams(api, 200, 200, 200, 200, 200, 200, 200, 200, isQueued=1)
    dType.SetPTPJumpParams(api, 60, 100, isQueued=1)
    dType.SetPTPCommonParams(api, 100, 100, isQueued=1)
    dType.SetHOMECmd(api, temp=0, isQueued=1)

    for start, end in JOBS:
        for (x, y), suck in ((start, 1), (end, 0)):
            dType.SetPTPCmd(api, dType.PTPMode.PTPJUMPXYZMode, x, y, DOWN, 0, isQueued=1)
            dType.SetEndEffectorSuctionCup(api, 1, suck, isQueued=1)
            dType.SetWAITCmd(api, 300, isQueued=1)
    lastIndex = dType.SetPTPCmd(api, dType.PTPMode.PTPMOVLXYZMode, 190, 40, ABOVE, 0, isQueued=1)[0]

    dType.SetQueuedCmdStartExec(api)
    while lastIndex > dType.GetQueuedCmdCurrentIndex(api)[0]:
        dType.dSleep(10)
    dType.SetQueuedCmdStopExec(api)
    print("done, at", [round(number) for number in dType.GetPose(api)[:3]])

dType.DisconnectDobot(api)
