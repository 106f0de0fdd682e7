"""`DobotDllType`'s functions for the device itself, its pose, its alarms and its Wi-Fi. See `_dll_motion` for isQueued.

What the vendor's file returns in a list is in a list here.
"""

from __future__ import annotations

from dobot_async.arms.magician import commands as c
from dobot_async.compat._dll_api import Api

__all__ = [
    "ClearAllAlarmsState",
    "GetAlarmsState",
    "GetAngleSensorCoef",
    "GetAngleSensorStaticError",
    "GetArmOrientation",
    "GetArmSpeedRatio",
    "GetAutoLevelingResult",
    "GetBaseDecoderStaticError",
    "GetDeviceID",
    "GetDeviceInfo",
    "GetDeviceName",
    "GetDeviceSN",
    "GetDeviceTime",
    "GetDeviceVersion",
    "GetDeviceWithL",
    "GetHHTTrigMode",
    "GetHHTTrigOutput",
    "GetHHTTrigOutputEnabled",
    "GetKinematics",
    "GetPose",
    "GetPoseL",
    "GetUserParams",
    "GetWIFIConfigMode",
    "GetWIFIConnectStatus",
    "GetWIFIDNS",
    "GetWIFIGateway",
    "GetWIFIIPAddress",
    "GetWIFINetmask",
    "GetWIFIPassword",
    "GetWIFISSID",
    "ResetPose",
    "SetArmOrientation",
    "SetArmSpeedRatio",
    "SetDeviceName",
    "SetDeviceWithL",
    "SetHHTTrigMode",
    "SetHHTTrigOutputEnabled",
    "SetLostStepCmd",
    "SetLostStepParams",
    "SetWIFIConfigMode",
    "SetWIFIDNS",
    "SetWIFIGateway",
    "SetWIFIIPAddress",
    "SetWIFINetmask",
    "SetWIFIPassword",
    "SetWIFISSID",
]


def GetDeviceSN(api: Api) -> list[str]:
    """Return the serial number, in a list."""
    return [api.session.read(c.GET_DEVICE_SN)]


def SetDeviceName(api: Api, str: str) -> None:  # noqa: A002 - the vendor's name
    """Name the arm."""
    api.session.write(c.SET_DEVICE_NAME, str)


def GetDeviceName(api: Api) -> list[str]:
    """Return the arm's name, in a list."""
    return [api.session.read(c.GET_DEVICE_NAME)]


def GetDeviceVersion(api: Api) -> list[int]:
    """Return the three numbers of the firmware's version."""
    found = api.session.read(c.GET_DEVICE_VERSION)
    return [found.major_version, found.minor_version, found.revision]


def SetDeviceWithL(api: Api, isWithL: int, version: int = 0, isQueued: int = 0) -> list[int]:
    """Say whether the arm stands on a rail, and of which version it is: 0 is V1, 1 is V2."""
    return api.tell(c.SET_DEVICE_WITH_L, c.DeviceWithL(bool(isWithL), c.AccessoryVersion(version)), isQueued)


def GetDeviceWithL(api: Api) -> list[bool]:
    """Return whether the arm was told that it stands on a rail, in a list."""
    return [api.session.read(c.GET_DEVICE_WITH_L)]


def GetDeviceTime(api: Api) -> list[int]:
    """Return milliseconds since the arm was switched on, in a list."""
    return [api.session.read(c.GET_DEVICE_TIME)]


def GetDeviceID(api: Api) -> list[int]:
    """Return 0, and the three numbers of the processor's id."""
    return [0, *api.session.read(c.GET_DEVICE_ID)]


def GetDeviceInfo(api: Api) -> list[int]:
    """Return how long the arm has been running in all, and how often it was switched on and off."""
    found = api.session.read(c.GET_DEVICE_INFO)
    return [found.run_time, found.power_on, found.power_off]


def ResetPose(api: Api, manual: int, rearArmAngle: float, frontArmAngle: float) -> None:
    """Take the pose anew: from the angle sensors (0), or from the two angles given (1)."""
    api.session.write(c.RESET_POSE, c.ResetPose(bool(manual), rearArmAngle, frontArmAngle))


def GetPose(api: Api) -> list[float]:
    """Return x, y, z (mm), r and the four joints (degrees)."""
    pose = api.session.read(c.GET_POSE)
    return [pose.x, pose.y, pose.z, pose.r, *pose.joints]


def GetPoseL(api: Api) -> list[float]:
    """Return where the arm stands on its rail, mm, in a list."""
    return [api.session.read(c.GET_POSE_L)]


def GetKinematics(api: Api) -> list[float]:
    """Return velocity and acceleration that the arm has now."""
    found = api.session.read(c.GET_KINEMATICS)
    return [found.velocity, found.acceleration]


def GetAlarmsState(api: Api, maxLen: int = 1000) -> tuple[bytes, int]:
    """Return 16 bytes, of which alarm n is bit n % 8 of byte n // 8, and their number."""
    bits = api.session.alarms()
    return bits, len(bits)


def ClearAllAlarmsState(api: Api) -> None:
    """Clear the alarms; what the arm was doing when they came up does not go on."""
    api.session.clear_alarms()


def GetUserParams(api: Api) -> list[float]:
    """Return the eight numbers that the firmware keeps for its user."""
    return list(api.session.read(c.GET_USER_PARAMS).params)


def GetAutoLevelingResult(api: Api) -> list[float]:
    """Return how precisely the arm was levelled, in a list."""
    return [api.session.read(c.GET_AUTO_LEVELING_RESULT)]


def SetArmOrientation(api: Api, armOrientation: int, isQueued: int = 0) -> list[int]:
    """Set the elbow's side; for SCARA arms, a Magician may not answer it."""
    return api.tell(c.SET_ARM_ORIENTATION, c.ArmOrientation(armOrientation), isQueued)


def GetArmOrientation(api: Api) -> list[int]:
    """Return the elbow's side, in a list; for SCARA arms, a Magician may not answer it."""
    return [api.session.read(c.GET_ARM_ORIENTATION)]


def GetArmSpeedRatio(api: Api, paramsMode: int = 0) -> list[float]:
    """Return the percentage of velocity that jogs (0) or PTP motions (1) use, in a list."""
    if paramsMode:
        return [api.session.read(c.GET_PTP_COMMON_PARAMS).velocity_ratio]

    return [api.session.read(c.GET_JOG_COMMON_PARAMS).velocity_ratio]


def SetArmSpeedRatio(api: Api, paramsMode: int, speedRatio: float, isQueued: int = 0) -> list[int]:
    """Set the percentage of velocity and acceleration that jogs (0) or PTP motions (1) use."""
    if paramsMode:
        return api.tell(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(speedRatio, speedRatio), isQueued)

    return api.tell(c.SET_JOG_COMMON_PARAMS, c.JOGCommonParams(speedRatio, speedRatio), isQueued)


def SetHHTTrigMode(api: Api, hhtTrigMode: int) -> None:
    """Say when a point is recorded while the arm is led by hand (`HHTTrigMode`)."""
    api.session.write(c.SET_HHT_TRIG_MODE, c.HHTTrigMode(hhtTrigMode))


def GetHHTTrigMode(api: Api) -> list[int]:
    """Return when a point is recorded while the arm is led by hand, in a list."""
    return [api.session.read(c.GET_HHT_TRIG_MODE)]


def SetHHTTrigOutputEnabled(api: Api, isEnabled: int) -> None:
    """Say whether points are recorded while the arm is led by hand."""
    api.session.write(c.SET_HHT_TRIG_OUTPUT_ENABLED, bool(isEnabled))


def GetHHTTrigOutputEnabled(api: Api) -> list[bool]:
    """Return whether points are recorded while the arm is led by hand, in a list."""
    return [api.session.read(c.GET_HHT_TRIG_OUTPUT_ENABLED)]


def GetHHTTrigOutput(api: Api) -> list[bool]:
    """Return whether a point is to be recorded now, in a list."""
    return [api.session.read(c.GET_HHT_TRIG_OUTPUT)]


def GetAngleSensorStaticError(api: Api) -> list[float]:
    """Return what the angle sensors of rear arm and forearm show too much, degrees."""
    found = api.session.read(c.GET_ANGLE_SENSOR_STATIC_ERROR)
    return [found.rear_arm_angle_error, found.front_arm_angle_error]


def GetAngleSensorCoef(api: Api) -> list[float]:
    """Return the scale of the angle sensors of rear arm and forearm."""
    found = api.session.read(c.GET_ANGLE_SENSOR_COEF)
    return [found.rear_arm_angle_coef, found.front_arm_angle_coef]


def GetBaseDecoderStaticError(api: Api) -> list[float]:
    """Return what the base's encoder shows too much, degrees, in a list."""
    return [api.session.read(c.GET_BASE_DECODER_STATIC_ERROR)]


def SetLostStepParams(api: Api, threshold: float, isQueued: int = 0) -> list[int]:
    """Set from how many degrees on steps count as lost."""
    return [api.session.write(c.SET_LOST_STEP_PARAMS, threshold)]


def SetLostStepCmd(api: Api, isQueued: int = 0) -> list[int]:
    """Check for lost steps; if there are any, that is an alarm."""
    return api.tell(c.SET_LOST_STEP_CMD, None, isQueued)


def GetWIFIConnectStatus(api: Api) -> list[bool]:
    """Return whether the arm is in a Wi-Fi network, in a list."""
    return [api.session.read(c.GET_WIFI_CONNECT_STATUS)]


def SetWIFIConfigMode(api: Api, enable: int) -> None:
    """Begin or end the configuration of the Wi-Fi module."""
    api.session.write(c.SET_WIFI_CONFIG_MODE, bool(enable))


def GetWIFIConfigMode(api: Api) -> list[bool]:
    """Return whether the Wi-Fi module is being configured, in a list."""
    return [api.session.read(c.GET_WIFI_CONFIG_MODE)]


def SetWIFISSID(api: Api, ssid: str) -> None:
    """Set the network that the arm joins."""
    api.session.write(c.SET_WIFI_SSID, ssid)


def GetWIFISSID(api: Api) -> list[str]:
    """Return the network that the arm joins, in a list."""
    return [api.session.read(c.GET_WIFI_SSID)]


def SetWIFIPassword(api: Api, password: str) -> None:
    """Set the network's password."""
    api.session.write(c.SET_WIFI_PASSWORD, password)


def GetWIFIPassword(api: Api) -> list[str]:
    """Return the network's password, in a list."""
    return [api.session.read(c.GET_WIFI_PASSWORD)]


def SetWIFIIPAddress(api: Api, dhcp: int, addr1: int, addr2: int, addr3: int, addr4: int) -> None:
    """Set the arm's address."""
    api.session.write(c.SET_WIFI_IP_ADDRESS, c.WIFIIPAddress(bool(dhcp), (addr1, addr2, addr3, addr4)))


def GetWIFIIPAddress(api: Api) -> list[int]:
    """Return whether the address comes from DHCP, and its four numbers."""
    found = api.session.read(c.GET_WIFI_IP_ADDRESS)
    return [int(found.dhcp), *found.addr]


def SetWIFINetmask(api: Api, addr1: int, addr2: int, addr3: int, addr4: int) -> None:
    """Set the netmask."""
    api.session.write(c.SET_WIFI_NETMASK, c.WIFINetmask((addr1, addr2, addr3, addr4)))


def GetWIFINetmask(api: Api) -> list[int]:
    """Return the netmask."""
    return list(api.session.read(c.GET_WIFI_NETMASK).addr)


def SetWIFIGateway(api: Api, addr1: int, addr2: int, addr3: int, addr4: int) -> None:
    """Set the gateway."""
    api.session.write(c.SET_WIFI_GATEWAY, c.WIFIGateway((addr1, addr2, addr3, addr4)))


def GetWIFIGateway(api: Api) -> list[int]:
    """Return the gateway."""
    return list(api.session.read(c.GET_WIFI_GATEWAY).addr)


def SetWIFIDNS(api: Api, addr1: int, addr2: int, addr3: int, addr4: int) -> None:
    """Set the name server."""
    api.session.write(c.SET_WIFI_DNS, c.WIFIDNS((addr1, addr2, addr3, addr4)))


def GetWIFIDNS(api: Api) -> list[int]:
    """Return the name server."""
    return list(api.session.read(c.GET_WIFI_DNS).addr)
