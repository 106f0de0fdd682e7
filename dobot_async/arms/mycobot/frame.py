"""The myCobot family's frames. Bytes in, frames out; no I/O.

    FE FE | Len | Cmd | Params ... | FA          Len = 2 + len(Params)
                `----- counted ----'

There is no checksum and no number, and FE FE may stand in the parameters too. So a frame is believed only if length,
footer and command agree: a command that is known, with as many bytes as its request, its reply or its
acknowledgement can have. Whatever else arrives (noise, one FE too many, text of the M5) is junk.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from dobot_async._core.protocol.wire import Command, Queueing

__all__ = ["MAX_LENGTH", "Frame", "Known", "Parser", "encode", "request"]

HEADER, FOOTER = b"\xfe\xfe", 0xFA
MIN_LENGTH, MAX_LENGTH = 2, 30  # the M5 and the vendor's library take no longer ones
OVERHEAD = 3  # header, Len

Known = Mapping[int, frozenset[int]]
"""The commands, and how many bytes of parameters a frame of each may have."""


class Frame(NamedTuple):
    """One whole frame that can be believed."""

    id: int
    params: bytes

    @property
    def key(self) -> int:
        """What a reply is matched by."""
        return self.id

    def __bytes__(self) -> bytes:
        return encode(self)


def encode(frame: Frame) -> bytes:
    """Return a frame's bytes; raise ValueError if it is longer than the arm takes (28 bytes of parameters)."""
    length = MIN_LENGTH + len(frame.params)
    if length > MAX_LENGTH:
        raise ValueError(f"{len(frame.params)} bytes of parameters; a frame carries at most {MAX_LENGTH - MIN_LENGTH}")

    return HEADER + bytes((length, frame.id)) + frame.params + bytes((FOOTER,))


def request(command: Command[Any, Any], params: bytes, *, queued: bool) -> Frame:
    """Return the frame that asks the arm to do, or tell, what a row of the table says."""
    if queued and command.queueing is Queueing.NEVER:
        raise ValueError(f"{command.name} cannot be queued")

    return Frame(command.id, params)


class Parser:
    """Find frames in a stream that may be cut anywhere and may hold anything.

    Args:
        known: The commands of a model.

    Attributes:
        junk_bytes: Bytes so far that belong to no frame.
        bad_frames: Candidates so far with a length that their command has, but no footer behind it.
    """

    def __init__(self, known: Known) -> None:
        self.junk_bytes: int = 0
        self.bad_frames: int = 0
        self._known = known
        self._buffer = bytearray()

    @property
    def waiting(self) -> int:
        """How many bytes are kept because they may be the beginning of a frame."""
        return len(self._buffer)

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes of the stream, return the frames that they complete."""
        self._buffer += data
        return self._scan(0)

    def resync(self) -> list[Frame]:
        """Give up the frame that is still incomplete, return all whole frames that lie inside of it and behind it.

        For when the rest of it is overdue: its header was noise, or its tail is lost.
        """
        if len(self._buffer) <= len(HEADER):
            return []

        return self._scan(1, overdue=True)

    def reset(self) -> None:
        """Forget the frame that is still incomplete: another stream begins."""
        self.junk_bytes += len(self._buffer)
        self._buffer.clear()

    def _scan(self, at: int, *, overdue: bool = False) -> list[Frame]:
        """Take all frames out of the buffer, beginning at an offset.

        Ends at the first incomplete candidate; if it is overdue, looks for whole frames behind it first.
        """
        buffer = self._buffer
        frames: list[Frame] = []
        framed = 0
        keep: int | None = None
        while (at := find_header(buffer, at)) < len(buffer):
            end = self._end(at)
            if end is None:
                at += 1
            elif end > len(buffer):
                keep = at if keep is None else keep
                if not overdue:
                    break

                at += 1
            elif buffer[end - 1] != FOOTER:
                self.bad_frames += 1
                at += 1
            else:
                frames.append(Frame(buffer[at + 3], bytes(buffer[at + 4 : end - 1])))
                framed += end - at
                keep = None
                at = end

        at = at if keep is None else keep
        self.junk_bytes += at - framed
        del buffer[:at]
        return frames

    def _end(self, at: int) -> int | None:
        """Where the candidate ends that begins here, as far as it is known yet; None if it is none."""
        buffer = self._buffer
        seen = len(buffer) - at
        if seen <= len(HEADER):
            return at + OVERHEAD + MIN_LENGTH

        length = buffer[at + 2]
        if not MIN_LENGTH <= length <= MAX_LENGTH:
            return None

        if seen > OVERHEAD and length - MIN_LENGTH not in self._known.get(buffer[at + 3], ()):
            return None

        return at + OVERHEAD + length


def find_header(buffer: bytearray, at: int) -> int:
    """The offset of the next header, or of the half of one at the end, or the end."""
    start = buffer.find(HEADER, at)
    return start if start >= 0 else len(buffer) - buffer.endswith(HEADER[:1], at)
