"""What is fuzzed of the myCobot family; see fuzz_targets."""

from __future__ import annotations

from contextlib import suppress

from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.frame import MAX_LENGTH, Frame, Parser
from dobot_async.arms.mycobot.models import MODELS
from dobot_async.errors import ProtocolError
from dobot_async.simulator import DeviceOptions, MyCobotQuirks, SimulatedMyCobot

__all__ = ["mycobot_arm", "mycobot_parser"]

SPLITS = 4
MODEL = MODELS["myarm300"]
NAMES = tuple(MODELS)


def mycobot_parser(data: bytes) -> None:
    """Four bytes say in which sizes, in turn, the rest arrives: the same frames as whole, and each can be read."""
    sizes = [1 + byte for byte in data[:SPLITS]] or [1]
    stream = data[SPLITS:]
    whole, split = Parser(MODEL.known), Parser(MODEL.known)
    expected = whole.feed(stream)
    found: list[Frame] = []
    at = turn = 0
    while at < len(stream):
        size = sizes[turn % len(sizes)]
        found += split.feed(stream[at : at + size])
        assert split.waiting < MAX_LENGTH + 3
        at, turn = at + size, turn + 1

    assert found == expected
    assert (split.junk_bytes, split.bad_frames, split.waiting) == (whole.junk_bytes, whole.bad_frames, whole.waiting)
    found += split.resync()
    assert sum(len(bytes(frame)) for frame in found) + split.junk_bytes + split.waiting == len(stream)
    for frame in found:
        assert bytes(frame) in stream
        row = MODEL.row(MODEL.by_id[frame.id])
        for layout in (row.request, row.reply):
            with suppress(ProtocolError):
                layout.decode(frame.params)


def mycobot_arm(data: bytes) -> None:
    """The first byte is the kind of arm; then bytes arrive, and at each 0xFF a tenth of a second passes."""
    kind, now = (data[0] if data else 0), 0.0
    quirks = MyCobotQuirks(
        acknowledges=bool(kind & 8), later=not kind & 16, transponder=not kind & 32, echo=bool(kind & 64)
    )
    options = DeviceOptions(4, True, 1, 0, on_fault="continue", power_up_alarms=frozenset(), keep=16)
    arm = SimulatedMyCobot(lambda: now, options, quirks, model=NAMES[(kind & 7) % len(NAMES)])
    session, replies = arm.session(), Parser(arm.model.known)
    for piece in data[1:].split(b"\xff"):
        replies.feed(session.receive(piece))
        assert replies.waiting == 0
        assert len(arm.device._queue) <= options.capacity
        now += 0.1

    limits = arm.ways.limits
    assert len(arm.joints) == len(limits)
    assert arm.settings.keys() >= {c.SET_FRESH_MODE}
