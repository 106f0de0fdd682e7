"""README.md, CONTRIBUTING.md, SECURITY.md and docs/: their Python runs, and what they refer to is there.

The blocks of a page run in their order and share their names. A block that awaits outside of a function runs as the
body of `async with Magician.connect("sim:?speed=20") as arm:`, as the pages say; any other is a program as it stands.
A ```python {fragment} only has to be Python.
"""

from __future__ import annotations

import ast
import asyncio
import inspect
import re
from pathlib import Path
from typing import Any

import pytest

from dobot_async import Magician
from dobot_async.arms.registry import REGISTERED
from dobot_async.transports import SCHEMES

ROOT = Path(__file__).parents[1]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
]
BLOCK = re.compile(r"^```(\w*)(.*)\n((?:.*\n)*?)```$", re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)


def named(page: Path) -> str:
    return str(page.relative_to(ROOT))


def blocks(page: Path) -> list[tuple[str, str, int]]:
    """Option, source and first line of each Python block of a page."""
    text = page.read_text(encoding="utf-8")
    found = [(match, text[: match.start()].count("\n") + 2) for match in BLOCK.finditer(text)]
    return [(match[2].strip(), match[3], line) for match, line in found if match[1] == "python"]


def execute(page: Path, source: str, line: int, names: dict[str, Any]) -> None:
    """Runs one block; its line numbers in a traceback are the page's."""
    code = compile("\n" * (line - 1) + source, str(page), "exec", flags=ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)

    async def framed() -> None:
        async with Magician.connect("sim:?speed=20") as names["arm"]:
            await eval(code, names)

    if code.co_flags & inspect.CO_COROUTINE:
        asyncio.run(framed())
    else:
        exec(code, names)


@pytest.mark.cases(4)
@pytest.mark.parametrize("page", PAGES, ids=named)
def test_blocks_run(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dobot_async.arms.registry.REGISTERED", dict(REGISTERED))  # one page adds a family
    names: dict[str, Any] = {"__name__": "__main__"}
    for option, source, line in blocks(page):
        if option == "{fragment}":
            compile(source, str(page), "exec", flags=ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)
        else:
            assert option == ""
            execute(page, source, line, names)


def test_blocks_are_found() -> None:
    for name in ("README.md", "docs/getting-started.md", "docs/concepts.md", "docs/simulator.md", "docs/kinematics.md"):
        page = ROOT / name
        fences = re.findall(r"^```python", page.read_text(encoding="utf-8"), re.MULTILINE)
        assert 0 < len(fences) == len(blocks(page))


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_links_lead_somewhere(page: Path) -> None:
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", target):
            continue

        path, _, anchor = target.partition("#")
        there = (page.parent / path).resolve() if path else page
        assert there.exists(), target
        assert not anchor or anchor in anchors(there), target


def anchors(page: Path) -> set[str]:
    """The anchors that GitHub gives to headings."""
    headings = HEADING.findall(page.read_text(encoding="utf-8"))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_readme_lists_each_scheme() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+):", readme, re.MULTILINE)
    assert sorted(rows) == sorted(scheme for scheme, (module, _) in SCHEMES.items() if module.startswith("dobot_async"))
