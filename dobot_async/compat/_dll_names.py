"""The numbers that `DobotDllType` has names for: each class holds whole numbers, as the vendor's file has them."""

from __future__ import annotations

from typing import Final

__all__ = [
    "JC",
    "ArmOrientation",
    "ColorPort",
    "ContinuousPathMode",
    "DevType",
    "DobotCommunicate",
    "DobotConnect",
    "EndType",
    "GPIOType",
    "HHTTrigMode",
    "InfraredPort",
    "InputLevel",
    "PTPMode",
    "ParamsMode",
    "TRIGADCCondition",
    "TRIGInputIOCondition",
    "TRIGMode",
]


class DobotConnect:
    """What `ConnectDobot` returns first."""

    DobotConnect_NoError: Final = 0
    DobotConnect_NotFound: Final = 1
    DobotConnect_Occupied: Final = 2


class DobotCommunicate:
    """How a call of the library ends. Here it is 0, or an exception."""

    DobotCommunicate_NoError: Final = 0
    DobotCommunicate_BufferFull: Final = 1
    DobotCommunicate_Timeout: Final = 2
    DobotCommunicate_InvalidParams: Final = 3
    DobotCommunicate_InvalidDevice: Final = 4


class DevType:
    """Which device answers; here it is always a Magician."""

    Idle: Final = 0
    Conntroller: Final = 1
    Magician: Final = 2
    MagicianLite: Final = 3


class EndType:
    """Tools."""

    EndTypeCustom: Final = 0
    EndTypeSuctionCup: Final = 1
    EndTypeGripper: Final = 2
    EndTypeLaser: Final = 3
    EndTypePen: Final = 4
    EndTypeMax: Final = 5


class ParamsMode:
    """Which speed ratio is meant."""

    JOG: Final = 0
    other: Final = 1


class ArmOrientation:
    """The elbow's side."""

    LeftyArmOrientation: Final = 0
    RightyArmOrientation: Final = 1


class HHTTrigMode:
    """When a point is recorded while the arm is led by hand."""

    TriggeredOnKeyReleased: Final = 0
    TriggeredOnPeriodicInterval: Final = 1


class JC:
    """Keys of the teach pendant, for `SetJOGCmd`."""

    JogIdle: Final = 0
    JogAPPressed: Final = 1
    JogANPressed: Final = 2
    JogBPPressed: Final = 3
    JogBNPressed: Final = 4
    JogCPPressed: Final = 5
    JogCNPressed: Final = 6
    JogDPPressed: Final = 7
    JogDNPressed: Final = 8
    JogEPPressed: Final = 9
    JogENPressed: Final = 10


class PTPMode:
    """Modes of `SetPTPCmd`."""

    PTPJUMPXYZMode: Final = 0
    PTPMOVJXYZMode: Final = 1
    PTPMOVLXYZMode: Final = 2
    PTPJUMPANGLEMode: Final = 3
    PTPMOVJANGLEMode: Final = 4
    PTPMOVLANGLEMode: Final = 5
    PTPMOVJANGLEINCMode: Final = 6
    PTPMOVLXYZINCMode: Final = 7
    PTPMOVJXYZINCMode: Final = 8
    PTPJUMPMOVLXYZMode: Final = 9


class InputLevel:
    """Levels of an input."""

    InputLevelBoth: Final = 0
    InputLevelLow: Final = 1
    InputLevelHigh: Final = 2


class ContinuousPathMode:
    """Modes of `SetCPCmd`."""

    CPRelativeMode: Final = 0
    CPAbsoluteMode: Final = 1


class TRIGMode:
    """What `SetTRIGCmd` looks at."""

    TRIGInputIOMode: Final = 0
    TRIGADCMode: Final = 1


class TRIGInputIOCondition:
    """Conditions of a digital input."""

    TRIGInputIOEqual: Final = 0
    TRIGInputIONotEqual: Final = 1


class TRIGADCCondition:
    """Conditions of an analog input."""

    TRIGADCLT: Final = 0
    TRIGADCLE: Final = 1
    TRIGADCGE: Final = 2
    TRIGADCGT: Final = 3


class GPIOType:
    """What a pin is for, for `SetIOMultiplexing`."""

    GPIOTypeDummy: Final = 0
    GPIOTypeDO: Final = 1
    GPIOTypePWM: Final = 2
    GPIOTypeDI: Final = 3
    GPIOTypeADC: Final = 4
    GPIOTypeDIPU: Final = 5
    GPIOTypeDIPD: Final = 6


class ColorPort:
    """Sockets of the colour sensor."""

    PORT_GP1: Final = 0
    PORT_GP2: Final = 1
    PORT_GP4: Final = 2
    PORT_GP5: Final = 3


class InfraredPort:
    """Sockets of the infrared sensor."""

    PORT_GP1: Final = 0
    PORT_GP2: Final = 1
    PORT_GP4: Final = 2
    PORT_GP5: Final = 3
