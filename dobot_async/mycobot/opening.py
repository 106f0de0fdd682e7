"""The way to an arm of the myCobot family, and what may be wrong with it."""

from __future__ import annotations

from urllib.parse import urlsplit

from dobot_async._core.link.link import Link
from dobot_async.arms.session import open_in_time
from dobot_async.errors import ConnectFailed
from dobot_async.mycobot.frame import Frame
from dobot_async.mycobot.models import CobotModel
from dobot_async.transports import Transport
from dobot_async.transports.paced import Paced

__all__ = ["GAP", "opened", "silent", "unlike", "with_baud"]

GAP = 0.02  # seconds; an M5 that is given frames more closely loses them


async def opened(url: str, model: str, timeout: float, gap: float) -> Transport:
    """Open the way to an arm; what goes out on it is paced."""
    return Paced(await open_in_time(url, model, timeout), gap)


def with_baud(url: str, baud: int) -> str:
    """Return a serial URL with the model's baud rate, unless it has one of its own or the rate is the usual one."""
    parts = urlsplit(url)
    if parts.scheme != "serial" or "baud=" in parts.query or baud == 115200:
        return url

    return f"{url}{'&' if parts.query else '?'}baud={baud}"


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
