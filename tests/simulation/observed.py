"""What really happened, noted at the simulation: when the arm answered what, and for how long a client heard nothing.

    client --said--> line --> arm.answer: answers, performed --> line --heard--> client

Nothing of the driver is looked at, so that nothing that it believes is taken for true.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from random import Random
from typing import Any

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame, Parser
from dobot_async.simulator import Simulation

__all__ = ["Observed"]

Trace = Callable[[str], None]
LEVELS = (0, 1)
PINS = range(1, 21)
ADC_RANGE = 4096
APART = 60.0  # seconds between two late answers of one command, so that one of a key at a time is on the way
DEAF = 0.3  # seconds without an answer from which on it is noted


@dataclass
class Observed:
    """The notes of one run.

    Attributes:
        answers: By command and its parameters: when the arm made which answer.
        performed: When the arm did which immediate command.
        silences: From when to when something had been sent and nothing was heard, of those that last.
        sent: How many messages clients have sent.
        late: Probability that an answer comes alone, behind later ones.
    """

    sim: Simulation
    clock: Callable[[], float]
    random: Random
    trace: Trace | None = None
    late: float = 0.0
    answers: dict[Hashable, list[tuple[float, Any]]] = field(default_factory=lambda: defaultdict(list))
    performed: list[tuple[float, Any, Any]] = field(default_factory=list)
    silences: list[tuple[float, float]] = field(default_factory=list)
    sent: int = 0
    _waiting_since: float | None = None
    _late_at: dict[Hashable, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._watch_the_line()
        self._watch_the_arm()
        if self.late:
            self._delay_answers()

    def silent(self, start: float, end: float, least: float) -> bool:
        """Whether nothing was heard for so long, in a time that overlaps this one."""
        silences = [*self.silences, *([(self._waiting_since, self.clock())] if self._waiting_since is not None else [])]
        return any(since < end and until > start and until - since >= least for since, until in silences)

    def has_no_index(self, start: float, end: float) -> bool:
        """Whether the arm told nonsense for the index of its last finished command."""
        answers = self.answers[c.GET_QUEUED_CMD_CURRENT_INDEX.id, None]
        return any(start <= time <= end and index >= 1 << 63 for time, index in answers)

    def broken(self, start: float, end: float) -> float:
        """For how many seconds of a time the line carried nothing."""
        return sum(max(0.0, min(end, ended) - max(start, begun)) for begun, ended in self.sim.outages)

    def answered(self, row: Any, value: Any, answer: Any, start: float, end: float) -> bool:
        """Whether the arm made this answer to this question in this time."""
        return any(start <= time <= end and each == answer for time, each in self.answers[row.id, value])

    def good_from(self, start: float, seconds: float) -> float:
        """When the line has carried everything for so many seconds without a break, from `start` on."""
        at = start
        for begun, ended in sorted(self.sim.outages):
            if ended > at and begun < at + seconds:
                at = ended

        return at + seconds

    def _watch_the_line(self) -> None:
        connect = self.sim.client

        def client(deliver: Callable[[bytes], None], disconnect: Callable[[], None], **details: Any) -> Any:
            heard, said = Parser(), Parser()

            def delivered(data: bytes) -> None:
                for frame in heard.feed(data):
                    self._heard(frame)

                deliver(data)

            line = connect(delivered, disconnect, **details)
            send = line.send

            def sent(data: bytes) -> None:
                self.sent += 1
                if self._waiting_since is None:
                    self._waiting_since = self.clock()

                for frame in said.feed(data) if self.trace else ():
                    self.note("-->     ", frame)

                send(data)

            vars(line)["send"] = sent
            return line

        vars(self.sim)["client"] = client

    def _heard(self, frame: Frame) -> None:
        now = self.clock()
        if self._waiting_since is not None and now - self._waiting_since >= DEAF:
            self.silences.append((self._waiting_since, now))

        self._waiting_since = None
        if self.trace:
            self.note("<--     ", frame)

    def _watch_the_arm(self) -> None:
        arm = self.sim.arm
        answer = arm.answer

        def answered(frame: Frame) -> bytes:
            row = c.BY_KEY.get((frame.id, frame.write))
            if row and not frame.write:
                self._change(row, frame)

            reply: bytes = answer(frame)
            if row and reply and not frame.queued:
                value = row.request.decode(frame.params)
                if frame.write:
                    self.performed.append((self.clock(), row, value))
                else:
                    (made,) = Parser().feed(reply)
                    self.answers[row.id, value].append((self.clock(), row.reply.decode(made.params)))

            if self.trace:
                self.note("     arm", frame, f" -> {reply.hex(' ')}")

            return reply

        vars(arm)["answer"] = answered

    def _change(self, row: Any, frame: Frame) -> None:
        """An input is read as something else each time, so that an answer tells when it was made."""
        arm = self.sim.arm
        if row in {c.GET_IODI, c.GET_IOADC} and len(frame.params) == 1 and frame.params[0] in PINS:
            address = frame.params[0]
            times = len(self.answers[row.id, address])
            function = c.IOFunction.DI if row is c.GET_IODI else c.IOFunction.ADC
            arm.state.set(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(address, function))
            if row is c.GET_IODI:
                arm.set_input(address, LEVELS[times % len(LEVELS)])
            else:
                arm.set_adc(address, times % ADC_RANGE)

    def _delay_answers(self) -> None:
        connect = self.sim.arm.session

        def session() -> Any:
            made = connect()
            receive = made.receive

            def received(data: bytes) -> bytes:
                reply: bytes = receive(data)
                self.sim.faults.late = float(bool(reply) and self._is_late(reply))
                return reply

            vars(made)["receive"] = received
            return made

        vars(self.sim.arm)["session"] = session

    def _is_late(self, reply: bytes) -> bool:
        """Draws whether an answer comes alone, of which there is one of a command at a time."""
        now = self.clock()
        frames = Parser().feed(reply)
        free = all(now >= self._late_at.get((frame.id, frame.write), now) for frame in frames)
        if not free or len(frames) != 1 or self.random.random() >= self.late:
            return False

        self._late_at[frames[0].id, frames[0].write] = now + APART
        return True

    def note(self, what: str, frame: Frame, more: str = "") -> None:
        """Adds a frame to the trace."""
        if self.trace:
            row = c.BY_KEY.get((frame.id, frame.write))
            name = row.name if row else str(frame.id)
            queued = "q " if frame.queued else ""
            self.trace(f"{self.clock():10.4f} {what} {name} {queued}{frame.params.hex(' ')}{more}")
