"""The way to an ultraArm, and why it may not answer."""

from __future__ import annotations

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.util.urls import hidden
from dobot_async.arms.session import open_in_time
from dobot_async.arms.ultraarm.frame import Frame
from dobot_async.errors import ConnectFailed

__all__ = ["opened", "silent"]


async def opened(url: str, timeout: float) -> Transport:
    """Open the transport in time, for one request at a time: nothing in an answer tells whose it is."""
    transport = await open_in_time(url, "ultraarm", timeout)
    if transport.reorder_window:
        await transport.aclose()
        raise ValueError(
            f"{hidden(url)!r}: an ultraArm needs a link that neither doubles nor reorders, such as serial: or tcp:"
        )

    transport.in_flight = transport.window = 1
    return transport


def silent(link: Link[Frame]) -> ConnectFailed:
    """Return why no arm answered."""
    return ConnectFailed(
        f"no ultraArm answers at {link.url}; is the arm switched on, is this its port, does it run at 115200 baud, and "
        "does its firmware know M120 (QUEUE SIZE), which the oldest does not?"
    )
