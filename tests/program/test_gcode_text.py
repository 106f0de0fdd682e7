"""G-code as text: where its lines and comments end, and what is ambiguous in a line is refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.gcode import parse_gcode
from dobot_async.program import ProgramError

MOVE = (c.MOVE_LINE, c.CoordsMove(200, f=50))


def read(path: Path, text: str) -> list[tuple[object, object]]:
    path.write_bytes(text.encode())
    return [(line.command, line.value) for line in parse_gcode(path)]


@pytest.mark.parametrize("end", ["\x0c", "\x0b", "\x1c", "\x1d", "\x1e", "\x85", "\u2028", "\u2029"])
@pytest.mark.parametrize("comment", ["; was:{}G1 X220", "(was:{}G1 X220)"])
def test_lines_end_at_newlines_alone(end: str, comment: str, tmp_path: Path) -> None:
    assert read(tmp_path / "part", f"G1 X200 F50\r\n{comment.format(end)}\r\n") == [MOVE]


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        (["G1 X200 X210 F50"], "G0 has a letter twice|G1 has a letter twice"),
        (["G1 X200 F50", "Y1 Y2"], "has a letter twice"),
        (["G1 X2%00 F50"], "no G-code"),
        (["G1 X2(c)00 F50"], "in the middle of a number"),
        (["G1 X2 (a) (b) .5 F50"], "in the middle of a number"),
        (["G1 X200 (F50"], "ends with \\) in the same line"),
        (["G1 X200 F50\rG1 X220"], "has a line break in it"),
        (["G1 X200 F50\nG1 X220"], "has a line break in it"),
    ],
    ids=str,
)
def test_what_is_ambiguous_is_refused(lines: Sequence[str], why: str) -> None:
    with pytest.raises(ProgramError, match=f"^line {len(lines)}: .*({why})"):
        parse_gcode(lines)


@pytest.mark.parametrize(
    "line", ["%", "(a) G1 X200 (b) F50 (c)", "G1 X200 F50 ; (not closed", "G1 X200 (;) F50 *71", "G1 X 2 00 F 5 0\n"]
)
def test_what_is_not(line: str) -> None:
    assert [(each.command, each.value) for each in parse_gcode([line])] == ([] if line == "%" else [MOVE])


@pytest.mark.parametrize("line", ["(" * 200_000, "()" * 100_000 + "(", "*1" * 100_000, "G1" + " X200" * 50_000])
def test_a_long_line_is_read_in_no_time(line: str) -> None:
    with pytest.raises(ProgramError) as wrong:
        parse_gcode([line])

    assert len(str(wrong.value)) < 200
