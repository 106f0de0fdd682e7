"""`serial:` URLs, by one of two libraries: pyserial with pyserial-asyncio, or serialx.

serialx is an extra. Without `?backend=` it is taken on Windows alone, if it is installed: there pyserial-asyncio can
only look again and again whether something has come.
"""

from __future__ import annotations

import sys
from collections.abc import Awaitable, Callable
from urllib.parse import SplitResult

from dobot_async._core.protocol.transport import Transport
from dobot_async.errors import ConnectFailed
from dobot_async.transports.options import Option, number, options

__all__ = ["BACKENDS", "open_url"]

BAUD = 115200
Open = Callable[[str, int], Awaitable[Transport]]


def pyserial() -> Open:
    """Return what opens a port by pyserial-asyncio."""
    try:
        from dobot_async.transports.serial import open_port  # noqa: PLC0415 - serialx does without it
    except (ImportError, RuntimeError, AttributeError) as error:
        raise ConnectFailed(
            f"pyserial cannot be used here: {error}; if serialx-compat is installed, which puts itself in its place: "
            "pip uninstall serialx-compat, then pip install --force-reinstall pyserial pyserial-asyncio; or use "
            "?backend=serialx"
        ) from error

    return open_port


def serialx() -> Open:
    """Return what opens a port by serialx."""
    try:
        from dobot_async.transports.serialx import open_port  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise ConnectFailed(
            f"{error.name or error} is not installed, and backend=serialx needs it: pip install 'dobot-async[serialx]'"
        ) from error

    return open_port


BACKENDS: dict[str, Callable[[], Open]] = {"pyserial": pyserial, "serialx": serialx}


def backend(word: str) -> str:
    """Return the name of a backend; raise ValueError for what is none."""
    if word not in BACKENDS:
        raise ValueError

    return word


OPTIONS = {
    "baud": number(int, "bits per second", least=50, most=12_000_000),
    "backend": Option(backend, " or ".join(BACKENDS)),
}


async def open_url(url: SplitResult, *, arm: str) -> Transport:  # noqa: ARG001 - for `sim:`
    """Open `serial:///dev/ttyUSB0` or `serial://COM3`.

    `?baud=` is for arms that do not speak at 115200; `?backend=` is pyserial or serialx.

    Raises:
        ValueError: The URL is none.
        ConnectFailed: The port cannot be opened, or the library is not installed.
    """
    path = url.netloc + url.path
    given = options(url, OPTIONS)
    if not path:
        raise ValueError("expected serial:///dev/ttyUSB0 or serial://COM3")

    open_port = BACKENDS[given["backend"]]() if "backend" in given else usual()
    try:
        return await open_port(path, given.get("baud", BAUD))
    except (OSError, ValueError) as error:
        raise ConnectFailed(
            f"cannot open {path}: {error}; is the arm plugged in, is this its port, may this user open it "
            "(group dialout), and is no other program using it?"
        ) from error


def usual() -> Open:
    """Return the backend of this system."""
    if sys.platform == "win32":
        try:
            return serialx()
        except ConnectFailed:
            pass

    return pyserial()
