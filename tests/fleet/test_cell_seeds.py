"""Some seeds of each scenario of a cell; `make soak OF=cell`, `OF=guards`, `OF=lost` and `OF=stops` run more."""

from __future__ import annotations

import pytest
import scenario_of_a_cell
import scenario_of_guards
import scenario_of_lost_places
import scenario_of_stops

from dobot_async.fleet.magician_planner import MagicianPlanner


@pytest.mark.cases(2)
@pytest.mark.parametrize("seed", range(4))
def test_a_seed(seed: int) -> None:
    scenario_of_a_cell.run_seed(seed)


@pytest.mark.cases(1)
@pytest.mark.parametrize("seed", range(4))
def test_a_seed_of_guarded_arms(seed: int) -> None:
    scenario_of_guards.run_seed(seed)


@pytest.mark.full
@pytest.mark.parametrize("seed", range(3))
def test_a_seed_of_arms_that_lose_their_places(seed: int) -> None:
    scenario_of_lost_places.run_seed(seed)


@pytest.mark.cases(1)
@pytest.mark.parametrize("seed", range(6))
def test_a_seed_of_a_stop(seed: int) -> None:
    scenario_of_stops.run_seed(seed)


@pytest.mark.full
def test_the_monitor_sees_what_happens_without_the_guard() -> None:
    with pytest.raises(scenario_of_guards.Violation, match="are in zone"):
        for seed in range(20):
            scenario_of_guards.run_seed(seed, guard="off")


@pytest.mark.full
def test_the_monitor_sees_what_happens_when_a_lost_place_is_not_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MagicianPlanner, "astray", False)
    with pytest.raises(scenario_of_lost_places.Violation, match="are in zone"):
        for seed in range(20):
            scenario_of_lost_places.run_seed(seed)
