"""The methods of pydobot with an underscore before their names: many programs call these.

What pydobot answers here with a raw message is the command's index instead, or nothing.
"""

from __future__ import annotations

from dobot_async.arms.magician import commands as c
from dobot_async.compat._dobot_types import ptp_mode
from dobot_async.compat._session import CompatSession

__all__ = ["RawDobot"]


class RawDobot:
    """A connection, and commands by their names in the manual.

    Attributes:
        session: The connection; `session.arm` is that of `dobot_async.sync`, for what is not here.
    """

    session: CompatSession

    def _set_ptp_cmd(
        self, x: float, y: float, z: float, r: float = 0.0, mode: int = c.PTPMode.MOVJ_XYZ, wait: bool = False
    ) -> int:
        command = c.PTPCmd(ptp_mode(mode), x, y, z, r)
        return self.session.run(c.SET_PTP_CMD, command) if wait else self.session.put(c.SET_PTP_CMD, command)

    def _set_cp_cmd(self, x: float, y: float, z: float) -> int:
        return self.session.put(c.SET_CP_CMD, c.CPCmd(c.CPMode.ABSOLUTE, x, y, z))

    def _set_arc_cmd(
        self, x: float, y: float, z: float, r: float, cir_x: float, cir_y: float, cir_z: float, cir_r: float
    ) -> int:
        command = c.ARCCmd(c.ARCPoint(cir_x, cir_y, cir_z, cir_r), c.ARCPoint(x, y, z, r))
        return self.session.put(c.SET_ARC_CMD, command)

    def _set_home_cmd(self) -> int:
        return self.session.put(c.SET_HOME_CMD, c.HOMECmd())

    def _set_home_coordinate(self, x: float, y: float, z: float, r: float) -> int:
        return self.session.put(c.SET_HOME_PARAMS, c.HOMEParams(x, y, z, r))

    def _set_wait_cmd(self, ms: float) -> int:
        return self.session.put(c.SET_WAIT_CMD, c.WAITCmd(round(ms)))

    def _set_ptp_joint_params(
        self, v_x: float, v_y: float, v_z: float, v_r: float, a_x: float, a_y: float, a_z: float, a_r: float
    ) -> int:
        value = c.PTPJointParams((v_x, v_y, v_z, v_r), (a_x, a_y, a_z, a_r))
        return self.session.put(c.SET_PTP_JOINT_PARAMS, value)

    def _set_ptp_coordinate_params(self, velocity: float, acceleration: float) -> int:
        value = c.PTPCoordinateParams(velocity, velocity, acceleration, acceleration)
        return self.session.put(c.SET_PTP_COORDINATE_PARAMS, value)

    def _set_ptp_jump_params(self, jump: float, limit: float) -> int:
        return self.session.put(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(jump, limit))

    def _set_ptp_common_params(self, velocity: float, acceleration: float) -> int:
        return self.session.put(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(velocity, acceleration))

    def _set_cp_params(self, velocity: float, acceleration: float, period: float) -> int:
        return self.session.put(c.SET_CP_PARAMS, c.CPParams(acceleration, velocity, period))

    def _set_cple_cmd(self, x: float, y: float, z: float, power: float, absolute: bool = False) -> int:
        return self.session.put(c.SET_CPLE_CMD, c.CPLECmd(c.CPMode(int(absolute)), x, y, z, power))

    def _set_end_effector_suction_cup(self, enable: bool = False) -> int:
        value = c.EndEffectorSuctionCup(is_ctrl_enabled=True, is_sucked=bool(enable))
        return self.session.put(c.SET_END_EFFECTOR_SUCTION_CUP, value)

    def _set_end_effector_gripper(self, enable: bool = False) -> int:
        value = c.EndEffectorGripper(is_ctrl_enabled=True, is_gripped=bool(enable))
        return self.session.put(c.SET_END_EFFECTOR_GRIPPER, value)

    def _set_end_effector_laser(self, power: float = 255, enable: bool = False) -> int:
        value = c.EndEffectorLaser(is_ctrl_enabled=bool(enable), is_on=bool(enable) and power > 0)
        return self.session.put(c.SET_END_EFFECTOR_LASER, value)

    def _set_stepper_motor(self, speed: int, interface: int = 0, motor_control: bool = True) -> int:
        return self.session.put(c.SET_E_MOTOR, c.EMotor(interface, bool(motor_control), int(speed)))

    def _set_stepper_motor_distance(
        self, speed: int, distance: int, interface: int = 0, motor_control: bool = True
    ) -> int:
        value = c.EMotorS(interface, bool(motor_control), int(speed), int(distance))
        return self.session.put(c.SET_E_MOTOR_S, value)

    def _set_queued_cmd_start_exec(self) -> None:
        self.session.start()

    def _set_queued_cmd_stop_exec(self) -> None:
        self.session.halt()

    def _set_queued_cmd_clear(self) -> None:
        self.session.clear()

    def _get_queued_cmd_current_index(self) -> int:
        return self.session.current_index()
