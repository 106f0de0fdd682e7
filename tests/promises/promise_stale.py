"""Whether an answer is the answer: three callers, an arm that dates each of its answers, and a line that is bad.

An answer is stale if the arm made it before the question was asked: then it was another question's. How old it is shows
by its date, in whatever the row tells: a time, a pose, a place on the rail, an analog value.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

from promise_arms import BY_NAME, bench
from promise_clock import now, run_on_virtual_clock
from promise_frames import analog_age, count, dated, pose_age, pose_l_age, time_age
from promise_line import Manner

from dobot_async import DobotError
from dobot_async.arms.magician import commands as c

__all__ = ["KINDS", "QUESTIONS", "Kind", "Tally", "ask_until", "tally_of"]

LATENCY = 0.004
FRESH = 0.001  # seconds that an answer may be older than its question, for dates are rounded
QUESTIONS: tuple[tuple[Any, Any, Callable[[Any, float], float]], ...] = (
    (c.GET_DEVICE_TIME, None, time_age),
    (c.GET_POSE, None, pose_age),
    (c.GET_POSE_L, None, pose_l_age),
    (c.GET_IOADC, 5, analog_age),
    (c.GET_IOADC, 6, analog_age),
)
"""Rows, parameters, and how an answer tells its age."""


@dataclass(frozen=True)
class Kind:
    """A kind of line.

    Attributes:
        name: Its name.
        manner: What it does.
        most: Frames to the arm per answer that it may cost at the most, in calm use; None where nothing is promised.
    """

    name: str
    manner: Manner
    most: float | None = None


KINDS = (
    Kind("stream, clean", Manner(LATENCY), 1.02),
    Kind("stream, loss 5 %", Manner(LATENCY, loss=0.05), 1.3),
    Kind("stream, loss 30 %", Manner(LATENCY, loss=0.3), 4.5),
    Kind("stream, stalls", Manner(LATENCY, stall=0.02)),
    Kind("stream, stalls, loss 1 %", Manner(LATENCY, stall=0.02, loss=0.01)),
    Kind("stream, stalls, loss 5 %", Manner(LATENCY, stall=0.02, loss=0.05)),
    Kind("stream, stalls, loss 30 %", Manner(LATENCY, stall=0.02, loss=0.3)),
    Kind("datagrams, loss 5 %, doubled 5 %", Manner(LATENCY, loss=0.05, double=0.05, spread=0.015), 1.4),
)


@dataclass
class Tally:
    """What came out.

    Attributes:
        asked: Questions.
        answers: Of them that were answered.
        stale: Of these that were answered with an older answer.
        oldest: Seconds that the worst of these was too old.
        frames: That went out to the arm.
    """

    asked: int = 0
    answers: int = 0
    stale: int = 0
    oldest: float = 0.0
    frames: int = 0

    def add(self, other: Tally) -> None:
        """Adds another one."""
        self.asked += other.asked
        self.answers += other.answers
        self.stale += other.stale
        self.oldest = max(self.oldest, other.oldest)
        self.frames += other.frames

    @property
    def frames_per_answer(self) -> float:
        """Frames to the arm per answer."""
        return self.frames / max(self.answers, 1)

    def __str__(self) -> str:
        worst = f" (by up to {self.oldest:.1f} s)" if self.stale else ""
        return (
            f"asked {self.asked}, answers {self.answers}, stale {self.stale}{worst}, "
            f"frames per answer {self.frames_per_answer:.2f}"
        )


async def ask_until(
    arm: Any,
    is_over: Callable[[], bool],
    random: Random,
    tally: Tally,
    clock: Callable[[], float],
    *,
    questions: Any = QUESTIONS,
    fresh: float = FRESH,
    calm: bool = False,
    pause: float = 8.0,
) -> None:
    """One caller: asks one thing after the other, with pauses, timeouts and cancellations; calm: without the latter."""
    while not is_over():
        await asyncio.sleep(random.choice((0, 0.01, 0.3, random.random() * (1 if calm else pause))))
        row, value, age = random.choice(questions)
        cancelled_after = random.random() * 0.05 if not calm and random.random() < 0.1 else None
        timeout = 5.0 if calm else random.choice((0.2, 0.5, 1.5))
        asked = clock()
        tally.asked += 1
        try:
            async with asyncio.timeout(cancelled_after):
                answer = await arm.link.request(row, value, timeout=timeout)
        except (TimeoutError, DobotError):
            continue

        tally.answers += 1
        if age(answer, asked) > fresh:
            tally.stale += 1
            tally.oldest = max(tally.oldest, age(answer, asked))


async def scenario(kind: Kind, seed: int, answers: int, *, calm: bool) -> Tally:
    """Three callers on one connection, until they have so many answers."""
    tally = Tally()
    ends = now() + 1000.0
    async with bench(BY_NAME["magician"], seed=seed) as b:
        # The line is good until the arm is connected.
        line = b.line
        line.change(kind.manner)
        line.stamp = lambda data: dated(data, now())

        def counted(data: bytes) -> bytes:
            tally.frames += count(data)
            return data

        line.up.spoil = counted
        async with asyncio.TaskGroup() as group:
            for number in range(3):
                random = Random(10 * seed + number)
                over = lambda: tally.answers >= answers or now() > ends  # noqa: E731
                group.create_task(ask_until(b.arm, over, random, tally, now, calm=calm))

    return tally


def tally_of(kind: Kind, answers: int, *, calm: bool = False, first: int = 0, per_seed: int = 400) -> Tally:
    """So many answers over a kind of line, on connections of some hundred each."""
    total = Tally()
    seed = first
    while total.answers < answers and seed < first + 50 + 10 * answers // per_seed:
        work = scenario(kind, seed, min(per_seed, answers - total.answers), calm=calm)
        total.add(run_on_virtual_clock(work, limit=1200))
        seed += 1

    return total
