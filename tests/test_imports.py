"""The way of the imports, read from the source: layers know nothing of higher ones, and families not of each other.

errors <- wire, util <- transports <- link <- queue <- following <- arms <- families <- discovery <- simulator
<- toolpath, handling <- teaching, metrics <- remote <- mcp_server, mqtt <- cli <- __main__
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

import dobot_async
from dobot_async.families import REGISTERED

PACKAGE = "dobot_async"
ROOT = Path(dobot_async.__file__).parent
FAMILIES = tuple(REGISTERED)
LAYERS = (
    ("errors", "families"),
    ("wire", "events", "_core.util"),
    ("layouts", "transports", "contract", "calibration", "grid"),
    ("_core.link", "rows"),
    ("_core.queue", "bridged", "program"),
    ("following",),
    ("arms",),
    FAMILIES,
    ("discovery", "fleet", "hands"),
    ("simulator", "bridge"),
    ("toolpath", "handling"),
    ("teaching", "metrics"),
    ("remote",),
    ("mcp_server", "mqtt"),
    ("cli", "pytest_plugin"),
    ("__main__",),
)
LAYER = {name: number for number, names in enumerate(LAYERS) for name in names}
SOURCES = sorted(ROOT.rglob("*.py"))


def top(path: Path) -> str:
    """The module, or the subpackage, that a file belongs to; "" for the package's own `__init__`."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return "" if parts[0] == "__init__" else layer_name(parts)


def layer_name(parts: Sequence[str]) -> str:
    """What a module is called in `LAYERS`: the packages of the core are layers of their own."""
    return ".".join(parts[: 2 if parts[0] == "_core" else 1])


def imports(path: Path) -> Iterator[str]:
    """All modules that a file imports, wherever in it, by their whole names."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide their layer"
            assert node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def words(path: Path) -> set[str]:
    """All names that a file uses, and those that it imports."""
    used = {node.id for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Name)}
    return used | {name.rpartition(".")[2] for name in imports(path)}


def own_imports(path: Path) -> set[str]:
    """The modules and subpackages of ours that a file imports; "" for the package itself."""
    found = set()
    for name in imports(path):
        head, _, rest = name.partition(".")
        if head == PACKAGE:
            parts = rest.split(".")
            is_module = (ROOT / parts[0]).is_dir() or (ROOT / f"{parts[0]}.py").is_file()
            found.add(layer_name(parts) if is_module else "")

    return found


def name_of(path: Path) -> str:
    """How a test is called after a file."""
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_imports_go_down(path: Path) -> None:
    here = top(path)
    if not here:
        assert not own_imports(path) & {"simulator", "cli", "__main__", ""}
        return

    for other in own_imports(path) - {here}:
        # The simulator and the command line may use the public names, as any user may.
        allowed = LAYER[other] < LAYER[here] if other else LAYER[here] > LAYER["simulator"]
        assert allowed, f"{here} imports {other or PACKAGE}"


def test_every_module_has_its_layer() -> None:
    assert {top(path) for path in SOURCES} - {"", "_core.__init__"} <= LAYER.keys()


def test_the_layers_are_seen_at_all() -> None:
    assert own_imports(ROOT / "_core" / "link" / "link.py") >= {"errors", "_core.util", "transports"}
    assert own_imports(ROOT / "magician" / "arm.py") >= {"_core.link", "arms", "magician"}


def test_modules_are_named_as_strings_in_the_places_alone_that_import_late() -> None:
    late = {name_of(path) for path in SOURCES if words(path) & {"import_module", "__import__", "importlib"}}
    assert late == {"__init__.py", "families.py", str(Path("transports", "__init__.py")), str(Path("cli", "main.py"))}


@pytest.mark.parametrize("statement", ["import dobot_async", "from dobot_async import Magician, open_transport"])
def test_importing_the_package_brings_in_nothing_that_is_not_used_yet(statement: str) -> None:
    late = ["serial", "serial_asyncio", "bleak", "zenoh", "click", "rich", "dobot_async.simulator", "dobot_async.cli"]
    late += ["dobot_async.toolpath", "svgelements", "ezdxf", "PIL", "numpy", "potrace", "HersheyFonts"]
    late += ["mcp", "aiomqtt", "prometheus_client", "pydantic", "dobot_async.mcp_server", "dobot_async.mqtt"]
    late += [f"dobot_async.{family}.commands" for family in FAMILIES] if statement == "import dobot_async" else []
    program = f"{statement}\nimport sys\nprint([name for name in {late!r} if name in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout.strip() == "[]"
    assert not ran.stderr
