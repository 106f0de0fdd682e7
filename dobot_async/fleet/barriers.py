"""Where programs that run side by side wait for each other, and fail together if one of them does not come."""

from __future__ import annotations

import asyncio
from collections.abc import Collection
from dataclasses import dataclass, field

from dobot_async.errors import ReplyTimeout
from dobot_async.fleet.errors import BarrierBroken

__all__ = ["Barriers"]


@dataclass(eq=False)
class Gathering:
    """Those who wait at one barrier.

    Attributes:
        parties: Who is to come.
        waiting: One for each who has come.
        broken: Why nobody gets past any more.
    """

    parties: frozenset[str]
    waiting: list[asyncio.Future[str]] = field(default_factory=list)
    broken: str = ""

    def open(self, why_not: str = "") -> None:
        """Tells all who have come that they may go on, or why not, and is ready for the next time."""
        waiting, self.waiting = self.waiting, []
        for each in waiting:
            if not each.done():
                each.set_result(why_not)

    def end(self, why: str) -> None:
        """Fails all who wait, and all who come."""
        self.broken = self.broken or why
        self.open(self.broken)


class Barriers:
    """The barriers of a fleet, by name."""

    def __init__(self) -> None:
        self._gatherings: dict[tuple[int, str], Gathering] = {}
        self._gone: dict[tuple[int, str], str] = {}

    async def wait(self, name: str, parties: Collection[str], *, run: object = None, timeout: float | None) -> None:
        """Returns when as many have come as there are parties.

        Raises:
            ValueError: It was reached with other parties before.
            BarrierBroken: One of them failed, ended or gave up.
            ReplyTimeout: They did not all come in time; for the others it is broken.
        """
        key = (id(run), name)
        gathering = self._gatherings.setdefault(key, Gathering(frozenset(parties)))
        if gathering.parties != frozenset(parties):
            raise ValueError(f"barrier {name!r} is for {words(gathering.parties)}, not for {words(parties)}")

        for party in sorted(gathering.parties):
            for gone in ((id(run), party), (id(None), party)):
                if gone in self._gone:
                    gathering.end(self._gone[gone])

        check(name, gathering.broken)
        arrived: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        gathering.waiting.append(arrived)
        if len(gathering.waiting) == len(gathering.parties):
            gathering.open()

        try:
            async with asyncio.timeout(timeout):
                why_not = await arrived
        except BaseException as error:
            if arrived in gathering.waiting:
                gathering.waiting.remove(arrived)
                gathering.end("a partner gave up waiting")

            if isinstance(error, TimeoutError):
                raise ReplyTimeout(f"not all came to barrier {name!r} within {timeout:.3g} s") from None

            raise

        check(name, why_not)

    def leave(self, party: str, why: str, *, run: object = None) -> None:
        """Takes note that somebody will come to no barrier any more."""
        self._gone[id(run), party] = why
        for (where, _), gathering in self._gatherings.items():
            if where == id(run) and party in gathering.parties and gathering.waiting:
                gathering.end(why)

    def fail(self, arm: str, why: str) -> None:
        """Breaks all barriers that wait for an arm, whoever runs it."""
        for gathering in self._gatherings.values():
            if arm in gathering.parties:
                gathering.end(why)

        self._gone[id(None), arm] = why

    def join(self, arm: str) -> None:
        """Takes note that an arm works again."""
        self._gone.pop((id(None), arm), None)

    def forget(self, run: object = None) -> None:
        """Forgets the barriers of a run that is over, or those outside of all runs."""
        for table in (self._gatherings, self._gone):
            for key in [key for key in table if key[0] == id(run)]:
                del table[key]


def check(name: str, broken: str) -> None:
    """Raises BarrierBroken if there is a reason."""
    if broken:
        raise BarrierBroken(f"nobody gets past barrier {name!r}: {broken}")


def words(parties: Collection[str]) -> str:
    """Names in order."""
    return ", ".join(sorted(parties))
