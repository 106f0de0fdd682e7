"""Frames/s of the parser by chunk size, beside a floor: the least code that cuts a clean stream into the same frames.

Noise has no floor; its MB/s must not depend on how much of it there is, so both a part and the whole are measured.

    python -m benchmarks.bench_parser [--frames 20000] [--json] [--quick]

The ratio is what counts: both columns come from one run on one machine.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable

from benchmarks.report import Row, parsed, show
from dobot_async.arms.magician.frame import Frame, Parser, encode

CHUNKS = (1, 20, 64, 4096)
ROUNDS = 5
NOISE = {"AA": b"\xaa", "AA AA FF": b"\xaa\xaa\xff", "AA AA FA": b"\xaa\xaa\xfa"}


class Floor:
    """Cuts a stream that holds nothing but good frames; checks nothing but the sum."""

    def __init__(self) -> None:
        self._buffer = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Takes the next bytes, returns the frames that they complete."""
        buffer, at, frames = self._buffer + data, 0, []
        while len(buffer) - at > 3:
            end = at + 4 + buffer[at + 2]
            if end > len(buffer):
                break

            if sum(buffer[at + 3 : end]) & 0xFF == 0:
                frames.append(Frame(buffer[at + 3], buffer[at + 4], buffer[at + 5 : end - 1]))

            at = end

        self._buffer = buffer[at:]
        return frames


def rate(feed: Callable[[bytes], list[Frame]], stream: bytes, chunk: int, expected: int) -> float:
    """Frames/s of one pass over the stream."""
    pieces = [stream[at : at + chunk] for at in range(0, len(stream), chunk)]
    started = time.perf_counter()
    found = sum(len(feed(piece)) for piece in pieces)
    elapsed = time.perf_counter() - started
    assert found == expected
    return found / elapsed


def row_of(chunk: int, stream: bytes, frames: int) -> Row:
    """The best of some rounds of each, taken in turns."""
    parser = Parser()
    floors, ours = [], []
    for _ in range(ROUNDS):
        floors.append(rate(Floor().feed, stream, chunk, frames))
        ours.append(rate(parser.feed, stream, chunk, frames))

    assert parser.junk_bytes == parser.bad_frames == 0
    return {
        "stream": "poses",
        "chunk": chunk,
        "frames_per_s": round(max(ours)),
        "mb_per_s": round(max(ours) * len(stream) / frames / 1e6, 2),
        "floor_frames_per_s": round(max(floors)),
        "ratio": round(max(ours) / max(floors), 3),
    }


def noise_row(name: str, chunk: int, size: int) -> Row:
    """How fast noise goes through; nothing of it may become a frame."""
    noise = (NOISE[name] * size)[:size]
    parser = Parser()
    started = time.perf_counter()
    assert not any(parser.feed(noise[at : at + chunk]) for at in range(0, size, chunk))
    elapsed = time.perf_counter() - started
    return {
        "stream": f"{size / 1e6:.3g} MB of {name}",
        "chunk": chunk,
        "frames_per_s": None,
        "mb_per_s": round(size / 1e6 / elapsed, 2),
        "floor_frames_per_s": None,
        "ratio": None,
    }


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, frames=20_000)
    poses = [Frame(10, 0, struct.pack("<8f", *(step / 7 + joint for joint in range(8)))) for step in range(50)]
    stream = b"".join(encode(poses[number % len(poses)]) for number in range(options.frames))
    rows = [row_of(chunk, stream, options.frames) for chunk in CHUNKS]
    size = options.frames * 50  # a megabyte, unless it is to be brief
    rows += [noise_row(name, chunk, part) for name in NOISE for chunk in (1, 4096) for part in (size // 8, size)]
    show("parser", rows, as_json=options.json, frames=options.frames)


if __name__ == "__main__":
    main()
