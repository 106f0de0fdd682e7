"""Plots as SVG, small enough to be kept beside the pages that show them: groups of bars, and lines over time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from itertools import count

__all__ = ["bars", "lines"]

WIDTH, HEIGHT = 720, 340
LEFT, RIGHT, TOP, BOTTOM = 64, 16, 66, 40
COLORS = ("#8a8a8a", "#1f6fb4", "#d1852c", "#6b9b37", "#8e5ba6", "#b5443c", "#3a9a9a")
INK = "#555"


class Scale:
    """Where a value is on the upright axis: evenly, or by its logarithm.

    Args:
        low: The value at the bottom; above 0 for a logarithm.
        high: The value at the top.
        log: Whether it is a logarithm.
    """

    def __init__(self, low: float, high: float, *, log: bool) -> None:
        self._log = log
        self.low, self.high = low, high if high > low else low + 1
        if log:
            self.low, self.high = 10 ** math.floor(math.log10(low)), 10 ** math.ceil(math.log10(self.high))

    def __call__(self, value: float) -> float:
        """Return the place in pixels."""
        low, high, at = self.low, self.high, min(max(value, self.low), self.high)
        if self._log:
            low, high, at = math.log10(low), math.log10(high), math.log10(at)

        return HEIGHT - BOTTOM - (at - low) / (high - low) * (HEIGHT - TOP - BOTTOM)

    def ticks(self) -> list[float]:
        """Return the values that are written beside the axis."""
        if self._log:
            decades = round(math.log10(self.high / self.low))
            return [self.low * 10**number for number in range(decades + 1)]

        step = 10 ** math.floor(math.log10(self.high))
        step *= next(factor for factor in (0.1, 0.2, 0.5, 1, 2) if self.high / (step * factor) <= 8)
        return [step * number for number in range(int(self.high / step) + 1)]


def text(x: float, y: float, words: str, anchor: str = "middle", size: int = 11) -> str:
    """Return words at a place."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" fill="{INK}">{escape(words)}</text>'
    )


def frame(scale: Scale, label: str, names: Sequence[str]) -> list[str]:
    """Return the axis, its ticks, and what the colours mean."""
    parts = [text(LEFT, 16, label, "start", 12)]
    for tick in scale.ticks():
        y = scale(tick)
        parts.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}" stroke="{INK}" opacity=".2"/>')
        parts.append(text(LEFT - 6, y + 4, f"{tick:g}", "end"))

    x, y = float(LEFT), 34
    for name, number in zip(names, count(), strict=False):
        width = 26 + 6.2 * len(name)
        if x + width > WIDTH:
            x, y = float(LEFT), y + 15

        color = COLORS[number % len(COLORS)]
        parts.append(f'<rect x="{x:.0f}" y="{y - 9}" width="10" height="10" fill="{color}"/>')
        parts.append(text(x + 14, y, name, "start"))
        x += width

    return parts


def whole(parts: Sequence[str]) -> str:
    """Return the file."""
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif">\n'
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>\n{body}\n</svg>\n'
    )


def bars(label: str, groups: Mapping[str, Mapping[str, float]], *, log: bool = False) -> str:
    """Return a plot with a group of bars for each of several things.

    Args:
        label: What the values are, with their unit.
        groups: The values of each group, by the names of the bars.
        log: Whether the axis is a logarithm; the values are above 0 then.
    """
    names = list(dict.fromkeys(name for group in groups.values() for name in group))
    values = [value for group in groups.values() for value in group.values()]
    scale = Scale(min(values) / 2 if log else 0.0, max(values), log=log)
    parts = frame(scale, label, names)
    room = (WIDTH - LEFT - RIGHT) / len(groups)
    width = room * 0.8 / len(names)
    for place, (group, found) in enumerate(groups.items()):
        begin = LEFT + room * (place + 0.1)
        parts.append(text(begin + room * 0.4, HEIGHT - BOTTOM + 16, group))
        for number, name in enumerate(names):
            if name in found:
                x, y, color = begin + width * number, scale(found[name]), COLORS[number % len(COLORS)]
                high = HEIGHT - BOTTOM - y
                parts.append(
                    f'<rect x="{x:.1f}" y="{y:.1f}" width="{width * 0.92:.1f}" height="{high:.1f}" fill="{color}"/>'
                )
                parts.append(text(x + width * 0.46, y - 3, f"{found[name]:.4g}", size=9))

    return whole(parts)


def lines(label: str, below: str, curves: Mapping[str, Sequence[tuple[float, float]]], *, log: bool = False) -> str:
    """Return a plot with a line for each of several things.

    Args:
        label: What the values are, with their unit.
        below: What they are plotted over, with its unit.
        curves: The places and values of each, by its name; with a logarithm those above 0 are drawn.
        log: Whether the axis is a logarithm.
    """
    drawn = {name: [(x, y) for x, y in points if y > 0 or not log] for name, points in curves.items()}
    values = [y for points in drawn.values() for _, y in points]
    furthest = max(x for points in drawn.values() for x, _ in points) or 1.0
    scale = Scale(max(min(values), max(values) / 1e4) if log else min(0.0, *values), max(values), log=log)
    parts = frame(scale, label, list(drawn))
    for number, points in enumerate(drawn.values()):
        way = " ".join(f"{LEFT + x / furthest * (WIDTH - LEFT - RIGHT):.1f},{scale(y):.1f}" for x, y in points)
        color = COLORS[number % len(COLORS)]
        parts.append(f'<polyline points="{way}" fill="none" stroke="{color}" stroke-width="1.3"/>')

    parts.append(text(WIDTH - RIGHT, HEIGHT - 8, f"{below}, 0 to {furthest:.3g}", "end"))
    return whole(parts)
