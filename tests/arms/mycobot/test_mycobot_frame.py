"""The parser against a naive reading of the same stream, and what it believes."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.frame import MAX_LENGTH, Frame, Parser, encode, request
from dobot_async.arms.mycobot.models import MODELS

MODEL = MODELS["mycobot280"]
KNOWN = MODEL.known
LONGEST = MAX_LENGTH + 3
ANGLES = Frame(0x20, bytes.fromhex("03 e8 f7 fe 0b d1 f0 15 13 88 e8 90"))

sizes = [(number, size) for number, found in KNOWN.items() for size in found]
frames = st.sampled_from(sizes).flatmap(
    lambda each: st.builds(Frame, st.just(each[0]), st.binary(min_size=each[1], max_size=each[1]))
)
quiet = st.binary(max_size=12).map(lambda noise: noise.replace(b"\xfe", b"\x55"))
noise = st.one_of(
    st.binary(max_size=12),
    st.lists(st.sampled_from([b"\xfe", b"\xfe\xfe", b"\xfa", b"ok--------------\r\n", b"\xfe\xfe\x1e\x20"])).map(
        b"".join
    ),
)
streams = st.lists(st.one_of(frames.map(bytes), noise), max_size=8).map(b"".join)
cuts = st.lists(st.integers(0, 400), max_size=12)


def pieces(stream: bytes, at: Iterable[int]) -> list[bytes]:
    """A stream, cut at some offsets."""
    marks = sorted({0, len(stream), *(offset % (len(stream) + 1) for offset in at)})
    return [stream[a:b] for a, b in pairwise(marks)]


def read(stream: bytes) -> list[Frame]:
    """All frames of a stream whose end is known: at each byte a whole frame that can be believed, or one byte on."""
    found, at = [], 0
    while at < len(stream):
        length = stream[at + 2] if len(stream) > at + 2 else 0
        whole = stream[at : at + 3 + length]
        if (
            whole[:2] == b"\xfe\xfe"
            and 2 <= length <= MAX_LENGTH
            and len(whole) == 3 + length
            and whole[-1] == 0xFA
            and length - 2 in KNOWN.get(whole[3], ())
        ):
            found.append(Frame(whole[3], whole[4:-1]))
            at += len(whole)
        else:
            at += 1

    return found


def feed(parser: Parser, chunks: Iterable[bytes]) -> list[Frame]:
    """What a parser finds in a stream of chunks."""
    found = []
    for chunk in chunks:
        found += parser.feed(chunk)
        assert parser.waiting < LONGEST

    return found


@given(frames)
def test_frame_round_trip(frame: Frame) -> None:
    data = bytes(frame)
    assert data == encode(frame)
    assert len(data) == 5 + len(frame.params)
    assert Parser(KNOWN).feed(data) == [frame]


@given(st.lists(st.tuples(quiet, frames), max_size=6), cuts)
def test_noise_without_headers_costs_no_frame_and_no_time(parts: list[tuple[bytes, Frame]], at: list[int]) -> None:
    stream = b"".join(before + bytes(frame) for before, frame in parts)
    parser = Parser(KNOWN)
    assert feed(parser, pieces(stream, at)) == [frame for _, frame in parts]
    assert parser.junk_bytes == sum(len(before) for before, _ in parts)
    assert parser.waiting == 0


@given(streams, cuts)
@example(b"\xfe\xfe\x0e" * 2 + bytes(ANGLES), [])
@example(b"\xfe\xfe\x0e\x20" + bytes(ANGLES), [])
def test_any_stream_cut_anywhere_gives_all_its_frames_after_a_resync(stream: bytes, at: list[int]) -> None:
    parser = Parser(KNOWN)
    assert feed(parser, pieces(stream, at)) + parser.resync() == read(stream)
    assert parser.waiting < LONGEST


@given(streams)
def test_cuts_change_nothing(stream: bytes) -> None:
    whole, single = Parser(KNOWN), Parser(KNOWN)
    assert whole.feed(stream) == feed(single, (stream[i : i + 1] for i in range(len(stream))))
    assert (whole.junk_bytes, whole.bad_frames) == (single.junk_bytes, single.bad_frames)


@given(streams)
def test_every_byte_is_in_a_frame_or_junk_or_still_waiting(stream: bytes) -> None:
    parser = Parser(KNOWN)
    found = [*parser.feed(stream), *parser.resync()]
    assert sum(len(bytes(frame)) for frame in found) + parser.junk_bytes + parser.waiting == len(stream)


@given(frames, st.integers(1, 40))
def test_one_fe_too_many_costs_nothing(frame: Frame, count: int) -> None:
    assert Parser(KNOWN).feed(b"\xfe" * count + bytes(frame)) == [frame]


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a command that nobody knows", "FE FE 03 63 17 FA"),
        ("a length that the command does not have", "FE FE 03 20 01 FA"),
        ("that of an arm with seven joints", "FE FE 10 20" + " 00" * 14 + " FA"),
        ("no footer", "FE FE 03 2B 01 FB"),
        ("a length of nothing", "FE FE 01 2B FA"),
        ("a length beyond all", "FE FE 1F 20" + " 00" * 29 + " FA"),
    ],
)
def test_what_is_not_believed(name: str, data: str) -> None:
    parser = Parser(KNOWN)
    assert parser.feed(bytes.fromhex(data) + bytes(ANGLES)) == [ANGLES], name
    assert parser.junk_bytes == len(bytes.fromhex(data))


def test_a_frame_that_has_lost_its_tail_does_not_take_the_next_one_with_it() -> None:
    following = Frame(0x2B, b"\x01")
    parser = Parser(KNOWN)
    assert parser.feed(bytes(ANGLES)[:-4]) == []
    assert parser.feed(bytes(following)) == [following]
    assert parser.feed(bytes(ANGLES)[:-8]) == []
    assert parser.feed(bytes(following)) == []
    assert parser.resync() == [following]
    assert parser.waiting == 0


def test_a_reset_forgets_half_a_frame() -> None:
    parser = Parser(KNOWN)
    parser.feed(bytes(ANGLES)[:-1])
    parser.reset()
    assert parser.feed(b"\xfa") == []
    assert parser.junk_bytes == len(bytes(ANGLES))


def test_a_frame_has_a_greatest_length() -> None:
    longest = Frame(0x3E, bytes(28))
    assert Parser(MODELS["myarm300"].known).feed(encode(longest)) == [longest]
    with pytest.raises(ValueError, match="at most 28"):
        encode(Frame(0x3E, bytes(29)))


def test_what_is_immediate_cannot_be_queued() -> None:
    assert request(c.SEND_ANGLES, b"", queued=True) == Frame(0x22, b"")
    with pytest.raises(ValueError, match="cannot be queued"):
        request(c.GET_ANGLES, b"", queued=True)
