"""What a trace tells in figures: how long answers took, what was lost and repeated, how far the queue filled up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from dobot_async.traces.exchanges import Exchanges
from dobot_async.traces.reader import Trace

__all__ = ["CommandFigures", "MotionFigures", "TraceFigures", "depth", "figures", "latencies", "percentile"]


@dataclass(slots=True)
class CommandFigures:
    """One command's.

    Attributes:
        asked: How often it was sent.
        repeated: How often it was sent again, after it had been lost.
        lost: How often no reply came.
        latencies: Seconds until each reply, sorted.
    """

    asked: int = 0
    repeated: int = 0
    lost: int = 0
    latencies: list[float] = field(default_factory=list[float])


@dataclass(frozen=True, slots=True)
class MotionFigures:
    """What became of a motion.

    Attributes:
        number: Its place in the trace, from 1.
        name: The command's.
        end: "done", "failed", or "pending" where the trace ends before it.
        seconds: From when it was put until it ended; None while it is pending.
        error: How it failed, "" if it did not.
    """

    number: int
    name: str
    end: str
    seconds: float | None
    error: str


@dataclass(frozen=True, slots=True)
class TraceFigures:
    """What one connection's trace tells.

    Attributes:
        seconds: How long it is.
        frames: Frames that went out, and that came in.
        commands: By name, in the order in which they were first sent.
        motions: All of them, in the order in which they were put.
        deepest: The most that waited in the queue at a time.
        silence: The longest time in seconds for which a request was unanswered.
        outages: How often the connection broke.
        junk: Bytes that were no frame.
        error: How the connection's block ended, "" if well.
    """

    seconds: float
    frames: tuple[int, int]
    commands: dict[str, CommandFigures]
    motions: tuple[MotionFigures, ...]
    deepest: int
    silence: float
    outages: int
    junk: int
    error: str


def figures(trace: Trace) -> TraceFigures:
    """Return the figures of one connection."""
    recorded = Exchanges(trace)
    ends = [line.text("error") for line in trace.lines if line.kind == "end"]
    junk = sum(line.number("count") for line in trace.lines if line.kind == "junk")
    states = [line.text("state") for line in trace.lines if line.kind == "state"]
    return TraceFigures(
        seconds=recorded.end - trace.lines[0].t,
        frames=(len(recorded.asked), len(recorded.came)),
        commands=by_command(recorded),
        motions=motions(trace),
        deepest=max((count for _, count in depth(trace)), default=0),
        silence=longest_silence(recorded),
        outages=sum(state in {"lost", "reopening"} for state in states),
        junk=int(junk),
        error=ends[-1] if ends else "",
    )


def by_command(recorded: Exchanges) -> dict[str, CommandFigures]:
    """Return the figures of each command."""
    found: dict[str, CommandFigures] = {}
    lost: set[tuple[bytes | None, ...]] = set()
    for asked in recorded.asked:
        command = found.setdefault(asked.name, CommandFigures())
        command.asked += 1
        command.repeated += asked.raw in lost
        if asked.latency is None:
            command.lost += 1
            lost.add(asked.raw)
        else:
            command.latencies.append(asked.latency)
            lost.discard(asked.raw)

    for command in found.values():
        command.latencies.sort()

    return found


def latencies(trace: Trace) -> list[tuple[float, float | None]]:
    """Return when each request was sent, and the seconds until its reply, None where none came."""
    start = trace.lines[0].t
    return [(asked.t - start, asked.latency) for asked in Exchanges(trace).asked]


def motions(trace: Trace) -> tuple[MotionFigures, ...]:
    """Return what became of each motion."""
    lines = [line for line in trace.lines if line.kind == "motion"]
    put: dict[int, float] = {}
    found: dict[int, MotionFigures] = {}
    for line in lines:
        number = int(line.number("motion"))
        began, state = put.setdefault(number, line.t), line.text("state")
        ended = state in {"done", "failed"}
        seconds = line.t - began if ended else None
        end = state if ended else "pending"
        found[number] = MotionFigures(number, line.text("name"), end, seconds, line.text("error"))

    return tuple(found.values())


def depth(trace: Trace) -> list[tuple[float, int]]:
    """Return how many commands the arm had accepted and not done, from which second of the trace on."""
    start = trace.lines[0].t
    pending: set[int] = set()
    found = [(0.0, 0)]
    for line in trace.lines:
        if line.kind == "motion":
            number, state = int(line.number("motion")), line.text("state")
            if state == "accepted":
                pending.add(number)
            elif state in {"done", "failed"}:
                pending.discard(number)

            if len(pending) != found[-1][1]:
                found.append((line.t - start, len(pending)))

    found.append((trace.lines[-1].t - start, len(pending)))
    return found


def longest_silence(recorded: Exchanges) -> float:
    """Return the longest time for which a request was unanswered."""
    longest, came = 0.0, iter([*recorded.came, recorded.end])
    until = next(came)
    heard = recorded.opening.t
    for asked in recorded.asked:
        while until < asked.t:
            heard, until = until, next(came, recorded.end)
            if until <= heard:
                break

        if asked.t > heard:
            longest = max(longest, until - asked.t)

    return longest


def percentile(sorted_values: Sequence[float], percent: float) -> float:
    """Return the value below which so many percent are; 0 where there is none."""
    if not sorted_values:
        return 0.0

    return sorted_values[min(len(sorted_values) - 1, int(len(sorted_values) * percent / 100))]
