"""Parameters of the Magician's commands, 2.17 to 2.19: calibration, Wi-Fi, programs; see the package."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from dobot_async._core.protocol.wire import f32, f32x8, flag, u8x4, u32

__all__ = [
    "WIFIDNS",
    "AngleSensorCoef",
    "AngleSensorStaticError",
    "QueuedCmdStartDownload",
    "UART4PeripheralsType",
    "UserParams",
    "WIFIGateway",
    "WIFIIPAddress",
    "WIFINetmask",
]


@dataclass(frozen=True, slots=True)
class AngleSensorStaticError:
    """What the angle sensors of the two arms show too much, degrees. 2.17.1."""

    rear_arm_angle_error: f32
    front_arm_angle_error: f32


@dataclass(frozen=True, slots=True)
class AngleSensorCoef:
    """The scale of the angle sensors of the two arms. V1.1."""

    rear_arm_angle_coef: f32
    front_arm_angle_coef: f32


@dataclass(frozen=True, slots=True)
class WIFIIPAddress:
    """The arm's IPv4 address, as in (192, 168, 1, 20), or DHCP. 2.18.4."""

    dhcp: flag
    addr: u8x4 = (0, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class WIFINetmask:
    """The IPv4 netmask, as in (255, 255, 255, 0). 2.18.5."""

    addr: u8x4


@dataclass(frozen=True, slots=True)
class WIFIGateway:
    """The gateway's IPv4 address. 2.18.6."""

    addr: u8x4


@dataclass(frozen=True, slots=True)
class WIFIDNS:
    """The name server's IPv4 address. 2.18.7."""

    addr: u8x4


@dataclass(frozen=True, slots=True)
class QueuedCmdStartDownload:
    """Stores what is queued next in the arm's flash, to be run from its key: loops, and lines in each. 2.19.4."""

    total_loop: u32
    line_per_loop: u32


class UART4PeripheralsType(IntEnum):
    """What is plugged into the arm's one serial socket. V1.1."""

    UART = 0
    WIFI = 1
    BLE = 2
    CH375 = 3


@dataclass(frozen=True, slots=True)
class UserParams:
    """Eight numbers that the firmware keeps for its user. V1.1."""

    params: f32x8
