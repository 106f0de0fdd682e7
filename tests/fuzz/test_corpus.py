"""Every input of the corpus, those that once failed among them, keeps the promises of its target."""

from __future__ import annotations

from pathlib import Path

import pytest
from fuzz import CORPUS, NAMES
from fuzz_targets import TARGETS


def test_each_target_has_a_corpus() -> None:
    assert tuple(TARGETS) == NAMES
    assert {path.name for path in CORPUS.iterdir()} == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_corpus(name: str) -> None:
    inputs = sorted((CORPUS / name).iterdir())
    assert len(inputs) > 2
    for path in inputs:
        replay(name, path)


def replay(name: str, path: Path) -> None:
    try:
        TARGETS[name](path.read_bytes())
    except Exception as error:
        error.add_note(f"corpus/{name}/{path.name}")
        raise
