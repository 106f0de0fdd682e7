"""Just enough of a Magician's frames to date its answers: written apart from the driver, whose parser is on trial.

AA AA | length | id | ctrl | parameters | checksum        length counts id, ctrl and parameters
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from typing import Any

HEADER = b"\xaa\xaa"
GET_DEVICE_TIME, GET_POSE, GET_POSE_L, GET_IOADC = 4, 10, 13, 134
COARSE = 256.0  # seconds in the first of a pair of floats, so that the second keeps its microseconds
VALUES = 4096  # of an analog input
TICKS = 0.05  # seconds from one of them to the next, which makes three minutes
ROUND = TICKS * VALUES

__all__ = ["DATED", "analog_age", "count", "dated", "pose_age", "pose_l_age", "time_age"]


def frames(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yields the id of each whole frame in a message, and where its parameters begin and end."""
    at = data.find(HEADER)
    while at >= 0 and at + 3 < len(data):
        end = at + 3 + data[at + 2]
        if end < len(data) and data[at + 2] >= 2:
            yield data[at + 3], at + 5, end
            at = data.find(HEADER, end + 1)
        else:
            at = data.find(HEADER, at + 2)


def count(data: bytes) -> int:
    """How many frames a message has."""
    return sum(1 for _ in frames(data))


def dated(data: bytes, now: float) -> bytes:
    """The arm's replies, in which what `DATED` has says when they were made."""
    stamped = bytearray(data)
    for number, begin, end in list(frames(data)):
        stamp = DATED.get(number)
        if stamp:
            stamped[begin:end] = stamp(bytes(data[begin:end]), now)
            stamped[end] = -(data[begin - 2] + data[begin - 1] + sum(stamped[begin:end])) % 256

    return bytes(stamped)


def stamp_pose(params: bytes, now: float) -> bytes:
    """x tells the coarse, y the fine part of the time."""
    return struct.pack("<2f", now // COARSE * COARSE, now % COARSE) + params[8:]


DATED: dict[int, Callable[[bytes, float], bytes]] = {
    GET_DEVICE_TIME: lambda _, now: struct.pack("<I", int(now * 1000) % 2**32),
    GET_POSE: stamp_pose,
    GET_POSE_L: lambda _, now: struct.pack("<f", now % COARSE),
    GET_IOADC: lambda params, now: params[:1] + struct.pack("<H", int(now / TICKS) % VALUES),
}
"""What becomes of the parameters of a reply."""


def signed(age: float, turn: float) -> float:
    """An age of which only the remainder is known."""
    return (age + turn / 2) % turn - turn / 2


def time_age(value: int, asked: float) -> float:
    """How long before the question the arm made the answer; negative if it was made after it."""
    return asked - (value + 1) / 1000


def pose_age(value: Any, asked: float) -> float:
    """The same of a pose."""
    return asked - float(value.x + value.y)


def pose_l_age(value: float, asked: float) -> float:
    """The same of the rail's place, up to two minutes."""
    return signed(asked - value, COARSE)


def analog_age(value: Any, asked: float) -> float:
    """The same of an analog input, up to a minute and a half."""
    return signed(asked - (value.value + 1) * TICKS, ROUND)
