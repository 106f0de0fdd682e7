"""The Magician's frames. Bytes in, frames out; no I/O.

    AA AA | Len | ID | Ctrl | Params ... | Checksum          Len = 2 + len(Params)
                  `------- summed -----------------'         sum = 0 (mod 256)

Ctrl: bit 0 rw (1 = write), bit 1 isQueued; the others stay 0 for a Magician. Manual 2.2. Sizes from the vendor's
sources: a request has at most 169 bytes of ID, Ctrl and Params, and an answer may have up to 250.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from dobot_async._core.protocol.wire import Command, Queueing

__all__ = ["FILLER", "MAX_PARAMS", "QUEUED", "WRITE", "Frame", "Parser", "encode", "request"]

HEADER = b"\xaa\xaa"
OVERHEAD = 4  # header, Len, Checksum
MIN_LENGTH, MAX_LENGTH = 2, 250
HEADER_LENGTH = 0xAA  # as a Len it is the third AA of a run: noise before a header, never sent by an arm
MAX_PARAMS = 167
FILLER = bytes(MAX_LENGTH + OVERHEAD)
WRITE, QUEUED = 0b01, 0b10


class Frame(NamedTuple):
    """One whole frame with a good checksum."""

    id: int
    ctrl: int
    params: bytes

    @property
    def key(self) -> int:
        """What a reply is matched by: the ID alone, for the manual shows replies with another Ctrl (Figure 29)."""
        return self.id

    @property
    def queued(self) -> bool:
        """Whether it goes, or went, through the arm's queue."""
        return bool(self.ctrl & QUEUED)

    @property
    def write(self) -> bool:
        """Whether it sets something."""
        return bool(self.ctrl & WRITE)

    def __bytes__(self) -> bytes:
        return encode(self)


def encode(frame: Frame) -> bytes:
    """Returns a frame's bytes; raises ValueError if it is longer than the arm's buffer (167 bytes of parameters)."""
    if len(frame.params) > MAX_PARAMS:
        raise ValueError(f"{len(frame.params)} bytes of parameters; a frame carries at most {MAX_PARAMS}")

    payload = bytes((frame.id, frame.ctrl)) + frame.params
    return HEADER + bytes((len(payload),)) + payload + bytes((-sum(payload) & 0xFF,))


def request(command: Command[Any, Any], params: bytes, *, queued: bool) -> Frame:
    """Returns the frame that asks the arm to do, or tell, what a row of the table says."""
    if queued and command.queueing is Queueing.NEVER:
        raise ValueError(f"{command.name} cannot be queued")

    return Frame(command.id, command.write * WRITE | queued * QUEUED, params)


class Parser:
    """Finds frames in a stream that may be cut anywhere and may hold anything.

    A byte that cannot begin a frame is junk; a frame whose sum is wrong is bad, and the search goes on one byte
    further, so a false header hides nothing. At most one frame's length is kept.

    Attributes:
        junk_bytes: Bytes so far that belong to no frame.
        bad_frames: Candidates so far whose checksum was wrong.
    """

    def __init__(self) -> None:
        self.junk_bytes: int = 0
        self.bad_frames: int = 0
        self._buffer = b""
        self._whole = 0  # how long the buffer has to be for the candidate at its beginning to be whole

    def feed(self, data: bytes) -> list[Frame]:
        """Takes the next bytes of the stream, returns the frames that they complete."""
        self._buffer += data
        return self._scan(0) if len(self._buffer) >= self._whole else []

    def resync(self) -> list[Frame]:
        """Gives up the frame that is still incomplete, returns all whole frames that lie inside of it and behind it.

        For when the rest of it is overdue: its header was noise, or its tail is lost.
        """
        if len(self._buffer) <= len(HEADER):
            return []

        return self._scan(1, overdue=True)

    def reset(self) -> None:
        """Forgets the frame that is still incomplete: another stream begins."""
        self.junk_bytes += len(self._buffer)
        self._buffer = b""
        self._whole = 0

    def _scan(self, at: int, *, overdue: bool = False) -> list[Frame]:
        """Takes all frames out of the buffer, beginning at an offset.

        Ends at the first incomplete candidate; if it is overdue, looks for whole frames behind it first.
        """
        buffer, size = self._buffer, len(self._buffer)
        frames: list[Frame] = []
        framed = 0
        keep = None
        while True:
            at = find_header(buffer, at)
            if size - at <= len(HEADER):
                break

            length = buffer[at + 2]
            end = at + OVERHEAD + length
            if not MIN_LENGTH <= length <= MAX_LENGTH or length == HEADER_LENGTH:
                at += 1
            elif end > size:
                keep = at if keep is None else keep
                if not overdue:
                    break

                at += 1
            elif sum(buffer[at + 3 : end]) & 0xFF:
                self.bad_frames += 1
                at += 1
            else:
                frames.append(Frame(buffer[at + 3], buffer[at + 4], buffer[at + 5 : end - 1]))
                framed += end - at
                keep = None
                at = end

        at = at if keep is None else keep
        self._whole = OVERHEAD + buffer[at + 2] if keep is not None else 0
        self.junk_bytes += at - framed
        self._buffer = buffer[at:]
        return frames


def find_header(buffer: bytes, at: int) -> int:
    """The offset of the next header, or of the half of one at the end, or the end."""
    start = buffer.find(HEADER, at)
    return start if start >= 0 else len(buffer) - buffer.endswith(HEADER[:1], at)
