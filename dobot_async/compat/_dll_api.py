"""The library of `DobotDllType`: connecting, its queue, and what is sent through it at once or in its turn.

A program has one library, as it has one DLL: `load()` returns the same one each time. A second arm has a library of its
own, `load("left")`.
"""

from __future__ import annotations

import logging
import time
from typing import Any, Literal, TypeVar

from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async.arms.magician import commands as c
from dobot_async.compat._dll_names import DobotConnect
from dobot_async.compat._ports import ports_with_arms
from dobot_async.compat._session import CompatSession
from dobot_async.errors import ConnectFailed, ConnectionLost

__all__ = [
    "Api",
    "ConnectDobot",
    "DisconnectDobot",
    "DobotExec",
    "GetQueuedCmdCurrentIndex",
    "GetQueuedCmdLeftSpace",
    "GetQueuedCmdMotionFinish",
    "PeriodicTask",
    "SearchDobot",
    "SetCmdTimeout",
    "SetQueuedCmdClear",
    "SetQueuedCmdForceStopExec",
    "SetQueuedCmdStartExec",
    "SetQueuedCmdStopExec",
    "dSleep",
    "gettime",
    "load",
    "output",
]

Q = TypeVar("Q")
logger = logging.getLogger("dobot_async.compat")
SHORTEST_MS, LONGEST_S = 20, 600
"""Waits in milliseconds that are shorter, and in seconds that are longer, are taken for the other unit, and refused."""


class Api:
    """What `load` returns, and every function takes first.

    Attributes:
        wait: The unit of `SetWAITCmd`: "ms", or "s".
    """

    def __init__(self, wait: Literal["ms", "s"]) -> None:
        self.wait = wait
        self._session: CompatSession | None = None

    @property
    def session(self) -> CompatSession:
        """The connection; its `arm` is that of `dobot_async.sync`.

        Raises:
            ConnectionLost: There is none.
        """
        if self._session is None or not self._session.is_open:
            raise ConnectionLost("no arm is connected: ConnectDobot(api, port, 115200) first, and look at what it says")

        return self._session

    @property
    def connected(self) -> bool:
        """Whether an arm is connected."""
        return self._session is not None and self._session.is_open

    def connect(self, port: str) -> None:
        """Connect to an arm."""
        self._session = CompatSession(port)

    def tell(self, row: Command[Q, Any], value: Q, queued: int) -> list[int]:
        """Send a command, in its turn or at once; a motion that is not queued is done when this returns.

        Returns:
            Its index in a list; 0 where it has none.
        """
        if queued:
            return [self.session.put(row, value)]

        if row.queueing is Queueing.ALWAYS:
            return [self.session.run(row, value)]

        return [self.session.write(row, value)]

    def milliseconds(self, wait: float) -> int:
        """Return a wait of a program in ms; raise ValueError for one that is most likely in the other unit."""
        unit, other = (self.wait, "s" if self.wait == "ms" else "ms")
        if (unit == "ms" and 0 < wait < SHORTEST_MS) or (unit == "s" and wait > LONGEST_S) or not wait >= 0:
            raise ValueError(
                f"a wait of {wait!r} {unit}? Copies of DobotDllType.py differ: if yours counts {other}, "
                f'say load(wait="{other}")'
            )

        return round(wait if unit == "ms" else 1000 * wait)


LIBRARIES: dict[str, Api] = {}


def load(name: str = "", *, wait: Literal["ms", "s"] | None = None) -> Api:
    """Return the library, the same one each time.

    Args:
        name: One for each arm, where there are several.
        wait: The unit of `SetWAITCmd` in your copy of the vendor's file: "ms", as in newer ones, or "s".
    """
    if wait not in {None, "ms", "s"}:
        raise ValueError(f'wait must be "ms" or "s", not {wait!r}')

    api = LIBRARIES.setdefault(name, Api("ms"))
    api.wait = wait or api.wait
    return api


def SearchDobot(api: Api, maxLen: int = 1000) -> list[str]:
    """Return the serial ports whose USB chip is one that an arm has."""
    return ports_with_arms()


def ConnectDobot(api: Api, portName: str, baudrate: int = 115200) -> tuple[int, str, str]:
    """Connect to an arm: a port, an IP address, a URL, or "" for the first one. Its queue is emptied, and runs.

    Returns:
        `DobotConnect`, "Dobot", and the version of the firmware. Why there is none is in the log.
    """
    if api.connected:
        logger.warning("an arm is connected already: DisconnectDobot first, or take a library for each: load(name)")
        return DobotConnect.DobotConnect_Occupied, "", ""

    try:
        api.connect(portName)
    except ConnectFailed as error:
        logger.warning("%s", error)
        occupied = isinstance(error.__cause__, PermissionError | BlockingIOError) or "another" in str(error)
        return DobotConnect.DobotConnect_Occupied if occupied else DobotConnect.DobotConnect_NotFound, "", ""

    return DobotConnect.DobotConnect_NoError, "Dobot", str(api.session.read(c.GET_DEVICE_VERSION))


def DisconnectDobot(api: Api) -> None:
    """Wait for what was queued, unless the queue does not run, and disconnect; after an error the arm is stopped."""
    if api.connected:
        api.session.close()


def PeriodicTask(api: Api) -> None:
    """Do nothing: there is nothing to be driven."""


def DobotExec(api: Api) -> list[int]:
    """Raise what has failed of what was queued; else return `[0]`."""
    api.session.current_index()
    return [0]


def SetCmdTimeout(api: Api, times: int) -> None:
    """Do nothing: how long an answer may take follows from how long answers take."""


def dSleep(ms: float) -> None:
    """Let the program wait, in ms. It is the program that waits, and not the arm: see `SetWAITCmd`."""
    time.sleep(ms / 1000)


def gettime() -> list[float]:
    """Return seconds since 1970, in a list."""
    return [time.time()]


def output(str: object) -> None:  # noqa: A002 - the vendor's name
    """Do nothing, as in the vendor's file."""


def SetQueuedCmdStartExec(api: Api) -> None:
    """Let the queue run."""
    api.session.start()


def SetQueuedCmdStopExec(api: Api) -> None:
    """Let the queue not run any further than the command that is being executed."""
    api.session.halt()


def SetQueuedCmdForceStopExec(api: Api) -> None:
    """Stop the arm now. The queue is empty then, and does not run until SetQueuedCmdStartExec."""
    api.session.stop()


def SetQueuedCmdClear(api: Api) -> list[int]:
    """Empty the queue, the running command included; return `[0]`."""
    api.session.clear()
    return [0]


def GetQueuedCmdCurrentIndex(api: Api) -> list[int]:
    """Return the index up to which everything is executed, in a list.

    Raises:
        ArmAlarm: What was queued will not be executed.
    """
    return [api.session.current_index()]


def GetQueuedCmdLeftSpace(api: Api) -> list[int]:
    """Return how many commands the arm's queue has room for, in a list."""
    return [api.session.read(c.GET_QUEUED_CMD_LEFT_SPACE)]


def GetQueuedCmdMotionFinish(api: Api) -> list[bool]:
    """Return whether all that was queued is executed, in a list."""
    api.session.current_index()
    return [not api.session.waiting()]
