"""A simulated Dobot Magician: bytes of requests in, bytes of replies out. No I/O, no tasks; time is a parameter.

    client's bytes --> Session --Frame--> SimulatedMagician --Work--> Device
                       parser             table of rows               queue, time, joints
    client's bytes <-- Session <--Frame---------'

Requests are read with the rows that the driver writes them with. A frame with a wrong checksum and parameters that do
not fit are left unanswered; so is an unknown command, which also sets alarm 0x01. Bits 2 to 7 of Ctrl say nothing.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from dobot_async._core.protocol.wire import Command, Number, u64
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import encode as encode_alarms
from dobot_async.arms.magician.frame import WRITE, Frame, Parser, encode
from dobot_async.arms.magician.kinematics import JointLimits
from dobot_async.errors import ProtocolError
from dobot_async.simulator.device.work import DeviceOptions, Work
from dobot_async.simulator.magician.body import MAGICIAN, MagicianBody, StoredProgram
from dobot_async.simulator.magician.state import REACH

__all__ = ["MAGICIAN", "Counters", "MagicianSession", "Quirks", "SimulatedMagician", "StoredProgram"]

UNKNOWN_COMMAND = 0x01
NO_NUMBER = struct.pack("<f", math.nan)
"""What an arm without a rail tells of its place there."""

INDEX: Number[int] = Number(u64)


@dataclass(frozen=True, slots=True)
class Quirks:
    """In what Magicians answer differently.

    Attributes:
        overflow: What a full queue does to a queued command: "silent" drops it without a reply, "index" drops it
            although it answers with an index.
        left_space_64: The left space has eight bytes, as the Magician Lite's.
        long_version: The firmware version has 14 bytes, as newer firmware's.
        hht_reply_as_write: The reply of GetHHTTrigMode has rw set, as in the manual's Figure 29.
        clear_alarms_with_21: ID 21 clears the alarms, as the manual says; without it, it is an unknown command.
    """

    overflow: Literal["silent", "index"] = "silent"
    left_space_64: bool = False
    long_version: bool = False
    hht_reply_as_write: bool = False
    clear_alarms_with_21: bool = False


@dataclass(slots=True)
class Counters:
    """What has happened on all sessions so far.

    Attributes:
        requests: Whole frames that came in.
        replies: Frames that went out.
        bad_frames: Candidates for a frame whose checksum was wrong.
        junk_bytes: Bytes that belonged to no frame.
        unknown: Requests that no row of the table describes.
        unfit: Requests whose parameters did not fit their row.
        overflowed: Queued commands that a full queue dropped.
    """

    requests: int = 0
    replies: int = 0
    bad_frames: int = 0
    junk_bytes: int = 0
    unknown: int = 0
    unfit: int = 0
    overflowed: int = 0


class SimulatedMagician(MagicianBody):
    """One arm, switched on where it believes to stand in the home pose, and its protocol.

    Attributes:
        quirks: What is known to differ between firmwares.
        counters: Figures of the protocol.
    """

    def __init__(
        self,
        clock: Callable[[], float],
        options: DeviceOptions | None = None,
        quirks: Quirks = Quirks(),
        *,
        limits: JointLimits | None = None,
        homed: bool = False,
    ) -> None:
        """Switches an arm on.

        Args:
            clock: Returns simulated seconds.
            options: The capacity of the queue, its first index, what an alarm does, ...
            quirks: What this arm's firmware does differently.
            limits: How far the joints go.
            homed: Whether it knows where it is, as after `home()`. A real arm does not know after power-up.
        """
        super().__init__(clock, options, limits or REACH, homed=homed)
        self.quirks = quirks
        self.counters: Counters = Counters()
        self._clock_speed: float = getattr(clock, "speed", 1.0)

    @property
    def time_on(self) -> float:
        """Seconds since power-up by the arm's own clock, which goes right in an arm that is simulated faster too."""
        return self.device.uptime / self._clock_speed

    def session(self) -> MagicianSession:
        """Returns the arm's side of a connection to a new client."""
        return MagicianSession(self)

    def answer(self, frame: Frame) -> bytes:
        """Does what a request says; returns the bytes of the reply, or none."""
        self.device.advance()
        self.counters.requests += 1
        reply = self._reply(frame)
        if reply is None:
            return b""

        self.counters.replies += 1
        as_write = frame.id == c.GET_HHT_TRIG_MODE.id and self.quirks.hht_reply_as_write
        return encode(Frame(frame.id, frame.ctrl | as_write * WRITE, reply))

    def _reply(self, frame: Frame) -> bytes | None:
        """The parameters of the reply, if there is one."""
        row = c.BY_KEY.get((frame.id, frame.write))
        if frame.queued and not frame.write and (row or (frame.id, True) in c.BY_KEY):
            return self._acknowledge(self.device.put(Work("queued read", lambda _: None, command=row)))

        if row is None or (row is c.CLEAR_ALL_ALARMS_STATE_21 and not self.quirks.clear_alarms_with_21):
            self.counters.unknown += 1
            self.device.raise_alarm(UNKNOWN_COMMAND)
            return None

        try:
            value = row.request.decode(frame.params)
            row.request.encode(value)  # refuses what no peer may send, such as pin 21 or a NaN
        except (ProtocolError, ValueError):
            self.counters.unfit += 1
            return None

        if not frame.write:
            return self._read(row, value)

        if row in VERBS:
            VERBS[row](self, value)
        elif frame.queued:
            return self._acknowledge(self.put(row, value))
        else:
            self.perform(row, value)

        return b""

    def _acknowledge(self, index: int | None) -> bytes | None:
        """The reply to a queued command."""
        if index is None:
            self.counters.overflowed += 1
            if self.quirks.overflow == "silent":
                return None

            index = self.device.skip()

        return INDEX.encode(index)

    def _read(self, row: Command[Any, Any], value: Any) -> bytes:
        """What a register, or the arm itself, tells."""
        if row is c.GET_QUEUED_CMD_LEFT_SPACE and self.quirks.left_space_64:
            return INDEX.encode(self.device.left_space)

        if row is c.GET_POSE_L and not self.state.has_rail:
            return NO_NUMBER

        read = READS.get(row)
        return row.reply.encode(read(self, value) if read else self.state.get(c.BY_KEY[row.id, True]))


class MagicianSession:
    """One client's connection: its half frames are its own."""

    def __init__(self, arm: SimulatedMagician) -> None:
        self._arm = arm
        self._parser = Parser()

    def receive(self, data: bytes) -> bytes:
        """Takes any bytes of requests, returns the bytes of all replies to those that are whole now, in their order."""
        parser, counters = self._parser, self._arm.counters
        bad, junk = parser.bad_frames, parser.junk_bytes
        frames = parser.feed(data)
        counters.bad_frames += parser.bad_frames - bad
        counters.junk_bytes += parser.junk_bytes - junk
        return b"".join(map(self._arm.answer, frames))


def version(arm: SimulatedMagician, _: None) -> c.DeviceVersion:
    """The firmware's version, 3.7.0, with hardware version 1 where it is told."""
    return c.DeviceVersion(3, 7, 0, bytes((0,) * 10 + (1,)) if arm.quirks.long_version else b"")


def color(arm: SimulatedMagician, _: None) -> c.Color:
    """What the colour sensor sees; nothing while it is off, settles, or is taken for another version."""
    sensor = arm.state.settled(c.SET_COLOR_SENSOR)
    return arm.color if sensor.enable and sensor.version == arm.color_version else c.Color(0, 0, 0)


def infrared(arm: SimulatedMagician, port: c.InfraredPort) -> int:
    """What an infrared sensor sees; nothing while it is off, settles, or is taken for another version."""
    sensor = arm.state.settled(c.SET_INFRARED_SENSOR, port)
    return int(arm.infrared[port] and sensor.enable and sensor.version == arm.infrared_version)


def level(arm: SimulatedMagician, address: int) -> c.IODI:
    """The level at a pin."""
    return c.IODI(address, arm.read_pin(c.TriggerMode.IO, address))


def analog(arm: SimulatedMagician, address: int) -> c.IOADC:
    """The analog value at a pin."""
    return c.IOADC(address, arm.read_pin(c.TriggerMode.ADC, address))


READS: Mapping[Command[Any, Any], Callable[[SimulatedMagician, Any], Any]] = {
    c.GET_DEVICE_VERSION: version,
    c.GET_DEVICE_WITH_L: lambda arm, _: arm.state.has_rail,
    c.GET_DEVICE_TIME: lambda arm, _: int(arm.time_on * 1000) % 2**32,
    c.GET_DEVICE_ID: lambda _arm, _: (1, 2, 3),
    c.GET_DEVICE_INFO: lambda arm, _: c.DeviceInfo(int(arm.time_on), 1, 0),
    c.GET_POSE: lambda arm, _: arm.pose,
    c.GET_KINEMATICS: lambda arm, _: arm.speed(),
    c.GET_POSE_L: lambda arm, _: arm.rail,
    c.GET_ALARMS_STATE: lambda arm, _: encode_alarms(arm.device.alarms),
    c.GET_AUTO_LEVELING_RESULT: lambda arm, _: arm.state.levelled,
    c.GET_HHT_TRIG_OUTPUT: lambda arm, _: arm.fetch_taught_point(),
    c.GET_IO_MULTIPLEXING: lambda arm, address: arm.state.get(c.SET_IO_MULTIPLEXING, address),
    c.GET_IODO: lambda arm, address: arm.state.get(c.SET_IODO, address),
    c.GET_IOPWM: lambda arm, address: arm.state.get(c.SET_IOPWM, address),
    c.GET_IODI: level,
    c.GET_IOADC: analog,
    c.GET_COLOR_SENSOR: color,
    c.GET_INFRARED_SENSOR: infrared,
    c.GET_WIFI_CONNECT_STATUS: lambda arm, _: arm.state.in_wifi,
    c.GET_UART4_PERIPHERALS_TYPE: lambda _arm, _: c.UART4PeripheralsType.UART,
    c.GET_USER_PARAMS: lambda _arm, _: c.UserParams((0.0,) * 8),
    c.GET_PTP_TIME: lambda arm, value: arm.ptp_time(value),
    c.GET_QUEUED_CMD_CURRENT_INDEX: lambda arm, _: arm.device.current_index,
    c.GET_QUEUED_CMD_LEFT_SPACE: lambda arm, _: arm.device.left_space,
    c.GET_QUEUED_CMD_MOTION_FINISH: lambda arm, _: arm.device.idle,
}
"""What is read from elsewhere than the register of the Set row with the same ID."""

VERBS: Mapping[Command[Any, Any], Callable[[SimulatedMagician, Any], None]] = {
    c.RESET_POSE: lambda arm, value: arm.reset_pose(value),
    c.CLEAR_ALL_ALARMS_STATE: lambda arm, _: arm.device.clear_alarms(),
    c.CLEAR_ALL_ALARMS_STATE_21: lambda arm, _: arm.device.clear_alarms(),
    c.SET_QUEUED_CMD_START_EXEC: lambda arm, _: arm.device.start(),
    c.SET_QUEUED_CMD_STOP_EXEC: lambda arm, _: arm.device.stop(),
    c.SET_QUEUED_CMD_FORCE_STOP_EXEC: lambda arm, _: arm.device.force_stop(),
    c.SET_QUEUED_CMD_START_DOWNLOAD: lambda arm, value: arm.start_download(value),
    c.SET_QUEUED_CMD_STOP_DOWNLOAD: lambda arm, _: arm.stop_download(),
    c.SET_QUEUED_CMD_CLEAR: lambda arm, _: arm.clear(),
}
"""What is done at once, whatever its Ctrl says of the queue."""
