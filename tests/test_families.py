"""The families of arms: what they say of themselves is there, and a fourth one is one folder and one line."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from dobot_async.arms.bridge_adapter import BridgeAdapter
from dobot_async.arms.mycobot.models import MODELS
from dobot_async.arms.registry import REGISTERED, Each, Parts, families, homes

PAGE = Path(__file__).parents[1] / "docs" / "adding-a-family.md"
PARTS = ("simulator", "scene", "bridge", "discovery", "cli", "fleet", "program")

PROGRAM = """
from dobot_async.cli.family import CommandAnswer, FamilyCommands

async def told(arm):
    angle = await arm.get_angle()
    return CommandAnswer({"angle": angle}, f"angle {angle:g}")

async def turn(arm, numbers, mode):
    await arm.turn_to(numbers[0])

class Chosen(Turntable):
    @classmethod
    def connect(cls, url, *, control=True, queue="fresh", on_error="stop"):
        return super().connect(url, control=control)

SHOWN = FamilyCommands(
    kind=Chosen, info=told, pose=told, read=told, move=turn, modes=("to",), jog=None, directions={}, suction=None,
    pieces=None,
)
"""
"""What the page leaves out: a turntable for the command line."""


def folder(where: Path) -> Path:
    """Makes a module of the page's blocks, up to where the page registers itself, as a folder would be."""
    blocks = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    own = [block for block in blocks if "REGISTERED" not in block and "async with Turntable" not in block]
    assert len(own) == len(blocks) - 2
    source = "\n".join([*own, PROGRAM]).replace("\n    discovery=", '\n    cli="turntable:SHOWN",\n    discovery=')
    file = where / "turntable.py"
    file.write_text(source, encoding="utf-8")
    return file


def run(where: Path, program: str) -> str:
    """What a program says in which one line registers the folder."""
    folder(where)
    line = 'from dobot_async.arms.registry import REGISTERED; REGISTERED["turntable"] = "turntable"\n'
    ran = subprocess.run(
        [sys.executable, "-c", line + program], cwd=where, capture_output=True, text=True, timeout=60, check=False
    )
    assert not ran.returncode, ran.stderr
    return ran.stdout.strip()


@pytest.mark.full
def test_one_line_gives_it_its_public_name_and_its_simulator(tmp_path: Path) -> None:
    said = run(
        tmp_path,
        """
import asyncio
from dobot_async import Turntable
from dobot_async.simulator import simulate

async def main():
    async with simulate("turntable", listen="tcp://127.0.0.1:0", speed=100) as sim:
        async with Turntable.connect(sim.url) as arm:
            await arm.turn_to(90)
            print(await arm.get_angle(), sim.arm.executed)

asyncio.run(main())
""",
    )
    assert said == "90.0 [90.0]"


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--arm", "turntable", "--url", "sim:?speed=100", "--json", "pose"], '{"angle": 0.0}'),
        (["--arm", "turntable", "--url", "sim:?speed=100", "move", "45", "0", "0"], ""),
        (["--help"], "turntable"),
    ],
)
def test_one_line_makes_it_known_to_the_command_line(arguments: list[str], said: str, tmp_path: Path) -> None:
    assert said in run(tmp_path, f"from dobot_async.cli.main import cli; cli({arguments!r})")


@pytest.mark.full
def test_one_line_makes_it_known_to_the_search(tmp_path: Path) -> None:
    said = run(
        tmp_path, "from dobot_async.discovery.families import FAMILIES; print(*[each.name for each in FAMILIES])"
    )
    assert said == "magician mycobot ultraarm turntable"


@pytest.mark.full
def test_a_place_whose_part_is_missing_refuses_it_by_name(tmp_path: Path) -> None:
    said = run(
        tmp_path,
        """
from dobot_async.bridge.families import family_of
try:
    family_of("turntable")
except ValueError as error:
    print(error)
""",
    )
    assert said.startswith("no arm 'turntable' to bridge; there are: magician, mycobot, ")


@pytest.mark.parametrize("part", PARTS)
def test_what_each_family_says_of_itself_is_there(part: str) -> None:
    words: Parts[Any] = Parts(part)
    assert len(list(Each[Any](part))) == len(REGISTERED)
    assert all(words[word] is not None for word in words) or part in {"discovery", "fleet"}
    assert len(words) == len(set(words)) == len(REGISTERED) + len(MODELS)


def test_the_models_are_those_of_the_family() -> None:
    assert dict(families())["mycobot"].models == tuple(MODELS)
    bridged: Parts[BridgeAdapter[Any]] = Parts("bridge")
    assert [bridged[name].model for name in MODELS] == list(MODELS)
    assert bridged["mycobot"].model == "mycobot280"


def test_there_is_nothing_by_another_name() -> None:
    assert "robot" not in Parts("bridge")
    with pytest.raises(KeyError):
        Parts("bridge")["robot"]


def test_public_names_are_told_with_their_homes() -> None:
    assert homes()["UltraArm"] == "dobot_async.arms.ultraarm.arm"
