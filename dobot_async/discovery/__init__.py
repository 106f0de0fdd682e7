"""Search for arms: on USB, in the Wi-Fi, over BLE and on Zenoh, all at once.

    serial ports --.
    Wi-Fi ---------+--> by identity, sorted --> (probe) --> in the order of the sources
    BLE -----------+
    Zenoh ---------'

A source that fails is told to `on_problem`, and the others go on.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Awaitable, Callable, Iterable, Mapping, Sequence
from contextlib import aclosing
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from urllib.parse import urlsplit

from dobot_async.discovery.ble import BLEModules
from dobot_async.discovery.families import FAMILIES, DiscoverableFamily
from dobot_async.discovery.found import DiscoveryProblem, DiscoverySource, Found, natural
from dobot_async.discovery.serial_ports import SerialPorts
from dobot_async.discovery.wifi import WiFiModules
from dobot_async.discovery.zenoh import ZenohArms
from dobot_async.errors import DobotError

__all__ = ["SOURCES", "DiscoveryProblem", "DiscoverySource", "Found", "discover"]

SOURCES: Mapping[str, DiscoverySource] = MappingProxyType(
    {source.name: source for source in (SerialPorts(), WiFiModules(), BLEModules(), ZenohArms(required=False))}
)
"""The sources, by name, in the order in which they tell."""

logger: logging.Logger = logging.getLogger(__name__)
PATIENCE = 5.0  # seconds that a source may need on top, to begin and to clean up


def discover(
    *,
    timeout: float = 3.0,
    sources: Iterable[str | DiscoverySource] = tuple(SOURCES),
    probe: bool = False,
    probe_timeout: float = 10.0,
    families: Iterable[DiscoverableFamily] = FAMILIES,
    on_problem: Callable[[DiscoveryProblem], None] | None = None,
) -> AsyncGenerator[Found, None]:
    """Searches for arms, and yields each once.

    The order is that of the sources, and within one that of the URLs: it does not depend on who answers first. What is
    plugged in by USB comes at once, the rest when the time is over.

    Args:
        timeout: Seconds to listen for answers.
        sources: Where to search: "serial", "wifi", "ble", "zenoh", or objects with a search of their own.
        probe: Connect to each, with reads alone, and ask who it is. Then an arm that is found in two ways, by its
            serial number, is yielded once, and all come at the end.
        probe_timeout: Seconds for each probe.
        families: Who is asked in a probe, and how.
        on_problem: Called with each source that fails; by default that is logged as a warning.

    Raises:
        ValueError: There is no source of that name, or a time is no number.
    """
    for seconds in (timeout, probe_timeout):
        if not seconds >= 0:
            raise ValueError(f"a search and a probe take seconds, not {seconds!r}")

    chosen = [named(source) if isinstance(source, str) else source for source in sources]
    search = partial(collected, timeout=timeout, tell=on_problem or log)
    if not probe:
        return in_order([partial(search, source) for source in chosen])

    return merged([partial(probed, source, search, families, probe_timeout) for source in chosen])


def named(name: str) -> DiscoverySource:
    """The source of a name."""
    if name not in SOURCES:
        raise ValueError(f"no source of arms is called {name!r}; there are: {', '.join(SOURCES)}")

    return SOURCES[name]


async def in_order(searches: Sequence[Callable[[], Awaitable[list[Found]]]]) -> AsyncGenerator[Found, None]:
    """Runs searches at once, and yields what each found, one after the other."""
    tasks = [asyncio.ensure_future(search()) for search in searches]
    try:
        for task in tasks:
            for found in await task:
                yield found
    finally:
        for task in tasks:
            task.cancel()

        await asyncio.gather(*tasks, return_exceptions=True)


async def merged(searches: Sequence[Callable[[], Awaitable[list[Found]]]]) -> AsyncGenerator[Found, None]:
    """The same, but at the end; another way to an arm that is there already is added to it."""
    arms: list[Found] = []
    async with aclosing(in_order(searches)) as found:
        async for each in found:
            twin = next((arm for arm in arms if same_arm(arm, each)), None)
            if twin:
                arms[arms.index(twin)] = replace(twin, also=(*twin.also, each.url))
            else:
                arms.append(each)

    for arm in arms:
        yield arm


def same_arm(arm: Found, other: Found) -> bool:
    """Whether two ways lead to one arm; two of the same kind never do, whatever the arms say of themselves."""
    if arm.info is None or other.info is None or not arm.info.serial_number:
        return False

    ways = {urlsplit(url).scheme for url in (arm.url, *arm.also)}
    return (
        arm.families == other.families
        and arm.info.serial_number == other.info.serial_number
        and urlsplit(other.url).scheme not in ways
    )


async def collected(
    source: DiscoverySource, *, timeout: float, tell: Callable[[DiscoveryProblem], None]
) -> list[Found]:
    """Returns what a source has found, sorted, when it has ended; tells what went wrong."""
    found: dict[str, Found] = {}
    limit = asyncio.timeout(timeout + PATIENCE)
    try:
        async with limit, aclosing(source.search(timeout)) as search:
            async for each in search:
                found[each.identity] = each
    except Exception as error:  # noqa: BLE001 - whatever breaks a source, the others go on
        message = f"it did not end within {timeout + PATIENCE:g} s" if limit.expired() else one_line(error)
        tell(DiscoveryProblem(source.name, message, error))

    return sorted(found.values(), key=lambda each: natural(each.url))


async def probed(
    source: DiscoverySource,
    search: Callable[[DiscoverySource], Awaitable[list[Found]]],
    families: Iterable[DiscoverableFamily],
    timeout: float,
) -> list[Found]:
    """Returns what a source has found, with what each arm says of itself."""
    turns = asyncio.Semaphore(source.probes_at_once)

    async def ask(found: Found) -> Found:
        async with turns:
            return await asked(found, families, timeout)

    return await asyncio.gather(*map(ask, await search(source)))


async def asked(found: Found, families: Iterable[DiscoverableFamily], timeout: float) -> Found:
    """Asks what was found who it is: as each family that it can be, until it answers."""
    problems: list[str] = []
    for family in families:
        if family.probe and family.name in found.families:
            try:
                info = await family.probe(found.url, timeout)
                return replace(found, families=(family.name,), info=info)
            except (DobotError, OSError, ValueError) as error:
                problems.append(one_line(error))

    return replace(found, problem="; ".join(problems) or "it is of a family that cannot be asked who it is")


def one_line(error: Exception) -> str:
    """What an error says, on one line."""
    return " ".join(str(error).split()) or type(error).__name__


def log(problem: DiscoveryProblem) -> None:
    """What becomes of a problem that nobody wants to hear of."""
    logger.warning("searching by %s failed: %s", problem.source, problem.message)
