"""The driver and the arm on bad lines, seed by seed; `make soak` runs many more."""

from __future__ import annotations

import pytest
from scenario import run_seed
from soak import replay

SEEDS = 200
BLOCK = 10


@pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
@pytest.mark.parametrize("first", range(0, SEEDS, BLOCK))
def test_seeds(first: int) -> None:
    for seed in range(first, first + BLOCK):
        try:
            run_seed(seed)
        except BaseException as error:
            error.add_note(replay(seed))
            raise


@pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
def test_a_seed_means_the_same_every_time() -> None:
    first: list[str] = []
    second: list[str] = []
    run_seed(7, first.append)
    run_seed(7, second.append)
    assert len(first) > 20
    # Names of simulations and tasks differ; what goes over the line does not.
    assert first == second
