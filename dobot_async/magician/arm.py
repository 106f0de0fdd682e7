"""A Dobot Magician: connect, ask, move, stop."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from typing import Any, Literal, Self, TypeVar

import anyio

from dobot_async.errors import ConnectFailed, DobotError
from dobot_async.family import open_in_time, owned
from dobot_async.link import Link
from dobot_async.magician import commands as c
from dobot_async.magician import frame
from dobot_async.magician.alarms import Alarm, decode
from dobot_async.magician.executor import MagicianExecutor
from dobot_async.magician.kinematics import Kinematics
from dobot_async.magician.queue import MagicianQueue
from dobot_async.magician.reach import check_reach as check_target
from dobot_async.magician.verbs import Verbs
from dobot_async.magician.wifi import WiFi
from dobot_async.motion import undisturbed
from dobot_async.roundtrip import RoundTrip
from dobot_async.wire import Command, Queueing

__all__ = ["DeviceInfo", "Jog", "Magician"]

Q = TypeVar("Q")
R = TypeVar("R")
LEAVE_TIMEOUT = 2.0
TEACH_INTERVAL = 0.05


class Jog(Enum):
    """A direction to jog in: of the tool, of a joint, or along the rail. Manual 2.10.4."""

    X_PLUS = (False, c.JOGKey.AP_DOWN)
    X_MINUS = (False, c.JOGKey.AN_DOWN)
    Y_PLUS = (False, c.JOGKey.BP_DOWN)
    Y_MINUS = (False, c.JOGKey.BN_DOWN)
    Z_PLUS = (False, c.JOGKey.CP_DOWN)
    Z_MINUS = (False, c.JOGKey.CN_DOWN)
    R_PLUS = (False, c.JOGKey.DP_DOWN)
    R_MINUS = (False, c.JOGKey.DN_DOWN)
    J1_PLUS = (True, c.JOGKey.AP_DOWN)
    J1_MINUS = (True, c.JOGKey.AN_DOWN)
    J2_PLUS = (True, c.JOGKey.BP_DOWN)
    J2_MINUS = (True, c.JOGKey.BN_DOWN)
    J3_PLUS = (True, c.JOGKey.CP_DOWN)
    J3_MINUS = (True, c.JOGKey.CN_DOWN)
    J4_PLUS = (True, c.JOGKey.DP_DOWN)
    J4_MINUS = (True, c.JOGKey.DN_DOWN)
    RAIL_PLUS = (False, c.JOGKey.EP_DOWN)
    RAIL_MINUS = (False, c.JOGKey.EN_DOWN)


STILL = c.JOGCmd(is_joint=False, cmd=c.JOGKey.IDLE)

LEAVING: tuple[tuple[Command[Any, None], Any], ...] = (
    (c.SET_QUEUED_CMD_FORCE_STOP_EXEC, None),
    (c.SET_QUEUED_CMD_CLEAR, None),
    (c.SET_JOG_CMD, STILL),
    (c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(is_ctrl_enabled=False, is_on=False)),
    (c.SET_E_MOTOR, c.EMotor(0, is_enabled=False, speed=0)),
    (c.SET_E_MOTOR, c.EMotor(1, is_enabled=False, speed=0)),
)
"""What is said to the arm at once when its block is left by an error: nothing moves or burns after it."""


FENCES = (
    c.GET_END_EFFECTOR_PARAMS,
    c.GET_PTP_COMMON_PARAMS,
    c.GET_JOG_COMMON_PARAMS,
    c.GET_CP_PARAMS,
    c.GET_PTP_JUMP_PARAMS,
    c.GET_ARC_PARAMS,
    c.GET_HHT_TRIG_MODE,
    c.GET_END_EFFECTOR_LASER,
    c.GET_END_EFFECTOR_SUCTION_CUP,
    c.GET_END_EFFECTOR_GRIPPER,
    c.GET_HOME_PARAMS,
    c.GET_PTP_COORDINATE_PARAMS,
)
"""Cheap to answer, and seldom asked: which answers are still to come shows by whether these have come.

So many, because one that is lost itself is of no use until its answer cannot come any more."""


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Who an arm is.

    Attributes:
        serial_number: The vendor's.
        name: The user's.
        version: Of the firmware, "3.2.1".
    """

    serial_number: str
    name: str
    version: str


class Magician(Verbs[Awaitable[None]]):
    """A Dobot Magician; made by `connect`. Each verb returns when the arm has done it.

    A motion belongs to the call that awaits it: if that is cancelled, or its timeout passes, the arm stops.

    Attributes:
        link: The connection, with its state, events and figures.
        queue: The arm's queue, with the same verbs.
        kinematics: The arm's geometry with the end effector that it had when it was connected.
        wifi: Which network the arm joins, and whether it is in it.
    """

    def __init__(self, link: Link[frame.Frame], *, window: int, check_reach: bool) -> None:
        self.link = link
        self.wifi = WiFi(link)
        self.kinematics = Kinematics()
        self._check_reach = check_reach
        self._executor = MagicianExecutor(link, window, self._check)
        self.queue = MagicianQueue(self._executor)
        link.lost = lambda error: self.queue.fail(error)  # noqa: PLW0108 - a fleet gives the arm another queue

    @classmethod
    @asynccontextmanager
    async def connect(
        cls,
        url: str,
        *,
        control: bool = True,
        queue: Literal["fresh", "keep"] = "fresh",
        timeout: float = 5.0,
        on_error: Literal["stop", "leave"] = "stop",
        window: int = 1,
        check_reach: bool = False,
        reconnect: bool = False,
        reply_timeout: float | tuple[float, float] = (0.02, 0.5),
    ) -> AsyncIterator[Self]:
        """Connects to an arm for the length of a block.

        It never clears alarms, sets parameters or moves on its own.

        Args:
            url: `serial:///dev/ttyUSB0`, `udp://192.168.1.20`, `tcp://host:port`, `ble://NAME`, `sim:`.
            control: False for observers: only reads are sent, everything else raises ValueError.
            queue: "fresh" empties the arm's queue and starts it, so that nothing that an earlier program left behind
                begins to move; "keep" leaves it as found.
            timeout: Seconds until an arm must have answered.
            on_error: "stop" stops the arm and empties its queue when the block is left by an exception or a
                cancellation; "leave" lets it finish.
            window: How many queued commands may be unacknowledged at a time, on links that allow more than one.
            check_reach: Refuse targets that the arm cannot reach before they are sent, with the reason.
            reconnect: Reopen a link that breaks. The arm goes on with its queue meanwhile; reads wait within their
                timeout; Motions resolve if it is still the same run of the arm, else they raise MotionUnknown.
            reply_timeout: Seconds without an answer after which a request is sent again: the least and the most that it
                may adapt itself to, or one fixed value.

        Raises:
            ValueError: The URL or an argument is wrong.
            ConnectFailed: No arm answered; the message says what to check.
        """
        if window < 1 or queue not in {"fresh", "keep"} or on_error not in {"stop", "leave"}:
            raise ValueError('expected window >= 1, queue "fresh" or "keep", on_error "stop" or "leave"')

        floor, ceiling = reply_timeout if isinstance(reply_timeout, tuple) else (reply_timeout, reply_timeout)
        round_trip = RoundTrip(floor, ceiling)
        loop = asyncio.get_running_loop()
        deadline = loop.time() + timeout
        transport = await open_in_time(url, "magician", timeout)
        link = Link(
            transport,
            frame.Parser(),
            frame.request,
            url=url,
            filler=frame.FILLER,
            fences=FENCES,
            read_only=not control,
            round_trip=round_trip,
            reopen=partial(open_in_time, getattr(transport, "url", url), "magician", timeout) if reconnect else None,
        )
        arm = cls(link, window=min(window, transport.window), check_reach=check_reach)
        try:
            await arm._greet(deadline - loop.time(), fresh=control and queue == "fresh", remember=control and reconnect)
        except BaseException:
            await undisturbed(arm._close())
            raise

        try:
            yield arm
        except BaseException:
            if control and on_error == "stop":
                await undisturbed(arm._leave())

            raise
        finally:
            await undisturbed(arm._close())

    async def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Sends any row of the command table immediately, and returns the arm's answer.

        Args:
            command: A row of `dobot_async.magician.commands`.
            value: Its parameters; None where it has none.
            timeout: Seconds, repetitions included; the row's own by default.

        Raises:
            ValueError: The parameters do not fit, the command must be queued, or the connection only reads.
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        if command.queueing is Queueing.ALWAYS:
            raise ValueError(f"{command.name} goes through the queue: await arm.queue.put(...)")

        return await self.link.request(command, value, timeout=timeout)

    async def get_pose(self, *, timeout: float | None = None) -> c.Pose:
        """Returns where the tool is (mm, degrees) and the joints (degrees). Manual 2.4.1."""
        return await self.link.request(c.GET_POSE, None, timeout=timeout)

    async def get_rail(self, *, timeout: float | None = None) -> float:
        """Returns where the arm stands on its rail, in mm."""
        return await self.link.request(c.GET_POSE_L, None, timeout=timeout)

    async def get_info(self, *, timeout: float | None = None) -> DeviceInfo:
        """Returns serial number, name and firmware version. Manual 2.3."""
        version = await self.link.request(c.GET_DEVICE_VERSION, None, timeout=timeout)
        return DeviceInfo(
            serial_number=await self.link.request(c.GET_DEVICE_SN, None, timeout=timeout),
            name=await self.link.request(c.GET_DEVICE_NAME, None, timeout=timeout),
            version=f"{version.major_version}.{version.minor_version}.{version.revision}",
        )

    async def get_alarms(self, *, timeout: float | None = None) -> tuple[Alarm, ...]:
        """Returns all alarms that are set, with cause and remedy. Manual 2.5.1."""
        return decode(await self.link.request(c.GET_ALARMS_STATE, None, timeout=timeout))

    async def clear_alarms(self, *, timeout: float | None = None) -> None:
        """Clears the alarms; what the arm was doing when they came up does not go on. Manual 2.5.2."""
        await self.queue.update()  # without its alarm a motion that failed looks like one that is done
        await self.link.request(c.CLEAR_ALL_ALARMS_STATE, None, timeout=timeout)
        self._executor.readings.alarms_cleared()

    async def recover(self) -> None:
        """Clears the alarms, empties the queue and starts it: the arm is ready for new commands."""
        await self.clear_alarms()
        await self.queue.clear()

    async def get_input(self, address: int, *, timeout: float | None = None) -> bool:
        """Returns the level of a digital input (1 to 20). Manual 2.16.4."""
        return bool((await self.link.request(c.GET_IODI, address, timeout=timeout)).level)

    async def get_output(self, address: int, *, timeout: float | None = None) -> bool:
        """Returns the level that a digital output (1 to 20) was set to. Manual 2.16.2."""
        return bool((await self.link.request(c.GET_IODO, address, timeout=timeout)).level)

    async def get_adc(self, address: int, *, timeout: float | None = None) -> int:
        """Returns an analog input (1 to 20), 0 to 4095. Manual 2.16.5."""
        return (await self.link.request(c.GET_IOADC, address, timeout=timeout)).value

    async def set_color_sensor(self, port: c.ColorPort, *, on: bool = True, timeout: float | None = None) -> None:
        """Switches the colour sensor at a port."""
        await self.link.request(c.SET_COLOR_SENSOR, c.ColorSensor(on, port), timeout=timeout)

    async def get_color(self, *, timeout: float | None = None) -> c.Color:
        """Returns the colour that the sensor sees."""
        return await self.link.request(c.GET_COLOR_SENSOR, None, timeout=timeout)

    async def set_infrared_sensor(self, port: c.InfraredPort, *, on: bool = True, timeout: float | None = None) -> None:
        """Switches the infrared sensor at a port."""
        await self.link.request(c.SET_INFRARED_SENSOR, c.InfraredSensor(on, port), timeout=timeout)

    async def get_infrared(self, port: c.InfraredPort, *, timeout: float | None = None) -> bool:
        """Returns whether the infrared sensor at a port sees something."""
        state = await self.link.request(c.GET_INFRARED_SENSOR, port, timeout=timeout)
        return state != 0

    async def set_rail(
        self, *, on: bool = True, version: c.AccessoryVersion = c.AccessoryVersion.V1, timeout: float | None = None
    ) -> None:
        """Says whether the arm stands on a rail; needed before `move_to(l=...)`."""
        await self.link.request(c.SET_DEVICE_WITH_L, c.DeviceWithL(on, version), timeout=timeout)

    async def set_end_effector(self, tool: c.EndEffectorParams, *, timeout: float | None = None) -> None:
        """Says which tool is on the arm: SuctionCup(), Gripper(), Pen(), Laser() or its own mm. Manual 2.9.1."""
        await self.link.request(c.SET_END_EFFECTOR_PARAMS, tool, timeout=timeout)
        self.kinematics = replace(self.kinematics, x_bias=tool.x_bias, y_bias=tool.y_bias, z_bias=tool.z_bias)

    async def pause(self) -> None:
        """Lets the arm finish the command that it executes, and then wait. Manual 2.19.2."""
        await self.queue.pause()

    async def resume(self) -> None:
        """Lets a paused arm go on. Manual 2.19.1."""
        await self.queue.resume()

    async def stop(self) -> None:
        """Stops the arm now, ahead of everything; pending Motions raise MotionStopped. Manual 2.19.3."""
        await self.queue.stop()

    async def jog(self, direction: Jog, seconds: float) -> None:
        """Jogs for a time, at the speed of the JOG parameters, then stops. Manual 2.10.4."""
        if not (math.isfinite(seconds) and seconds >= 0):
            raise ValueError(f"seconds must be finite and not negative, not {seconds!r}")

        async with self.jogging(direction):
            await anyio.sleep(seconds)

    @asynccontextmanager
    async def jogging(self, direction: Jog) -> AsyncIterator[None]:
        """Jogs until the block ends, however it ends. Manual 2.10.4."""
        is_joint, key = direction.value
        try:
            await self.link.request(c.SET_JOG_CMD, c.JOGCmd(is_joint, key))
            yield
        finally:
            await undisturbed(self.link.request(c.SET_JOG_CMD, STILL, urgent=True))

    async def taught_points(
        self, mode: c.HHTTrigMode = c.HHTTrigMode.TRIGGERED_ON_KEY_RELEASED
    ) -> AsyncIterator[c.Pose]:
        """Yields the poses of hand-guided teaching (HHT): the user presses the key on the forearm, and guides the arm.

        Args:
            mode: A pose when the key is released, or at intervals while it is held. Manual 2.7.
        """
        await self.link.request(c.SET_HHT_TRIG_MODE, mode)
        await self.link.request(c.SET_HHT_TRIG_OUTPUT_ENABLED, value=True)
        try:
            while True:
                if await self.link.request(c.GET_HHT_TRIG_OUTPUT, None):
                    yield await self.get_pose()

                await anyio.sleep(TEACH_INTERVAL)
        finally:
            with suppress(DobotError):
                await undisturbed(self.link.request(c.SET_HHT_TRIG_OUTPUT_ENABLED, value=False))

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Awaitable[None]:
        """Does a command and returns when it is done: a motion through the queue, anything else immediately."""
        if command.queueing is Queueing.ALWAYS:
            return owned(self.queue, command, value, timeout)

        return self.link.request(command, value, timeout=timeout)

    def _check(self, value: Any) -> None:
        """Raises Unreachable for a target that the arm cannot reach, if it was asked to."""
        if self._check_reach:
            check_target(self.kinematics, value)

    async def _greet(self, timeout: float, *, fresh: bool, remember: bool) -> None:
        """Proves that an arm answers, with a read that tells its end effector, and readies its queue."""
        try:
            async with asyncio.timeout(timeout):
                bias = await self.link.request(c.GET_END_EFFECTOR_PARAMS, None, timeout=timeout)
                self.kinematics = Kinematics(bias.x_bias, bias.y_bias, bias.z_bias)
                if remember:
                    await self._executor.readings.remember()

                if fresh:
                    await self._executor.reset()
                    await self._executor.left_space()
        except (DobotError, TimeoutError) as error:
            raise silent(self.link) from error

    async def _leave(self) -> None:
        """Stops the arm and everything on it, as far as the link still allows."""
        with suppress(TimeoutError, DobotError):
            async with asyncio.timeout(LEAVE_TIMEOUT):
                requests = (self.link.request(command, value, urgent=True) for command, value in LEAVING)
                await asyncio.gather(*requests, return_exceptions=True)
                # Who found out meanwhile what had become of a command may have queued a WAIT for its index.
                await self.queue.aclose()
                await self.link.request(c.SET_QUEUED_CMD_CLEAR, None, urgent=True)

    async def _close(self) -> None:
        await self.queue.aclose()
        await self.link.aclose()


def silent(link: Link[frame.Frame]) -> ConnectFailed:
    """Why no arm answered, as far as what came instead tells."""
    if link.stats.junk_bytes:
        return ConnectFailed(
            f"{link.url} sends {link.stats.junk_bytes} bytes that are no answer of a Magician; is the baud rate right, "
            "is it a Magician, and does it run the Dobot firmware (in 3D-printing mode it speaks G-code)?"
        )

    return ConnectFailed(
        f"no Magician answers at {link.url}; is the arm switched on (not only on USB power), is this its port or "
        "address, and does it run the Dobot firmware (in 3D-printing mode it speaks G-code)?"
    )
