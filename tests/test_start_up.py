"""What an import brings in: nothing that is not used yet. The layers are contracts in pyproject.toml."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import dobot_async
from dobot_async.arms.registry import REGISTERED

ROOT = Path(dobot_async.__file__).parent
LATE = ["serial", "serial_asyncio", "bleak", "zenoh", "click", "rich", "dobot_async.simulator", "dobot_async.cli"]
LATE += ["dobot_async.toolpath", "svgelements", "ezdxf", "PIL", "numpy", "HersheyFonts", "aiohttp"]
LATE += ["mcp", "aiomqtt", "prometheus_client", "pydantic", "dobot_async.mcp_server", "dobot_async.mqtt"]
IMPORTERS = {"import_module", "__import__", "importlib"}


def words(path: Path) -> set[str]:
    """All names that a file uses, and those that it imports."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    imported = {
        alias.name for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom) for alias in node.names
    }
    return imported | {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


def test_modules_are_named_as_strings_in_the_places_alone_that_import_late() -> None:
    late = {path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*.py") if words(path) & IMPORTERS}
    assert late == {
        "__init__.py",
        "arms/registry.py",
        "cli/main.py",
        "sync/__init__.py",
        "transports/__init__.py",
        "_core/util/late.py",
        "endpoints/pty.py",  # asks whether there is a module of the system's
    }


@pytest.mark.parametrize("statement", ["import dobot_async", "from dobot_async import Magician, open_transport"])
def test_importing_the_package_brings_in_nothing_that_is_not_used_yet(statement: str) -> None:
    late = list(LATE)
    late += (
        [f"dobot_async.arms.{family}.commands" for family in REGISTERED] if statement == "import dobot_async" else []
    )
    program = f"{statement}\nimport sys\nprint([name for name in {late!r} if name in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout.strip() == "[]"
    assert not ran.stderr


FIRST_MOTION = """
import asyncio, sys
from dobot_async import Magician

async def main():
    async with Magician.connect("sim:") as arm:
        await arm.queue.move_to(220, 0, 40)

asyncio.run(main())
print([name for name in {late!r} if name in sys.modules])
"""


def test_the_first_motion_of_a_simulated_arm_needs_no_other_family_and_no_way_to_it_from_outside() -> None:
    late = ["dobot_async.simulator.mycobot", "dobot_async.simulator.ultraarm", "dobot_async.simulator.scene.scene"]
    late += ["dobot_async.discovery", "dobot_async.endpoints", "dobot_async.arms.mycobot.arm", "importlib.metadata"]
    program = FIRST_MOTION.format(late=late)
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout.strip() == "[]"


@pytest.mark.parametrize("package", ["simulator", "simulator.scene", "traces"])
def test_packages_that_import_late_have_all_of_their_names(package: str) -> None:
    module = __import__(f"dobot_async.{package}", fromlist=["__all__"])
    assert [name for name in module.__all__ if not hasattr(module, name)] == []
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = module.nothing


@pytest.mark.parametrize("family", REGISTERED)
def test_the_commands_are_found_where_users_import_them(family: str) -> None:
    public = __import__(f"dobot_async.{family}.commands", fromlist=["commands"])
    inner = __import__(f"dobot_async.arms.{family}.commands", fromlist=["commands"])
    names = {name for name in vars(inner) if not name.startswith("_")}
    assert {name for name in names if getattr(public, name, None) is not getattr(inner, name)} == set()
