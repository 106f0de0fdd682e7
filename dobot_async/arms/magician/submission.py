"""How a Magician is given queued commands, each exactly once, whatever the link does; see docs/exactly-once.md.

    submit --> sent --acknowledged with the next index--> taken
                 `----lost, or its acknowledgement--> reconcile: count by reading, then probe --> taken
                                                                                              |-> not taken: sent again
                                                                                              `-> MotionUnknown
Manual 2.2.1 (3), 2.19.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from dobot_async._core.link.correlator import Request
from dobot_async._core.link.link import Link
from dobot_async._core.protocol.wire import Command, Number, u64
from dobot_async._core.queue.executor import Entry, MotionSource, alarmed
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.hooks import Hooks
from dobot_async._core.util.tasks import Cleanup
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import Alarm, faults
from dobot_async.arms.magician.datagrams import DatagramGuard, Surplus
from dobot_async.arms.magician.frame import Frame
from dobot_async.arms.magician.free_slots import QueueSpace
from dobot_async.arms.magician.keeping import MagicianKeeper
from dobot_async.arms.magician.ledger import QueueLedger, Resolution, UnackedCommand
from dobot_async.arms.magician.reach import is_relative
from dobot_async.arms.magician.status import GARBAGE, SILENCE, ArmStatus
from dobot_async.errors import MotionUnknown, ProtocolError, ReplyTimeout

__all__ = ["Submission", "Surplus"]

Q = TypeVar("Q")
INDEX: Number[int] = Number(u64)
PROBES = 60  # in a row, none acknowledged although the arm answers what it is asked
FULL_PAUSE = 0.005  # seconds between two looks at a full queue
SERIAL = 64  # commands that are sent one at a time after one of a window was not acknowledged


class Submission:
    """The part of `MagicianExecutor` that gives commands to the arm.

    Attributes:
        status: What the arm says of itself.
        ledger: What it has taken.
        space: How much room it has.
        keeper: See `Executor`.
    """

    keeper: MagicianKeeper | None = None

    def __init__(self, link: Link[Frame], window: int, check: Callable[[Any], None]) -> None:
        self.cleanup: Cleanup = link.cleanup
        self.on_unknown: Hooks[[MotionUnknown]] = Hooks()
        self.on_motion: Hooks[[Motion]] = Hooks()
        self.status: ArmStatus = ArmStatus(link, self._restarted)
        self.ledger: QueueLedger = QueueLedger()
        self.space: QueueSpace = QueueSpace(self.status)
        self._link = link
        self._window = window
        self._check = check
        self._heard = -1  # the highest index that was acknowledged: another one is late, or a copy
        self._serial_left = 0
        self._relative: str | None = None  # what was queued since the arm was idle and must not run twice
        self._guard = DatagramGuard(self, link)
        link.on_unsolicited.add(self._unsolicited)

    @property
    def _datagrams(self) -> DatagramGuard | None:
        return self._guard if self._link.reorder_window else None

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Return a checked and encoded command."""
        frame = self._link.frame(command, value, queued=True)
        self._check(value)
        return Entry(command, value, frame)

    async def submit(self, source: MotionSource) -> None:
        """Queue commands in order; see `Executor`."""
        while source or self.ledger.unacked:
            await self._reconcile(source)
            if source:
                await self._await_room()

            if source:
                await (self._submit_one if self._window == 1 or self._serial_left else self._submit_window)(source)

    async def alarms(self) -> Sequence[Alarm]:
        """Return the alarms that keep the arm from moving. Manual 2.5.1."""
        return faults(await self.status.alarms())

    async def _await_room(self) -> None:
        """Return when the arm's queue has room and the ledger is open. Manual 2.19.8."""
        await self.status.check_outage(self.ledger.highest)
        while not self.space.room or self.ledger.last is None:
            if not self.space.room and not await self.space.read():
                if blocking := await self.alarms():
                    raise alarmed(blocking)

                await asyncio.sleep(FULL_PAUSE)
            elif self.ledger.last is None:
                await self._open()

    async def _submit_one(self, source: MotionSource) -> None:
        """Send one command, and find out whether the arm took it."""
        if self._datagrams:
            await self._datagrams.before_command()

        await self._link.turn()
        async with self._link.slot("a queued command", SILENCE):
            if not source:
                return

            request = await self._post(source.take())
            answered = await self._settle(request)

        if answered:
            self._enter(self.ledger.acknowledge(request.value), source)
            self._serial_left = max(0, self._serial_left - 1)
        else:
            await self._reconcile(source)

    async def _submit_window(self, source: MotionSource) -> None:
        """Send commands, at most `window` of them unacknowledged, with something to read behind each window's length.

        An acknowledgement does not say whose it is: with one command lost, the next one's would pass for it. But this
        checkpoint is answered behind them all, so that the highest index by then says how many the arm took.
        """
        sent: deque[tuple[Request[Frame], int]] = deque()  # with the number of commands that a checkpoint confirms
        unchecked = 0
        while True:
            while source and self.space.room and sum(not r.outcome for r, count in sent if not count) < self._window:
                await self._link.turn()
                if not source:
                    break

                sent.append((await self._post(source.take()), 0))
                unchecked += 1
                if unchecked == self._window:
                    break

            if unchecked == self._window or (unchecked and not (source and self.space.room)):
                question = self._link.frame(c.GET_QUEUED_CMD_LEFT_SPACE, None)
                sent.append((await self._link.send(question, self._checkpoint), unchecked))
                unchecked = 0

            if not sent:
                return

            request, count = sent.popleft()
            await self._settle(request)
            if count and not self._confirm(request, count, source, sum(not n for _, n in sent)):
                for request, _ in sent:
                    await self._settle(request)

                self._serial_left = SERIAL
                return

    def _checkpoint(self, frame: Frame) -> tuple[int, int]:
        """What the answer to a checkpoint says: the highest index acknowledged before it, and the left space."""
        return self._heard, c.GET_QUEUED_CMD_LEFT_SPACE.reply.decode(frame.params)

    def _confirm(self, request: Request[Frame], count: int, source: MotionSource, sent_since: int) -> bool:
        """Enter the commands before a checkpoint; return False if the arm did not take them all."""
        if request.value is None or self.ledger.last is None or request.value[0] != self.ledger.last + count:
            return False

        index, left = request.value
        self.space.room = max(self.space.room, left - sent_since)
        self._enter(self.ledger.acknowledge(index, count), source)
        return True

    async def _settle(self, request: Request[Frame]) -> bool:
        """Return whether a command was acknowledged; raise MotionUnknown if the arm is silent."""
        try:
            return await self._link.settle(request, SILENCE)
        except ReplyTimeout as error:
            raise MotionUnknown(f"{error}, and nothing tells whether the arm took {self._names()}") from error

    async def _post(self, entry: Entry, *, probe: bool = False, counted: int | None = None) -> Request[Frame]:
        """Send a command, and enter it as unacknowledged."""
        if self._datagrams:
            await self._datagrams.before_post()

        self.space.posted()
        if is_relative(entry.value):
            self._relative = entry.command.name

        unacked = UnackedCommand(entry, asyncio.get_running_loop().time(), probe, counted)
        self.ledger.unacked.append(unacked)
        try:
            return await self._link.send(entry.frame, self._index_of, timeout=SILENCE)
        except ReplyTimeout as error:
            raise MotionUnknown(f"{error}, and nothing tells whether the arm took {self._names()}") from error

    def _index_of(self, frame: Frame) -> int:
        """The index in an acknowledgement; that of a command known to be taken is late or doubled."""
        index = INDEX.decode(frame.params)
        known = -1 if self.ledger.last is None else self.ledger.last
        if index <= max(known, self._heard):
            raise ProtocolError(f"index {index} belongs to an earlier command")

        self._heard = index
        return index

    async def _open(self) -> None:
        """Open the ledger with the index of a WAIT of 0 ms."""
        await self.status.remember()
        for attempt in range(PROBES):
            cleared = self.space.empty
            index = await self._probe()
            if index is not None:
                self.ledger = QueueLedger(index)
                await self.space.opened(self.ledger, first=cleared and not attempt)
                return

            self.ledger.unacked.clear()
            if not await self.space.read():
                return

        raise ReplyTimeout("the arm does not acknowledge a WAIT of 0 ms; nothing was queued")

    async def _probe(self, counted: int | None = None) -> int | None:
        """Queue a WAIT of 0 ms; return its index, None if it is lost."""
        async with self._link.slot(c.SET_WAIT_CMD.name, SILENCE):
            request = await self._post(self.prepare(c.SET_WAIT_CMD, c.WAITCmd(0)), probe=True, counted=counted)
            index: int | None = request.value if await self._settle(request) else None
            return index

    async def _reconcile(self, source: MotionSource) -> None:
        """Find out what became of the unacknowledged commands: those that the arm did not take are sent again."""
        ledger = self.ledger
        for _ in range(PROBES if ledger.unacked else 0):
            if self._datagrams:
                await self._datagrams.before_count()

            try:
                counted = await self.space.count(ledger)
                await self.status.check_run()
            except ReplyTimeout as error:
                raise MotionUnknown(f"{error}, and nothing tells whether the arm took {self._names()}") from error

            if counted is None and not self._datagrams and self.space.least(ledger) >= len(ledger.unacked):
                resolution = ledger.conclude(len(ledger.unacked))  # nothing is doubled on a stream
            elif counted is not None and (self._datagrams or not self.space.left):
                # A probe would find no room, or prove nothing: its acknowledgement may be that of its second copy.
                resolution = ledger.conclude(counted)
            else:
                # What the count has found was acknowledged before the probe: if that comes now, it is late.
                self._heard = max(self._heard, (ledger.last or 0) + (counted or 0))
                index = await self._probe(counted)
                if index is None:
                    continue

                resolution = ledger.prove(index, doubling=self._datagrams is not None)

            if resolution is None:
                raise MotionUnknown(f"the arm took some and lost some, and nothing tells which, of {self._names()}")

            self._enter(resolution, source)
            return

        if ledger.unacked:
            raise MotionUnknown(f"the arm answers, but does not say whether it took {self._names()}")

    def _enter(self, resolution: Resolution, source: MotionSource) -> None:
        """Tell the source what the arm took; for the others there may have been no room."""
        if resolution.lost:
            self.space.room = 0

        for entry, index in resolution.taken:
            source.accepted(entry, index)

        source.put_back(resolution.lost)
        if self._datagrams:
            self._datagrams.entered()

        self.surplus(resolution.surplus)

    def surplus(self, count: int) -> None:
        """The arm took more than was sent: absolute motions may be done twice, nothing else."""
        if count <= 0:
            return

        if self._relative:
            raise MotionUnknown(
                f"the arm took {count} commands more than were sent, and {self._relative} must not run twice: the "
                "network doubled one, or another program queues commands on this arm"
            )

        self._link.events.publish(Surplus(count))

    def _unsolicited(self, frame: Frame) -> None:
        """An acknowledgement that nobody waits for: late, or of a command that the network delivered twice."""
        last = self.ledger.last
        if not frame.queued or len(frame.params) != INDEX.struct.size or last is None or self.ledger.unacked:
            return

        index = INDEX.decode(frame.params)
        if last < index < last + GARBAGE:
            self._heard = max(self._heard, index)
            self.ledger.last = index
            try:
                self.surplus(index - last)
            except MotionUnknown as error:
                self.on_unknown(error)

    def _restarted(self) -> None:
        """The arm was switched off and on: it counts its commands anew, and its queue is empty."""
        self._heard = -1
        self.ledger = QueueLedger()
        self.space.restarted()

    def _names(self) -> str:
        return ", ".join(entry.command.name for entry in self.ledger.commands) or "a WAIT of 0 ms"
