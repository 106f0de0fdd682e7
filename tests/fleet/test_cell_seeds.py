"""Some seeds of the cell's scenario; `make soak OF=cell` runs more."""

from __future__ import annotations

import pytest
from scenario_of_a_cell import run_seed


@pytest.mark.parametrize("seed", range(4))
def test_a_seed(seed: int) -> None:
    run_seed(seed)
