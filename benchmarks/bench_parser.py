"""Frames/s of the parser by chunk size, beside a floor: the least code that cuts a clean stream into the same frames.

    python benchmarks/bench_parser.py [--frames 20000] [--json]

The ratio is what counts: both columns come from one run on one machine.
"""

from __future__ import annotations

import argparse
import json
import struct
import time
from collections.abc import Callable

from dobot_async.magician.frame import Frame, Parser, encode

CHUNKS = (1, 20, 64, 4096)


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


def main() -> None:
    """Prints a table, or one JSON object."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--frames", type=int, default=20_000)
    options.add_argument("--json", action="store_true")
    arguments = options.parse_args()

    poses = [Frame(10, 0, struct.pack("<8f", *(step / 7 + joint for joint in range(8)))) for step in range(50)]
    stream = b"".join(encode(poses[number % len(poses)]) for number in range(arguments.frames))
    rows = []
    for chunk in CHUNKS:
        parser = Parser()
        floor = rate(Floor().feed, stream, chunk, arguments.frames)
        ours = rate(parser.feed, stream, chunk, arguments.frames)
        assert parser.junk_bytes == parser.bad_frames == 0
        rows.append(
            {
                "chunk": chunk,
                "frames_per_s": round(ours),
                "mb_per_s": round(ours * len(stream) / arguments.frames / 1e6, 2),
                "floor_frames_per_s": round(floor),
                "ratio": round(ours / floor, 3),
            }
        )

    if arguments.json:
        print(json.dumps({"benchmark": "parser", "frames": arguments.frames, "rows": rows}))
        return

    print(f"{'chunk':>6} {'frames/s':>12} {'MB/s':>8} {'floor':>12} {'ratio':>7}")
    for row in rows:
        print("{chunk:>6} {frames_per_s:>12,} {mb_per_s:>8} {floor_frames_per_s:>12,} {ratio:>7}".format(**row))


if __name__ == "__main__":
    main()
