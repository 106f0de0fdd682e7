"""Serial ports over pseudo-terminals, by each backend: the test holds the arm's end."""

from __future__ import annotations

import asyncio
import os
import struct
import sys
import threading
import types
from collections.abc import AsyncIterator, Iterator
from contextlib import aclosing, asynccontextmanager, nullcontext
from typing import Any, cast

import anyio
import pytest
import serial

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.contract import LinkState
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame, Parser, request
from dobot_async.errors import ConnectFailed, ConnectionLost
from dobot_async.transports import open_transport, serial_port
from dobot_async.transports import port as serial_output
from dobot_async.transports import serial as serial_transport
from dobot_async.transports import serialx as serialx_transport

if sys.platform == "win32":
    pytest.skip("needs pseudo-terminals", allow_module_level=True)

import fcntl
import termios
import tty

BARRIERS = [request(row, b"", queued=False) for row in (c.GET_POSE, c.GET_ALARMS_STATE)]
BUFFER = 1 << 16


class Terminal:
    """A serial port whose other end is in the hands of the test."""

    def __init__(self, backend: str) -> None:
        self.backend = backend
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(self.slave)
        self.url = f"serial://{self.path}?backend={backend}"

    async def read(self, size: int) -> bytes:
        """Returns exactly so many bytes that the driver sent."""
        data = b""
        while len(data) < size:
            await ready(self.master, write=False)
            data += os.read(self.master, size - len(data))

        return data

    async def write(self, data: bytes) -> None:
        """Sends all of it to the driver."""
        while data:
            await ready(self.master, write=True)
            data = data[os.write(self.master, data) :]

    def fill(self) -> int:
        """Sends junk to the driver until no more of it fits; returns how much that was."""
        sent = 0
        while True:
            try:
                sent += os.write(self.master, bytes(1024))
            except BlockingIOError:
                return sent

    def unplug(self) -> None:
        """The arm is gone."""
        os.close(self.master)
        self.master = -1

    def close(self) -> None:
        """Closes both ends."""
        os.close(self.slave)
        if self.master >= 0:
            os.close(self.master)


async def ready(descriptor: int, *, write: bool) -> None:
    """Returns when a descriptor can be read or written."""
    await (anyio.wait_writable(descriptor) if write else anyio.wait_readable(descriptor))


MODULES = {"pyserial": serial_transport, "serialx": serialx_transport}
PYSERIAL = pytest.mark.parametrize("terminal", ["pyserial"], indirect=True)
SERIALX = pytest.mark.parametrize("terminal", ["serialx"], indirect=True)


@pytest.fixture(params=["pyserial", "serialx"])
def terminal(request: pytest.FixtureRequest) -> Iterator[Terminal]:
    """A port that nobody has opened yet."""
    terminal = Terminal(request.param)
    yield terminal
    terminal.close()


@pytest.fixture(autouse=True)
async def in_time() -> AsyncIterator[None]:
    """What hangs is cut off and fails."""
    loop = asyncio.get_running_loop()
    timers: list[asyncio.TimerHandle] = []

    def cut() -> None:
        timers.append(loop.call_later(1, cut))
        for task in asyncio.all_tasks():
            task.cancel()

    timers.append(loop.call_later(20, cut))
    yield
    for timer in timers:
        timer.cancel()


@asynccontextmanager
async def linked(terminal: Terminal) -> AsyncIterator[Link[Frame]]:
    """A link to the terminal."""
    transport = await open_transport(terminal.url, arm="magician")
    async with aclosing(Link(transport, Parser(), request, url=terminal.url, barriers=BARRIERS)) as link:
        yield link


@asynccontextmanager
async def opened(terminal: Terminal) -> AsyncIterator[Any]:
    """The port as a transport, closed at the end."""
    async with aclosing(cast(Any, await open_transport(terminal.url, arm="magician"))) as transport:
        yield transport


async def step(count: int) -> None:
    """Lets the loop go round so many times."""
    for _ in range(count):
        await asyncio.sleep(0)


# The way of the bytes


async def test_a_request_goes_out_and_its_answer_comes_back_byte_by_byte(terminal: Terminal) -> None:
    async with linked(terminal) as link:
        call = asyncio.create_task(link.request(c.GET_POSE, None))
        assert await terminal.read(6) == bytes.fromhex("aa aa 02 0a 00 f6")
        for byte in bytes(Frame(10, 0, struct.pack("<8f", *range(8)))):
            await terminal.write(bytes((byte,)))
            await step(1)

        assert await call == c.Pose(*map(float, range(8)))


async def test_every_byte_arrives_as_it_is(terminal: Terminal) -> None:
    every = bytes(range(256))
    async with opened(terminal) as transport:
        await transport.send(every)
        assert await terminal.read(256) == every

        await terminal.write(every)
        received = b""
        while len(received) < 256:
            received += await transport.receive()

        assert received == every


async def test_a_cancelled_receive_loses_nothing(terminal: Terminal) -> None:
    async with opened(terminal) as transport:
        for steps in range(4):
            receiving = asyncio.create_task(transport.receive())
            await step(steps)
            receiving.cancel()
            await asyncio.wait([receiving])

        await terminal.write(b"after")
        received = b""
        while len(received) < 5:
            received += await transport.receive()

        assert received == b"after"


async def test_what_nobody_reads_is_bounded_and_not_lost(terminal: Terminal) -> None:
    everything = os.urandom(4 * BUFFER)
    async with opened(terminal) as transport:
        writing = asyncio.create_task(terminal.write(everything))
        while len(transport._buffer) <= BUFFER:
            await step(1)

        await step(100)
        assert len(transport._buffer) < BUFFER + 8192  # the system hands over so much at a time
        assert not writing.done()

        received = b""
        while len(received) < len(everything):
            received += await transport.receive()

        assert received == everything
        await writing


async def test_send_waits_for_a_peer_that_does_not_read(terminal: Terminal) -> None:
    everything = os.urandom(4 * BUFFER)
    async with opened(terminal) as transport:
        sending = asyncio.create_task(transport.send(everything))
        await step(100)
        assert not sending.done()
        assert await terminal.read(len(everything)) == everything
        await sending


# Opening


@pytest.mark.parametrize(("option", "speed"), [("", termios.B115200), ("&baud=57600", termios.B57600)])
async def test_the_port_has_the_speed_of_the_url(terminal: Terminal, option: str, speed: int) -> None:
    transport = await open_transport(terminal.url + option, arm="magician")
    assert termios.tcgetattr(terminal.slave)[4:6] == [speed, speed]
    await transport.aclose()


@PYSERIAL
async def test_dtr_and_rts_are_low_before_the_port_opens(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[bool, bool, bool]] = []
    real = serial.Serial.open

    def recording(port: serial.Serial) -> None:
        seen.append((port.is_open, port.dtr, port.rts))
        real(port)
        seen.append((port.is_open, port.dtr, port.rts))

    monkeypatch.setattr(serial.Serial, "open", recording)
    async with opened(terminal):
        assert seen == [(False, False, False), (True, False, False)]


@pytest.mark.parametrize("backend", MODULES)
async def test_a_missing_port_says_what_to_check(backend: str) -> None:
    with pytest.raises(ConnectFailed, match=r"cannot open /dev/no-such-port: .*is the arm plugged in") as failed:
        await open_transport(f"serial:///dev/no-such-port?backend={backend}", arm="magician")

    assert isinstance(failed.value, ConnectionError)
    assert isinstance(failed.value.__cause__, OSError)


@pytest.mark.parametrize("backend", MODULES)
async def test_a_file_that_is_no_port_is_refused(backend: str, tmp_path: Any) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"")
    with pytest.raises(ConnectFailed, match="cannot open"):
        await open_transport(f"serial://{path}?backend={backend}", arm="magician")


async def test_a_port_in_use_is_refused(terminal: Terminal) -> None:
    async with opened(terminal):
        with pytest.raises(ConnectFailed, match="is no other program using it"):
            await open_transport(terminal.url, arm="magician")

    async with opened(terminal):
        pass


@PYSERIAL
async def test_a_port_that_vanishes_while_it_is_opened_is_refused(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = serial.Serial.open

    ports: list[serial.Serial] = []

    def open_and_vanish(port: serial.Serial) -> None:
        ports.append(port)
        real(port)
        terminal.unplug()

    monkeypatch.setattr(serial.Serial, "open", open_and_vanish)
    with pytest.raises(ConnectFailed, match="cannot open"):
        await open_transport(terminal.url, arm="magician")

    assert [port.is_open for port in ports] == [False]


@PYSERIAL
@pytest.mark.parametrize("there", [True, False])
async def test_the_thread_that_opens_has_ended_when_it_is_open(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch, there: bool
) -> None:
    loop = asyncio.get_running_loop()
    real = loop.call_soon_threadsafe

    def and_then_dawdle(*args: Any) -> Any:
        handle = real(*args)
        threading.Event().wait(0.05)
        return handle

    monkeypatch.setattr(loop, "call_soon_threadsafe", and_then_dawdle)
    with nullcontext() if there else pytest.raises(ConnectFailed):
        transport = await open_transport(
            terminal.url if there else "serial:///dev/no-such-port?backend=pyserial", arm="magician"
        )

    assert "dobot_async open" not in {thread.name for thread in threading.enumerate()}
    if there:
        await transport.aclose()


@pytest.mark.parametrize("steps", range(8))
async def test_opening_may_be_cancelled_anywhere(terminal: Terminal, steps: int) -> None:
    opening = asyncio.create_task(open_transport(terminal.url, arm="magician"))
    await step(steps)
    opening.cancel()
    await asyncio.wait([opening])
    if not opening.cancelled():
        await opening.result().aclose()

    await released(terminal)


@PYSERIAL
async def test_opening_that_takes_its_time_blocks_nobody_and_may_be_cancelled(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = serial.Serial.open
    go = threading.Event()
    loop = asyncio.get_running_loop()
    entered, ended = asyncio.Event(), asyncio.Event()

    def slowly(port: serial.Serial) -> None:
        loop.call_soon_threadsafe(entered.set)
        go.wait()
        real(port)

    closing = serial.Serial.close

    def closed(port: serial.Serial) -> None:
        was_open = port.is_open
        closing(port)
        if was_open:
            loop.call_soon_threadsafe(ended.set)

    monkeypatch.setattr(serial.Serial, "open", slowly)
    monkeypatch.setattr(serial.Serial, "close", closed)
    opening = asyncio.create_task(open_transport(terminal.url, arm="magician"))
    await entered.wait()
    opening.cancel()
    await asyncio.wait([opening])
    assert opening.cancelled()

    go.set()
    await ended.wait()
    await released(terminal)


async def released(terminal: Terminal) -> None:
    """Returns when no thread opens the port any more, and nobody holds it."""
    for thread in threading.enumerate():
        if thread.name == "dobot_async open":
            await asyncio.to_thread(thread.join)

    async with opened(terminal):
        pass


# Unplugging


async def test_unplugging_ends_a_receive(terminal: Terminal) -> None:
    async with opened(terminal) as transport:
        receiving = asyncio.create_task(transport.receive())
        await step(3)
        terminal.unplug()
        with pytest.raises(anyio.BrokenResourceError) as broken:
            await receiving

        assert isinstance(broken.value.__cause__, OSError)
        with pytest.raises(anyio.BrokenResourceError):
            await transport.send(b"x")


async def test_what_came_before_the_unplugging_can_be_read(terminal: Terminal) -> None:
    async with opened(terminal) as transport:
        await terminal.write(b"last words")
        while len(transport._buffer) < 10:
            await step(1)

        terminal.unplug()
        await asyncio.wait([transport._lost])
        assert await transport.receive() == b"last words"
        with pytest.raises(anyio.BrokenResourceError):
            await transport.receive()


async def test_unplugging_ends_a_waiting_request(terminal: Terminal) -> None:
    async with linked(terminal) as link:
        call = asyncio.create_task(link.request(c.GET_POSE, None, timeout=60))
        await terminal.read(6)
        terminal.unplug()
        with pytest.raises(ConnectionLost, match="is the arm powered and the cable in"):
            await call

        assert link.state.value is LinkState.LOST


async def test_unplugging_ends_a_waiting_send(terminal: Terminal) -> None:
    async with opened(terminal) as transport:
        sending = asyncio.create_task(transport.send(bytes(4 * BUFFER)))
        await step(20)
        terminal.unplug()
        with pytest.raises(anyio.BrokenResourceError):
            await sending


# Closing


async def test_closing_with_unread_data_does_not_hang(terminal: Terminal) -> None:
    async with opened(terminal) as transport:
        terminal.fill()
        await step(3)
        terminal.fill()
        await transport.aclose()


@pytest.mark.parametrize("size", [10, 8192, 4 * BUFFER])
async def test_closing_with_unsent_data_does_not_hang(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    monkeypatch.setattr(serial_output, "DRAIN", 0.02)
    async with opened(terminal) as transport:
        sending = asyncio.create_task(transport.send(bytes(size)))
        await step(10)
        await transport.aclose()
        await asyncio.wait([sending])
        assert sending.exception() is None or isinstance(sending.exception(), anyio.ClosedResourceError)


@PYSERIAL
async def test_closing_a_broken_port_with_unsent_data_does_not_hang(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(port: serial.Serial, size: int) -> bytes:
        raise serial.SerialException("broken")

    monkeypatch.setattr(serial_output, "DRAIN", 0.02)
    async with opened(terminal) as transport:
        await transport.send(bytes(BUFFER // 2))
        monkeypatch.setattr(serial_transport.Port, "read", fail)
        await terminal.write(b"x")
        while not transport._transport.is_closing():
            await step(1)

        await transport.aclose()


async def test_a_peer_that_never_stops_does_not_keep_others_from_running(terminal: Terminal) -> None:
    async with linked(terminal) as link:
        flooding = asyncio.create_task(terminal.write(bytes(1 << 24)))
        while link.stats.junk_bytes < 4 * BUFFER:
            await step(1)

        flooding.cancel()
        await asyncio.wait([flooding])


async def test_closing_waits_for_a_peer_that_reads(terminal: Terminal) -> None:
    everything = os.urandom(BUFFER // 2)
    async with opened(terminal) as transport:
        await transport.send(everything)
        _, received = await asyncio.gather(transport.aclose(), terminal.read(len(everything)))
        assert received == everything


@PYSERIAL
async def test_closing_waits_for_the_systems_own_buffer(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    waiting = iter([4096, 2048])
    thrown_away: list[bool] = []
    monkeypatch.setattr(serial.Serial, "out_waiting", property(lambda port: next(waiting, 0)))
    monkeypatch.setattr(serial.Serial, "reset_output_buffer", lambda port: thrown_away.append(True))
    async with opened(terminal):
        pass

    assert next(waiting, None) is None
    assert not thrown_away

    monkeypatch.setattr(serial_output, "DRAIN", 0.02)
    monkeypatch.setattr(serial.Serial, "out_waiting", 1)
    async with opened(terminal):
        pass

    assert thrown_away


async def test_closing_again_and_by_many_does_nothing(terminal: Terminal) -> None:
    async with opened(terminal) as transport:
        await asyncio.gather(*(transport.aclose() for _ in range(3)))
        await transport.aclose()
        with pytest.raises(anyio.ClosedResourceError):
            await transport.send(b"x")

        with pytest.raises(anyio.ClosedResourceError):
            await transport.receive()


async def test_closing_ends_a_receive(terminal: Terminal) -> None:
    async with opened(terminal) as transport:
        receiving = asyncio.create_task(transport.receive())
        await step(3)
        await transport.aclose()
        with pytest.raises(anyio.ClosedResourceError):
            await receiving


async def test_closing_after_unplugging(terminal: Terminal) -> None:
    async with opened(terminal) as transport:
        terminal.unplug()
        await transport.aclose()


@pytest.mark.parametrize("unsent", [False, True])
async def test_closing_may_be_cancelled_anywhere(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch, unsent: bool
) -> None:
    monkeypatch.setattr(serial_output, "DRAIN", 60)
    for steps in range(6):
        transport = await open_transport(terminal.url, arm="magician")
        if unsent:
            await transport.send(bytes(BUFFER // 2))

        closing = asyncio.create_task(transport.aclose())
        await step(steps)
        closing.cancel()
        await asyncio.wait([closing])
        if steps:
            await transport.aclose()
        else:
            monkeypatch.setattr(serial_output, "DRAIN", 0.02)
            await transport.aclose()
            monkeypatch.setattr(serial_output, "DRAIN", 60)


async def test_closing_in_a_cancelled_scope_closes_the_port(terminal: Terminal) -> None:
    transport = await open_transport(terminal.url, arm="magician")
    with anyio.CancelScope() as scope:
        scope.cancel()
        await transport.aclose()

    await transport.aclose()


async def test_nothing_of_it_is_left_in_the_loop(terminal: Terminal) -> None:
    threads = set(threading.enumerate())
    async with linked(terminal) as link:
        ours = {thread for thread in threading.enumerate() if not thread.name.startswith("asyncio_")}
        assert ours <= threads  # the loop ends its own
        call = asyncio.create_task(link.request(c.GET_POSE, None))
        await terminal.read(6)

    with pytest.raises(ConnectionLost, match="was closed"):
        await call


# serialx


@SERIALX
async def test_serialx_has_dtr_and_rts_low_as_soon_as_the_port_is_open(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pseudo-terminal has no such pins: what the system is asked for is looked at."""
    asked: list[tuple[int, int]] = []
    real = fcntl.ioctl

    def noted(descriptor: int, request: int, argument: Any = 0, *more: Any) -> Any:
        if request in {termios.TIOCMBIS, termios.TIOCMBIC, termios.TIOCMSET}:
            asked.append((request, argument[0]))

        return real(descriptor, request, argument, *more)

    monkeypatch.setattr(fcntl, "ioctl", noted)
    async with opened(terminal):
        pins = termios.TIOCM_DTR | termios.TIOCM_RTS
        assert asked == [(termios.TIOCMBIC, pins)]


@SERIALX
async def test_serialx_does_not_log_what_goes_over_the_line(
    terminal: Terminal, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("DEBUG")
    async with opened(terminal) as transport:
        await transport.send(b"hunter2")
        assert await terminal.read(7) == b"hunter2"
        await terminal.write(b"hunter3")
        assert await transport.receive()

    assert "hunter" not in caplog.text


@SERIALX
async def test_serialx_may_be_cancelled_while_the_system_opens_the_port(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(serialx_transport, "PATIENCE", 0.05)
    real, go, entered = os.open, threading.Event(), asyncio.Event()
    loop = asyncio.get_running_loop()

    def slowly(path: Any, *arguments: Any, **options: Any) -> int:
        if path == terminal.path:
            loop.call_soon_threadsafe(entered.set)
            go.wait()

        return real(path, *arguments, **options)

    monkeypatch.setattr(os, "open", slowly)
    opening = asyncio.create_task(open_transport(terminal.url, arm="magician"))
    await entered.wait()
    opening.cancel()
    await asyncio.wait([opening])
    assert opening.cancelled()

    go.set()
    while any(task.get_name() == "dobot_async open" for task in asyncio.all_tasks()):
        await step(1)

    monkeypatch.setattr(os, "open", real)
    await released(terminal)


@SERIALX
async def test_a_port_of_one_backend_is_in_use_for_the_other(terminal: Terminal) -> None:
    async with opened(terminal):
        with pytest.raises(ConnectFailed, match="is no other program using it"):
            await open_transport(f"serial://{terminal.path}?backend=pyserial", arm="magician")


# Which backend


async def test_pyserial_is_the_usual_one(terminal: Terminal) -> None:
    transport = await open_transport(f"serial://{terminal.path}", arm="magician")
    assert isinstance(transport, serial_transport.SerialTransport)
    await transport.aclose()


@pytest.mark.parametrize(("installed", "name"), [(True, "serialx"), (False, "serial")])
def test_on_windows_serialx_is_the_usual_one_if_it_is_installed(
    monkeypatch: pytest.MonkeyPatch, installed: bool, name: str
) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    if not installed:
        forget(monkeypatch, "serialx", "dobot_async.transports.serialx")

    assert serial_port.usual().__module__ == f"dobot_async.transports.{name}"


def forget(monkeypatch: pytest.MonkeyPatch, missing: str, user: str) -> None:
    """A module cannot be imported any more, and who uses it has not been yet."""
    monkeypatch.setitem(sys.modules, missing, None)
    monkeypatch.delitem(sys.modules, user, raising=False)
    monkeypatch.delattr(f"dobot_async.transports.{user.rpartition('.')[2]}", raising=False)


async def test_a_backend_that_is_not_installed_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    forget(monkeypatch, "serialx", "dobot_async.transports.serialx")
    with pytest.raises(ConnectFailed, match=r"serialx is not installed.*pip install 'dobot-async\[serialx\]'"):
        await open_transport("serial:///dev/ttyUSB0?backend=serialx", arm="magician")


async def test_another_library_in_pyserials_place_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """serialx-compat brings a serial_asyncio without what is needed of it."""
    forget(monkeypatch, "serial_asyncio", "dobot_async.transports.serial")
    monkeypatch.setitem(sys.modules, "serial_asyncio", types.ModuleType("serial_asyncio"))
    with pytest.raises(ConnectFailed, match=r"pip uninstall serialx-compat.*backend=serialx"):
        await open_transport("serial:///dev/ttyUSB0", arm="magician")


async def test_a_backend_that_there_is_not_is_wrong() -> None:
    with pytest.raises(ValueError, match="backend='usb': expected pyserial or serialx"):
        await open_transport("serial:///dev/ttyUSB0?backend=usb", arm="magician")
