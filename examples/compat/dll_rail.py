"""DobotDllType: an arm on its rail carries parts from one end to the other, with DobotStudio's functions that wait.

One line differs from a program of the vendor's DobotDllType.py: the import. The arm's port, or a URL, is the argument.
"""

import sys

import dobot_async.compat.DobotDllType as dType  # was: import DobotDllType as dType

PORT = sys.argv[1] if len(sys.argv) > 1 else "sim:?speed=50"
PLACES = [(200, -60), (230, 0), (200, 60)]
ABOVE, DOWN = 20, -53.5
NEAR, FAR = 100, 700  # mm along the rail


def suck(on):
    dType.SetEndEffectorSuctionCupEx(api, 1, on)
    dType.SetWAITCmdEx(api, 300, 1)


api = dType.load()
if dType.ConnectDobot(api, PORT, 115200)[0] == dType.DobotConnect.DobotConnect_NoError:
    dType.SetDeviceWithL(api, 1)
    dType.SetPTPLParamsEx(api, 200, 200, 1)
    dType.SetPTPCommonParamsEx(api, 100, 100, 1)
    dType.SetHOMECmdEx(api, 0, 1)
    for x, y in PLACES:
        dType.SetPTPWithLCmdEx(api, 1, x, y, ABOVE, 0, NEAR, 1)
        dType.SetPTPCmdEx(api, 2, x, y, DOWN, 0, 1)
        suck(1)
        dType.SetPTPCmdEx(api, 2, x, y, ABOVE, 0, 1)
        dType.SetPTPWithLCmdEx(api, 1, x, y, ABOVE, 0, FAR, 1)
        dType.SetPTPCmdEx(api, 2, x, y, DOWN, 0, 1)
        suck(0)
        dType.SetPTPCmdEx(api, 2, x, y, ABOVE, 0, 1)
        print("put down at", round(dType.GetPoseEx(api, 0)), "mm")
    dType.DisconnectDobot(api)
