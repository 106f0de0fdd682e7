"""What is fuzzed of the ultraArm; see fuzz_targets."""

from __future__ import annotations

from contextlib import suppress

from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.answers import Answer, Refusal
from dobot_async.arms.ultraarm.frame import LONGEST, Parser
from dobot_async.arms.ultraarm.gcode import parse_gcode
from dobot_async.errors import ProtocolError
from dobot_async.simulator import DeviceOptions, SimulatedUltraArm, UltraArmQuirks

__all__ = ["ultraarm_answers", "ultraarm_arm", "ultraarm_gcode"]

SPLITS = 4
DECODERS = {id(row.reply): Answer[object](row.reply) for row in c.ALL}


def ultraarm_answers(data: bytes) -> None:
    """Four bytes say in which sizes, in turn, the rest arrives: answers are the same as whole, and each can be read."""
    sizes = [1 + byte for byte in data[:SPLITS]] or [1]
    stream = data[SPLITS:]
    whole, split = Parser(), Parser()
    expected = whole.feed(stream)
    found, at, turn = [], 0, 0
    while at < len(stream):
        size = sizes[turn % len(sizes)]
        found += split.feed(stream[at : at + size])
        assert len(split._buffer) <= LONGEST
        at, turn = at + size, turn + 1

    if len(stream) <= LONGEST:
        assert found == expected

    for frame in found:
        for decoder in DECODERS.values():
            with suppress(ProtocolError):
                value = decoder.decode(frame.params)
                if not isinstance(value, Refusal):
                    decoder.encode(value)


def ultraarm_arm(data: bytes) -> None:
    """The first byte is the kind of arm; then bytes arrive, and at each 0xFF a tenth of a second passes."""
    kind, now = (data[0] if data else 0), 0.0
    quirks = UltraArmQuirks(
        acknowledge=("size", "ok", "nothing")[kind % 3],
        later=not kind & 4,
        blanks=bool(kind & 8),
        dwell_rests=bool(kind & 16),
        jog_stop="all" if kind & 32 else "jog",
        release="queued" if kind & 64 else "now",
    )
    options = DeviceOptions(4, bool(kind & 128), 1, 0, power_up_alarms=frozenset(), keep=16)
    arm = SimulatedUltraArm(lambda: now, options, quirks)
    session = arm.session()
    for piece in data[1:].split(b"\xff"):
        session.receive(piece).decode("ascii")
        assert len(arm.device._queue) <= options.capacity
        assert len(arm.executed) <= 16
        now += 0.1


def ultraarm_gcode(data: bytes) -> None:
    """A G-code file; what is not UTF-8 is replaced. What passes can be sent, and reads the same a second time."""
    lines = data.decode("utf-8", "replace").split("\n")
    try:
        steps = parse_gcode(lines)
    except ValueError as error:
        messages = str(error).split("\n")
        assert all(message.startswith("line ") for message in messages), messages
        return

    for step in steps:
        sent = step.command.request.encode(step.value)
        assert b"e" not in sent
        assert step.command.request.encode(step.command.request.decode(sent)) == sent
