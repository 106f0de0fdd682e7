"""The way to an arm of the myCobot family, and what may be wrong with it."""

from __future__ import annotations

import asyncio
from urllib.parse import urlsplit

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.transport import Transport
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.channel import Channel
from dobot_async.arms.mycobot.frame import Frame
from dobot_async.arms.mycobot.models import CobotModel
from dobot_async.arms.mycobot.stopping import stop_until_still
from dobot_async.arms.session import open_in_time
from dobot_async.errors import ConnectFailed, ConnectionLost, ProtocolError
from dobot_async.traces.replay import recorded_times
from dobot_async.transports.paced import Paced

__all__ = ["BARRIERS", "GAP", "greet", "opened", "reply_times", "with_baud"]

GAP = 0.02  # seconds; an M5 that is given frames more closely loses them

USUAL, PATIENT = (0.05, 0.5), (0.7, 1.5)
"""Least and most seconds until a request is sent again. The vendor's TCP server writes to the arm what one of its reads
gave, and then waits up to 0.5 s for one answer: two requests at a time, and all later answers come one too late."""

BARRIERS = (
    c.IS_POWER_ON,
    c.IS_CONTROLLER_CONNECTED,
    c.IS_FREE_MODE,
    c.GET_SPEED,
    c.GET_REFERENCE_FRAME,
    c.GET_MOVEMENT_TYPE,
    c.GET_END_TYPE,
)
"""Cheap reads of all models, used as barriers: the answer to one proves that earlier requests will not be answered."""


def reply_times(url: str) -> tuple[float, float]:
    """Return the least and the most seconds until a request to a URL is sent again, by default."""
    return recorded_times(url) or (PATIENT if urlsplit(url).scheme == "tcp" else USUAL)


async def opened(url: str, model: str, timeout: float, gap: float) -> Transport:
    """Open the way to an arm; what goes out on it is paced."""
    return Paced(await open_in_time(url, model, timeout), gap)


def with_baud(url: str, baud: int) -> str:
    """Return a serial URL with the model's baud rate, unless it has one of its own or the rate is the usual one."""
    parts = urlsplit(url)
    if parts.scheme != "serial" or "baud=" in parts.query or baud == 115200:
        return url

    return f"{url}{'&' if parts.query else '?'}baud={baud}"


async def greet(channel: Channel, timeout: float, *, stop: bool) -> None:
    """Prove that an arm answers, and as its model does, and stop it if that is wanted.

    Raises:
        ConnectFailed: It does not; the message says what to check.
    """
    powered = None
    try:
        async with asyncio.timeout(timeout):
            powered = await channel.ask(c.IS_POWER_ON, None, timeout=timeout)
            if powered:
                await channel.ask(c.GET_ANGLES, None)

            if stop:
                await stop_until_still(channel)
    except (TimeoutError, ProtocolError, ConnectionLost) as error:
        raise (silent if powered is None else unlike)(channel.link, channel.model) from error


def silent(link: Link[Frame], model: CobotModel) -> ConnectFailed:
    """Return why no arm answered, as far as what came instead tells."""
    advice = (
        "is the M5 in its base set by hand to the menu Transponder, and there to USB UART; is the arm switched on; and "
        "is this its port?"
    )
    if link.stats.junk_bytes:
        return ConnectFailed(
            f"{link.url} sends {link.stats.junk_bytes} bytes that are no answer of a {model.title}; is the baud rate "
            f"right ({model.baud} for this model), {advice}"
        )

    return ConnectFailed(f"no {model.title} answers at {link.url}; {advice}")


def unlike(link: Link[Frame], model: CobotModel) -> ConnectFailed:
    """Return why an arm that answers is not the one that was expected."""
    return ConnectFailed(
        f"an arm answers at {link.url}, but not as a {model.title} with {model.joints} joints does "
        f"({link.stats.junk_bytes} bytes fit none of its answers); is the model right?"
    )
