"""G-code programs: what they are read as, what is refused before a byte is sent, and how they run."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from virtual import virtual

from dobot_async import ArmAlarm, CommandRejected, MotionStopped, UltraArm
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.gcode import parse_gcode
from dobot_async.simulator import Simulation, simulate

SQUARE = """\
; a square
(drawn by hand) G90
N10 G1 X200 Y0 Z40 F100 *71
Y20
G01 X220
G91
Y-20 (increments from here)
x-20
M3
G4 S1
m21 p 200
M5
M30
this is behind the end, and nobody reads it
""".splitlines()


def read(*lines: str, limits: c.UltraArmLimits = c.MANUAL_LIMITS) -> list[tuple[str, Any]]:
    return [(each.command.name, each.value) for each in parse_gcode(lines, limits)]


def moves(sim: Simulation) -> list[tuple[float | None, ...]]:
    rows = {c.MOVE_COORDS, c.MOVE_LINE}
    return [(each.value.x, each.value.y) for each in sim.arm.executed if each.command in rows]


def test_a_program() -> None:
    assert read(*SQUARE) == [
        ("G90", None),
        ("G1", c.CoordsMove(200, 0, 40, f=100)),
        ("G1", c.CoordsMove(y=20, f=100)),
        ("G1", c.CoordsMove(x=220, f=100)),
        ("G91", None),
        ("G1", c.CoordsMove(y=-20, f=100)),
        ("G1", c.CoordsMove(x=-20, f=100)),
        ("M3", None),
        ("G4", c.Dwell(1)),
        ("M21", c.PWM(200)),
        ("M5", None),
    ]
    assert [each.number for each in parse_gcode(SQUARE)] == [2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]


@pytest.mark.parametrize(
    ("lines", "commands"),
    [
        (["G90 G0 X200"], [("G90", None), ("G0", c.CoordsMove(x=200))]),
        (["F50", "%", "", "  "], []),
        (["G0 F50", "G0 X200"], [("G0", c.CoordsMove(x=200, f=50))]),
        (["G21", "G17 G94", "G28"], [("G28", None)]),
        (["M25 A50 F200 M1 T2"], [("M25", c.GripperSet(50, 200, c.GripperType.ELECTRIC, c.GripperMode.FLEXIBLE))]),
        (["M24 M1", "M24"], [("M24", c.GripperZero(c.GripperType.ELECTRIC)), ("M24", c.GripperZero())]),
        (["M11 X10 Y20 Z30", "M10 J1 A5"], [("M11", c.JointsMove(10, 20, 30)), ("M10", c.JointMove(1, 5))]),
        (["G0 X0 F100", "M28", "X5"], [("G0", c.CoordsMove(0, f=100)), ("M28", None), ("G0", c.CoordsMove(5, f=100))]),
        (["G92 X0 Y0 Z0", "M2", "G99"], [("G92", c.Position(0, 0, 0))]),
    ],
    ids=str,
)
def test_lines(lines: Sequence[str], commands: Sequence[tuple[str, Any]]) -> None:
    if lines[0] == "F50":
        lines = ["G0 X0 F50", *lines[1:]]
        commands = [("G0", c.CoordsMove(0, f=50))]

    assert read(*lines) == list(commands)


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("G2 X10 Y10 I5", "no command G2"),
        ("G0 X301", "x must be in -260 to 300"),
        ("G0 X200 F500", "f must be in 1 to 200"),
        ("G0 X1e5", "exponent"),
        ("G0 Q5", "mean nothing: Q"),
        ("M114", "no command for a program"),
        ("M13 J1 D0", "no command for a program"),
        ("M15", "no command for a program"),
        ("X10", "belongs to no command"),
        ("hello", "belongs to no command|no G-code"),
        ("G0 X200 Ü", "no G-code"),
        ("G0 X200,5", "no G-code"),
        ("M11 X0 Y0 Z90", "j3 must be in -5 to 60"),
        ("M11 X0 Y0", "Z is missing"),
        ("G4", "S is missing"),
        ("G4 S-1", "seconds must be in"),
        ("G4 S70000", "seconds must be in"),
        ("G0 X200 X210", "a letter twice"),
        ("X2%00", "no G-code"),
        ("G0 X200 ((nested) Y5)", "no G-code"),
        ("G1.5 X10", "no command G1.5"),
        ("G0 X--5", "no number|no G-code"),
    ],
)
def test_wrong_lines_are_named(line: str, why: str) -> None:
    with pytest.raises(ValueError, match=rf"^line 2: .*({why})"):
        parse_gcode(["G28", line])


def test_all_wrong_lines_are_named_at_once() -> None:
    with pytest.raises(ValueError, match=r"(?s)^line 1: .*\nline 3: [^\n]*$"):
        parse_gcode(["G5", "G28", "G0 X999"])


def test_increments_are_looked_at_where_it_is_known_from_where() -> None:
    read("G91", "G0 X200", "G0 X200")
    with pytest.raises(ValueError, match=r"^line 4: x must be in"):
        read("G90", "G0 X200", "G91", "X150")

    with pytest.raises(ValueError, match=r"^line 3: x must be in"):
        read("G92 X250", "G91", "G0 X60")

    read("G0 X200", "G91", "G28", "G0 X150")
    read("G0 X350", limits=c.LIBRARY_LIMITS)


@given(st.lists(st.text(max_size=30), max_size=5))
def test_any_text_is_a_program_or_wrong_with_its_line(lines: list[str]) -> None:
    try:
        steps = parse_gcode(lines)
    except ValueError as error:
        steps, messages = (), str(error).split("\n")
    else:
        messages = []

    assert all(each.startswith("line ") for each in messages)
    for step in steps:
        step.command.request.encode(step.value)


@virtual
async def test_a_program_runs() -> None:
    told: list[tuple[int, int]] = []
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:
        await arm.run_gcode(SQUARE, progress=lambda done, of: told.append((done, of)))
        assert moves(sim) == [(200, 0), (None, 20), (220, None), (None, 0), (200, None)]
        assert {each.name for each in sim.arm.executed} >= {"G1", "M3", "M5"}
        assert "G0" not in {each.name for each in sim.arm.executed}
        assert told == [(done, 11) for done in range(1, 12)]
        assert not sim.arm.registers.relative, "a program leaves the arm in absolute coordinates"
        assert abs(sim.arm.pose.x - 200) < 0.01
        await arm.move_to(210, 0, 40)


@virtual
async def test_a_program_tells_what_is_done_as_it_goes() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        run = arm.run_gcode(["G0 X200 Y0 Z40 F100", "G0 X210", "M3"], constant_speed=True)
        seen = [(line.number, len(moves(sim))) async for line in run]

        assert [number for number, _ in seen] == [1, 2, 3]
        assert seen[0][1] >= 1
        assert [int(each.value.mode) for each in sim.arm.executed if each.command is c.SET_SPEED_MODE] == [0, 2]


@virtual
async def test_a_dry_run_sends_nothing() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        before = sim.arm.counters.requests
        run = arm.run_gcode(SQUARE, dry_run=True)
        await run
        assert len(run.lines) == 11
        with pytest.raises(ValueError, match="line 1"):
            arm.run_gcode(["G0 X999"], dry_run=True)

        with pytest.raises(ValueError, match="line 2"):
            arm.run_gcode(["G0 X200", "G0 X999"])

        await arm.run_gcode([])
        assert sim.arm.counters.requests == before


@virtual
async def test_a_line_that_fails_is_named() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:
        with pytest.raises(ArmAlarm) as caught:
            await arm.run_gcode(["G0 X200 Y0 Z40", "G0 X10 Y0 Z0"])

        assert caught.value.__notes__ == ["line 2 (G0 X10 Y0 Z0)"]
        assert sim.arm.missed == 1


@virtual
async def test_who_leaves_a_program_stops_the_arm() -> None:
    program = [f"G0 X{150 + step} Y{100 * (-1) ** step} Z40 F20" for step in range(50)]
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(3):
                await arm.run_gcode(program)

        assert not sim.arm.device.moving
        assert len(moves(sim)) < 5

    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        run = arm.run_gcode(program)
        lines = aiter(run)
        await anext(lines)
        await lines.aclose()  # type: ignore[attr-defined]
        assert not sim.arm.device.moving

    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        running = asyncio.ensure_future(arm.run_gcode(program)._run())
        await asyncio.sleep(1)
        await arm.stop()
        with pytest.raises(MotionStopped) as caught:
            await running

        assert caught.value.__notes__[0].startswith("line ")


@pytest.mark.full
@virtual
async def test_a_long_program_does_not_fill_the_queue() -> None:
    async with simulate("ultraarm", homed=True, speed=50) as sim, UltraArm.connect(sim.url) as arm:
        await arm.run_gcode(f"G0 X{180 + step / 4} Y0 Z40 F200" for step in range(200))
        assert [x for x, _ in moves(sim)] == [180 + step / 4 for step in range(200)]
        assert sim.arm.counters.overflowed == 0


@virtual
async def test_a_program_that_fails_leaves_neither_increments_nor_constant_speed() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:
        program = ["G0 X200 Y0 Z40 F100", "G91", "G1 X10", "G90", "G1 X10 Y0 Z0", "G91", "G1 X5"]
        with pytest.raises(ArmAlarm) as caught:
            await arm.run_gcode(program, constant_speed=True)

        assert caught.value.__notes__ == ["line 5 (G1 X10 Y0 Z0)"]
        await arm.move_to(220, 0, 40)
        assert not sim.arm.registers.relative
        assert sim.arm.registers.speed_mode == c.SpeedMode.RAMPED
        assert moves(sim)[-1] == (220, 0)
        assert abs(sim.arm.pose.x - 220) < 0.01


@virtual
async def test_of_increments_the_goal_is_checked() -> None:
    program = ["G0 X200 Y0 Z100 F100", "G91", "G1 Z-140"]
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:
        await arm.run_gcode(program)
        assert abs(sim.arm.pose.z + 40) < 0.01
        before = sim.arm.counters.requests
        with pytest.raises(ValueError, match=r"^line 4: z must be in -130 to 135, not -180"):
            arm.run_gcode([*program, "Z-140"])

        assert sim.arm.counters.requests == before
        # From where nobody knows yet, it shows when its turn comes, and nothing is sent.
        with pytest.raises(CommandRejected, match="z must be in -130 to 135, not -180") as caught:
            await arm.run_gcode(["G91", "G1 Z-140"])

        assert caught.value.__notes__ == ["line 2 (G1 Z-140)"]
        assert abs(sim.arm.pose.z + 40) < 0.01


@virtual
async def test_a_fraction_of_a_second_is_waited() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        before = sim.arm.device.now
        await arm.run_gcode(["G4 S0.5", "M23"])
        (pump,) = (each for each in sim.arm.executed if each.command is c.PUMP_ON)
        assert pump.started >= before + 0.5
        before = sim.arm.device.now
        await arm.run_gcode(["G04 S1.25", "M22"])
        (pump,) = (each for each in sim.arm.executed if each.command is c.PUMP_OFF)
        assert pump.started >= before + 1.25


@pytest.mark.parametrize("end", ["\x0b", "\x0c", "\x1c", "\x85", "\u2028"])
def test_nothing_but_a_line_feed_ends_a_comment(end: str, tmp_path: Path) -> None:
    file = tmp_path / "part.gcode"
    file.write_bytes(f"G28 ; and then{end}G0 X200\r\nG0 X210\n".encode())
    assert [(each.number, each.value) for each in parse_gcode(file)] == [(1, None), (2, c.CoordsMove(210))]


async def test_a_file(tmp_path: Path) -> None:
    file = tmp_path / "square.gcode"
    file.write_text("\ufeff" + "\n".join(SQUARE), encoding="utf-8")
    assert parse_gcode(file) == parse_gcode(str(file)) == parse_gcode(SQUARE)
    with pytest.raises(OSError, match="missing"):
        parse_gcode(tmp_path / "missing.gcode")


@virtual
async def test_a_program_is_absolute_whatever_was_said_to_the_arm_before() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        sim.arm.registers.relative = True  # another program has left it so
        await arm.run_gcode(["G0 X220 Y0 Z60 F100", "G0 X200"])
        assert sim.arm.pose.x == pytest.approx(200, abs=0.1)
