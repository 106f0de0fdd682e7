"""What is fuzzed: functions of any bytes that return nothing, and fail by an exception where a promise is broken.

Each says how it reads its bytes, so that a seed can be written by hand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Any

from fuzz_mycobot import mycobot_arm, mycobot_parser
from fuzz_ultraarm import ultraarm_answers, ultraarm_arm, ultraarm_gcode

from dobot_async._core.protocol.wire import Layout
from dobot_async.arms.magician import alarms
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import HEADER, MAX_LENGTH, OVERHEAD, Frame, Parser
from dobot_async.errors import ProtocolError
from dobot_async.program import VOCABULARIES
from dobot_async.simulator import DeviceOptions, Quirks, SimulatedMagician

__all__ = ["TARGETS"]

LONGEST = MAX_LENGTH + OVERHEAD
SPLITS = 4
KEPT = 16
LAYOUTS: Mapping[int, Layout[Any]] = {id(each): each for row in c.ALL for each in (row.request, row.reply)}
"""Every layout of the table, once."""


def parser(data: bytes) -> None:
    """Four bytes say in which sizes, in turn, the rest arrives; one more after how many of them comes a resync."""
    sizes = [1 + byte for byte in data[:SPLITS]] or [1]
    stream = data[SPLITS + 1 :]
    pause = data[SPLITS] if len(data) > SPLITS else 0
    frames, at = reference(stream, 0, overdue=False)

    whole, split = Parser(), Parser()
    assert whole.feed(stream) == frames
    found = []
    for piece in pieces(stream, sizes):
        found += split.feed(piece)
        assert len(split._buffer) < LONGEST

    assert found == frames
    assert (split.junk_bytes, split.bad_frames) == (whole.junk_bytes, whole.bad_frames)
    assert split._buffer == whole._buffer
    assert whole._buffer == stream[at:]
    framed_bytes = sum(len(frame.params) + len(HEADER) + OVERHEAD for frame in frames)
    assert whole.junk_bytes + framed_bytes + len(whole._buffer) == len(stream)
    resynced(stream, pause)


def resynced(stream: bytes, pause: int) -> None:
    """A resync finds each whole frame that lies in what is kept, and the parser goes on from there."""
    here = Parser()
    here.feed(stream[:pause])
    kept = bytes(here._buffer)
    frames, _ = reference(kept, 1, overdue=True) if len(kept) > len(HEADER) else ([], 0)
    assert here.resync() == frames
    rest = bytes(here._buffer)
    assert kept.endswith(rest)
    later, _ = reference(rest + stream[pause:], 0, overdue=False)
    assert here.feed(stream[pause:]) == later
    assert len(here._buffer) < LONGEST


def reference(data: bytes, at: int, *, overdue: bool) -> tuple[list[Frame], int]:
    """What the parser finds, by trying every offset; and where the first candidate begins that is incomplete."""
    frames = []
    while at < len(data):
        length = data[at + 2] if data[at : at + 2] == HEADER and at + 2 < len(data) else None
        end = at + OVERHEAD + (length or 0)
        if length is None and not overdue and HEADER.startswith(data[at:]):
            break

        if length is None or not 2 <= length <= MAX_LENGTH or length == HEADER[0]:
            at += 1
        elif end > len(data):
            if not overdue:
                break

            at += 1
        elif sum(data[at + 3 : end]) % 256:
            at += 1
        else:
            frames.append(Frame(data[at + 3], data[at + 4], data[at + 5 : end - 1]))
            at = end

    return frames, at


def pieces(stream: bytes, sizes: list[int]) -> Iterator[bytes]:
    """The stream, cut into sizes that take turns."""
    at = turn = 0
    while at < len(stream):
        size = sizes[turn % len(sizes)]
        yield stream[at : at + size]
        at, turn = at + size, turn + 1


def layouts(data: bytes) -> None:
    """All bytes are the parameters of a request and of a reply, of every row."""
    for layout in LAYOUTS.values():
        try:
            value = layout.decode(data)
        except ProtocolError:
            continue

        with suppress(ValueError):  # a reading may be one that must not be sent
            sent = layout.encode(value)
            assert layout.encode(layout.decode(sent)) == sent


def session(data: bytes) -> None:
    """The first byte is the kind of arm, then come steps: a byte that says what, a byte that says how much.

    0 mod 4: so many bytes arrive. 1: so many tenths of a second pass. 2: a frame, of ID, Ctrl and so many parameters.
    3: the same, of the row of that number, its parameters filled up with zeros to the layout's size.
    """
    kind, at = (data[0] if data else 0), 1
    now = 0.0
    options = DeviceOptions(capacity=4, keep=KEPT, garbage_index_while_moving=bool(kind & 1))
    quirks = Quirks("index" if kind & 2 else "silent", bool(kind & 4), bool(kind & 8), bool(kind & 16), bool(kind & 32))
    arm = SimulatedMagician(lambda: now, options, quirks)
    here, replies = arm.session(), Parser()
    while at + 1 < len(data):
        what, much = data[at] % 4, data[at + 1]
        at += 2
        if what == 1:
            now += much / 10
            continue

        taken = much if what == 0 else 2 + much if what == 2 else 1 + much
        piece = data[at : at + taken]
        at += taken
        sent = here.receive(MESSAGES[what](piece))
        replies.feed(sent)
        assert not replies.junk_bytes
        assert not replies.bad_frames
        assert not replies._buffer
        assert len(here._parser._buffer) < LONGEST
        assert len(arm.device._queue) <= options.capacity
        assert len(arm.executed) <= KEPT


def framed(piece: bytes) -> bytes:
    """ID, Ctrl and parameters, as any peer may frame them, however many."""
    payload = piece[: MAX_LENGTH - 1].ljust(2, b"\0")
    return HEADER + bytes((len(payload),)) + payload + bytes((-sum(payload) & 0xFF,))


def of_row(piece: bytes) -> bytes:
    """A request of a row: its number and twice the bit of the queue, then parameters."""
    number, params = (piece[0] if piece else 0), piece[1:]
    row = c.ALL[(number >> 1) % len(c.ALL)]
    layout = getattr(row.request, "layout", row.request)
    size = layout.struct.size if hasattr(layout, "struct") else len(params)
    return framed(bytes((row.id, row.write | (number & 1) << 1)) + params.ljust(size, b"\0"))


MESSAGES: Mapping[int, Callable[[bytes], bytes]] = {0: bytes, 2: framed, 3: of_row}


def alarm_bits(data: bytes) -> None:
    """All bytes are an alarm state, whatever its length."""
    found = alarms.decode(data)
    codes = [alarm.code for alarm in found]
    assert codes == sorted(set(codes))
    assert sum(1 << code for code in codes) == int.from_bytes(data, "little")
    assert all(str(alarm) and alarms.lookup(alarm.code) == alarm for alarm in found)
    if len(data) <= alarms.SIZE:
        assert alarms.encode(codes) == data.ljust(alarms.SIZE, b"\0")
    assert set(alarms.faults(found)) == {alarm for alarm in found if alarm.code not in alarms.IGNORED}


def program(data: bytes) -> None:
    """A program file; what is not UTF-8 is replaced."""
    lines = data.decode("utf-8", "replace").split("\n")
    try:
        steps = VOCABULARIES["magician"].parse(lines)
    except ValueError as error:
        messages = str(error).split("\n")
        assert all(message.startswith("line ") for message in messages), messages
        return

    again = VOCABULARIES["magician"].parse([step.text for step in steps])
    for step, same in zip(steps, again, strict=True):
        assert step.command is same.command
        assert step.command.request.encode(step.value) == same.command.request.encode(same.value)


TARGETS: Mapping[str, Callable[[bytes], None]] = {
    "parser": parser,
    "layouts": layouts,
    "session": session,
    "alarms": alarm_bits,
    "program": program,
    "mycobot_parser": mycobot_parser,
    "mycobot_arm": mycobot_arm,
    "ultraarm_answers": ultraarm_answers,
    "ultraarm_arm": ultraarm_arm,
    "ultraarm_gcode": ultraarm_gcode,
}
