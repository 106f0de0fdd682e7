"""Functions of users, of which none harms another; and arguments, checked before a byte is sent."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from typing import Any

import pytest

from dobot_async._core.util.arguments import check_choice, check_duration, check_timeout
from dobot_async._core.util.hooks import Hooks


def test_hooks_are_called_in_their_order_with_what_happened() -> None:
    hooks: Hooks[[int]] = Hooks()
    seen: list[tuple[str, int]] = []
    assert not hooks
    hooks.add(lambda number: seen.append(("first", number)))
    hooks.add(lambda number: seen.append(("second", number)))
    assert hooks
    hooks(1)
    hooks(2)
    assert seen == [("first", 1), ("second", 1), ("first", 2), ("second", 2)]


def test_a_hook_that_raises_harms_no_other_and_nobody_who_calls(caplog: pytest.LogCaptureFixture) -> None:
    def bad() -> None:
        raise ZeroDivisionError("a bug")

    hooks: Hooks[[]] = Hooks()
    seen: list[int] = []
    hooks.add(bad)
    hooks.add(lambda: seen.append(1))
    hooks()
    hooks()
    assert seen == [1, 1]
    assert caplog.text.count("ZeroDivisionError: a bug") == 2


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit])
def test_what_ends_a_program_ends_it(error: type[BaseException]) -> None:
    def ends() -> None:
        raise error

    hooks: Hooks[[]] = Hooks()
    hooks.add(ends)
    with pytest.raises(error):
        hooks()


def test_a_hook_is_removed_once_and_may_remove_itself() -> None:
    hooks: Hooks[[]] = Hooks()
    seen: list[str] = []

    def once() -> None:
        seen.append("once")
        hooks.remove(once)

    hooks.add(once)
    hooks.add(lambda: seen.append("always"))
    hooks()
    hooks()
    assert seen == ["once", "always", "always"]
    with pytest.raises(ValueError, match="not in list"):
        hooks.remove(once)


@pytest.mark.parametrize("timeout", [0, 0.5, 3, math.inf, Fraction(1, 2), Decimal("1.5"), True])
def test_a_timeout_may_be_any_number_from_zero_on(timeout: Any) -> None:
    found = check_timeout(timeout)
    assert found == float(timeout)
    assert type(found) is float


def test_no_timeout_is_none() -> None:
    assert check_timeout(None) is None


@pytest.mark.parametrize("timeout", [-1, -0.001, -math.inf, math.nan])
def test_a_timeout_below_zero_is_refused(timeout: float) -> None:
    with pytest.raises(ValueError, match="patience must be seconds, 0 or more"):
        check_timeout(timeout, "patience")


@pytest.mark.parametrize("wrong", ["1", b"1", [1], object(), 1j])
def test_what_is_no_number_is_refused(wrong: Any) -> None:
    with pytest.raises(TypeError, match="must be a number"):
        check_timeout(wrong)

    with pytest.raises(TypeError, match="must be a number"):
        check_duration(wrong)


@pytest.mark.parametrize("seconds", [-1, math.inf, math.nan])
def test_a_duration_is_finite(seconds: float) -> None:
    with pytest.raises(ValueError, match="seconds must be 0 or more and finite"):
        check_duration(seconds)


def test_a_duration_has_a_limit() -> None:
    assert check_duration(10, most=10) == 10.0
    with pytest.raises(ValueError, match=r"pause must be 0 or more and at most 10, not 10\.1"):
        check_duration(10.1, "pause", most=10)


def test_a_choice_is_one_of_several() -> None:
    check_choice("on_error", "stop", "stop", "leave")
    with pytest.raises(ValueError, match="on_error must be 'stop' or 'leave', not 'go'"):
        check_choice("on_error", "go", "stop", "leave")
