"""Arms that are served on Eclipse Zenoh: each has a liveliness token with its name and model."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import suppress
from typing import TYPE_CHECKING

from dobot_async.discovery.found import Found
from dobot_async.errors import ConnectFailed
from dobot_async.transports.zenoh.config import NAME, address

if TYPE_CHECKING:
    import zenoh

__all__ = ["ZenohArms"]


class ZenohArms:
    """Finds arms on Zenoh, as far as this computer's session of Zenoh sees.

    Args:
        config: A configuration file of Zenoh's.
        connect: Endpoints to connect to, such as `tcp/192.168.1.20:7447`; without them Zenoh looks for others by
            multicast.
        required: Whether it is a failure that the package eclipse-zenoh is not installed; else nothing is found.
    """

    name = "zenoh"
    probes_at_once = 8

    def __init__(self, config: str | None = None, connect: tuple[str, ...] = (), *, required: bool = True) -> None:
        self._config = config
        self._connect = connect
        self._required = required

    async def search(self, timeout: float) -> AsyncGenerator[Found, None]:
        """Yields each arm that is there, or appears meanwhile.

        Raises:
            ValueError: The configuration is no good.
            ConnectFailed: There is no Zenoh, or it cannot be started.
        """
        from dobot_async.transports.zenoh.config import ZenohConfig, library
        from dobot_async.transports.zenoh.session import KeyExpressions, ZenohSession

        try:
            library()
        except ConnectFailed:
            if self._required:
                raise

            return

        end = asyncio.get_running_loop().time() + timeout
        arrived: asyncio.Queue[str] = asyncio.Queue()
        session = ZenohSession(ZenohConfig("*", self._config, self._connect))

        def begin(opened: zenoh.Session) -> None:
            put = library().SampleKind.PUT
            opened.liveliness().declare_subscriber(
                f"{KeyExpressions('*').arm}/*/*",
                session.crossing.to(
                    arrived.put_nowait, lambda sample: str(sample.key_expr) if sample.kind == put else ""
                ),
                history=True,
            )

        try:
            await session.open(begin)
            while key := await next_of(arrived, end):
                if found := self._found(key):
                    yield found
        finally:
            await session.aclose()

    def _found(self, key: str) -> Found | None:
        """What a token says: dobot/NAME/@arm/MODEL/ID; None for what is no arm that anybody can connect to.

        Anybody may declare a token, and may put into it what a terminal obeys.
        """
        _, name, _, model, server = key.split("/")
        if not all(map(NAME.fullmatch, (name, model, server))):
            return None

        url = address(name, config=self._config, connect=self._connect)
        return Found(url, self.name, f"{name} {server}", "served on Zenoh", families=(model,))


async def next_of(arrived: asyncio.Queue[str], until: float) -> str | None:
    """Returns the next key, None if there is none until a time of the loop."""
    with suppress(TimeoutError):
        async with asyncio.timeout_at(until):
            while not (key := await arrived.get()):
                pass

            return key

    return None
