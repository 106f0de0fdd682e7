"""Starts a bridge: the link to the arm first, then the listeners; ends it in the other order."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Collection, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeVar

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.contract import Frame
from dobot_async._core.util.tasks import run_shielded
from dobot_async.arms.bridge_adapter import BridgeAdapter
from dobot_async.bridge.families import family_of
from dobot_async.bridge.limits import Limits
from dobot_async.bridge.listeners import Listeners, open_listeners
from dobot_async.bridge.service import Bridge
from dobot_async.errors import ConnectFailed, DobotError

__all__ = ["bridge"]

F = TypeVar("F", bound=Frame)


@asynccontextmanager
async def bridge(
    arm_url: str,
    *,
    listen: str | Sequence[str] = "tcp://127.0.0.1:0",
    token: str | None = None,
    takeover: bool = False,
    on_vanish: Literal["stop", "leave"] = "stop",
    deny: Collection[str] = (),
    certificate: str | Path | None = None,
    key: str | Path | None = None,
    origins: Collection[str] = (),
    limits: Limits | None = None,
    family: str = "magician",
    timeout: float = 5.0,
) -> AsyncGenerator[Bridge[Any]]:
    """Gives an arm to programs on a network for the length of a block.

    Args:
        arm_url: The arm, on any transport.
        listen: Where programs reach it: `tcp://host:port`, `udp://host:port`, `ws://host:port`, `pty`; or several of
            them. Port 0 takes a free one. An ultraArm cannot be reached by udp.
        token: What clients have to present. Where it listens on more than this computer's own addresses there is
            always one: it is made up if none is given.
        takeover: Whoever writes takes the lease from who has it; else the first one keeps it.
        on_vanish: "stop" stops the arm if its mover goes in the middle of a motion; "leave" lets it finish.
        deny: Groups of commands that nobody may send: for a Magician "wifi", "calibration", "firmware".
        certificate: PEM file with the certificate for TLS on tcp and ws.
        key: PEM file with its key, if that is not in the same file.
        origins: Web pages, as `https://host`, that may connect by ws without a token.
        limits: What one client may do.
        family: Which arm it is: a name of `FAMILIES`.
        timeout: Seconds until the arm must have answered.

    Raises:
        ValueError: An argument is wrong.
        ConnectFailed: No arm answered, or it cannot listen there.
    """
    known = family_of(family)
    unknown = set(deny) - known.deny_groups.keys()
    if unknown or on_vanish not in {"stop", "leave"}:
        raise ValueError(f'expected deny to be of {", ".join(known.deny_groups)}, and on_vanish "stop" or "leave"')

    limits = limits or Limits()
    listeners = Listeners.of([listen] if isinstance(listen, str) else listen, token, certificate, key, origins)
    if known.in_order and any(place.scheme == "udp" for place in listeners.places):
        raise ValueError(
            f"{family} cannot be bridged to udp: nothing but their order tells whose its answers are, and datagrams "
            "have none; listen at tcp, ws, zenoh or pty"
        )

    async with AsyncExitStack() as stack:
        link = await linked(arm_url, known, timeout)
        running: Bridge[Any] = Bridge(
            link,
            known,
            takeover=takeover,
            on_vanish=on_vanish,
            denied={each for group in deny for each in known.deny_groups[group]},
            limits=limits,
        )
        stack.push_async_callback(lambda: run_shielded(running.aclose()))
        await greet(running.link, known, timeout)
        running.urls = await open_listeners(listeners, running, stack, running.turned_away)
        running.token = listeners.token
        stack.callback(running.end)
        yield running


async def linked(url: str, family: BridgeAdapter[F], timeout: float) -> Link[F]:
    """Opens the link to the arm, which reopens itself if it breaks."""
    transport = await family.open(url, timeout)
    # `ble:` may be any arm at first, but not another one later.
    again = partial(family.open, getattr(transport, "url", url), timeout)
    parser = family.parser()
    link = Link(transport, parser, family.encode, url=url, barriers=family.barriers, filler=family.filler, reopen=again)
    family.attach(link, parser)
    return link


async def greet(link: Link[F], family: BridgeAdapter[F], timeout: float) -> None:
    """Proves that an arm answers."""
    frame = family.greeting
    try:
        await link.exchange(
            frame, partial(family.accept, frame), name=family.name(frame), timeout=timeout, repeatable=True
        )
    except DobotError as error:
        raise ConnectFailed(f"no arm answers at {link.url}; is it switched on, and is this its address?") from error
