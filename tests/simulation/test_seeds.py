"""The driver and the arm on bad lines, seed by seed; `make soak` runs many more."""

from __future__ import annotations

import pytest
from scenario import run_seed
from soak import replay, scenario

SEEDS = 60
BLOCK = 10
HARD = {
    1529: "an answer that was on the line when the line stood still, and a question of the same kind after that",
    292: "alarms that were read before a question, and came when it was asked",
    1307: "a jog whose end was given up while the line stood still",
    1359: "a jog that was cancelled while the line stood still",
    34: "a jog that is cancelled, and whose end is not answered",
    447: "a jog that is left by an error, and whose end is not answered",
    75: "a clear that is cancelled while nothing is answered",
    29: "a stop that is cancelled while nothing is answered",
    2: "a move that is cancelled while nothing is answered",
    600: "a move that is cancelled while the cable is pulled",
    23: "a line that is silent, and open",
    531: "a motion that is aborted because its connection's block was left, and that the arm ticks off",
    1401: "an alarm that holds a motion back of which nobody knows any more",
    710848: "an arm that is switched off and on while the line stays open, with a command under way",
    800859: "an acknowledgement that comes late, when its command is known to be taken, and another one was sent",
    801433: "an arm that was switched off and on once, and not again",
    6023359: "a stop whose first copy was thought to be lost, and is acknowledged twice",
    8001935: "stops that a line of datagrams holds up, one after the other: each acknowledgement is an older one's",
    9049553: "several answers in a row that come alone, on a line that is known to do that",
    153: "a question that waits for its turn, and then for its answer",
}
"""What once broke a promise, each found in the scenario as it is now."""

HARD_CELLS = {
    ("cell", 900895): "an arm that comes to rest and does not tell where, while all wait and nothing else happens",
    ("guards", 50159): "an arm that may be anywhere along its rail, and one with leftovers in its queue",
    ("guards", 50728): "a longer tool that was queued behind a motion which an alarm ended",
}
"""The same of the scenarios of several arms."""


@pytest.mark.cases(2)
@pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
@pytest.mark.parametrize("first", range(0, SEEDS, BLOCK))
def test_seeds(first: int) -> None:
    for seed in range(first, first + BLOCK):
        try:
            run_seed(seed)
        except BaseException as error:
            error.add_note(replay(seed, "arm"))
            raise


@pytest.mark.cases(5)
@pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
@pytest.mark.parametrize("seed", HARD, ids=HARD.get)
def test_seeds_that_once_broke_a_promise(seed: int) -> None:
    run_seed(seed)


@pytest.mark.full
@pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
@pytest.mark.parametrize(("of", "seed"), HARD_CELLS, ids=HARD_CELLS.values())
def test_cells_that_once_broke_a_promise(of: str, seed: int) -> None:
    scenario(of).run_seed(seed)


@pytest.mark.filterwarnings("ignore::async_solipsism.exceptions.ResolutionWarning")
def test_a_seed_means_the_same_every_time() -> None:
    first: list[str] = []
    second: list[str] = []
    run_seed(4, first.append)
    run_seed(4, second.append)
    assert len(first) > 20
    # Names of simulations and tasks differ; what goes over the line does not.
    assert first == second
