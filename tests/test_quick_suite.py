"""The quick suite: what is left out without `--full`, that it is told, and that nothing is left out by everybody."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from quick_suite import CASES, FEWEST_EXAMPLES, PLAIN_CASES, QUICK_EXAMPLES, spread

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[1]
SUITE = f"""
    import pytest
    from hypothesis import given, settings, strategies as st
    from quick_suite import examples

    @pytest.mark.parametrize("trouble", ["a", "b", "c"])
    @pytest.mark.parametrize("verb", range(20))
    async def test_table(verb, trouble):
        pass

    @pytest.mark.parametrize("row", range({PLAIN_CASES + 5}))
    def test_plain(row):
        pass

    @pytest.mark.cases(2)
    @pytest.mark.parametrize("seed", range(9))
    def test_dear(seed):
        pass

    @pytest.mark.parametrize("seed", range({CASES}))
    def test_few(seed):
        pass

    @pytest.mark.full
    def test_flood():
        pass

    @given(st.integers())
    @settings(max_examples=examples(200), database=None)
    def test_property(number):
        with open("tried", "a") as file:
            file.write("x")
"""

LEFT = f"left for `make test-full`: 1 tests marked full, {60 - CASES + 5 + 7} further cases"


@pytest.fixture
def suite(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.Pytester]:
    """A suite with the plugin, in a process of its own: it chooses a profile of hypothesis for all of the process."""
    monkeypatch.setenv("PYTHONPATH", f"{ROOT / 'tests' / 'support'}")
    pytester.makepyprojecttoml(
        "[tool.pytest.ini_options]\nasyncio_mode = 'auto'\naddopts = '-p no:cacheprovider -p no:dobot_async'\n"
    )
    pytester.makeconftest('pytest_plugins = ["quick_suite"]')
    pytester.makepyfile(test_it=SUITE)
    yield pytester
    (pytester.path / "tried").unlink(missing_ok=True)


def ran(suite: pytest.Pytester, *options: str) -> tuple[set[str], str]:
    """The names of the cases that were run, and the output."""
    (suite.path / "tried").unlink(missing_ok=True)
    result = suite.runpytest_subprocess("-v", *options)
    assert result.ret == 0
    text = result.stdout.str()
    return set(re.findall(r"::(test_\S+)", text)), text


def tried(suite: pytest.Pytester) -> int:
    """How many examples the property had."""
    return len((suite.path / "tried").read_text())


def test_a_few_cases_are_run_and_it_is_told_what_is_left(suite: pytest.Pytester) -> None:
    quick, told = ran(suite)
    assert tried(suite) == 2 * QUICK_EXAMPLES
    assert LEFT in told
    assert {name for name in quick if name.startswith("test_dear")} == {"test_dear[0]", "test_dear[8]"}
    assert len([name for name in quick if name.startswith("test_table")]) == CASES
    assert len([name for name in quick if name.startswith("test_plain")]) == PLAIN_CASES
    assert {"test_table[0-a]", "test_table[19-c]"} <= quick
    assert len([name for name in quick if name.startswith("test_few")]) == CASES
    assert "test_flood" not in quick


@pytest.mark.full
def test_the_quick_suite_and_the_rest_are_the_full_one(suite: pytest.Pytester) -> None:
    """Each case is in one of both, and properties are in the rest again with all of their examples."""
    quick, _ = ran(suite)
    rest, told = ran(suite, "--rest")
    assert tried(suite) == 200
    assert "left for" not in told
    everything, told = ran(suite, "--full")
    assert tried(suite) == 200
    assert "left for" not in told

    assert quick | rest == everything
    assert quick & rest == {"test_property"}
    assert len(everything) == 60 + PLAIN_CASES + 5 + 9 + CASES + 2


@pytest.mark.full
def test_workers_choose_alike_and_what_they_leave_is_told_once(suite: pytest.Pytester) -> None:
    """xdist refuses workers that disagree, and its reporter has collected nothing itself."""
    alone, _ = ran(suite)
    shared, told = ran(suite, "-n", "2")
    assert shared == alone
    assert told.count(LEFT) == 1


@pytest.mark.full
def test_what_is_named_is_run(suite: pytest.Pytester) -> None:
    found, told = ran(suite, "test_it.py::test_flood", "test_it.py::test_table")
    assert len(found) == 61
    assert "left for" not in told


def table(verbs: int, troubles: int) -> list[frozenset[tuple[str, int]]]:
    return [frozenset({("verb", verb), ("trouble", trouble)}) for verb in range(verbs) for trouble in range(troubles)]


@pytest.mark.parametrize(("verbs", "troubles"), [(8, 4), (4, 8), (8, 8), (1, 8)])
def test_each_value_of_each_parameter_is_tried(verbs: int, troubles: int) -> None:
    cases = table(verbs, troubles)
    chosen = spread(cases, 8, "name")
    assert set().union(*(cases[index] for index in chosen)) == set().union(*cases)


@pytest.mark.parametrize("number", [7, 20, 129, 1000])
@pytest.mark.parametrize("limit", [1, 2, 6])
def test_the_first_the_last_and_some_between(number: int, limit: int) -> None:
    chosen = spread(table(number, 1), limit, "name")
    assert len(chosen) == limit
    assert chosen == sorted(set(chosen))
    assert chosen[0] == 0
    assert limit == 1 or chosen[-1] == number - 1
    if limit > 2:
        gaps = [after - before for before, after in pairwise(chosen)]
        assert max(gaps) <= number * 0.62 + 1


def test_tests_that_share_a_table_try_different_rows() -> None:
    cases = table(78, 1)
    rows = [spread(cases, CASES, f"test_{number}") for number in range(40)]
    assert rows == [spread(cases, CASES, f"test_{number}") for number in range(40)]
    assert len({row for each in rows for row in each}) > 20


def test_a_property_has_a_few_examples_at_least() -> None:
    assert FEWEST_EXAMPLES <= QUICK_EXAMPLES


def test_what_the_quick_suite_leaves_is_run_by_machines() -> None:
    """`make test` is the quick suite, `make test-full` all of it, and machines run both."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    runs = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    workflow = (ROOT / ".github" / "workflows" / "test.yml").read_text(encoding="utf-8")
    assert re.search(r"^test-full:", makefile, re.MULTILINE)
    assert re.search(r"^make test$", runs, re.MULTILINE)
    assert re.search(r"^make test-full REST=1$", runs, re.MULTILINE)
    assert "pytest -n auto --full" in workflow
