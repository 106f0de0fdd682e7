"""A Dobot Magician, for programs without asyncio.

Written by tests/sync/write_sync.py: change what that reads, and run it again.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any, Literal, Self, SupportsFloat, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.bounds import ToolBounds
from dobot_async._core.util.shapes import Box, Cylinder
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.info import DeviceInfo
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import Alarm
from dobot_async.arms.magician.arm import Magician as AsyncMagician
from dobot_async.arms.magician.following import Way
from dobot_async.arms.magician.jogs import Jog
from dobot_async.arms.magician.kinematics import Kinematics
from dobot_async.arms.magician.queue import Batch as AsyncBatch
from dobot_async.arms.magician.queue import Download as AsyncDownload
from dobot_async.arms.magician.queue import MagicianQueue as AsyncMagicianQueue
from dobot_async.arms.magician.verbs import Verbs
from dobot_async.arms.magician.wifi import WiFi as AsyncWiFi
from dobot_async.arms.magician.wifi import WiFiSettings
from dobot_async.sync.bases import ArmTwin, BatchTwin, QueueTwin
from dobot_async.sync.follow import Follow
from dobot_async.sync.link import Link
from dobot_async.sync.motion import Motion
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twin import BlockingContext, Items, Twin, same
from dobot_async.traces.recorder import Record

__all__ = ["Batch", "Download", "Magician", "MagicianQueue", "WiFi"]

Q = TypeVar("Q")
R = TypeVar("R")


class Batch(BatchTwin[AsyncBatch], Verbs[Motion]):
    """Commands that are sent together; each verb returns its Motion, to be waited for after the batch's block."""

    def put(self, command: Command[Q, Any], value: Q) -> Motion:
        """Add any row of the table that may be queued.

        Args:
            command: A row of the table that may be queued.
            value: Its parameters.

        Raises:
            ValueError: The parameters do not fit, or the command cannot be queued.
            TypeError: They are of the wrong type.
        """
        return Motion(PORTAL.look(lambda: self.asynchronous.put(command, value)))


class Download(BatchTwin[AsyncDownload], Verbs[Motion]):
    """Commands to be stored in the arm; nobody waits for their Motions."""

    def put(self, command: Command[Q, Any], value: Q) -> Motion:
        """Add any row of the table that may be queued.

        Args:
            command: A row of the table that may be queued.
            value: Its parameters.

        Raises:
            ValueError: The parameters do not fit, or the command cannot be queued.
            TypeError: They are of the wrong type.
        """
        return Motion(PORTAL.look(lambda: self.asynchronous.put(command, value)))


class MagicianQueue(QueueTwin[AsyncMagicianQueue], Verbs[Motion]):
    """The arm's queue: each verb returns a Motion once the arm has accepted it, and waits while the queue is full."""

    @property
    def kinematics(self) -> Kinematics:
        """The arm's geometry with its end effector."""
        return self.asynchronous.kinematics

    def stop(self, *, timeout: float = 5.0, tools: Literal["off", "leave"] = "off") -> None:
        """Stop the arm now, ahead of everything; all pending Motions raise MotionStopped, and the queue is empty.

        Args:
            timeout: Seconds to wait until the arm has acknowledged it; it is repeated after that, too.
            tools: "off" ends the laser and the stepper motors as well; "leave" leaves them as they are.

        Raises:
            ReplyTimeout: The arm has not acknowledged it yet.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(lambda: self.asynchronous.stop(timeout=timeout, tools=tools))

    def batch(self, *, timeout: float | None = None) -> AbstractContextManager[Batch]:
        """Collect commands, and queue them with nothing between them when the block ends; an error sends none.

        Args:
            timeout: Seconds to wait for room in the arm's queue.

        Raises:
            ValueError: A rail or a pin that a command needs was not declared; none was sent.
            DobotError: As `put`; what was accepted before that is pending.
        """
        return BlockingContext(lambda: self.asynchronous.batch(timeout=timeout), Batch, "batch")

    def download(self, *, loops: int = 1) -> AbstractContextManager[Download]:
        """Store the commands of the block in the arm, which runs them when its key is pressed. Manual 2.19.4.

        A cancellation or a stop ends it, and the arm executes again what it is told. After power-up the arm knows of no
        rail and of no pin: a program that uses them has to declare them itself.

        Args:
            loops: How often the arm is to run them.

        Raises:
            ValueError: A rail or a pin that a command needs was declared neither to the arm nor in the program.
            MotionStopped: The arm was stopped meanwhile; a part of the program may be stored.
        """
        return BlockingContext(lambda: self.asynchronous.download(loops=loops), Download, "download")

    def put(self, command: Command[Q, Any], value: Q, *, timeout: float | None = None) -> Motion:
        """Give one command to the arm's queue and return once the arm has accepted it.

        Args:
            command: A row of the table that may be queued.
            value: Its parameters.
            timeout: Seconds to wait for room in the arm's queue; None waits as long as the arm answers.

        Raises:
            ValueError: The parameters do not fit, or the command cannot be queued.
            CommandRejected: The arm follows a target, and takes no commands meanwhile.
            ReplyTimeout: There was no room in time, or the arm is silent; it was not sent.
            ArmAlarm: The arm has raised alarms and makes no more room.
            MotionStopped: The queue was stopped while this waited.
            MotionUnknown: Nothing can tell whether the arm took it.
            ConnectionLost: The link is gone.
        """
        return Motion(PORTAL.run(lambda: self.asynchronous.put(command, value, timeout=timeout)))

    @property
    def bounds(self) -> ToolBounds | None:
        """Where the tool may be, for who sends the arm about without the queue; None where nothing limits it."""
        return self.asynchronous.bounds

    def join(self, timeout: float | None = None) -> None:
        """Return when all that was put has been executed.

        Args:
            timeout: Seconds for all of it.

        Raises:
            ReplyTimeout: Something is still to be done; it goes on.
            DobotError: The first failure since the last `join`, stops by this program aside.
        """
        PORTAL.run(lambda: self.asynchronous.join(timeout))

    def pause(self) -> None:
        """Let the arm finish the command that it executes, and then wait; Motions stay pending.

        Raises:
            ReplyTimeout: The arm does not acknowledge it.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(self.asynchronous.pause)

    def resume(self) -> None:
        """Let a paused arm go on; a stop ends this call, which raises why: MotionStopped, or the ArmAlarm behind it.

        Raises:
            MotionStopped: A stop ended this call.
            ArmAlarm: An alarm was behind that stop.
            ReplyTimeout: The arm does not acknowledge it.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(self.asynchronous.resume)

    def clear(self, *, timeout: float = 5.0) -> None:
        """Throw away all that is queued, the running command included; its Motions raise MotionStopped. See `stop`.

        Args:
            timeout: Seconds to wait until the arm has acknowledged it.

        Raises:
            ReplyTimeout: The arm has not acknowledged it yet.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(lambda: self.asynchronous.clear(timeout=timeout))

    @property
    def pending(self) -> int:
        """How many accepted commands are not known to have ended."""
        return self.asynchronous.pending


class WiFi(Twin[AsyncWiFi]):
    """An arm's Wi-Fi; `arm.wifi`. It needs the vendor's Wi-Fi module in the arm's serial socket."""

    def get_settings(self, *, timeout: float | None = None) -> WiFiSettings:
        """Returns what it is set to. Manual 2.18.2 to 2.18.7.

        Raises:
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        return PORTAL.run(lambda: self.asynchronous.get_settings(timeout=timeout))

    def configure(
        self,
        ssid: str,
        password: str,
        *,
        address: str | None = None,
        netmask: str = "255.255.255.0",
        gateway: str | None = None,
        dns: str | None = None,
        timeout: float | None = None,
    ) -> None:
        """Lets the arm join a network; `wait_connected` tells when it has. Manual 2.18.1 to 2.18.7.

        If this fails half way the arm stays in its configuration mode, so that it does not act on half of the
        settings: do it again.

        Args:
            ssid: The network's name, 1 to 32 bytes of UTF-8.
            password: Up to 64 bytes; "" for an open network.
            address: The arm's own IPv4 address; None lets the network give it one (DHCP).
            netmask: Of the network; only with an address.
            gateway: The router; only with an address.
            dns: The name server; only with an address.
            timeout: Seconds for each of the commands; the rows' own by default.

        Raises:
            ValueError: An argument is wrong, or the connection only reads; nothing was sent.
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(
            lambda: self.asynchronous.configure(
                ssid, password, address=address, netmask=netmask, gateway=gateway, dns=dns, timeout=timeout
            )
        )

    def connected(self, *, timeout: float | None = None) -> bool:
        """Returns whether the arm is in its network. Manual 2.18.8.

        Raises:
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        return PORTAL.run(lambda: self.asynchronous.connected(timeout=timeout))

    def wait_connected(self, timeout: float = 30.0) -> None:
        """Returns when the arm is in its network.

        Args:
            timeout: Seconds that it may take to join.

        Raises:
            ReplyTimeout: It was not in time; the message says what to check.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(lambda: self.asynchronous.wait_connected(timeout))


class Magician(ArmTwin[AsyncMagician], Verbs[None]):
    """A Dobot Magician; made by `connect`. Each verb returns when the arm has done it, and raises what `Arm` names.

    A motion belongs to the call that waits for it: if that is cancelled, or its timeout passes, the arm stops.
    """

    @property
    def link(self) -> Link:
        """The connection, with its state, events and figures."""
        return Link(self.asynchronous.link)

    @property
    def queue(self) -> MagicianQueue:
        """The arm's queue, with the same verbs."""
        return MagicianQueue(self.asynchronous.queue)

    @property
    def wifi(self) -> WiFi:
        """Which network the arm joins, and whether it is in it."""
        return WiFi(self.asynchronous.wifi)

    @classmethod
    def connect(
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
        max_requests: float | None = None,
        workspace: Workspace | Box | Cylinder | None = None,
        record: Record | None = None,
    ) -> AbstractContextManager[Self]:
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
            max_requests: How many requests per second go to the arm, 5 or more, over a line that others need as well;
                None sends as many as it answers. A call waits for its turn before its timeout begins; what stops the
                arm does not wait. With few of them the end of a motion is noticed later.
            workspace: Where the tool may be, in mm and the arm's own coordinates: a `Workspace`, or a Box or Cylinder
                that is allowed. Targets, and ways as far as they are known, raise OutsideWorkspace, a ValueError,
                before anything is sent; docs/workspace.md says what is looked at.
            record: Where to write down what goes over the connection, for the length of the block: a path, or a
                `dobot_async.traces.TraceFile`. Passwords are left out; see docs/trace.md.

        Raises:
            ValueError: The URL or an argument is wrong.
            ConnectFailed: No arm answered; the message says what to check.
        """
        return BlockingContext(
            lambda: AsyncMagician.connect(
                url,
                control=control,
                queue=queue,
                timeout=timeout,
                on_error=on_error,
                window=window,
                check_reach=check_reach,
                reconnect=reconnect,
                reply_timeout=reply_timeout,
                max_requests=max_requests,
                workspace=workspace,
                record=record,
            ),
            cls,
            str(url),
        )

    @property
    def kinematics(self) -> Kinematics:
        """The arm's geometry with the end effector that it was told, or that it had when it was connected."""
        return self.asynchronous.kinematics

    def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Sends any row of the command table immediately, and returns the arm's answer.

        Args:
            command: A row of `dobot_async.arms.magician.commands`.
            value: Its parameters; None where it has none.
            timeout: Seconds, repetitions included; the row's own by default.

        Raises:
            ValueError: The parameters do not fit, or are such that no motion would end; the command must be queued; or
                the connection only reads.
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        return PORTAL.run(lambda: self.asynchronous.request(command, value, timeout=timeout))

    def get_alarms(self, *, timeout: float | None = None) -> tuple[Alarm, ...]:
        """Returns all alarms that are set, with cause and remedy. Manual 2.5.1."""
        return PORTAL.run(lambda: self.asynchronous.get_alarms(timeout=timeout))

    def clear_alarms(self, *, timeout: float | None = None) -> None:
        """Clears the alarms; what the arm was doing when they came up does not go on. Manual 2.5.2."""
        PORTAL.run(lambda: self.asynchronous.clear_alarms(timeout=timeout))

    def recover(self) -> None:
        """Empty the queue, clear the alarms, and let the queue run: the arm is ready for new commands."""
        PORTAL.run(self.asynchronous.recover)

    def set_rail(
        self, *, on: bool = True, version: c.AccessoryVersion = c.AccessoryVersion.V1, timeout: float | None = None
    ) -> None:
        """Says whether the arm stands on a rail; needed after each power-up, before it moves along it.

        Args:
            on: Whether it does.
            version: Which hardware version the rail is.
            timeout: Seconds.
        """
        PORTAL.run(lambda: self.asynchronous.set_rail(on=on, version=version, timeout=timeout))

    def set_end_effector(self, tool: c.EndEffectorParams, *, timeout: float | None = None) -> None:
        """Says which tool is on the arm: SuctionCup(), Gripper(), Pen(), Laser() or its own mm. Manual 2.9.1."""
        PORTAL.run(lambda: self.asynchronous.set_end_effector(tool, timeout=timeout))

    def pause(self) -> None:
        """Lets the arm finish the command that it executes, and then wait. Manual 2.19.2."""
        PORTAL.run(self.asynchronous.pause)

    def resume(self) -> None:
        """Lets a paused arm go on. Manual 2.19.1."""
        PORTAL.run(self.asynchronous.resume)

    def stop(self, *, timeout: float = 5.0, tools: Literal["off", "leave"] = "off") -> None:
        """Stop the arm now, ahead of everything; pending Motions raise MotionStopped. Manual 2.19.3.

        The laser and the stepper motors stop as well. The pump keeps its state, so that nothing is dropped.

        Args:
            timeout: Seconds to wait for the arm to acknowledge it; it is repeated after that, too, until the arm does.
            tools: "leave" leaves laser and stepper motors as they are.

        Raises:
            ReplyTimeout: The arm has not acknowledged it yet.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(lambda: self.asynchronous.stop(timeout=timeout, tools=tools))

    def get_pose(self, *, timeout: float | None = None) -> c.Pose:
        """Returns where the tool is (mm, degrees) and the joints (degrees). Manual 2.4.1."""
        return PORTAL.run(lambda: self.asynchronous.get_pose(timeout=timeout))

    def get_joints(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Returns the four joint angles, degrees. Manual 2.4.1."""
        return PORTAL.run(lambda: self.asynchronous.get_joints(timeout=timeout))

    def get_rail(self, *, timeout: float | None = None) -> float:
        """Returns where the arm stands on its rail, in mm.

        Raises:
            UnsupportedError: It has none, or was not told that it has; see `set_rail`.
        """
        return PORTAL.run(lambda: self.asynchronous.get_rail(timeout=timeout))

    def get_info(self, *, timeout: float | None = None) -> DeviceInfo:
        """Returns serial number, name and firmware version. Manual 2.3."""
        return PORTAL.run(lambda: self.asynchronous.get_info(timeout=timeout))

    def get_input(self, address: int, *, timeout: float | None = None) -> bool:
        """Returns the level of a digital input (1 to 20). Manual 2.16.4.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            timeout: Seconds.

        Raises:
            ValueError: The pin is not configured as an input; see `configure_io`.
        """
        return PORTAL.run(lambda: self.asynchronous.get_input(address, timeout=timeout))

    def get_output(self, address: int, *, timeout: float | None = None) -> bool:
        """Returns the level that a digital output (1 to 20) was set to. Manual 2.16.2.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            timeout: Seconds.

        Raises:
            ValueError: An argument is out of range; nothing was sent.
        """
        return PORTAL.run(lambda: self.asynchronous.get_output(address, timeout=timeout))

    def get_adc(self, address: int, *, timeout: float | None = None) -> int:
        """Returns an analog input (1 to 20), 0 to 4095. Manual 2.16.5.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            timeout: Seconds.

        Raises:
            ValueError: The pin is not configured as an analog input; see `configure_io`.
        """
        return PORTAL.run(lambda: self.asynchronous.get_adc(address, timeout=timeout))

    def set_color_sensor(
        self,
        port: c.ColorPort,
        *,
        on: bool = True,
        version: c.AccessoryVersion = c.AccessoryVersion.V1,
        timeout: float | None = None,
    ) -> None:
        """Switches the colour sensor at a port; it sees something some 0.2 s later.

        Args:
            port: Its socket.
            on: Whether it is to look; its lamp goes with it.
            version: Which hardware version it is. One that is taken for the other sees nothing.
            timeout: Seconds.

        Raises:
            ValueError: There is no such port or version.
        """
        PORTAL.run(lambda: self.asynchronous.set_color_sensor(port, on=on, version=version, timeout=timeout))

    def get_color(self, *, timeout: float | None = None) -> c.Color:
        """Returns the colour that the sensor sees; all 0 where there is none."""
        return PORTAL.run(lambda: self.asynchronous.get_color(timeout=timeout))

    def wait_for_color(self, name: str | None = None, *, timeout: float | None = None) -> c.Color:
        """Waits until the colour sensor, which has to be switched on, sees a colour.

        Args:
            name: "red", "green" or "blue"; any of them unless given.
            timeout: Seconds; None waits for ever.

        Returns:
            What it sees; `.name` is the colour's.

        Raises:
            ValueError: There is no such name.
            ReplyTimeout: It did not see any in time. Nothing is stopped.
        """
        return PORTAL.run(lambda: self.asynchronous.wait_for_color(name, timeout=timeout))

    def set_infrared_sensor(
        self,
        port: c.InfraredPort,
        *,
        on: bool = True,
        version: c.AccessoryVersion = c.AccessoryVersion.V1,
        timeout: float | None = None,
    ) -> None:
        """Switches the infrared sensor at a port; it sees something some 0.1 s later.

        Args:
            port: Its socket.
            on: Whether it is to look.
            version: Which hardware version it is. One that is taken for the other sees nothing.
            timeout: Seconds.

        Raises:
            ValueError: There is no such port or version.
        """
        PORTAL.run(lambda: self.asynchronous.set_infrared_sensor(port, on=on, version=version, timeout=timeout))

    def get_infrared(self, port: c.InfraredPort, *, timeout: float | None = None) -> bool:
        """Returns whether the infrared sensor at a port sees something.

        Args:
            port: Its socket.
            timeout: Seconds.

        Raises:
            ValueError: There is no such port.
        """
        return PORTAL.run(lambda: self.asynchronous.get_infrared(port, timeout=timeout))

    def wait_for_infrared(self, port: c.InfraredPort, *, seen: bool = True, timeout: float | None = None) -> None:
        """Waits until the infrared sensor at a port, which has to be switched on, sees something.

        Args:
            port: Its socket.
            seen: False waits until it sees nothing.
            timeout: Seconds; None waits for ever.

        Raises:
            ReplyTimeout: That did not come about in time. Nothing is stopped.
        """
        PORTAL.run(lambda: self.asynchronous.wait_for_infrared(port, seen=seen, timeout=timeout))

    def jog(self, direction: Jog | str, seconds: float) -> None:
        """Jog for a time, at the speed of the JOG parameters, then stop. Manual 2.10.4.

        Args:
            direction: Of the tool ("x+", "x-", "y+", ... "r-"), of a joint ("j1+" ... "j4-"), or along the rail ("l+",
                "l-").
            seconds: How long, finite and not negative.

        Raises:
            ValueError: There is no such direction, or the rail was not declared; see `set_rail`.
            ArmAlarm: The jog ended at a limit.
            CommandRejected: The arm executes what is queued.
        """
        PORTAL.run(lambda: self.asynchronous.jog(direction, seconds))

    def jogging(self, direction: Jog | str) -> AbstractContextManager[None]:
        """Jog until the block ends, however it ends; the stop is repeated until the arm has heard it. Manual 2.10.4.

        Args:
            direction: As in `jog`.

        Raises:
            ReplyTimeout: The arm does not acknowledge that it is to begin, or that it is to stop.
            ValueError: There is no such direction, or the rail was not declared; see `set_rail`.
            ArmAlarm: The jog has ended at a limit; raised when the block ends.
            CommandRejected: The arm executes what is queued, and would not hear the jog.
            MotionStopped: It was stopped before the tool left the workspace of `connect`; raised when the block ends.
        """
        return BlockingContext(lambda: self.asynchronous.jogging(direction), same, "jogging")

    def taught_points(self, mode: c.HHTTrigMode = c.HHTTrigMode.TRIGGERED_ON_KEY_RELEASED) -> Items[c.Pose]:
        """Yields the poses of hand-guided teaching (HHT): the user presses the key on the forearm, and guides the arm.

        Args:
            mode: A pose when the key is released, or at intervals while it is held. Manual 2.7.

        Raises:
            ReplyTimeout: The arm does not answer in time.
            ConnectionLost: The link is gone.
        """
        return Items(lambda: self.asynchronous.taught_points(mode), same)

    def following(
        self,
        *,
        rate: SupportsFloat = 30.0,
        max_speed: SupportsFloat = 100.0,
        max_turn: SupportsFloat = 90.0,
        stale: SupportsFloat = 0.3,
        way: Way = "replace",
    ) -> AbstractContextManager[Follow]:
        """Let the arm follow a target for the length of a block, and stop it at the end, as `stop` does.

        While it lasts commands that are queued are refused, and jogs; what is done at once, as the tools, is not. How
        fast the arm catches up with the target, `set_speed` says: more acceleration is less lag.

        Args:
            rate: Setpoints per second at the most, above 0 to 200; fewer where the line is slow.
            max_speed: mm/s at which the setpoint goes to the target, above 0.
            max_turn: The same of r, and of joints: degrees/s.
            stale: Seconds after which the arm comes to rest if the target was not renewed.
            way: "replace" sends immediate motions, each in place of the one before; "clear" empties the queue and
                queues the next one, for firmware that does not do that.

        Raises:
            ValueError: A number is out of range.
            CommandRejected: Commands are pending; the arm stands although it is to go.
            ArmAlarm: The arm raised alarms; the message has the target.
            MotionStopped: A stop ended it.
            MotionUnknown: The arm is silent, the link was lost, or the arm was switched off and on.
            ConnectionLost: The link is gone.
        """
        return BlockingContext(
            lambda: self.asynchronous.following(
                rate=rate, max_speed=max_speed, max_turn=max_turn, stale=stale, way=way
            ),
            Follow,
            "__call__",
        )
