"""Refusals of the panel, and errors as a page gets them: a kind for its code, and a text for people."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

from dobot_async._core.util.text import printable
from dobot_async.errors import (
    ArmAlarm,
    CommandRejected,
    ConnectionLost,
    DobotError,
    MotionStopped,
    MotionUnknown,
    ProtocolError,
    ReplyTimeout,
    UnsupportedError,
)

__all__ = ["PanelRefusal", "told"]

logger: logging.Logger = logging.getLogger("dobot_async.panel")
LONGEST = 2000  # characters of a message
KINDS: tuple[tuple[type[BaseException], str], ...] = (
    (ArmAlarm, "alarm"),
    (MotionStopped, "stopped"),
    (MotionUnknown, "unknown"),
    (CommandRejected, "rejected"),
    (UnsupportedError, "unsupported"),
    (ReplyTimeout, "timeout"),
    (ConnectionLost, "link"),
    (ConnectionError, "link"),
    (ProtocolError, "link"),
    (DobotError, "rejected"),
    (ImportError, "unsupported"),
    (ValueError, "wrong"),
    (TypeError, "wrong"),
)
"""The kind of each error; the first that fits counts."""


class PanelRefusal(Exception):
    """Something is not done; nothing was sent to the arm.

    Attributes:
        kind: The word for it; see docs/panel-protocol.md.
    """

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


def told(error: BaseException) -> Mapping[str, Any]:
    """Return what a page is told of an error; what nobody expects goes to the log with its traceback."""
    if isinstance(error, PanelRefusal):
        return {"kind": error.kind, "text": printable(str(error), LONGEST)}

    for kind, word in KINDS:
        if isinstance(error, kind):
            words = "; ".join([str(error) or type(error).__name__, *getattr(error, "__notes__", ())])
            return {"kind": word, "text": printable(words, LONGEST)}

    logger.error("the panel failed", exc_info=error)
    return {"kind": "bug", "text": f"the panel failed: {type(error).__name__}; its log has more"}
