"""Ctrl-C stops the arms at once, wherever the program is: old programs have no block that it would leave.

    SIGINT            every arm begins to stop, and KeyboardInterrupt is raised, as without this
    SIGTERM, SIGHUP   likewise, and the program ends as by sys.exit

Signals that the program handles itself are left to it.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType

__all__ = ["StopSignals"]

DEFAULTS: dict[str, Callable[[int, FrameType | None], object] | signal.Handlers] = {
    "SIGINT": signal.default_int_handler,
    "SIGTERM": signal.SIG_DFL,
    "SIGHUP": signal.SIG_DFL,
}
"""The signals that end a program, and what handles each unless the program says otherwise."""


class StopSignals:
    """The handlers, while arms are connected.

    Args:
        stop: Called in the handler; begins to stop the arms, and does not wait.
    """

    def __init__(self, stop: Callable[[], None]) -> None:
        self._stop = stop
        self._installed: dict[int, str] = {}

    def install(self) -> None:
        """Handle the signals that nobody else does; only the main thread can."""
        if threading.current_thread() is not threading.main_thread():
            return

        for name, default in DEFAULTS.items():
            number: int | None = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is default:
                signal.signal(number, self._handle)
                self._installed[number] = name

    def restore(self) -> None:
        """Leave the signals to their defaults again, as far as nobody else handles them by now."""
        if threading.current_thread() is not threading.main_thread():
            return  # until the next time; without arms the handlers do what the defaults do

        for number, name in self._installed.items():
            if signal.getsignal(number) == self._handle:
                signal.signal(number, DEFAULTS[name])

        self._installed.clear()

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self._stop()
        if number == signal.SIGINT:
            signal.default_int_handler(number, frame)

        raise SystemExit(128 + number)
