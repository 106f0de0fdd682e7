from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quick_suite import examples

from dobot_async.simulator.device.device import Device
from dobot_async.simulator.device.path import joint_segment, travel
from dobot_async.simulator.device.profile import SpeedLimits
from dobot_async.simulator.device.work import Activity, DeviceFault, DeviceOptions, Executed, Vector, Work

PACE = SpeedLimits((100.0, 100.0), (200.0, 200.0))
LITE = DeviceOptions(on_fault="continue")
BEGIN_FAULT, END_FAULT, LIMIT = 0x11, 0x22, 0x40


@dataclass
class Clock:
    now: float = 0.0

    def __call__(self) -> float:
        return self.now


@dataclass
class Bench:
    """A device, its clock, and works to put into it."""

    options: DeviceOptions = field(default_factory=DeviceOptions)
    clock: Clock = field(default_factory=Clock)

    def __post_init__(self) -> None:
        self.device = Device(self.clock, (0.0, 0.0), self.options)

    def until(self, now: float) -> Device:
        self.clock.now = now
        return self.device

    @property
    def names(self) -> list[tuple[str, str]]:
        return [(executed.name, executed.outcome) for executed in self.device.executed]


def instant(name: str = "set", effect: Callable[[], None] = lambda: None) -> Work:
    def begin(device: Device) -> None:
        effect()

    return Work(name, begin)


def wait(seconds: float, name: str = "wait") -> Work:
    return Work(name, lambda device: Activity(seconds))


def move(*target: float, name: str = "move") -> Work:
    """Moves the joints; 100 degrees take 1.5 s."""

    def begin(device: Device) -> Activity:
        return travel([joint_segment(device.joints, target, PACE)])

    return Work(name, begin, moves=True)


def move_into_fault(*target: float) -> Work:
    def begin(device: Device) -> Activity:
        return travel([joint_segment(device.joints, target, PACE, fault=DeviceFault(END_FAULT))])

    return Work("strand", begin, moves=True)


def unreachable() -> Work:
    def begin(device: Device) -> Activity:
        raise DeviceFault(BEGIN_FAULT)

    return Work("unreachable", begin, moves=True)


def trigger(key: str = "pin", level: float = 1.0) -> Work:
    return Work("trigger", lambda device: Activity(None, ready=lambda: device.get_input(key) >= level))


def jog(limit: float) -> Work:
    def begin(device: Device) -> Activity:
        there = (limit, device.joints[1])
        return travel([joint_segment(device.joints, there, PACE, fault=DeviceFault(LIMIT), leave=math.inf)])

    return Work("jog", begin, moves=True)


# The queue and its indices.


def test_indices_go_up_from_the_first_one() -> None:
    bench = Bench()
    device = bench.device
    assert device.current_index == 2**64 - 1
    assert [device.put(move(100, 0)), device.put(instant()), device.put(wait(1))] == [2, 3, 4]
    assert (device.next_index, device.accepted) == (5, 3)
    assert device.current_index == 2**64 - 1
    assert bench.until(1.5).current_index == 3
    assert bench.until(2.5).current_index == 4
    assert device.idle


def test_times_are_exact_however_late_one_looks() -> None:
    bench = Bench()
    for work in (move(100, 0), instant(), wait(0.25), move(0, 0)):
        bench.device.put(work)

    times = [(executed.started, executed.finished) for executed in bench.until(1000.0).executed]
    assert times == [(0.0, 1.5), (1.5, 1.5), (1.5, 1.75), (1.75, 3.25)]


def test_a_full_queue_takes_nothing() -> None:
    bench = Bench(DeviceOptions(capacity=2))
    device = bench.device
    assert device.left_space == 2
    assert device.put(wait(1)) == 2
    assert device.left_space == 1
    assert device.put(wait(1)) == 3
    assert device.left_space == 0
    assert device.put(wait(1)) is None
    assert (device.next_index, device.accepted) == (4, 2)
    assert bench.until(1.0).left_space == 1
    assert device.put(wait(1)) == 4


def test_the_executing_command_may_take_no_place() -> None:
    bench = Bench(DeviceOptions(capacity=1, count_executing=False))
    device = bench.device
    assert device.put(wait(1)) == 2
    assert device.left_space == 1
    assert device.put(wait(1)) == 3
    assert device.put(wait(1)) is None


def test_a_queue_of_one() -> None:
    bench = Bench(DeviceOptions(capacity=1))
    assert bench.device.put(instant()) == 2
    assert bench.device.put(move(10, 0)) == 3
    assert bench.device.put(instant()) is None
    assert bench.until(10).put(instant()) == 4


def test_lite_tells_no_index_while_it_moves() -> None:
    bench = Bench(DeviceOptions(garbage_index_while_moving=True))
    device = bench.device
    device.put(instant())
    assert device.current_index == 2
    device.put(move(100, 0))
    assert {device.current_index for _ in range(4)} == {2**64 - 1, 2**64 - 2}
    device.put(wait(1))
    assert bench.until(1.5).current_index == 3


def test_what_is_kept_of_the_record() -> None:
    bench = Bench(DeviceOptions(keep=2))
    for number in range(5):
        bench.device.put(instant(f"set {number}"))

    assert [name for name, _ in bench.names] == ["set 3", "set 4"]


def test_the_record_keeps_what_the_family_put_in() -> None:
    command, value = object(), object()
    bench = Bench()
    bench.clock.now = 5.0
    bench.device.put(Work("named", lambda device: None, command=command, value=value))
    assert bench.device.executed == [Executed(2, "named", command, value, 5.0, 5.0, "done")]


# Motion in time.


def test_joints_on_the_way() -> None:
    bench = Bench()
    bench.device.put(move(100, -50))
    assert bench.until(0.5).joints == pytest.approx((25, -12.5))
    assert bench.until(0.75).joints == pytest.approx((50, -25))
    assert bench.device.moving
    assert bench.until(1.5).joints == (100, -50)
    assert not bench.device.moving


def test_begin_and_end_see_the_time_of_the_event() -> None:
    seen: list[tuple[str, float, Vector]] = []

    def begin(device: Device) -> Activity:
        seen.append(("begin", device.now, device.joints))
        return Activity(2.0, end=lambda: seen.append(("end", device.now, device.joints)))

    bench = Bench()
    bench.device.put(move(100, 0))
    bench.device.put(Work("look", begin))
    bench.device.put(move(0, 0))
    bench.until(50.0).advance()
    assert seen == [("begin", 1.5, (100, 0)), ("end", 3.5, (100, 0))]


def test_a_motion_ends_exactly_where_it_should() -> None:
    bench = Bench(LITE)
    for number in range(1, 100):
        bench.clock.now += 0.1
        bench.device.begin_aside(jog(number / 7))
        bench.clock.now += 9.7
        assert bench.device.joints == (number / 7, 0.0)


def test_a_clock_that_goes_back_does_not_turn_time_back() -> None:
    bench = Bench()
    bench.device.put(wait(1))
    assert bench.until(5.0).now == 5.0
    assert bench.until(4.0).now == 5.0


# Stop, force-stop, clear.


def test_stop_lets_the_command_end_and_start_goes_on() -> None:
    bench = Bench()
    device = bench.device
    device.put(wait(1, "a"))
    device.put(wait(1, "b"))
    device.stop()
    assert not device.started
    assert bench.until(9.0).current_index == 2
    device.start()
    assert device.executing is not None
    assert [(e.name, e.started, e.finished) for e in bench.until(20.0).executed] == [("a", 0, 1), ("b", 9, 10)]


def test_a_stopped_queue_still_takes_commands() -> None:
    bench = Bench()
    bench.device.stop()
    assert bench.device.put(instant()) == 2
    assert bench.until(1.0).executed == []
    bench.device.start()
    assert bench.names == [("set", "done")]


def test_force_stop_ends_where_the_arm_is_and_keeps_the_queue() -> None:
    bench = Bench()
    device = bench.device
    device.put(move(100, 0))
    device.put(wait(1))
    bench.until(0.75).force_stop()
    assert bench.names == [("move", "aborted")]
    assert (device.current_index, device.left_space, device.started) == (2, 31, False)
    assert bench.until(5.0).joints == pytest.approx((50, 0))
    device.start()
    assert bench.until(6.0).current_index == 3


def test_clear_ends_the_command_and_empties_the_queue() -> None:
    bench = Bench()
    device = bench.device
    device.put(move(100, 0))
    device.put(wait(1))
    bench.until(0.75).clear()
    assert bench.names == [("move", "aborted")]
    assert (device.current_index, device.left_space, device.started, device.idle) == (2, 32, True, True)
    assert device.put(instant()) == 4
    assert device.current_index == 4
    assert bench.until(5.0).joints == pytest.approx((50, 0))


def test_clear_leaves_a_stopped_queue_stopped() -> None:
    bench = Bench()
    bench.device.stop()
    bench.device.put(wait(1))
    bench.device.clear()
    bench.device.put(wait(1))
    assert bench.until(5.0).executed == []


def test_a_stop_for_good_of_what_never_ends() -> None:
    bench = Bench()
    bench.device.put(wait(math.inf))
    assert bench.until(1e9).executed == []
    bench.device.force_stop()
    assert bench.names == [("wait", "aborted")]


# Conditions.


def test_a_condition_ends_when_the_input_changes() -> None:
    bench = Bench()
    bench.device.put(wait(1))
    bench.device.put(trigger())
    bench.device.put(wait(1))
    bench.until(4.0).set_input("pin", 0.5)
    bench.until(6.0).set_input("pin", 1.0)
    times = [(e.name, e.started, e.finished) for e in bench.until(20.0).executed]
    assert times == [("wait", 0, 1), ("trigger", 1, 6), ("wait", 6, 7)]


def test_a_condition_that_holds_takes_no_time() -> None:
    bench = Bench()
    bench.device.set_input("pin", 1.0)
    bench.device.put(wait(1))
    bench.device.put(trigger())
    assert [(e.name, e.finished) for e in bench.until(20.0).executed] == [("wait", 1), ("trigger", 1)]


def test_a_condition_of_the_world_is_asked_at_each_advance() -> None:
    world = {"open": False}
    bench = Bench()
    bench.device.put(Work("gate", lambda device: Activity(None, ready=lambda: world["open"])))
    assert bench.until(1.0).executed == []
    world["open"] = True
    assert [e.finished for e in bench.until(2.0).executed] == [2.0]


# Alarms.


def test_power_up_alarm_stops_nothing() -> None:
    bench = Bench()
    assert bench.device.alarms == {0x00}
    assert not bench.device.halted
    bench.device.put(move(100, 0))
    assert bench.until(1.5).joints == (100, 0)


def test_halt_holds_motions_back_until_the_alarms_are_cleared() -> None:
    bench = Bench()
    device = bench.device
    for work in (unreachable(), instant(), move(100, 0), wait(1)):
        device.put(work)

    assert bench.until(5.0).alarms == {0x00, BEGIN_FAULT}
    assert bench.names == [("unreachable", "alarm"), ("set", "done")]
    assert (device.current_index, device.halted, device.moving) == (3, True, False)
    device.clear_alarms()
    assert device.alarms == set()
    assert [(e.name, e.started, e.finished) for e in bench.until(20.0).executed][2:] == [
        ("move", 5, 6.5),
        ("wait", 6.5, 7.5),
    ]


def test_lite_goes_on_with_the_next_command() -> None:
    bench = Bench(LITE)
    bench.device.put(unreachable())
    bench.device.put(move(100, 0))
    assert bench.until(1.5).joints == (100, 0)
    assert bench.names == [("unreachable", "alarm"), ("move", "done")]
    assert bench.device.alarms == {0x00, BEGIN_FAULT}
    assert not bench.device.halted


def test_a_fault_on_the_way_counts_as_finished() -> None:
    bench = Bench()
    bench.device.put(move_into_fault(100, 0))
    bench.device.put(move(0, 0))
    assert bench.until(9.0).joints == (100, 0)
    assert bench.names == [("strand", "alarm")]
    assert bench.device.executed[0].finished == 1.5
    assert bench.device.current_index == 2
    assert bench.device.alarms == {0x00, END_FAULT}


def test_clearing_another_alarm_does_not_free_the_arm() -> None:
    bench = Bench()
    bench.device.raise_alarm(0x50)
    bench.device.put(move(100, 0))
    bench.device.clear_alarms([0x00])
    assert bench.until(5.0).executed == []
    bench.device.clear_alarms([0x50])
    assert bench.until(10.0).joints == (100, 0)


@pytest.mark.parametrize("options", [DeviceOptions(), LITE])
def test_an_alarm_ends_the_motion_where_it_is(options: DeviceOptions) -> None:
    bench = Bench(options)
    bench.device.put(move(100, 0))
    bench.until(0.75).raise_alarm(0x50)
    assert bench.names == [("move", "alarm")]
    assert bench.until(5.0).joints == pytest.approx((50, 0))


def test_an_alarm_leaves_a_wait_alone() -> None:
    bench = Bench()
    bench.device.put(wait(1))
    bench.until(0.5).raise_alarm(0x50)
    assert bench.until(1.0).executed[0].outcome == "done"


def test_a_harmless_alarm_ends_nothing() -> None:
    bench = Bench(DeviceOptions(harmless=frozenset({0x00, 0x01})))
    bench.device.put(move(100, 0))
    bench.until(0.75).raise_alarm(0x01)
    assert bench.until(1.5).executed[0].outcome == "done"


# Beside the queue.


def test_a_jog_ends_when_the_key_is_let_go() -> None:
    bench = Bench()
    assert bench.device.begin_aside(jog(500.0))
    assert bench.device.beside is not None
    assert bench.until(0.5).joints == pytest.approx((25, 0))
    bench.until(1.0).end_aside()
    assert bench.until(5.0).joints == pytest.approx((75, 0))
    assert bench.device.executed == [Executed(None, "jog", None, None, 0.0, 1.0, "done")]
    assert bench.device.current_index == 2**64 - 1


def test_a_jog_ends_at_the_limit_with_its_alarm() -> None:
    bench = Bench()
    bench.device.begin_aside(jog(75.0))
    assert bench.until(50.0).joints == (75.0, 0.0)
    assert bench.device.alarms == {0x00, LIMIT}
    assert [(e.finished, e.outcome) for e in bench.device.executed] == [(1.0, "alarm")]
    assert bench.device.begin_aside(jog(0.0)), "a jog leads out of the limit"


def test_no_jog_while_something_executes() -> None:
    bench = Bench()
    bench.device.put(wait(1))
    assert not bench.device.begin_aside(jog(75.0))
    assert bench.until(1.0).begin_aside(jog(75.0))
    assert not bench.device.begin_aside(jog(10.0))


def test_motions_wait_for_the_jog_and_the_rest_does_not() -> None:
    bench = Bench()
    bench.device.begin_aside(jog(500.0))
    bench.device.put(instant())
    bench.device.put(move(0, 0))
    assert bench.until(1.0).current_index == 2
    bench.device.end_aside()
    assert [(e.name, e.started) for e in bench.until(9.0).executed][-1] == ("move", 1.0)
    assert bench.device.joints == (0, 0)


def test_force_stop_ends_the_jog_and_clear_does_not() -> None:
    bench = Bench()
    bench.device.begin_aside(jog(500.0))
    bench.until(0.5).clear()
    assert bench.device.moving
    bench.device.force_stop()
    assert bench.names == [("jog", "aborted")]


def test_a_limit_that_ends_a_jog_holds_the_queue_back_at_its_time() -> None:
    bench = Bench()
    bench.device.begin_aside(jog(75.0))
    bench.device.put(wait(0.5))
    bench.device.put(move(0, 0))
    assert bench.until(50.0).joints == (75.0, 0.0)
    assert bench.names == [("wait", "done"), ("jog", "alarm")]


# Freezing, power, hooks.


def test_a_frozen_arm_goes_on_from_where_it_was() -> None:
    bench = Bench()
    device = bench.device
    device.put(move(100, 0))
    bench.until(0.5).freeze()
    assert bench.until(5.0).joints == pytest.approx((25, 0))
    assert device.put(wait(1)) == 3
    assert not device.begin_aside(jog(75.0))
    device.thaw()
    assert bench.until(5.25).joints == pytest.approx((50, 0))
    assert [(e.started, e.finished) for e in bench.until(50.0).executed] == [(0.0, 6.0), (6.0, 7.0)]


def test_a_frozen_arm_begins_nothing() -> None:
    bench = Bench()
    bench.device.freeze()
    assert not bench.device.begin_aside(jog(75.0))
    bench.device.put(instant())
    assert bench.until(1.0).executed == []
    bench.device.thaw()
    assert bench.names == [("set", "done")]


def test_a_frozen_arm_can_be_stopped() -> None:
    bench = Bench()
    bench.device.put(move(100, 0))
    bench.until(0.5).freeze()
    bench.until(5.0).force_stop()
    assert bench.device.joints == pytest.approx((25, 0))
    bench.device.thaw()
    bench.device.start()
    assert bench.until(9.0).joints == pytest.approx((25, 0))


def test_power_cycle() -> None:
    bench = Bench()
    device = bench.device
    device.put(unreachable())
    device.clear_alarms()
    device.put(move(100, 0))
    device.put(wait(1))
    device.stop()
    bench.until(0.75).power_cycle()
    assert (device.current_index, device.next_index, device.left_space) == (2**64 - 1, 2, 32)
    assert device.alarms == {0x00}
    assert (device.started, device.idle) == (True, True)
    assert bench.names == [("unreachable", "alarm"), ("move", "aborted")]
    assert device.joints == pytest.approx((50, 0))
    assert bench.until(10.75).uptime == 10.0
    assert device.put(instant()) == 2


def test_power_cycle_frees_a_frozen_arm() -> None:
    bench = Bench()
    bench.device.freeze()
    bench.until(1.0).power_cycle()
    bench.device.put(wait(1))
    assert bench.until(2.0).current_index == 2


def test_the_joints_can_be_put_elsewhere() -> None:
    bench = Bench()
    bench.device.place((10.0, 20.0))
    bench.device.put(move(110, 20))
    assert bench.until(0.75).joints == pytest.approx((60, 20))


def test_the_hook_hears_everything_and_may_put_more() -> None:
    bench = Bench()
    heard: list[tuple[str, float]] = []

    def on_finish(executed: Executed) -> None:
        heard.append((executed.name, bench.device.now))
        if executed.name == "first":
            bench.device.put(wait(2, "second"))

    bench.device.on_finish = on_finish
    bench.device.put(wait(1, "first"))
    bench.until(50.0).advance()
    assert heard == [("first", 1.0), ("second", 3.0)]


def test_the_hook_may_clear_while_another_ends() -> None:
    bench = Bench()
    bench.device.on_finish = lambda executed: bench.device.clear()
    bench.device.begin_aside(jog(500.0))
    bench.device.put(wait(9))
    bench.until(0.5).force_stop()
    assert bench.names == [("jog", "aborted"), ("wait", "aborted")]


@pytest.mark.full
def test_ten_thousand_points() -> None:
    bench = Bench()
    device = bench.device
    for number in range(10_000):
        while device.put(move(number % 7, number % 3)) is None:
            bench.clock.now += 0.05

    bench.clock.now += 1e6
    assert len(device.executed) == 10_000
    assert device.current_index == 10_001


# Whatever the pattern of looking at it.

WORKS: dict[str, Callable[[], Work]] = {
    "instant": instant,
    "wait": lambda: wait(0.3),
    "there": lambda: move(40, -15),
    "back": lambda: move(0, 5),
    "nowhere": lambda: move(0, 0),
    "strand": lambda: move_into_fault(-20, 0),
    "unreachable": unreachable,
    "trigger": trigger,
    "for ever": lambda: wait(math.inf),
}


def put(make: Callable[[], Work], device: Device) -> int | None:
    return device.put(make())


VERBS: dict[str, Callable[[Device], Any]] = {
    **{name: partial(put, make) for name, make in WORKS.items()},
    "jog": lambda device: device.begin_aside(jog(60)),
    "immediate": lambda device: device.begin_aside(move(10, 10)),
    "let go": Device.end_aside,
    "start": Device.start,
    "stop": Device.stop,
    "force_stop": Device.force_stop,
    "clear": Device.clear,
    "freeze": Device.freeze,
    "thaw": Device.thaw,
    "alarm": lambda device: device.raise_alarm(0x50),
    "clear alarms": Device.clear_alarms,
    "pin high": lambda device: device.set_input("pin", 1.0),
    "pin low": lambda device: device.set_input("pin", 0.0),
    "power": Device.power_cycle,
}
LOOKS: list[Callable[[Device], Any]] = [
    Device.advance,
    lambda device: device.joints,
    lambda device: device.current_index,
    lambda device: device.left_space,
    lambda device: (device.moving, device.executing, device.idle, device.alarms, device.now, device.executed),
]
mostly_works = st.one_of(st.sampled_from(sorted(WORKS)), st.sampled_from(sorted(VERBS)))
scripts = st.lists(st.tuples(st.floats(0, 1.5), mostly_works), max_size=40)
option_sets = st.builds(
    DeviceOptions,
    capacity=st.integers(1, 6),
    count_executing=st.booleans(),
    on_fault=st.sampled_from(["halt", "continue"]),
)


def play(script: list[tuple[float, str]], options: DeviceOptions, look: Callable[[Device, float, float], None]) -> Any:
    """Runs a script; `look` is called between two verbs with the times of both. Returns all that can be told."""
    bench = Bench(options)
    device, now, answers = bench.device, 0.0, []
    for pause, verb in script:
        look(device, now, now + pause)
        now += pause
        answers.append(VERBS[verb](bench.until(now)))
        answers.append((device.joints, device.current_index, device.left_space, device.alarms, device.started))

    look(device, now, now + 100.0)
    return answers, bench.until(now + 100.0).executed, device.joints, device.alarms, device.left_space


@settings(max_examples=examples(300), deadline=None)
@given(scripts, option_sets, st.lists(st.tuples(st.floats(0, 1), st.sampled_from(LOOKS)), max_size=8))
def test_looking_changes_nothing(
    script: list[tuple[float, str]], options: DeviceOptions, looks: list[tuple[float, Callable[[Device], Any]]]
) -> None:
    def look_often(device: Device, begin: float, end: float) -> None:
        clock = device._clock
        assert isinstance(clock, Clock)
        for share, look in sorted(looks, key=lambda item: item[0]):
            clock.now = min(end, begin + share * (end - begin))
            look(device)

    assert play(script, options, look_often) == play(script, options, lambda device, begin, end: None)


@settings(max_examples=examples(200), deadline=None)
@given(scripts.filter(lambda script: all(verb != "power" for _, verb in script)), option_sets)
def test_the_record_is_in_order(script: list[tuple[float, str]], options: DeviceOptions) -> None:
    executed: list[Executed]
    answers, executed, *_ = play(script, options, lambda device, begin, end: None)
    accepted = [answer for answer, (_, verb) in zip(answers[::2], script, strict=True) if verb in WORKS and answer]
    assert accepted == list(range(2, 2 + len(accepted)))
    assert all(0 <= state[2] <= options.capacity for state in answers[1::2])
    assert [e.finished for e in executed] == sorted(e.finished for e in executed)

    queued = [e for e in executed if e.index is not None]
    indices = [e.index for e in executed if e.index is not None]
    assert indices == sorted(set(indices))
    assert all(before.finished <= after.started for before, after in pairwise(queued))

    motions = sorted(
        (e for e in executed if e.finished > e.started and e.name in {"move", "strand", "jog"}), key=lambda e: e.started
    )
    assert all(before.finished <= after.started for before, after in pairwise(motions))
