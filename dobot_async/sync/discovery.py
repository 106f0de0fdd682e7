"""Search for arms, for programs without asyncio.

Written by tests/sync/write_sync.py: change what that reads, and run it again.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable

from dobot_async.discovery import SOURCES
from dobot_async.discovery import discover as async_discover
from dobot_async.discovery.families import FAMILIES, DiscoverableFamily
from dobot_async.discovery.found import DiscoveryProblem, DiscoverySource, Found
from dobot_async.sync.twin import Items, held, same

__all__ = ["discover"]


def discover(
    *,
    timeout: float = 3.0,
    sources: Iterable[str | DiscoverySource] = tuple(SOURCES),
    probe: bool = False,
    probe_timeout: float = 10.0,
    families: Iterable[DiscoverableFamily] = FAMILIES,
    on_problem: Callable[[DiscoveryProblem], None] | None = None,
) -> Generator[Found, None, None]:
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
    return held(
        Items(
            lambda: async_discover(
                timeout=timeout,
                sources=sources,
                probe=probe,
                probe_timeout=probe_timeout,
                families=families,
                on_problem=on_problem,
            ),
            same,
        )
    )
