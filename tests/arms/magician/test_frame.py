"""The parser against a naive reading of the same stream, and the limits of a frame."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import MAX_PARAMS, Frame, Parser, encode, request

LONGEST = 254  # header, Len, 250 of payload, Checksum

frames = st.builds(Frame, st.integers(0, 255), st.integers(0, 255), st.binary(max_size=MAX_PARAMS))
quiet = st.binary(max_size=12).map(lambda noise: noise.replace(b"\xaa", b"\x55"))
noise = st.one_of(
    st.binary(max_size=12),
    st.lists(st.sampled_from([b"\xaa", b"\x02", b"\xaa\xaa\x05", b"\xaa\xaa\xfa", b"\xaa\xaa\xff"])).map(b"".join),
)
streams = st.lists(st.one_of(frames.map(bytes), noise), max_size=8).map(b"".join)
cuts = st.lists(st.integers(0, 2000), max_size=12)


def pieces(stream: bytes, at: Iterable[int]) -> list[bytes]:
    """A stream, cut at some offsets."""
    marks = sorted({0, len(stream), *(offset % (len(stream) + 1) for offset in at)})
    return [stream[a:b] for a, b in pairwise(marks)]


def read(stream: bytes) -> list[Frame]:
    """All frames of a stream whose end is known: at each byte a whole good frame, or one byte on."""
    found, at = [], 0
    while at < len(stream):
        length = stream[at + 2] if len(stream) > at + 2 else 0
        whole = stream[at : at + 4 + length]
        if (
            whole[:2] == b"\xaa\xaa"
            and 2 <= length <= 250
            and length != 0xAA
            and len(whole) == 4 + length
            and sum(whole[3:]) % 256 == 0
        ):
            found.append(Frame(whole[3], whole[4], whole[5:-1]))
            at += len(whole)
        else:
            at += 1

    return found


def feed(parser: Parser, chunks: Iterable[bytes]) -> list[Frame]:
    """What a parser finds in a stream of chunks."""
    found = []
    for chunk in chunks:
        found += parser.feed(chunk)
        assert len(parser._buffer) < LONGEST

    return found


@given(frames)
def test_frame_round_trip(frame: Frame) -> None:
    data = bytes(frame)

    assert data == encode(frame)
    assert len(data) == 6 + len(frame.params)
    assert sum(data[3:]) % 256 == 0
    assert Parser().feed(data) == [frame]


@given(st.lists(st.tuples(quiet, frames), max_size=6), cuts)
def test_noise_without_headers_costs_no_frame_and_no_time(parts: list[tuple[bytes, Frame]], at: list[int]) -> None:
    stream = b"".join(before + bytes(frame) for before, frame in parts)
    parser = Parser()

    assert feed(parser, pieces(stream, at)) == [frame for _, frame in parts]
    assert parser.junk_bytes == sum(len(before) for before, _ in parts)
    assert parser.bad_frames == 0
    assert not parser._buffer


@given(streams, cuts)
@example(b"\xaa\xaa\xfa" * 2 + bytes(Frame(10, 0, b"")), [])
def test_any_stream_cut_anywhere_gives_all_its_frames_after_a_resync(stream: bytes, at: list[int]) -> None:
    parser = Parser()

    assert feed(parser, pieces(stream, at)) + parser.resync() == read(stream)
    assert len(parser._buffer) < LONGEST


@given(streams)
def test_cuts_change_nothing(stream: bytes) -> None:
    whole, single = Parser(), Parser()

    assert whole.feed(stream) == feed(single, (stream[i : i + 1] for i in range(len(stream))))
    assert (whole.junk_bytes, whole.bad_frames) == (single.junk_bytes, single.bad_frames)


@given(streams)
def test_every_byte_is_in_a_frame_or_junk_or_still_waiting(stream: bytes) -> None:
    parser = Parser()
    found = [*parser.feed(stream), *parser.resync()]

    assert sum(len(bytes_of(frame)) for frame in found) + parser.junk_bytes + len(parser._buffer) == len(stream)


@given(streams, frames)
def test_repeated_resyncs_leave_nothing_in_the_way(before: bytes, frame: Frame) -> None:
    parser = Parser()
    parser.feed(before)
    for _ in range(LONGEST):
        parser.resync()

    assert len(parser._buffer) <= 2
    assert parser.feed(bytes(frame))[-1:] == [frame]


def test_false_header_stalls_until_resync_and_swallows_nothing() -> None:
    parser = Parser()
    pose, name = Frame(10, 0, bytes(32)), Frame(1, 0, b"Hello\0")

    assert parser.feed(b"\xaa\xaa\xfa" + bytes(pose) + bytes(name)) == []
    assert parser.resync() == [pose, name]
    assert parser.junk_bytes == 3


def test_resync_keeps_a_frame_that_is_still_coming() -> None:
    parser = Parser()
    late = Frame(10, 0, b"\xaa\xaa\x20" + bytes(29))
    parser.feed(b"\xaa\xaa\xfa" + bytes(late)[:20])

    assert parser.resync() == []
    assert parser.feed(bytes(late)[20:]) == [late]


def test_resync_with_nothing_or_half_a_header_does_nothing() -> None:
    parser = Parser()

    assert parser.resync() == []
    parser.feed(b"\xaa")
    assert parser.resync() == []
    assert parser.junk_bytes == 0
    assert parser.feed(bytes(Frame(10, 0, b""))[1:]) == [Frame(10, 0, b"")]


def test_wrong_checksum_is_counted_and_hides_nothing() -> None:
    parser = Parser()
    good = Frame(240, 1, b"")
    bad = bytearray(bytes(Frame(10, 0, b"")))
    bad[-1] ^= 1

    assert parser.feed(bytes(bad) + bytes(good)) == [good]
    assert (parser.bad_frames, parser.junk_bytes) == (1, 6)


@pytest.mark.parametrize("run", range(2, 8))
def test_run_of_header_bytes_ends_in_the_last_two(run: int) -> None:
    frame = Frame(10, 0, b"")

    assert Parser().feed(b"\xaa" * (run - 2) + bytes(frame)) == [frame]


@pytest.mark.parametrize("length", [0, 1, 251, 255])
def test_impossible_length_does_not_wait(length: int) -> None:
    frame = Frame(10, 0, b"")

    assert Parser().feed(bytes((0xAA, 0xAA, length)) + bytes(frame)) == [frame]


def test_good_sum_does_not_make_a_frame_of_an_impossible_length() -> None:
    assert Parser().feed(b"\xaa\xaa\x01\x0a\xf6") == Parser().feed(b"\xaa\xaa\x00\x00") == []


def test_replies_may_be_longer_than_requests() -> None:
    payload = bytes((10, 0)) + bytes(248)
    data = b"\xaa\xaa\xfa" + payload + bytes((-sum(payload) & 0xFF,))

    assert Parser().feed(data) == [Frame(10, 0, bytes(248))]


def test_encode_refuses_what_the_arm_cannot_hold() -> None:
    assert len(encode(Frame(1, 1, bytes(MAX_PARAMS)))) == 173
    with pytest.raises(ValueError, match="at most 167"):
        encode(Frame(1, 1, bytes(MAX_PARAMS + 1)))

    with pytest.raises(ValueError, match="byte"):
        encode(Frame(256, 1, b""))


def test_request_sets_the_control_bits() -> None:
    assert request(c.GET_POSE, b"", queued=False) == Frame(10, 0, b"")
    assert request(c.SET_IODO, b"\1\1", queued=False) == Frame(131, 1, b"\1\1")
    assert request(c.SET_IODO, b"\1\1", queued=True) == Frame(131, 3, b"\1\1")
    with pytest.raises(ValueError, match="GetPose cannot be queued"):
        request(c.GET_POSE, b"", queued=True)


def test_frame_says_what_its_control_bits_mean() -> None:
    assert [(frame.write, frame.queued) for frame in (Frame(1, ctrl, b"") for ctrl in range(4))] == [
        (False, False),
        (True, False),
        (False, True),
        (True, True),
    ]
    assert Frame(10, 0, b"").key == Frame(10, 3, b"x").key


def bytes_of(frame: Frame) -> bytes:
    """A frame's bytes, also of one that is longer than a request may be."""
    payload = bytes((frame.id, frame.ctrl)) + frame.params
    return b"\xaa\xaa" + bytes((len(payload),)) + payload + bytes((-sum(payload) & 0xFF,))
