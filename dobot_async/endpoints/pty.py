"""A pseudo-terminal: a serial port whose other end is a `Host` of `listeners`. Windows has none."""

from __future__ import annotations

import asyncio
import os
from contextlib import AsyncExitStack, suppress
from importlib import import_module
from typing import Any, Generic, TypeVar

from dobot_async.endpoints.listeners import Host, Peer

__all__ = ["PseudoTerminal", "on_pty"]

P = TypeVar("P", bound=Peer)
BUFFER = 1 << 16
NONE_HERE = "this system has no pseudo-terminals, which need POSIX: listen at tcp://127.0.0.1:0 instead"
LOOK = 0.02  # seconds between two looks at whether somebody has opened it: no system call tells it


async def on_pty(host: Host[Any], stack: AsyncExitStack, *, lasting: bool = True) -> str:
    """A serial port; returns its URL. See `PseudoTerminal`.

    Raises:
        ValueError: This system has no pseudo-terminals.
    """
    try:
        import_module("termios")  # Windows has neither it nor what follows
    except ImportError:
        raise ValueError(NONE_HERE) from None

    port = PseudoTerminal(host, lasting=lasting)
    stack.callback(port.close)
    return f"serial://{port.path}"


class PseudoTerminal(Generic[P]):
    """The host's end of a pseudo-terminal.

    Args:
        host: Who is reached.
        lasting: True makes all programs that open the port one client, for ever; False each opening one of its own.
    """

    def __init__(self, host: Host[P], *, lasting: bool = True) -> None:
        self._host = host
        self._lasting = lasting
        self._loop = asyncio.get_running_loop()
        self._master, self._slave = os.openpty()
        make_raw(self._slave)
        os.set_blocking(self._master, False)
        self.path: str = os.ttyname(self._slave)
        self._unsent = bytearray()
        self._client: P | None = None
        self._ignoring = False
        self._timer: asyncio.TimerHandle | None = None
        if lasting:
            self._client = host.client(
                self._deliver, self.close, ordered=True, pause_reading=self._pause_reading, name=self.path
            )
            self._loop.add_reader(self._master, self._readable)
        else:
            os.close(self._slave)
            self._look()

    def close(self) -> None:
        """Closes it; a client's port breaks."""
        if self._master >= 0:
            self._gone()
            self._loop.remove_reader(self._master)
            if self._timer:
                self._timer.cancel()

            os.close(self._master)
            self._master = -1
            if self._lasting:
                os.close(self._slave)

    def _look(self) -> None:
        """Looks whether somebody has opened the port; until then reading it is an error."""
        try:
            data = os.read(self._master, BUFFER)
        except BlockingIOError:
            data = b""
        except OSError:
            self._timer = self._loop.call_later(LOOK, self._look)
            return

        self._ignoring = False
        self._client = self._host.client(
            self._deliver, self._ignore, ordered=True, pause_reading=self._pause_reading, name=self.path
        )
        self._loop.add_reader(self._master, self._readable)
        if data:
            self._client.send(data)

    def _readable(self) -> None:
        try:
            data = os.read(self._master, BUFFER)
        except BlockingIOError:
            return
        except OSError:
            if self._lasting:
                raise

            self._closed()
            return

        if self._client and not self._ignoring:
            self._client.send(data)

    def _closed(self) -> None:
        """The last program has closed the port; what it has not read is not for the next one."""
        self._loop.remove_reader(self._master)
        self._gone()
        slave = os.open(self.path, os.O_RDWR | os.O_NOCTTY)
        make_raw(slave)
        os.close(slave)
        self._look()

    def _gone(self) -> None:
        """Tells the host that its client has gone."""
        self._loop.remove_writer(self._master)
        self._unsent.clear()
        client, self._client = self._client, None
        if client:
            self._host.leave(client)

    def _ignore(self) -> None:
        """A port cannot be closed from here without losing its name: input is ignored until the client closes it."""
        self._ignoring = True
        self._pause_reading(False)
        self._gone()

    def _pause_reading(self, held: bool) -> None:
        """Lets the client wait. While it does, its end goes unnoticed; it is let go on again in any case."""
        if self._master >= 0:
            if held:
                self._loop.remove_reader(self._master)
            else:
                self._loop.add_reader(self._master, self._readable)

    def _deliver(self, data: bytes) -> None:
        """Writes what fits; a client that never reads loses the rest, as a UART's does."""
        if self._client and len(self._unsent) < BUFFER:
            self._unsent += data
            self._write()

    def _write(self) -> None:
        with suppress(BlockingIOError):
            del self._unsent[: os.write(self._master, self._unsent)]

        if self._unsent:
            self._loop.add_writer(self._master, self._write)
        else:
            self._loop.remove_writer(self._master)


def make_raw(terminal: int) -> None:
    """Makes a terminal a line for bytes, with nothing on its way."""
    import termios  # noqa: PLC0415 - Windows has neither, and needs none for the other places
    import tty  # noqa: PLC0415 - as termios

    tty.setraw(terminal)
    termios.tcflush(terminal, termios.TCIOFLUSH)
