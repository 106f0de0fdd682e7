"""One seed is one random cell that is stopped at a random moment: 0.1 s after that has returned, no arm moves.

make soak OF=stops [SEEDS=1000] [FIRST=0]     runs many of them
"""

from __future__ import annotations

from collections.abc import Callable

import scenario_of_guards
from scenario_of_guards import Figures, Violation

__all__ = ["Figures", "Violation", "run_seed"]


def run_seed(seed: int, say: Callable[[str], None] = lambda _: None) -> Figures:
    """Runs a seed; raises Violation if an arm moves after the stop."""
    return scenario_of_guards.run_seed(seed, say, stopped=True)
