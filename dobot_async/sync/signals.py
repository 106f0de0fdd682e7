"""What ends a program without a word to it: SIGTERM, and SIGHUP of a terminal that is closed.

Unless the program deals with them itself, they end it here as `sys.exit` does, so that its blocks are left, and its
arms stop. Python does that for Ctrl-C (SIGINT) by itself.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any

__all__ = ["Signals"]

NAMES = ("SIGTERM", "SIGHUP")


class Signals:
    """The handlers, while arms are connected.

    Args:
        interrupt: Called with what is raised in the main thread.
    """

    def __init__(self, interrupt: Callable[[BaseException], None]) -> None:
        self._interrupt = interrupt
        self._installed: list[int] = []

    def install(self) -> None:
        """Handle the signals that nobody handles; does nothing in other threads than the main one."""
        if threading.current_thread() is not threading.main_thread():
            return

        for name in NAMES:
            number: int | None = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, self._end)
                self._installed.append(number)

    def restore(self) -> None:
        """Leave the signals to the system again, as far as nobody else handles them by now."""
        if threading.current_thread() is not threading.main_thread():
            return  # the handlers do what the system would, but with an exit code

        for number in self._installed:
            if signal.getsignal(number) == self._end:
                signal.signal(number, signal.SIG_DFL)

        self._installed.clear()

    def _end(self, number: int, _: FrameType | Any) -> None:
        error = SystemExit(128 + number)
        self._interrupt(error)
        raise error
