"""What a simulated Magician remembers beside its pose: registers, motors, lost steps. Knows no bytes and no motion.

What a Set row of the command table wrote is its register, kept under the row's ID. Registers of pins and ports are kept
apart by address. Two tables say what stands in them: FLASH when the arm is made, POWER_UP whenever it is switched on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from typing import Any, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.kinematics import JointLimits, Joints, Kinematics

__all__ = ["HOME_JOINTS", "HOME_POINT", "REACH", "Motor", "State"]

Q = TypeVar("Q")

REACH = JointLimits(
    j1=(-125.0, 125.0),  # measured for magician_ros2, 2024; the data sheet says 90
    j2=(-5.0, 90.0),  # the same; the data sheet says 0 to 85
    j3=(-15.0, 90.0),  # lower end as measured; upper end by the vendor's ALARM Description V1.0.1, table 3.4
    j4=(-150.0, 150.0),  # measured; the data sheet says 135
    fold=(-70.0, 55.0),  # stretched as measured (j3 rises with j2 from 40 on); folded by the Magician Lite's limits
)
"""How far the joints go unless `limits` says otherwise, with the source of each number."""

HOME_JOINTS = Joints(0.0, 45.0, 45.0, 0.0)
HOME_POINT = c.HOMEParams(*Kinematics().forward(*HOME_JOINTS))
"""What HOMEParams are until somebody sets them: the home joints, with the default end effector."""

FLASH: Mapping[Command[Any, None], Any] = {
    c.SET_DEVICE_SN: "DTSIM00000000001",
    c.SET_DEVICE_NAME: "Dobot Magician",
    c.SET_ANGLE_SENSOR_STATIC_ERROR: c.AngleSensorStaticError(0, 0),
    c.SET_ANGLE_SENSOR_COEF: c.AngleSensorCoef(1, 1),
    c.SET_BASE_DECODER_STATIC_ERROR: 0.0,
    c.SET_WIFI_CONFIG_MODE: False,
    c.SET_WIFI_SSID: "",
    c.SET_WIFI_PASSWORD: "",
    c.SET_WIFI_IP_ADDRESS: c.WIFIIPAddress(dhcp=True),
    c.SET_WIFI_NETMASK: c.WIFINetmask((255, 255, 255, 0)),
    c.SET_WIFI_GATEWAY: c.WIFIGateway((0, 0, 0, 0)),
    c.SET_WIFI_DNS: c.WIFIDNS((0, 0, 0, 0)),
}
"""What the arm keeps without power."""

POWER_UP: Mapping[Command[Any, None], Any] = {
    c.SET_DEVICE_WITH_L: c.DeviceWithL(is_with_l=False),
    c.SET_HOME_PARAMS: HOME_POINT,
    c.SET_HHT_TRIG_MODE: c.HHTTrigMode.TRIGGERED_ON_KEY_RELEASED,
    c.SET_HHT_TRIG_OUTPUT_ENABLED: False,
    c.SET_ARM_ORIENTATION: c.ArmOrientation.LEFTY,
    c.SET_END_EFFECTOR_PARAMS: c.EndEffectorParams(59.7),
    c.SET_END_EFFECTOR_LASER: c.EndEffectorLaser(is_ctrl_enabled=False, is_on=False),
    c.SET_END_EFFECTOR_SUCTION_CUP: c.EndEffectorSuctionCup(is_ctrl_enabled=False, is_sucked=False),
    c.SET_END_EFFECTOR_GRIPPER: c.EndEffectorGripper(is_ctrl_enabled=False, is_gripped=False),
    c.SET_JOG_JOINT_PARAMS: c.JOGJointParams((15, 15, 15, 15), (100, 100, 100, 100)),
    c.SET_JOG_COORDINATE_PARAMS: c.JOGCoordinateParams((60, 60, 60, 60), (200, 200, 200, 200)),
    c.SET_JOG_COMMON_PARAMS: c.JOGCommonParams(100, 100),
    c.SET_JOGL_PARAMS: c.JOGLParams(60, 200),
    c.SET_PTP_JOINT_PARAMS: c.PTPJointParams((200, 200, 200, 200), (200, 200, 200, 200)),
    c.SET_PTP_COORDINATE_PARAMS: c.PTPCoordinateParams(200, 200, 200, 200),
    c.SET_PTP_JUMP_PARAMS: c.PTPJumpParams(20, 100),
    c.SET_PTP_COMMON_PARAMS: c.PTPCommonParams(50, 50),
    c.SET_PTPL_PARAMS: c.PTPLParams(200, 200),
    c.SET_PTP_JUMP2_PARAMS: c.PTPJump2Params(20, 20, 100),
    c.SET_CP_PARAMS: c.CPParams(100, 100, 100),
    c.SET_CPR_HOLD_ENABLE: False,
    c.SET_CP_COMMON_PARAMS: c.CPCommonParams(100, 100),
    c.SET_ARC_PARAMS: c.ARCParams(200, 200, 200, 200),
    c.SET_ARC_COMMON_PARAMS: c.ARCCommonParams(50, 50),
    c.SET_COLOR_SENSOR: c.ColorSensor(enable=False, port=c.ColorPort.GP1),
    c.SET_LOST_STEP_PARAMS: 5.0,
    c.SET_UART4_PERIPHERALS_ENABLE: False,
}
"""What the arm forgets without power. Velocities are what scripts for the Magician commonly set, jogs the Lite's."""

PINS: Mapping[Command[Any, None], Callable[[int], Any]] = {
    c.SET_IO_MULTIPLEXING: lambda address: c.IOMultiplexing(address, c.IOFunction.DUMMY),
    c.SET_IODO: lambda address: c.IODO(address, 0),
    c.SET_IOPWM: lambda address: c.IOPWM(address, 10, 0),
    c.SET_INFRARED_SENSOR: lambda port: c.InfraredSensor(enable=False, port=c.InfraredPort(port)),
}
"""Registers that each pin (1 to 20) or port has for itself, and what is in them after power-up."""

LEFT_AT = (8.0, 0.0, 0.0, -20.0, 120.0)
"""Where an arm stands that nobody has homed, as seen from where it believes to stand: joints in degrees, rail in mm.

Joints 2 and 3 have angle sensors that know at power-up; the base, the tool and the rail count steps from 0.
"""

LATENCIES: Mapping[Command[Any, None], float] = {
    c.SET_END_EFFECTOR_SUCTION_CUP: 0.2,
    c.SET_END_EFFECTOR_GRIPPER: 0.5,
    c.SET_COLOR_SENSOR: 0.2,
    c.SET_INFRARED_SENSOR: 0.1,
}
"""Seconds until what a register switches has followed: air has to flow, a sensor to take its first reading. Guesses."""

JOINING = 2.0
"""Seconds that the Wi-Fi module needs to join a network, from the last setting on."""

WIFI: Collection[Command[Any, None]] = {
    c.SET_WIFI_CONFIG_MODE,
    c.SET_WIFI_SSID,
    c.SET_WIFI_PASSWORD,
    c.SET_WIFI_IP_ADDRESS,
    c.SET_WIFI_NETMASK,
    c.SET_WIFI_GATEWAY,
    c.SET_WIFI_DNS,
}

SLOTS: Mapping[Command[Any, None], str] = {
    c.SET_IO_MULTIPLEXING: "address",
    c.SET_IODO: "address",
    c.SET_IOPWM: "address",
    c.SET_INFRARED_SENSOR: "port",
}


class Motor:
    """One of the two steppers.

    Attributes:
        speed: Pulses/s; negative backwards.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self.speed: int = 0
        self._now = now
        self._since = now()
        self._pulses = 0.0

    @property
    def pulses(self) -> int:
        """Pulses so far, those backwards subtracted."""
        return round(self._pulses + self.speed * (self._now() - self._since))

    def run(self, speed: int) -> None:
        """Goes on at a speed from now on; 0 stops."""
        now = self._now()
        self._pulses += self.speed * (now - self._since)
        self._since, self.speed = now, speed

    def __repr__(self) -> str:
        return f"<Motor at {self.speed} pulses/s, {self.pulses} pulses so far>"


class State:
    """The memory of one arm.

    Attributes:
        limits: How far its joints go.
        motors: The two steppers.
        lost_steps: By how many degrees each joint has lost steps.
        left_at: By how many degrees each joint, and by how many mm the rail, stood elsewhere than the arm believes when
            it was switched on.
        homed: Whether it was homed since it was switched on.
        levelled: The precision of the last levelling, 0 before it.
        networks: The Wi-Fi networks in range, with their passwords; None for any, with any password.
    """

    def __init__(self, now: Callable[[], float], limits: JointLimits, *, homed: bool) -> None:
        self.limits = limits
        self.homed: bool = homed
        self.motors: tuple[Motor, Motor] = (Motor(now), Motor(now))
        self.lost_steps: list[float] = [0.0] * 4
        self.left_at = (0.0,) * 5 if homed else LEFT_AT
        self.levelled: float = 0.0
        self.networks: Mapping[str, str] | None = None
        self._now = now
        self._registers = {(row.id, 0): value for row, value in FLASH.items()}
        self.boot()

    def power_up(self, joints: tuple[float, ...]) -> tuple[float, ...]:
        """Forgets all that is not in flash, and how far the base, the tool and the rail have come.

        Args:
            joints: Where it believed to stand.

        Returns:
            Where it believes to stand now: the base, the tool and the rail at 0, the two arms where they are.
        """
        self.boot()
        self.homed = False
        base, rear, fore, tool, rail = self.true(joints)
        self.lost_steps, self.left_at = [0.0] * 4, (base, 0.0, 0.0, tool, rail)
        return 0.0, rear, fore, 0.0, 0.0

    def true(self, joints: tuple[float, ...]) -> tuple[float, ...]:
        """Returns where joints and rail are, of where the arm believes them to be."""
        return tuple(each + astray for each, astray in zip(joints, self.astray, strict=True))

    @property
    def astray(self) -> tuple[float, ...]:
        """By how much joints (degrees) and rail (mm) stand elsewhere than the arm believes."""
        return tuple(left + lost for left, lost in zip(self.left_at, (*self.lost_steps, 0.0), strict=True))

    def found(self) -> None:
        """The switches were found: the arm knows where it is, and on its rail if it has one."""
        self.homed = True
        self.lost_steps = [0.0] * 4
        self.left_at = (0.0, 0.0, 0.0, 0.0, 0.0 if self.has_rail else self.left_at[4])

    def boot(self) -> None:
        """Puts into the registers what is there after power-up."""
        kept = {row.id for row in FLASH}
        self._registers = {key: value for key, value in self._registers.items() if key[0] in kept}
        self._registers |= {(row.id, 0): value for row, value in POWER_UP.items()}
        self._lift: c.PTPJumpParams | c.PTPJump2Params = self.get(c.SET_PTP_JUMP_PARAMS)
        self.levelled = 0.0
        self._changes: dict[tuple[int, int], tuple[float, Any]] = {}
        self._wifi_since = self._now()
        for motor in self.motors:
            motor.run(0)

    def get(self, row: Command[Q, None], slot: int = 0) -> Q:
        """Returns what a Set row wrote last, or what is there without it; `slot` is the address of a pin or port."""
        value: Q | None = self._registers.get((row.id, slot))
        return PINS[row](slot) if value is None else value

    def settled(self, row: Command[Q, None], slot: int = 0) -> Q:
        """Returns what the hardware behind a register does by now, for it takes its time to follow."""
        follows, before = self._changes.get((row.id, slot), (-math.inf, None))
        if before is not None and self._now() < follows:
            former: Q = before
            return former

        return self.get(row, slot)

    @property
    def due(self) -> float:
        """When the next hardware follows what was switched; infinity if none has to."""
        now = self._now()
        return min((follows for follows, _ in self._changes.values() if follows > now), default=math.inf)

    def set(self, row: Command[Q, None], value: Q) -> None:
        """Does what a Set row does that takes no time."""
        slot = getattr(value, SLOTS[row]) if row in SLOTS else 0
        if row in LATENCIES and value != self.get(row, slot):
            self._changes[row.id, slot] = self._now() + LATENCIES[row], self.settled(row, slot)

        self._registers[row.id, slot] = value
        if row in WIFI:
            self._wifi_since = self._now()

        if isinstance(value, (c.PTPJumpParams, c.PTPJump2Params)):
            self._lift = value

    def function(self, address: int) -> c.IOFunction:
        """Returns what a pin is configured for."""
        return self.get(c.SET_IO_MULTIPLEXING, address).multiplex

    @property
    def kinematics(self) -> Kinematics:
        """The geometry with the end effector that is set."""
        bias = self.get(c.SET_END_EFFECTOR_PARAMS)
        return Kinematics(bias.x_bias, bias.y_bias, bias.z_bias, self.limits)

    @property
    def in_wifi(self) -> bool:
        """Whether it has joined its network: some time has passed, the network is there, and the password right."""
        ssid = self.get(c.SET_WIFI_SSID)
        if not ssid or self.get(c.SET_WIFI_CONFIG_MODE) or self._now() < self._wifi_since + JOINING:
            return False

        return self.networks is None or self.networks.get(ssid) == self.get(c.SET_WIFI_PASSWORD)

    @property
    def has_rail(self) -> bool:
        """Whether the arm was told that it stands on a rail."""
        return self.get(c.SET_DEVICE_WITH_L).is_with_l

    @property
    def lift(self) -> tuple[float, float, float]:
        """How far a jump lifts at its start and at its end, and its zLimit: of the parameters that were set last."""
        match self._lift:
            case c.PTPJumpParams(height, limit):
                return height, height, limit
            case c.PTPJump2Params(start, end, limit):
                return start, end, limit
