"""How fast along the way: velocity profiles, in closed form. Knows no arm and no clock.

    velocity    peak  ________
                     :        :
                    :          :
          enter ...:            :... leave
                   rise        fall         too short for the peak: a triangle

`position` and its inverse `time` are exact, so that a motion that is cut short ends at an exact time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

__all__ = ["Profile", "SpeedLimits", "shared", "trapezoid"]

NEGLIGIBLE = 1e-9  # mm or degrees; a share of the way below this does not slow the others down


class SpeedLimits(NamedTuple):
    """Highest velocity and acceleration, per s and s²: of each axis (degrees), or of length (mm) and turn (degrees)."""

    velocity: tuple[float, ...]
    acceleration: tuple[float, ...]

    def scaled(self, velocity: float, acceleration: float) -> SpeedLimits:
        """Returns these, each by a factor (1.0 changes nothing)."""
        return SpeedLimits(
            tuple(value * velocity for value in self.velocity),
            tuple(value * acceleration for value in self.acceleration),
        )


@dataclass(frozen=True, slots=True)
class Profile:
    """One way of some length, begun and ended at given velocities; made by `trapezoid`.

    Attributes:
        length: The length of the way.
        enter: Velocity at its beginning.
        peak: Highest velocity.
        leave: Velocity at its end.
        acceleration: Up and down.
        rise: Seconds from `enter` to `peak`.
        fall: Seconds from `peak` to `leave`.
        duration: Seconds in all; infinite where nothing can move.
    """

    length: float
    enter: float
    peak: float
    leave: float
    acceleration: float
    rise: float
    fall: float
    duration: float

    def position(self, elapsed: float) -> float:
        """Returns how far one is after some seconds: 0 before the beginning, exactly `length` from the end on."""
        if elapsed >= self.duration:
            return self.length

        if elapsed <= 0 or math.isinf(self.duration):
            return 0.0

        left = self.duration - elapsed
        if elapsed <= self.rise:
            done = self.enter * elapsed + self.acceleration * elapsed * elapsed / 2
        elif left <= self.fall:
            done = self.length - self.leave * left - self.acceleration * left * left / 2
        else:
            done = (self.enter + self.peak) / 2 * self.rise + self.peak * (elapsed - self.rise)

        return min(max(done, 0.0), self.length)

    def time(self, position: float) -> float:
        """Returns after how many seconds one is there: 0 for what is behind, `duration` from the end on."""
        if position >= self.length:
            return self.duration

        if position <= 0 or math.isinf(self.duration):
            return 0.0 if position <= 0 else math.inf

        risen = (self.enter + self.peak) / 2 * self.rise
        if position <= risen:
            return ramp_time(self.enter, self.acceleration, position)

        left = self.length - position
        if left <= (self.leave + self.peak) / 2 * self.fall:
            return self.duration - ramp_time(self.leave, self.acceleration, left)

        return self.rise + (position - risen) / self.peak


def trapezoid(
    length: float, velocity: float, acceleration: float, *, enter: float = 0.0, leave: float = 0.0
) -> Profile:
    """Returns the fastest profile along a way.

    The velocities at both ends are brought to what acceleration and length allow; what they became is in the profile.
    `leave=velocity` runs into the end at full speed, as a jog into its limit does. Where velocity or acceleration is 0
    (never set), the way never ends.
    """
    if length <= 0:
        return Profile(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    if velocity <= 0 or acceleration <= 0:
        return Profile(length, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.inf)

    gain = 2 * acceleration * length
    enter = min(max(enter, 0.0), velocity)
    leave = min(max(leave, 0.0), velocity, math.sqrt(enter * enter + gain))
    leave = max(leave, math.sqrt(max(0.0, enter * enter - gain)))
    peak = max(enter, leave, min(velocity, math.sqrt((gain + enter * enter + leave * leave) / 2)))
    rise, fall = (peak - enter) / acceleration, (peak - leave) / acceleration
    ramps = (enter + peak) / 2 * rise + (leave + peak) / 2 * fall
    cruise = max(0.0, length - ramps) / peak
    return Profile(length, enter, peak, leave, acceleration, rise, fall, rise + cruise + fall)


def shared(spans: Sequence[float], pace: SpeedLimits, *, enter: float = 0.0, leave: float = 0.0) -> Profile:
    """Returns the profile of a way of length 1 on which several axes set out and arrive together: the slowest leads.

    Args:
        spans: How far each axis has to go.
        pace: What each axis may do; all of it is kept.
        enter: Share of the way per second at its beginning.
        leave: Share of the way per second at its end.
    """
    limits = [
        (velocity / abs(span), acceleration / abs(span))
        for span, velocity, acceleration in zip(spans, pace.velocity, pace.acceleration, strict=True)
        if abs(span) > NEGLIGIBLE
    ]
    if not limits:
        return trapezoid(0.0, 0.0, 0.0)

    return trapezoid(
        1.0,
        min(velocity for velocity, _ in limits),
        min(acceleration for _, acceleration in limits),
        enter=enter,
        leave=leave,
    )


def ramp_time(velocity: float, acceleration: float, distance: float) -> float:
    """Seconds that a constant acceleration takes for a distance, from a velocity on; stable for small distances."""
    return 2 * distance / (velocity + math.sqrt(velocity * velocity + 2 * acceleration * distance))
