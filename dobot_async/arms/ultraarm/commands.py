"""Every command of an ultraArm P340, one row each: those of the manual, and those of later firmware that are of use.

    from dobot_async.arms.ultraarm import commands as c

    await arm.request(c.GET_ENDSTOPS, None)
    await arm.queue.put(c.MOVE_COORDS, c.CoordsMove(x=200, y=0, z=40, f=100))

A row's name is the word that goes over the wire. `section` is the manual's heading, or "pymycobot" for what only the
vendor's library knows, "G-code programs" for what only programs for this arm have. docs/ultraarm.md lists where they
disagree.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, TypeVar

from dobot_async._core.protocol.layouts import NOTHING
from dobot_async._core.protocol.rows import Rows
from dobot_async._core.protocol.wire import Command, Layout, Queueing, commands_in
from dobot_async.arms.ultraarm.answers import RECEIPT, STATUS, Bracket, Numbers, Receipt
from dobot_async.arms.ultraarm.layouts import Relative, Whole, Words
from dobot_async.arms.ultraarm.limits import *
from dobot_async.arms.ultraarm.params import *

Q = TypeVar("Q")
R = TypeVar("R")
SLOW = 60.0  # seconds that the calibration of a joint may take
ROWS = Rows(Words, RECEIPT)


def code(word: str) -> int:
    """The number of a row: its letter and its number in one."""
    return ord(word[0]) << 8 | int(word[1:])


def read(word: str, reply: Layout[R], section: str) -> Command[None, R]:
    """A row that asks for something, with no parameters."""
    return ROWS.read(word, code(word), reply, section)


def ask(word: str, request: type[Q], reply: Layout[R], section: str) -> Command[Q, R]:
    """A row that asks for something that the request names."""
    return ROWS.ask(word, code(word), request, reply, section)


def write(
    word: str, request: type[Q] | Layout[Q], section: str, queueing: Queueing = Queueing.ALLOWED
) -> Command[Q, Receipt]:
    """A row that sets something."""
    return ROWS.write(word, code(word), request, section, queueing)


def motion(word: str, request: type[Q] | Layout[Q], section: str) -> Command[Q, Receipt]:
    """A row that moves the arm, in the queue; to send it twice is to do it twice."""
    return ROWS.motion(word, code(word), request, section)


def plain(convert: type[R]) -> tuple[Any, Any]:
    """How one number in brackets is read and written."""

    def read(texts: Sequence[str]) -> R:
        return convert(*texts)

    return read, str


NEVER = Queueing.NEVER
COORDS_MOVE = Words(CoordsMove)

MOVE_COORDS = motion("G0", COORDS_MOVE, "coordinate control")
MOVE_LINE = motion("G1", COORDS_MOVE, "G-code programs")  # in no manual, and in every program that is published
WAIT = write("G4", Whole(Dwell), "wait (seconds)", Queueing.ALWAYS)
GET_SYSTEM_VERSION = read("G6", Bracket[float]("GetSystemVersion", *plain(float)), "pymycobot")  # of the firmware
GET_MODIFY_VERSION = read("G7", Bracket[int]("GetModifyVersion", *plain(int)), "pymycobot")  # of the firmware
HOME = motion("G28", NOTHING, "back to zero point")
ABSOLUTE = write("G90", NOTHING, "set absolute cartesian mode")
RELATIVE = write("G91", NOTHING, "set relative cartesian mode")
MOVE_BY = motion("G91", Relative(COORDS_MOVE), "set relative cartesian mode")  # and back: G91, G0, G90 in one write
SET_POSITION = write("G92", Position, "set point (current position)")

LASER_ON = write("M3", NOTHING, "turn on the laser")
LASER_OFF = write("M5", NOTHING, "turn off the laser")
GET_STATUS = read("M9", STATUS, "pymycobot")
MOVE_JOINT = motion("M10", JointMove, "single joint angle control")
MOVE_JOINTS = motion("M11", JointsMove, "all angle control")
GET_ANGLES = read("M12", Numbers("ANGLES", UltraArmAngles), "get current joint angle information")
JOG_JOINT = write("M13", JogMove, "jog angle move", NEVER)
JOG_COORD = write("M14", JogMove, "jog coord move", NEVER)
JOG_STOP = write("M15", NOTHING, "jog stop", NEVER)
SET_SPEED_MODE = write("M16", ModeOfSpeed, "pymycobot")
RELEASE = write("M17", NOTHING, "release all motors")
POWER_ON = write("M18", NOTHING, "power on all motors")
SET_PWM = write("M21", PWM, "set PWM duty cycle")
PUMP_OFF = write("M22", NOTHING, "set suction pump off")  # the vendor's library starts the pump with this one
PUMP_ON = write("M23", NOTHING, "set suction pump on")
SET_GRIPPER_ZERO = write("M24", GripperZero, "set gripper calibration")
SET_GRIPPER = write("M25", GripperSet, "set gripper open state")
RELEASE_GRIPPER = write("M26", NOTHING, "release gripper")
FAN_ON = write("M27", NOTHING, "set fan on")
FAN_OFF = write("M28", NOTHING, "set fan off")
SET_GRIPPER_CLOSE_POSITION = write("M29", GripperClosePosition, "pymycobot")
GET_GRIPPER_POSITION = ask("M30", ModeOfGripper, Numbers("GetGripperPosition", GripperPosition, int), "pymycobot")
CALIBRATE_J1 = Command("M31", code("M31"), NOTHING, RECEIPT, "pymycobot", write=True, repeatable=False, timeout=SLOW)
GET_CALIBRATION_STEP = read("M32", Bracket[int]("J1CAL", *plain(int)), "pymycobot")  # which of them
GET_GRIPPER_ANGLE = ask("M50", ModeOfGripper, Bracket[int]("GRIPPERANGLE", *plain(int)), "pymycobot")
SET_SERVO_REGISTER = write("M51", ServoValue, "pymycobot", NEVER)
GET_SERVO_REGISTER = ask("M52", ServoRegister, Bracket[int]("ReadSYS", *plain(int)), "pymycobot")
GET_COORDS = read("M114", Numbers("COORDS", UltraArmCoords), "get current cartesian coordinate information")
GET_ENDSTOPS = read("M119", Numbers("ENDSTOP", Endstops, int), "get the status of all current homing switches")
GET_QUEUE_SIZE = read("M120", RECEIPT, "pymycobot")

# The order of the module is the order of the table.
ALL = commands_in(globals())
BY_WORD: Mapping[str, Command[Any, Any]] = MappingProxyType({row.name: row for row in ALL if row is not MOVE_BY})
