"""The Magician as a bridge sees it: kinds of frames, what fits, and when the arm moves for a program."""

from __future__ import annotations

import pytest

from dobot_async._core.protocol.wire import Command, Number, Queueing, u64
from dobot_async.arms.bridge_adapter import RequestKind
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.bridge_adapter import BRIDGED, MagicianWatch
from dobot_async.arms.magician.frame import QUEUED, WRITE, Frame
from dobot_async.errors import ProtocolError

INDEX: Number[int] = Number(u64)
PTP = c.SET_PTP_CMD.request.encode(c.PTPCmd(c.PTPMode.MOVJ_XYZ, 200, 0, 40, 0))


def jog(key: c.JOGKey, ctrl: int = WRITE) -> Frame:
    return Frame(73, ctrl, c.SET_JOG_CMD.request.encode(c.JOGCmd(is_joint=True, cmd=key)))


def queued(index: int | None = None) -> tuple[Frame, Frame]:
    """A queued motion and its acknowledgement."""
    return Frame(84, WRITE | QUEUED, PTP), Frame(84, WRITE | QUEUED, INDEX.encode(index or 0))


FORCE_STOP, EMPTY = Frame(242, WRITE, b""), Frame(245, WRITE, b"")


def do(watch: MagicianWatch, frame: Frame) -> None:
    """A request and its answer."""
    watch.sent(frame)
    watch.answered(frame, frame)


def told(index: int) -> Frame:
    return Frame(246, 0, INDEX.encode(index))


@pytest.mark.parametrize("row", c.ALL, ids=repr)
def test_a_row_is_what_the_table_says(row: Command[object, object]) -> None:
    frame = Frame(row.id, row.write * WRITE, b"")
    stops = {c.SET_QUEUED_CMD_FORCE_STOP_EXEC.id, c.SET_QUEUED_CMD_STOP_EXEC.id}
    expected = RequestKind.STOP if row.id in stops else RequestKind.WRITE if row.write else RequestKind.READ
    assert BRIDGED.kind(frame) is expected
    assert BRIDGED.name(frame) == row.name
    if row.queueing is not Queueing.NEVER:
        assert not BRIDGED.repeatable(Frame(row.id, WRITE | QUEUED, b""))


@pytest.mark.parametrize(
    ("frame", "kind"),
    [
        (jog(c.JOGKey.IDLE), RequestKind.STOP),
        (jog(c.JOGKey.AP_DOWN), RequestKind.WRITE),
        (jog(c.JOGKey.IDLE, WRITE | QUEUED), RequestKind.WRITE),
        (Frame(242, 0, b""), RequestKind.STOP),
        (Frame(84, 0, PTP), RequestKind.WRITE),
        (Frame(10, QUEUED, b""), RequestKind.WRITE),
        (Frame(10, 0b100, b""), RequestKind.READ),
        (Frame(7, 0, b""), RequestKind.READ),
        (Frame(99, 0, b""), RequestKind.WRITE),
        (Frame(160, 0, b""), RequestKind.WRITE),
    ],
)
def test_what_is_no_known_read_is_a_write(frame: Frame, kind: RequestKind) -> None:
    assert BRIDGED.kind(frame) is kind


@pytest.mark.parametrize(
    ("frame", "repeatable"),
    [
        (Frame(10, 0, b""), True),
        (Frame(83, WRITE, b""), True),
        (Frame(83, WRITE | QUEUED, b""), False),
        (Frame(84, WRITE, PTP), False),
        (jog(c.JOGKey.AP_DOWN), False),
        (jog(c.JOGKey.IDLE), True),
        (Frame(242, WRITE, b""), True),
        (Frame(135, WRITE, b""), False),
        (Frame(99, WRITE, b""), False),
    ],
)
def test_nothing_that_moves_is_sent_again(frame: Frame, repeatable: bool) -> None:
    assert BRIDGED.repeatable(frame) == repeatable


@pytest.mark.parametrize(
    ("request_", "reply", "fits"),
    [
        (Frame(10, 0, b""), Frame(10, 0, bytes(32)), True),
        (Frame(10, 0, b""), Frame(10, 0, bytes(31)), False),
        (Frame(83, WRITE, b""), Frame(83, WRITE, b""), True),
        (Frame(83, 0, b""), Frame(83, WRITE, b""), False),
        (queued()[0], queued(7)[1], True),
        (queued()[0], Frame(84, WRITE | QUEUED, b""), False),
        (Frame(240, WRITE | QUEUED, b""), Frame(240, WRITE, b""), True),
        (Frame(134, 0, b"\x05"), Frame(134, 0, b"\x05\x01\x00"), True),
        (Frame(134, 0, b"\x05"), Frame(134, 0, b"\x06\x01\x00"), False),
        (Frame(99, 0, b""), Frame(99, 0, b"anything"), True),
        (Frame(99, 0, b""), Frame(99, 0, bytes(200)), False),
    ],
)
def test_an_answer_fits_its_request(request_: Frame, reply: Frame, fits: bool) -> None:
    if fits:
        assert BRIDGED.accept(request_, reply) == reply
    else:
        with pytest.raises(ProtocolError):
            BRIDGED.accept(request_, reply)


def test_the_arm_moves_until_the_last_index_is_reached() -> None:
    watch = MagicianWatch()
    assert not watch.moving(None)
    request, reply = queued(5)
    watch.sent(request)
    assert watch.moving(told(100))
    watch.answered(request, reply)
    assert watch.moving(None)
    assert watch.moving(told(4))
    assert not watch.moving(told(5))
    assert not watch.moving(told(6))
    assert watch.moving(told(2**64 - 1))
    do(watch, FORCE_STOP)
    do(watch, EMPTY)
    assert not watch.moving(None)


@pytest.mark.parametrize(
    ("on", "off"),
    [
        (jog(c.JOGKey.AP_DOWN), jog(c.JOGKey.IDLE)),
        (Frame(61, WRITE, b"\1\1"), Frame(61, WRITE, b"\0\0")),
        (Frame(135, WRITE, b"\0\1\0\0\0\0"), Frame(135, WRITE, b"\0\0\0\0\0\0")),
        (Frame(84, WRITE, PTP), Frame(242, WRITE, b"")),
    ],
)
def test_what_has_no_index_goes_on_until_it_is_switched_off(on: Frame, off: Frame) -> None:
    watch = MagicianWatch()
    watch.sent(on)
    assert watch.moving(None)
    watch.sent(off)
    assert watch.moving(None), "it may be lost on its way"
    watch.answered(off, off)
    assert not watch.moving(None)


@pytest.mark.parametrize("halted", [False, True])
def test_clearing_the_queue_ends_no_immediate_motion_and_not_surely_the_queued_one(halted: bool) -> None:
    watch = MagicianWatch()
    do(watch, Frame(84, WRITE, PTP))
    do(watch, EMPTY)
    assert watch.moving(None)
    do(watch, FORCE_STOP)
    assert not watch.moving(None)
    request, reply = queued(3)
    watch.sent(request)
    watch.answered(request, reply)
    if halted:
        do(watch, FORCE_STOP)

    do(watch, EMPTY)
    assert watch.moving(None) is not halted


def test_a_clear_that_was_not_answered_ends_nothing() -> None:
    watch = MagicianWatch()
    request, reply = queued(3)
    watch.sent(request)
    watch.answered(request, reply)
    do(watch, FORCE_STOP)
    watch.sent(EMPTY)
    assert watch.moving(told(2))


def test_the_pwm_of_each_pin_is_ended() -> None:
    watch = MagicianWatch()
    on = [Frame(132, WRITE, c.SET_IOPWM.request.encode(c.IOPWM(pin, 50, 7.5))) for pin in (4, 6)]
    for frame in on:
        do(watch, frame)

    assert watch.moving(None)
    assert [c.SET_IOPWM.request.decode(frame.params) for frame in watch.off()] == [
        c.IOPWM(4, 1000, 0),
        c.IOPWM(6, 1000, 0),
    ]
    for frame in watch.off():
        do(watch, frame)

    assert not watch.moving(None)


def test_one_motor_does_not_stop_the_other() -> None:
    watch = MagicianWatch()
    watch.sent(Frame(135, WRITE, b"\0\1\0\0\0\0"))
    watch.sent(Frame(135, WRITE, b"\1\0\0\0\0\0"))
    assert watch.moving(None)


def test_a_frame_may_be_too_long_for_the_arm() -> None:
    BRIDGED.check(Frame(1, WRITE, bytes(167)))
    with pytest.raises(ProtocolError):
        BRIDGED.check(Frame(1, WRITE, bytes(168)))


def test_the_stop_comes_first_and_no_group_blocks_it() -> None:
    assert BRIDGED.stopping[0].id == c.SET_QUEUED_CMD_FORCE_STOP_EXEC.id
    blocked = set().union(*BRIDGED.deny_groups.values())
    assert not blocked & {frame.id for frame in BRIDGED.stopping}
    assert {150, 151, 152, 140, 160} <= blocked
