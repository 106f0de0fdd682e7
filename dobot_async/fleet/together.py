"""Batches on several arms that start at one instant.

    join --> request --> measure --> pause --> load --> release each, earlier by what its link takes --> rest --> skew

Nobody else commands the arms meanwhile, and each step is bound to the epochs in which the block began: a stop of one of
the arms ends the start of all.

An arm begins about half a round trip after its release was sent, and tells so half a round trip later. So the releases
are sent half a round trip before the common instant, and the start that is reported lies in the middle between release
and answer; `uncertainty` is how far it may be off.
"""

from __future__ import annotations

import asyncio
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.motion import Motion
from dobot_async.errors import MotionStopped, another
from dobot_async.fleet.admission import admit_together, turns
from dobot_async.fleet.concurrent import on_the_way_out, run_concurrently
from dobot_async.fleet.fleet_arm import FleetArm
from dobot_async.fleet.zones import Zones

__all__ = ["Start", "SynchronizedStart", "Together", "abandon"]


class CollectedBatch(Protocol):
    """A batch, as far as its start is concerned."""

    @property
    def motions(self) -> list[Motion]:
        """What it has collected."""
        ...


B = TypeVar("B", bound=CollectedBatch)
SAMPLES = 7
PLENTY = 1000  # commands that a queue on this side takes
LEAD = 0.003  # seconds from the decision to the first release, for all to be ready to send


@dataclass(frozen=True, slots=True)
class Start:
    """How well several arms started together, as their links tell.

    Attributes:
        at: When each arm started, in the loop's seconds.
        latency: Seconds that a release takes to each arm, as measured before.
        uncertainty: Seconds by which a start may be off.
    """

    at: Mapping[str, float]
    latency: Mapping[str, float]
    uncertainty: float

    @property
    def skew(self) -> float:
        """Seconds between the first and the last start."""
        return max(self.at.values()) - min(self.at.values())


@dataclass(eq=False)
class Together(Generic[B]):
    """The batches of several arms, by name; each verb returns its Motion, to be awaited after the block.

    Attributes:
        start: How they started, once the block has ended.
    """

    batches: Mapping[str, B]
    start: Start | None = field(default=None)

    def __getitem__(self, name: str) -> B:
        return self.batches[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.batches)

    def __len__(self) -> int:
        return len(self.batches)

    @property
    def skew(self) -> float:
        """Seconds between the first and the last start.

        Raises:
            RuntimeError: The block has not ended yet.
        """
        if self.start is None:
            raise RuntimeError("the arms start when the block ends")

        return self.start.skew

    async def wait(self) -> None:
        """Returns when all motions are done; raises the first failure when all have ended."""
        await run_concurrently(
            {name: wait_for(batch) for name, batch in self.batches.items()}, ends=lambda _name, _error: False
        )


async def wait_for(batch: CollectedBatch) -> None:
    """Waits for all motions of a batch."""
    for motion in list(batch.motions):
        await motion


def abandon(batches: Mapping[str, CollectedBatch]) -> None:
    """Ends the Motions of batches that were not sent."""
    for batch in batches.values():
        for motion in batch.motions:
            if motion.call is None:
                motion.end(MotionStopped("it was not sent: the block that starts the arms together ended by an error"))


@dataclass(frozen=True, slots=True)
class SynchronizedStart:
    """A start under way.

    Attributes:
        fleet_arms: The arms.
        batches: What each is to do.
        epochs: Those of the arms in which the block began.
        zones: The zones of the cell.
        timeout: Seconds for the arms to finish what they do, for the zones, and for room in their queues.
    """

    fleet_arms: Mapping[str, FleetArm]
    batches: Mapping[str, CollectedBatch]
    epochs: Mapping[str, Epoch]
    zones: Zones
    timeout: float | None

    def check(self) -> None:
        """Raises MotionStopped if one of the arms was stopped since the block began."""
        for name, fleet_arm in self.fleet_arms.items():
            fleet_arm.check()
            self.epochs[name].check()

    async def run(self) -> Start:
        """Loads the batches, and starts them at one instant; a failure or a cancellation lets none of them go on.

        Raises:
            DobotError: As `put_all` does; the arms were stopped.
        """
        fleet_arms = self.fleet_arms
        self.check()
        async with turns(fleet_arms):
            self.check()
            await run_concurrently({name: fleet_arm.queue.join(self.timeout) for name, fleet_arm in fleet_arms.items()})
            self.check()
            motions = {name: self.batches[name].motions for name in fleet_arms}
            for fleet_arm in fleet_arms.values():
                fleet_arm.quiet(True)  # what is admitted cannot be watched before it is sent

            try:
                await admit_together(fleet_arms, motions, self.zones, self.timeout)
                self.check()
                latency = await run_concurrently({name: measure(fleet_arm) for name, fleet_arm in fleet_arms.items()})
                return await self._start(latency)
            except BaseException as error:
                abandon(self.batches)  # before anybody watches them
                await on_the_way_out(error, give_up(fleet_arms))
                raise
            finally:
                self._watch()

    async def _start(self, latency: Mapping[str, float]) -> Start:
        """Loads what the arms take while they are paused, starts them, and sends the rest."""
        fleet_arms = self.fleet_arms
        try:
            pausing = {name: fleet_arm for name, fleet_arm in fleet_arms.items() if fleet_arm.family.pauses}
            await run_concurrently({name: fleet_arm.queue.pause() for name, fleet_arm in pausing.items()})
            rooms = await run_concurrently({name: room(fleet_arm) for name, fleet_arm in pausing.items()})
            first: dict[str, Sequence[Motion]] = {}
            rest: dict[str, Sequence[Motion]] = {}
            for name in fleet_arms:
                motions = self.batches[name].motions
                loaded = max(1, rooms.get(name, 1) - 1)
                first[name], rest[name] = motions[:loaded], motions[loaded:]

            await run_concurrently({name: self._put(name, first[name]) for name in pausing})
            self.check()
            instant = asyncio.get_running_loop().time() + LEAD + max(latency.values())
            told = await run_concurrently(
                {name: self._release(name, instant - latency[name], first[name]) for name in fleet_arms}
            )
        finally:
            self._watch()

        await run_concurrently({name: self._put(name, more) for name, more in rest.items() if more})
        at = {name: (sent + answered) / 2 for name, (sent, answered) in told.items()}
        return Start(at, latency, max(answered - sent for sent, answered in told.values()) / 2)

    def _watch(self) -> None:
        """Has the arms watched again."""
        for fleet_arm in self.fleet_arms.values():
            fleet_arm.quiet(False)

    async def _put(self, name: str, motions: Sequence[Motion]) -> None:
        """Sends motions that were admitted."""
        await self.fleet_arms[name].queue.put_admitted(motions, self.timeout, self.epochs[name])

    async def _release(self, name: str, when: float, motions: Sequence[Motion]) -> tuple[float, float]:
        """Starts one arm at a time; returns when that was sent, and when it was answered."""
        loop = asyncio.get_running_loop()
        await asyncio.sleep(when - loop.time())
        self.check()
        sent = loop.time()
        if self.fleet_arms[name].family.pauses:
            await self.fleet_arms[name].queue.resume()
        else:
            await self._put(name, motions)

        return sent, loop.time()


async def room(fleet_arm: FleetArm) -> int:
    """Returns how many commands an arm takes while it is paused."""
    return await fleet_arm.arm.request(fleet_arm.family.room, None) if fleet_arm.family.room else PLENTY


async def measure(fleet_arm: FleetArm) -> float:
    """Returns how many seconds a message takes to an arm: half of a typical round trip."""
    loop = asyncio.get_running_loop()
    trips: list[float] = []
    for _ in range(SAMPLES):
        asked = loop.time()
        await fleet_arm.arm.request(fleet_arm.family.ask, None)
        trips.append(loop.time() - asked)

    return statistics.median(trips) / 2


async def give_up(fleet_arms: Mapping[str, FleetArm]) -> list[str]:
    """Stops arms that were to start, so that what was loaded does not run later.

    Returns:
        Of which arms it is not known whether they stand.
    """
    for fleet_arm in fleet_arms.values():
        fleet_arm.tell_to_stop()

    error = MotionStopped("the start of several arms together was given up")
    stops = [(fleet_arm, fleet_arm.begin_stop(another(error))) for fleet_arm in fleet_arms.values()]
    heard = await asyncio.gather(*(fleet_arm.stop_heard(stop) for fleet_arm, stop in stops))
    return [problem for problem in heard if problem]
