"""The quick suite and the full one: which tests run when nobody asks for all of them.

    pytest           the quick suite: no test marked `full`, and of each parametrised test a few cases
    pytest --full    everything
    pytest --rest    what the quick suite leaves, and again the properties that it tries with fewer examples
    pytest FILE::TEST    all cases of what is named, whatever its marks are

1. A test marked `full` is left out. Another test of the quick suite looks at the same behaviour, on fewer examples.
2. Of a parametrised test that runs a loop, or tries examples, CASES cases stay; of a plain function PLAIN_CASES; of any
   test as many as its mark `cases(n)` says. They are the first, the last, and between them those that bring most values
   of the parameters that no chosen case has. Where there are more values than cases, which ones are tried depends on
   the test's name, so that tests that share a table try different rows of it.
3. Hypothesis tries QUICK_EXAMPLES where it tries 100 in the full suite, and `examples(n)` in proportion, but not less
   than FEWEST_EXAMPLES.

The choice depends on names and parameters alone: it is the same in every process and on every day.
"""

from __future__ import annotations

import gc
import inspect
import os
import zlib
from collections import defaultdict
from collections.abc import Generator, Hashable, Sequence
from typing import Any

import hypothesis
import pytest

CASES = 3
PLAIN_CASES = 25
QUICK_EXAMPLES = 12
FEWEST_EXAMPLES = 5
GOLDEN = 0.618  # steps of this part of the whole fall evenly, however many they are
QUICK, FULL = "quick", "full"
LEFT = pytest.StashKey[tuple[int, int]]()  # tests marked `full`, and cases

hypothesis.settings.register_profile(QUICK, deadline=None, max_examples=QUICK_EXAMPLES)
hypothesis.settings.register_profile(FULL, deadline=None)


def examples(number: int) -> int:
    """How many examples a property tries in the suite at hand, for its number in the full one."""
    return max(min(number, FEWEST_EXAMPLES), number * hypothesis.settings().max_examples // 100)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int | None:
    """Returns how many processes `-n auto` are: half as many again as there are cores, for many tests wait."""
    if "PYTEST_XDIST_AUTO_NUM_WORKERS" in os.environ:
        return None

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores + cores // 2


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the two options."""
    group = parser.getgroup("suite", "the quick suite and the full one")
    group.addoption("--full", action="store_true", help="run all cases of all tests")
    group.addoption("--rest", action="store_true", help="run what is left out without --full, and all properties")


def pytest_configure(config: pytest.Config) -> None:
    """Registers the marks, and says how many examples a property has."""
    config.addinivalue_line("markers", "full: left to --full; a quicker test looks at the same")
    config.addinivalue_line("markers", "cases(n): of this many cases the quick suite is made")
    config.stash[LEFT] = (0, 0)
    everything = config.getoption("full") or config.getoption("rest")
    hypothesis.settings.load_profile(FULL if everything else QUICK)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collects without the garbage collector, and lets it look at what was collected never: a tenth of all the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leaves out what the suite at hand does not run."""
    if config.getoption("full") or any("::" in argument for argument in config.args):
        return

    marked = [item for item in items if item.get_closest_marker("full")]
    quick = sampled([item for item in items if not item.get_closest_marker("full")])
    if config.getoption("rest"):
        kept = [item for item in items if item not in quick or item.get_closest_marker("hypothesis")]
    else:
        kept = [item for item in items if item in quick]
        config.stash[LEFT] = (len(marked), len(items) - len(marked) - len(quick))

    left = set(items).difference(kept)
    if left:
        config.hook.pytest_deselected(items=[item for item in items if item in left])
        items[:] = kept


def sampled(items: Sequence[pytest.Item]) -> set[pytest.Item]:
    """The items that the quick suite runs."""
    tests = defaultdict[tuple[str, str], list[pytest.Item]](list)
    for item in items:
        assert item.parent is not None
        tests[item.parent.nodeid, getattr(item, "originalname", item.name)].append(item)

    chosen = set[pytest.Item]()
    for (place, name), cases in tests.items():
        mark = cases[0].get_closest_marker("cases")
        limit = mark.args[0] if mark else CASES if is_dear(cases[0]) else PLAIN_CASES
        chosen.update(cases[index] for index in spread([values(item) for item in cases], limit, f"{place}::{name}"))

    return chosen


def is_dear(item: pytest.Item) -> bool:
    """Whether a case costs more than a call: it runs a loop, or tries examples."""
    test = inspect.unwrap(item.obj) if isinstance(item, pytest.Function) else None
    return inspect.iscoroutinefunction(test) or item.get_closest_marker("hypothesis") is not None


def values(item: pytest.Item) -> frozenset[Hashable]:
    """The parameters of a case, each with its value."""
    parameters: dict[str, Any] = item.callspec.params if isinstance(item, pytest.Function) and has_cases(item) else {}
    return frozenset((name, repr(value)) for name, value in parameters.items())


def has_cases(item: pytest.Function) -> bool:
    return hasattr(item, "callspec")


def spread(cases: Sequence[frozenset[Hashable]], limit: int, name: str) -> list[int]:
    """Which cases to try, of these; all, if they are no more than the limit."""
    number = len(cases)
    if number <= limit:
        return list(range(number))

    start = zlib.crc32(name.encode())
    order = [int(number * ((start + step) * GOLDEN % 1)) for step in range(2 * number)]
    waiting = [0, number - 1, *(index for index in dict.fromkeys([*order, *range(number)]) if 0 < index < number - 1)]
    chosen, seen = [waiting.pop(0)], set(cases[0])
    if limit > 1:
        chosen.append(waiting.pop(0))
        seen |= cases[-1]

    while len(chosen) < limit:
        best = max(waiting, key=lambda index: len(cases[index] - seen))
        waiting.remove(best)
        chosen.append(best)
        seen |= cases[best]

    return sorted(chosen)


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Lets the process that reports know what this one left out."""
    output = getattr(session.config, "workeroutput", None)
    if output is not None:
        output["left"] = session.config.stash[LEFT]


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """All workers leave out the same, so the last one tells it for all."""
    left = getattr(node, "workeroutput", {}).get("left")
    if left:
        node.config.stash[LEFT] = tuple(left)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Says how much was left out."""
    tests, cases = config.stash[LEFT]
    if tests or cases:
        terminalreporter.write_line(f"left for `make test-full`: {tests} tests marked full, {cases} further cases")
