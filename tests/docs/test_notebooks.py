"""Each notebook runs from its first cell to its last, and says what it is to say; none is kept with its outputs.

Here the cells run in the process of the test, as one program; `make docs` runs them in kernels, as Jupyter does, and
tests/docs/test_site.py looks at what came out.
"""

from __future__ import annotations

import ast
import asyncio
import inspect
import json
from collections.abc import Iterator
from typing import Any

import pytest
from notebook_words import NOTEBOOKS, WORDS

pytest.importorskip("IPython", reason="notebooks need the extra docs")


def cells(name: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads((NOTEBOOKS / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    return found


@pytest.fixture(autouse=True)
def no_window(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Plots are drawn, and shown to nobody."""
    monkeypatch.setenv("MPLBACKEND", "agg")
    from matplotlib import pyplot as plt

    yield
    plt.close("all")


@pytest.mark.full
def test_each_notebook_is_known() -> None:
    assert {path.stem for path in NOTEBOOKS.glob("*.ipynb")} == set(WORDS)


@pytest.mark.full
@pytest.mark.parametrize("name", WORDS)
def test_notebook(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {"__name__": "__main__"}

    async def run() -> None:
        for number, cell in enumerate(cells(name)):
            if cell["cell_type"] == "code":
                where = f"{name}.ipynb, cell {number}"
                code = compile("".join(cell["source"]), where, "exec", flags=ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)
                found = eval(code, names)
                if inspect.isawaitable(found):
                    await found

    asyncio.run(run())
    said = capsys.readouterr().out
    missing = [word for word in WORDS[name] if word not in said]
    assert not missing, said


@pytest.mark.parametrize("name", WORDS)
def test_no_output_is_kept(name: str) -> None:
    kept = [cell for cell in cells(name) if cell.get("outputs") or cell.get("execution_count")]
    assert not kept, f"clear the outputs of {name}.ipynb: the site makes them anew"
