"""The whole exception tree. Imports nothing of this package.

    DobotError
    ├── ConnectFailed    (ConnectionError)   no arm answered behind the URL
    ├── ConnectionLost   (ConnectionError)   the link broke or was closed
    ├── ReplyTimeout     (TimeoutError)      the arm did not answer one request in time
    ├── ProtocolError                        the arm answered something that the layout does not allow
    ├── CommandRejected                      the arm answered that it will not do it
    ├── ArmAlarm                             the arm ended the motion with alarms
    ├── MotionStopped                        a stop or a clear ended the motion
    ├── MotionUnknown                        the motion may or may not run
    └── UnsupportedError                     the arm has no such thing, or its protocol does not give it

Wrong arguments are `ValueError` or `TypeError` and are raised before a byte is sent.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any, TypeVar

__all__ = [
    "ArmAlarm",
    "CommandRejected",
    "ConnectFailed",
    "ConnectionLost",
    "DobotError",
    "MotionStopped",
    "MotionUnknown",
    "ProtocolError",
    "ReplyTimeout",
    "UnsupportedError",
    "another",
]

E = TypeVar("E", bound=BaseException)


class DobotError(Exception):
    """The root of everything that an arm or its link can do wrong.

    Attributes:
        steps: Of `queue.stream`: the first and the last step that may have failed, both the same where it is known
            which; () for everything else.
    """

    steps: tuple[object, ...] = ()


class ConnectFailed(DobotError, ConnectionError):
    """No arm could be reached; the message says what to check."""


class ConnectionLost(DobotError, ConnectionError):
    """The link broke, or was closed, while it was needed."""


class ReplyTimeout(DobotError, TimeoutError):
    """The arm did not answer a request in time; the link itself may still be good."""


class ProtocolError(DobotError):
    """The arm sent something that its protocol does not allow."""


class CommandRejected(DobotError):
    """The arm understood a command and refused it."""


class ArmAlarm(DobotError):
    """The arm raised alarms and ended, or will not run, the motion.

    Attributes:
        alarms: What is set: of a Magician and a myCobot each with its code, name, cause and remedy; of an ultraArm,
            which has no alarms of its own, what was seen, in words when printed.
        motions: Of a queue, in order: the first motion that is not known to be done, up to the last that may have
            failed, each a `Motion`; while the arm follows, words that name the target.
    """

    def __init__(self, message: str, alarms: Sequence[Any] = (), motions: Sequence[object] = ()) -> None:
        super().__init__(message)
        self.alarms: tuple[Any, ...] = tuple(alarms)  # a type of each family: whoever connected knows which
        self.motions: tuple[object, ...] = tuple(motions)


class MotionStopped(DobotError):
    """A stop, a clear or the end of the connection's block ended the motion before it was known to be done."""


class MotionUnknown(DobotError):
    """Nothing can tell whether the motion runs; the arm was told to stop."""


class UnsupportedError(DobotError):
    """The arm has no such thing, or its protocol does not give it."""


def another(error: E) -> E:
    """Return a copy of an error, to be raised by somebody else: a traceback and a context belong to one raise."""
    found = copy.copy(error)
    if hasattr(found, "__notes__"):
        found.__notes__ = list(found.__notes__)

    found.__cause__, found.__context__ = error.__cause__, None
    return found.with_traceback(None)
