"""Cell files: what they may say, and what is told of those that are wrong."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path
from typing import Any

import pytest
from virtual import virtual

from dobot_async import Fleet, Magician, MyCobot, ReplyTimeout, UltraArm
from dobot_async.fleet import BaseFrame, Box, Cylinder
from dobot_async.fleet.cell import parse_cell, read_cell

WHOLE = """
[arms.left]
url = "sim:?speed=20"
guard = "wait"
clearance = 20
limits = { x = [100, 300] }
rail = -90
options = { check_reach = true }

[arms.right]
url = "sim:"
family = "mycobot"
model = "myarm300"
base = { x = 500, yaw = 180 }
group = "loading"

[arms.third]
url = "sim:"
family = "ultraarm"

[groups.loading]
on_failure = "alone"

[zones.bin]
box = { x = [1, 2], y = [3, 4], z = [5, 6] }

[zones.feeder]
cylinder = { x = 200, y = 100, radius = 60 }

[zones.turn]
"""


def test_all_that_a_file_may_say() -> None:
    cell = parse_cell(WHOLE)
    left, right, third = cell.members.values()
    assert (left.kind, right.kind, third.kind) == (Magician, MyCobot, UltraArm)
    assert (left.guard, left.clearance, left.limits) == ("wait", 20, Box(x=(100, 300)))
    assert [each.rail for each in cell.members.values()] == [-90, None, None]
    assert left.options == {"check_reach": True}
    assert right.options == {"model": "myarm300"}
    assert right.base == BaseFrame(500, 0, 0, 180)
    assert (right.group, dict(cell.groups)) == ("loading", {"loading": "alone"})
    assert cell.zones == {
        "bin": Box((1, 2), (3, 4), (5, 6)),
        "feeder": Cylinder(200, 100, 60, (-math.inf, math.inf)),
        "turn": None,
    }


ARM = '[arms.a]\nurl = "sim:"\n'


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "there are no arms"),
        ("[arms", "at end of document"),
        ("arms = 1", r"arms: expected tables, such as \[arms.NAME\]"),
        (f"{ARM}[robots]", "the file has no 'robots'; there are: arms, zones, groups"),
        ("[arms.a]", r"arms\.a: url: it is missing"),
        ("[arms.a]\nurl = 1", r"arms\.a: url: expected a text, not 1"),
        (f"{ARM}speed = 1", r"arms\.a: an arm has no 'speed'"),
        (f"{ARM}family = 'dobot'", r"arms\.a: family: one of magician, mycobot, ultraarm, not 'dobot'"),
        (f"{ARM}guard = 'maybe'", r"arms\.a: expected guard"),
        (f"{ARM}clearance = -1", r"arms\.a: expected guard .* clearance >= 0"),
        (f"{ARM}clearance = true", r"arms\.a: clearance: expected a number, not True"),
        (f"{ARM}rail = {{}}", r"arms\.a: rail: expected a number, not {}"),
        (f"{ARM}rail = inf", r"arms\.a: rail is the direction of a Magician's rail in degrees, not inf"),
        (f"{ARM}family = 'ultraarm'\nrail = 90", r"arms\.a: rail is the direction of a Magician's rail"),
        (f"{ARM}base = 1", r"arms\.a: base: expected a table"),
        (f"{ARM}base = {{ roll = 1 }}", r"arms\.a: base: a base has no 'roll'"),
        (f"{ARM}base = {{ x = nan }}", r"arms\.a: base: a base frame has finite numbers"),
        (f"{ARM}limits = {{ x = [1, 2] }}", r"arms\.a: limits are kept by the guard"),
        (f"{ARM}guard = 'wait'\nlimits = {{ x = [2, 1] }}", r"arms\.a: limits: x goes from a lower number"),
        (f"{ARM}group = 'b'", r"arms\.a\.group: there is no \[groups\.b\]"),
        (f"{ARM}[groups.b]\non_failure = 'never'", r"groups\.b: on_failure: .* not 'never'"),
        (f"{ARM}[zones.z]\nsphere = {{}}", r"zones\.z: a zone has no 'sphere'"),
        (f"{ARM}[zones.z]\nbox = {{}}", r"zones\.z: box: a box has x, y or z"),
        (f"{ARM}[zones.z]\nbox = {{ x = 1 }}", r"zones\.z: box: x: expected \[lowest, highest\], not 1"),
        (f"{ARM}[zones.z]\nbox = {{ x = ['a', 1] }}", r"zones\.z: box: x: expected a number, not 'a'"),
        (f"{ARM}[zones.z]\ncylinder = {{ x = 1, y = 1 }}", r"zones\.z: cylinder: radius: it is missing"),
        (f"{ARM}[zones.z]\ncylinder = {{}}\nbox = {{}}", r"zones\.z: either a box or a cylinder"),
        (f"{ARM}base = {{ x = 1{'0' * 400} }}", r"arms\.a: base: x: the number is too large"),
        (f"{ARM}clearance = 1{'0' * 400}", r"arms\.a: clearance: the number is too large"),
        (f"{ARM}options = {{ window = 1{'0' * 400} }}", r"arms\.a: options: window: the number is too large"),
        (f"{ARM}options = {{ a = {'[' * 3000}{']' * 3000} }}", "nested too deeply"),
        (f"{ARM}options = {{ chek_reach = true }}", r"arms\.a: options: connect of a magician has no 'chek_reach'"),
        (f"{ARM}options = {{ check_reach = 1 }}", r"arms\.a: options: check_reach: 1 is not what it takes"),
        (f"{ARM}options = {{ timeout = '5' }}", r"arms\.a: options: timeout: '5' is not what it takes"),
        (f"{ARM}options = {{ timeout = nan }}", r"arms\.a: options: timeout must be"),
        (f"{ARM}options = {{ timeout = true }}", r"arms\.a: options: timeout: True is not what it takes"),
        (f"{ARM}options = {{ timeout = [1, 2] }}", r"arms\.a: options: timeout: \[1, 2\] is not what it takes"),
        (f"{ARM}options = {{ reply_timeout = [0.5] }}", r"arms\.a: options: reply_timeout: expected \[lowest"),
        (f"{ARM}options = {{ queue = 'old' }}", r"arms\.a: options: queue must be 'fresh' or 'keep'"),
        (f"{ARM}options = {{ url = 'sim:' }}", r"arms\.a: options: connect of a magician has no 'url'"),
        (f"{ARM}model = 'myarm300'", r"arms\.a: options: connect of a magician has no 'model'"),
        (f"{ARM}family = 'mycobot'\nmodel = 'x'", r"arms\.a: options: model: one of myarm300, .* not 'x'"),
        (f"{ARM}family = 'ultraarm'\noptions = {{ limits = 1 }}", r"arms\.a: options: connect .* has no 'limits'"),
        ('[arms.a]\nurl = "file:///etc/passwd"', r"arms\.a: url: 'file:///etc/passwd' has no scheme"),
        ('[arms."a:b"]\nurl = "sim:"', r"arms\.'a:b': a name has"),
        ('[arms."*"]\nurl = "sim:"', r"arms\.'\*': a name has"),
        ('[arms."a\\u001bb"]\nurl = "sim:"', r"arms\.'a b': a name has"),
    ],
)
def test_wrong_files(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        parse_cell(text)


def test_the_message_begins_with_the_file(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_text("[arms.a]", encoding="utf-8")
    with pytest.raises(ValueError, match=r"cell\.toml: arms\.a"):
        read_cell(path)


def test_options_are_what_connect_takes() -> None:
    options = "options = { reply_timeout = [0.05, 1], window = 2, reconnect = true, on_error = 'leave' }"
    (member,) = parse_cell(f"{ARM}{options}").members.values()
    assert member.options == {"reply_timeout": (0.05, 1), "window": 2, "reconnect": True, "on_error": "leave"}


@pytest.mark.parametrize("family", ["magician", "mycobot", "ultraarm"])
def test_every_family_has_its_reply_timeout(family: str) -> None:
    """That of a myCobot depends on its URL, unless it is given."""
    cell = f'{ARM}family = "{family}"\n'
    (member,) = parse_cell(cell).members.values()
    assert "reply_timeout" not in member.options
    for text, value in (("[0.05, 1]", (0.05, 1)), ("0.5", 0.5)):
        (member,) = parse_cell(f"{cell}options = {{ reply_timeout = {text} }}").members.values()
        assert member.options["reply_timeout"] == value

    with pytest.raises(ValueError, match="reply_timeout"):
        parse_cell(f"{cell}options = {{ reply_timeout = 0 }}")


def test_a_guarded_arm_of_a_file_rides_on_its_rail_and_keeps_out_of_zones(tmp_path: Path) -> None:
    """From x = 0 to x = 300 the tool that stands out to y = 200 comes into the bin."""
    path = tmp_path / "cell.toml"
    path.write_text(
        """
        [arms.a]
        url = "sim:?speed=20"
        guard = "raise"
        base = { yaw = 90 }
        rail = -90

        [zones.bin]
        box = { x = [250, 350], y = [150, 250], z = [0, 80] }
        """,
        encoding="utf-8",
    )

    async def enter(fleet: Fleet[Any]) -> None:
        """Enters the bin as a task that is not the arm's."""
        async with fleet.zone("bin", timeout=1):
            pass

    @virtual
    async def scene() -> None:
        async with Fleet.from_file(path) as fleet:
            arm = fleet.arm("a", Magician)
            await arm.set_rail()
            await arm.home()
            await arm.move_to(200, 0, 40, l=0)
            await asyncio.create_task(enter(fleet))
            await arm.move_to(200, 0, 40, l=300)
            with pytest.raises(ReplyTimeout, match="did not get zone bin"):
                await asyncio.create_task(enter(fleet))

    scene()


def test_a_byte_order_mark_is_none_of_the_text(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_text(f"\ufeff{ARM}", encoding="utf-8")
    assert list(read_cell(path).members) == ["a"]
    path.write_bytes(b"\xff")
    with pytest.raises(ValueError, match=r"cell\.toml: not UTF-8 text"):
        read_cell(path)


def test_a_fleet_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_text('[arms.a]\nurl = "sim:?speed=20"\n[arms.b]\nurl = "sim:?speed=20"\n', encoding="utf-8")

    @virtual
    async def scene() -> None:
        async with Fleet.from_file(path, check_reach=True) as fleet:
            await fleet.arm("a", Magician).move_to(220, 0, 40)
            with pytest.raises(ValueError, match="too far"):
                await fleet.each("move_to", 400, 0, 40)

    scene()
