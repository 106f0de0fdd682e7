"""Where programs that run side by side wait for each other, and fail together if one of them does not come."""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import partial

from dobot_async._core.queue.epoch import Epoch
from dobot_async.errors import ReplyTimeout
from dobot_async.fleet.errors import BarrierBroken, ZoneDeadlock
from dobot_async.fleet.zone_locks import ProgramWait, ZoneHolder, ZoneLocks
from dobot_async.fleet.zones import FleetProgram

__all__ = ["Barriers"]


@dataclass(eq=False)
class Gathering:
    """Those who wait at one barrier.

    Attributes:
        parties: Who is to come.
        waiting: One for each who has come, and as which program of the run, if it is of one.
        broken: Why nobody gets past any more.
    """

    parties: frozenset[str]
    waiting: dict[asyncio.Future[str], ZoneHolder | None] = field(
        default_factory=dict[asyncio.Future[str], ZoneHolder | None]
    )
    broken: str = ""

    def absent(self, run: Mapping[str, ZoneHolder], arrived: asyncio.Future[str]) -> list[ZoneHolder]:
        """Who of a run keeps one who has come from going on."""
        if arrived.done():
            return []

        come = set(self.waiting.values())
        return [run[name] for name in sorted(self.parties & run.keys()) if run[name] not in come]

    def open(self, why_not: str = "") -> None:
        """Tells all who have come that they may go on, or why not, and is ready for the next time."""
        waiting, self.waiting = self.waiting, {}
        for each in waiting:
            if not each.done():
                each.set_result(why_not)

    def end(self, why: str) -> None:
        """Fails all who wait, and all who come."""
        self.broken = self.broken or why
        self.open(self.broken)


class Barriers:
    """The barriers of a fleet, by name.

    Args:
        locks: Where it is found out who would wait for himself.
    """

    def __init__(self, locks: ZoneLocks) -> None:
        self._locks = locks
        self._gatherings: dict[tuple[int, str], Gathering] = {}
        self._gone: dict[tuple[int, str], str] = {}

    async def wait(
        self,
        name: str,
        parties: Collection[str],
        program: FleetProgram,
        arms: frozenset[ZoneHolder],
        timeout: float | None,
        epoch: Epoch,
    ) -> None:
        """Returns when as many have come as there are parties.

        Args:
            name: Of the barrier, in the run of the program.
            parties: The names of those who are to come.
            program: Who comes.
            arms: Those that wait for its command.
            timeout: Seconds.
            epoch: That of the fleet.

        Raises:
            MotionStopped: The fleet was stopped meanwhile.
            ValueError: It was reached with other parties before.
            BarrierBroken: One of them failed, ended or gave up.
            ZoneDeadlock: One of them waits, in the end, for what this program holds.
            ReplyTimeout: They did not all come in time; for the others it is broken.
        """
        program.check()
        part = program.part()
        run = part.run if part else None
        gathering = self._gatherings.setdefault((id(run), name), Gathering(frozenset(parties)))
        if gathering.parties != frozenset(parties):
            raise ValueError(f"barrier {name!r} is for {words(gathering.parties)}, not for {words(parties)}")

        for party in sorted(gathering.parties):
            for gone in ((id(run), party), (id(None), party)):
                if gone in self._gone:
                    gathering.end(self._gone[gone])

        check(name, gathering.broken)
        arrived: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        gathering.waiting[arrived] = part.holder if part else None
        absent = partial(gathering.absent, run.holders if run else {}, arrived)
        pause = ProgramWait(f"at barrier {name!r} for", program.holder, arms | {program.holder}, absent)
        try:
            if len(gathering.waiting) == len(gathering.parties):
                gathering.open()

            with self._locks.pausing(pause):
                async with asyncio.timeout(timeout):
                    why_not = await arrived
        except ZoneDeadlock:
            del gathering.waiting[arrived]  # it may come again, with empty hands
            raise
        except BaseException as error:
            if arrived in gathering.waiting:
                del gathering.waiting[arrived]
                gathering.end("a partner gave up waiting")

            if isinstance(error, TimeoutError):
                raise ReplyTimeout(f"not all came to barrier {name!r} within {timeout:.3g} s") from None

            raise

        epoch.check()
        check(name, why_not)

    def stop(self) -> None:
        """Ends all waiting, as the fleet was stopped; who comes later begins anew."""
        for gathering in self._gatherings.values():
            gathering.open("the fleet was stopped")

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
