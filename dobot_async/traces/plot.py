"""A trace as curves: how full the queue was, and how long each answer took. As text, or as PNG by matplotlib."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from dobot_async.traces.figures import depth, latencies
from dobot_async.traces.reader import Trace

__all__ = ["MissingPlotter", "in_terminal", "to_png"]

BLOCKS = " ▁▂▃▄▅▆▇█"
ROWS = 6
LEAST = 10  # columns


class MissingPlotter(ImportError):
    """matplotlib is not installed; the message says how to install it."""


def in_terminal(trace: Trace, columns: int) -> str:
    """Return both curves as text.

    Args:
        trace: Of one connection.
        columns: Of the terminal, 10 at least.
    """
    width = max(columns, LEAST) - 8
    seconds = trace.lines[-1].t - trace.lines[0].t
    waits = [(at, 1000 * wait) for at, wait in latencies(trace) if wait is not None]
    lost = [(at, 1.0) for at, wait in latencies(trace) if wait is None]
    marks = "".join("x" if each else " " for each in highest(lost, seconds, width))
    return "\n".join(
        [
            "commands in the queue",
            *curve(stretched(depth(trace), seconds, width)),
            "",
            "ms until the answer",
            *curve(highest(waits, seconds, width)),
            f"{'lost':>6}  {marks}",
            f"{'':8}0 s{f'{seconds:.1f} s':>{max(width - 3, 1)}}",
        ]
    )


def curve(values: Sequence[float]) -> list[str]:
    """Return columns of blocks, the largest value as high as there are rows."""
    top = max(values, default=0.0) or 1.0
    steps = len(BLOCKS) - 1
    heights = [round(value / top * ROWS * steps) or (value > 0) for value in values]
    rows: list[str] = []
    for row in reversed(range(ROWS)):
        cells = "".join(BLOCKS[min(max(height - row * steps, 0), steps)] for height in heights)
        scale = f"{top:6.4g}" if row == ROWS - 1 else f"{0:6}" if row == 0 else " " * 6
        rows.append(f"{scale} |{cells}")

    return rows


def highest(points: Sequence[tuple[float, float]], seconds: float, width: int) -> list[float]:
    """Return the largest value in each column."""
    found = [0.0] * width
    for at, value in points:
        place = min(int(at / seconds * width), width - 1) if seconds else 0
        found[place] = max(found[place], value)

    return found


def stretched(steps: Sequence[tuple[float, int]], seconds: float, width: int) -> list[float]:
    """Return the largest value in each column of what stays until it changes."""
    found = highest([(at, float(value)) for at, value in steps], seconds, width)
    following = 0
    for place in range(width):
        begins = place / width * seconds
        while following < len(steps) and steps[following][0] <= begins:
            following += 1

        if following:
            found[place] = max(found[place], float(steps[following - 1][1]))

    return found


def to_png(trace: Trace, path: str | os.PathLike[str]) -> Path:
    """Write both curves as a picture.

    Args:
        trace: Of one connection.
        path: Of the picture.

    Returns:
        The path.

    Raises:
        MissingPlotter: matplotlib is not installed.
        OSError: The picture cannot be written.
    """
    try:
        from matplotlib.figure import Figure  # noqa: PLC0415 - of an extra
    except ImportError as error:
        name = error.name or "matplotlib"
        raise MissingPlotter(f"{name} is not installed, and this needs it: pip install 'dobot-async[plot]'") from error

    figure = Figure(figsize=(10, 6), layout="constrained")
    queue, answers = figure.subplots(2, 1, sharex=True)
    times, counts = zip(*depth(trace), strict=True)
    queue.step(times, counts, where="post")
    queue.set_ylabel("commands in the queue")
    queue.set_title(f"{trace.lines[0].text('model')} at {trace.lines[0].text('url')}")
    found = latencies(trace)
    answered = [(at, 1000 * wait) for at, wait in found if wait is not None]
    lost = [at for at, wait in found if wait is None]
    answers.plot([at for at, _ in answered], [wait for _, wait in answered], ".", label="answered")
    answers.plot(lost, [0.0] * len(lost), "rx", label="lost")
    answers.set_ylabel("ms until the answer")
    answers.set_xlabel("s")
    answers.legend(loc="upper right")
    target = Path(path)
    figure.savefig(target, format="png")  # pyright: ignore[reportUnknownMemberType] - its own **kwargs
    return target
