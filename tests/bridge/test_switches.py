"""What a program has switched on is off after it has gone, in whatever order it was told on, off, stop and clear."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import pytest

from dobot_async.arms.bridge_adapter import ClientWatch, Switch
from dobot_async.arms.magician import bridge_adapter as magician
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame, Parser, request
from dobot_async.arms.ultraarm import bridge_adapter as ultraarm
from dobot_async.arms.ultraarm.bridge_lines import BridgedLine
from dobot_async.arms.ultraarm.frame import END
from dobot_async.simulator import SimulatedMagician, SimulatedUltraArm, UltraArmQuirks

LATER = 60.0  # seconds


class Clock:
    """Seconds that a test sets."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def frame(command: Any, value: Any = None, *, queued: bool = False) -> Frame:
    return request(command, command.request.encode(value), queued=queued)


MOVE = c.PTPCmd(c.PTPMode.MOVJ_ANGLE, 60, 10, 10, 0)
THINGS: dict[str, tuple[Any, Any, Any]] = {
    "laser": (c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(True, True), c.EndEffectorLaser(False, False)),
    "stepper": (c.SET_E_MOTOR, c.EMotor(1, True, 900), c.EMotor(1, False, 0)),
    "jog": (c.SET_JOG_CMD, c.JOGCmd(True, c.JOGKey.AP_DOWN), c.JOGCmd(True, c.JOGKey.IDLE)),
}
VERBS = {
    "force-stop": frame(c.SET_QUEUED_CMD_FORCE_STOP_EXEC),
    "stop": frame(c.SET_QUEUED_CMD_STOP_EXEC),
    "clear": frame(c.SET_QUEUED_CMD_CLEAR),
    "start": frame(c.SET_QUEUED_CMD_START_EXEC),
    "motion now": frame(c.SET_PTP_CMD, MOVE),
}


def orders(words: Sequence[str], longest: int) -> Iterator[tuple[str, ...]]:
    for length in range(1, longest + 1):
        yield from product(words, repeat=length)


class Bench:
    """A simulated Magician, and what a bridge follows of one program."""

    def __init__(self) -> None:
        self.clock = Clock()
        self.arm = SimulatedMagician(self.clock)
        self.watch: ClientWatch[Frame] = magician.BRIDGED.watch()

    def ask(self, each: Frame) -> Frame | None:
        found = Parser().feed(self.arm.answer(each))
        return found[0] if found else None

    def tell(self, each: Frame) -> None:
        self.watch.sent(each)
        reply = self.ask(each)
        if reply:
            self.watch.answered(each, reply)

    def vanish(self) -> bool:
        """What a bridge does when the program is gone; returns whether it stopped the arm."""
        if not (self.watch.moving(None) and self.watch.moving(self.ask(self.watch.question))):
            return False

        for each in [*magician.BRIDGED.stopping, *self.watch.off()] * 2:
            self.ask(each)

        return True

    @property
    def active(self) -> list[Any]:
        """What burns, turns or moves."""
        motors = [motor.speed for motor in self.arm.motors]
        return [each for each in (self.arm.laser, *motors, self.arm.device.moving) if each]


@pytest.mark.full
def test_a_laser_is_off_whatever_four_commands_came_behind_a_long_one() -> None:
    row, on, off = THINGS["laser"]
    words = {"on": frame(row, on), "off": frame(row, off), **{verb: VERBS[verb] for verb in ("force-stop", "clear")}}
    words |= {"queued on": frame(row, on, queued=True), "queued off": frame(row, off, queued=True)}
    for order in product(words, repeat=4):
        bench = Bench()
        bench.tell(frame(c.SET_WAIT_CMD, c.WAITCmd(5000), queued=True))
        for word in order:
            bench.tell(words[word])

        bench.clock.now += LATER
        bench.vanish()
        assert not bench.active, order


@pytest.mark.cases(1)
@pytest.mark.parametrize("busy", [True, False])
@pytest.mark.parametrize(("thing", "longest"), [("laser", 3), ("stepper", 2), ("jog", 2)])
def test_nothing_burns_turns_or_moves_when_its_program_is_gone(thing: str, longest: int, busy: bool) -> None:
    row, on, off = THINGS[thing]
    words = {"on": frame(row, on), "off": frame(row, off)}
    words |= {"queued on": frame(row, on, queued=True), "queued off": frame(row, off, queued=True)} | VERBS
    left = 0
    for order in orders(list(words), longest):
        for wait in (0.0, LATER):
            bench = Bench()
            if busy:
                bench.tell(frame(c.SET_WAIT_CMD, c.WAITCmd(5000), queued=True))

            for word in order:
                bench.tell(words[word])

            bench.clock.now += wait
            left += not bench.vanish()
            assert not bench.active, (order, wait)
            bench.clock.now += LATER
            assert not bench.active, (order, wait)

    assert left, "an arm that is at rest is left alone"


LINES = ("M3", "M5", "M21 P200", "M21 P0", "G0 X200 F5", "M15", "M17", "G4 S5")


@pytest.mark.parametrize("jog_stop", ["jog", "all"])
def test_the_laser_of_an_ultraarm_is_off_when_its_program_is_gone(jog_stop: Any) -> None:
    for order in orders(LINES, 3):
        clock = Clock()
        arm = SimulatedUltraArm(clock, quirks=UltraArmQuirks(jog_stop=jog_stop))
        watch = ultraarm.UltraArmWatch(clock)
        for word in order:
            line = BridgedLine(word.encode() + END)
            watch.sent(line)
            arm.answer(line.text)
            watch.answered(line, line)

        clock.now += LATER  # whatever moves has come to rest
        rest = BridgedLine(b"DATA: Moving end\r\nQUEUE SIZE[0]\r\nENDSTOP[0 ,0 ,0]\r\nCOORDS[0 ,0 ,0 ,0]\r\n")
        assert not arm.device.moving
        if not watch.moving(rest):
            assert not arm.registers.laser, order
            assert not arm.registers.pwm, order


def test_a_switch_counts_as_on_where_that_is_not_known() -> None:
    switch = Switch()
    assert not switch.is_on(finished=True)
    switch.switch_on(queued=True)
    switch.switch_off(queued=False)
    assert switch.is_on(finished=True), "the queued on may come yet"
    switch.switch_off(queued=True)
    assert switch.is_on(finished=False)
    assert not switch.is_on(finished=True)
    switch.empty()
    assert switch.is_on(finished=True), "the off may have been thrown away"
    switch.switch_off(queued=False)
    assert not switch.is_on(finished=False)
