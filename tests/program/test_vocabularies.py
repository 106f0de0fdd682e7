"""Programs of all families: what their lines mean, what is refused before anything is sent, and how text is read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async.arms.magician import commands as c
from dobot_async.arms.mycobot import commands as m
from dobot_async.arms.mycobot.models import MODELS
from dobot_async.arms.ultraarm import commands as u
from dobot_async.program import VOCABULARIES, ProgramError, Step
from dobot_async.program.text import LARGEST, lines_in, parse_number, read_text, shortened


def problems(arm: str, *lines: str, **options: Any) -> tuple[tuple[int, str], ...]:
    with pytest.raises(ProgramError) as wrong:
        VOCABULARIES[arm].parse(lines, options)

    return wrong.value.problems


def parsed(arm: str, *lines: str, **options: Any) -> list[tuple[Any, Any]]:
    return [(step.command, step.value) for step in VOCABULARIES[arm].parse(lines, options)]


# The Magician: reach, increments, rail and tool


@pytest.mark.parametrize(
    ("lines", "number", "why"),
    [
        (["move 400 0 50"], 1, "too far"),
        (["move 200 0 50 mode=jump", "move 200 0 200"], 2, "joint"),
        (["joints 0 120 0 0"], 1, "joint 2 would be 120.0 degrees, limit 90"),
        (["move 250 0 50", "by 0 0 -10", "by 90 0 0"], 3, "too far"),
        (["move 250 0 50", "move 90 0 0 mode=movl-inc"], 2, "too far"),
        (["joints 0 0 0 0", "move 130 0 0 mode=movj-inc"], 2, "joint 1 would be 130"),
        (["path 400 0 0"], 1, "too far"),
        (["move 250 0 50", "engrave 400 0 0 50"], 2, "too far"),
        (["move 200 0 50 l=100"], 1, "write `rail on` in a line before this one"),
        (["rail on", "rail off", "move 200 0 50 l=100"], 3, "rail"),
        (["tool x=10", "move 310 0 50"], 2, "too far"),
        (["tool"], 1, "expected: tool, and suction, gripper, pen, laser or x=MM"),
        (["tool saw"], 1, "name is one of suction, gripper, pen, laser, not 'saw'"),
        (["speed 0"], 1, "velocity must be above 0 percent"),
        (["wait -1"], 1, "seconds must be 0 or more"),
        (["output 99 on"], 1, "address must be 1 to 20"),
        (["conveyor 1.5"], 1, "speed is a whole number, not '1.5'"),
        (["move 1 2 3 mode=movl mode=movj"], 1, "twice 'mode'"),
    ],
    ids=str,
)
def test_what_a_magician_could_not_do_is_refused(lines: list[str], number: int, why: str) -> None:
    ((line, told),) = problems("magician", *lines)
    assert line == number
    assert why in told


def test_what_depends_on_where_the_arm_is_is_left_to_it() -> None:
    lines = ["by 900 0 0", "move 250 0 50", "home", "by 90 0 0", "tool x=100", "move 350 0 50", "rail on"]
    assert len(parsed("magician", *lines, "move 300 0 50 l=100")) == 8
    assert parsed("magician", "rail on", "move 200 0 50 l=100")[1] == (
        c.SET_PTP_WITH_L_CMD,
        c.PTPWithLCmd(c.PTPMode.MOVJ_XYZ, 200, 0, 50, 0, 100),
    )


def test_a_wrong_line_does_not_make_those_behind_it_wrong() -> None:
    assert [number for number, _ in problems("magician", "move 250 0 50", "move 900 0 0", "by 90 0 0", "fly")] == [2, 4]


# The others


def test_the_verbs_of_a_mycobot() -> None:
    assert parsed(
        "mycobot",
        "home",
        "move 150 0 250 0 0 0 mode=linear speed=20",
        "joints 1 2 3 4 5 6",
        "joint 6 -30",
        "wait 1.5",
        "gripper on",
        "gripper-to 40",
        "color 1 2 3",
        "output 22 on",
    )[1:4] == [
        (m.SEND_COORDS, m.ToMove((150, 0, 250, 0, 0, 0), 20, m.MoveMode.LINEAR)),
        (m.SEND_ANGLES, m.JointsMove((1, 2, 3, 4, 5, 6), 50)),
        (m.SEND_ANGLE, m.JointMove(6, -30, 50)),
    ]
    assert len(parsed("myarm300", "joints 1 2 3 4 5 6 7")) == len(parsed("mypalletizer260", "move 150 0 100 0")) == 1


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("suction on", "no verb 'suction' for the myCobot 280"),
        ("home 5", "expected: home [speed=SPEED]"),
        ("move 100 0", "expected: move X Y Z RX RY RZ"),
        ("joints 999 0 0 0 0 0", "joint 1 must be in -168 to 168 degrees, not 999.0"),
        ("move 999 0 0 0 0 0", "x must be in -281.45 to 281.45"),
        ("joint 8 0", "has joints 1 to 6, not 8"),
        ("home speed=101", "speed must be in 1 to 100"),
        ("wait nan", "seconds is a number"),
        ("gripper-to 101", "percent must be in 0 (closed) to 100 (open)"),
    ],
)
def test_what_a_mycobot_could_not_do_is_refused(line: str, why: str) -> None:
    ((number, told),) = problems("mycobot", "home", line)
    assert number == 2
    assert why in told


def test_the_verbs_of_an_ultraarm() -> None:
    lines = ["home", "move 200 0 40 speed=100", "by 0 0 -10", "joints 1 2 3", "joint 1 5", "wait 1", "suction on"]
    assert [command for command, _ in parsed("ultraarm", *lines, "laser off", "gripper-to 30", "pwm 1", "fan on")] == [
        u.HOME,
        u.MOVE_COORDS,
        u.MOVE_BY,
        u.MOVE_JOINTS,
        u.MOVE_JOINT,
        u.WAIT,
        u.PUMP_ON,
        u.LASER_OFF,
        u.SET_GRIPPER,
        u.SET_PWM,
        u.FAN_ON,
    ]
    assert parsed("ultraarm", "suction on", pump="vendor")[0][0] is u.PUMP_OFF


@pytest.mark.parametrize(
    ("lines", "number", "why"),
    [
        (["move 900 0 0"], 1, "x must be in -260 to 300"),
        (["move 200 0 40", "by 150 0 0"], 2, "x must be in -260 to 300, not 350"),
        (["joints 0 0 90"], 1, "j3 must be in -5 to 60"),
        (["move 200 0 40 speed=300"], 1, "speed must be in 1 to 200"),
    ],
    ids=str,
)
def test_what_an_ultraarm_could_not_do_is_refused(lines: list[str], number: int, why: str) -> None:
    ((line, told),) = problems("ultraarm", *lines)
    assert line == number
    assert why in told


def test_goals_are_checked_and_not_increments() -> None:
    assert len(parsed("ultraarm", "move 200 0 100", "by 0 0 -140", "home", "by 250 0 0", "by 250 0 0")) == 5


def test_every_word_of_arms_has_programs() -> None:
    assert list(VOCABULARIES) == ["magician", "mycobot", *MODELS, "ultraarm"]
    for vocabulary in VOCABULARIES.values():
        assert "move X Y Z" in vocabulary.usage()


@given(st.sampled_from(list(VOCABULARIES)), st.lists(st.text(max_size=30), max_size=5))
def test_any_text_is_a_program_or_wrong_with_its_line(arm: str, lines: list[str]) -> None:
    steps: tuple[Step, ...] = ()
    wrong: ProgramError | None = None
    try:
        steps = VOCABULARIES[arm].parse(lines)
    except ProgramError as error:
        wrong = error

    assert all(step.command.write for step in steps)
    if wrong:
        assert "\n" not in wrong.summary
        assert all(1 <= number <= len(lines) for number, _ in wrong.problems)


# Text


def test_lines_end_at_newlines_alone() -> None:
    text = "a\r\nb\x0cc\x0bd\u2028e\x85f\rg\x1ch\n\ni"
    assert lines_in(text) == ["a", "b\x0cc\x0bd\u2028e\x85f\rg\x1ch", "", "i"]
    assert lines_in("a\n") == ["a"]
    assert lines_in("") == []


@pytest.mark.parametrize("end", ["\x0c", "\x0b", "\x1c", "\x85", "\u2028", "\r"])
def test_nothing_else_ends_a_comment(end: str) -> None:
    assert parsed("magician", *lines_in(f"wait 1 # was:{end}move 200 0 50\n")) == [(c.SET_WAIT_CMD, c.WAITCmd(1000))]


@pytest.mark.parametrize("text", ["1", "-1.5", "+.5", "5.", "1e2", "0"])
def test_numbers(text: str) -> None:
    assert parse_number(text) == float(text)


@pytest.mark.parametrize("text", ["nan", "inf", "1e999", "\uff12\uff10", "2_0_0", "0x10", "", "1e", "-", "\u0663"])
def test_what_is_no_number(text: str) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - the message is made by who asks
        parse_number(text)


def test_files(tmp_path: Path) -> None:
    path = tmp_path / "program"
    path.write_bytes(b"\xef\xbb\xbfhome\r\n")
    assert read_text(path) == "home\r\n"
    path.write_bytes(b"home # \xe9\n")
    with pytest.raises(ValueError, match=r"not UTF-8 text: .* at byte 7"):
        read_text(path)

    with path.open("wb") as file:
        file.truncate(LARGEST + 1)

    with pytest.raises(ValueError, match="more than 64 MB"):
        read_text(path)


def test_a_message_has_no_endless_text_and_stays_on_its_line() -> None:
    assert shortened("a\n\x1b[31mb") == "a  [31mb"
    assert len(shortened("x" * 10_000)) == 60
    ((_, told),) = problems("magician", "move " + "1" * 1_000_000 + " 0 0")
    assert len(told) < 200
    assert len(problems("magician", *["fly"] * 100)) == 100
    with pytest.raises(ProgramError) as wrong:
        VOCABULARIES["magician"].parse(["fly"] * 100)

    assert wrong.value.summary.endswith("(wrong as well: lines 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, ...)")
