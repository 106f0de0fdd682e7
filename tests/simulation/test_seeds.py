"""The driver and the arm on bad lines, seed by seed; `make soak` runs many more."""

from __future__ import annotations

import pytest
from scenario import run_seed
from soak import replay

SEEDS = 200
BLOCK = 10
HARD = {
    24392: "an increment that the network doubles, with both acknowledgements lost",
    22128: "a power failure after which the index stays nonsense",
    21616: "an acknowledgement that comes a command late when the books are opened",
    30696: "a command that goes out while the queue is found empty",
    31909: "a command whose second copy arrives behind the clear",
    33188: "a put that is cancelled while it is under way and the arm is being stopped",
    33840: "a count on an arm that is paused and has finished nothing since it was cleared",
    34884: "a power failure after which the indices go on where the books stand",
    37856: "an alarm that two readers find at once",
    41596: "a restart that is found while the alarms are being cleared",
    46348: "a full queue on a paused arm whose books were opened with difficulty",
    702423: "a command that the network doubles in front of one that may go out at once",
    403548: "two urgent calls of one command, of which the first one's proof is lost",
    83242: "books from before a power failure",
    2058674: "a command whose put was cancelled, accepted just before the cable was pulled",
}


@pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
@pytest.mark.parametrize("first", range(0, SEEDS, BLOCK))
def test_seeds(first: int) -> None:
    for seed in range(first, first + BLOCK):
        try:
            run_seed(seed)
        except BaseException as error:
            error.add_note(replay(seed, "arm"))
            raise


@pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
@pytest.mark.parametrize("seed", HARD, ids=HARD.get)
def test_seeds_that_once_broke_a_promise(seed: int) -> None:
    run_seed(seed)


@pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
def test_a_seed_means_the_same_every_time() -> None:
    first: list[str] = []
    second: list[str] = []
    run_seed(7, first.append)
    run_seed(7, second.append)
    assert len(first) > 20
    # Names of simulations and tasks differ; what goes over the line does not.
    assert first == second
