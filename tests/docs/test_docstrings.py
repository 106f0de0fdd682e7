"""What the docstrings of the verbs, and of the functions beside them, say: their arguments, and what they raise.

ruff looks at each docstring by itself: that a section `Args:` names every argument, for one. These tests look at what
is public, at classes together with those that they come from.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

import pytest
from dobot_docs.names import modules, owned_names
from dobot_docs.reference import INSIDE

from dobot_async import Arm, Fleet, Magician, MyCobot, UltraArm
from dobot_async.teaching import Recorder
from dobot_async.toolpath import Drawing

OBJECTS = (Arm, Magician, MyCobot, UltraArm, Fleet, Recorder, Drawing)
ELSEWHERE = ("dobot_async.sync", "dobot_async.compat")
"""Written from what is looked at here, or named as vendors name it."""

PLAIN = {"color", "set_end_effector", "member", "base", "holders", "change_last"}
"""Methods whose first sentence says all of their arguments."""

QUIET = {"read_figures", "figures_of_bridge", "serve_stdio"}
"""Functions that take what an arm, or a client, does wrong for an answer, and raise nothing of their own."""

Documented = tuple[Callable[..., Any], tuple[type[Any], ...]]


def methods(kind: type[Any]) -> Iterator[Documented]:
    """The public methods of a class, each with the classes whose docstrings speak of it as well."""
    for name in dir(kind):
        found = inspect.getattr_static(kind, name)
        function = found.__func__ if isinstance(found, (classmethod, staticmethod)) else found
        if not name.startswith("_") and name not in INSIDE and inspect.isfunction(function):
            told = Arm if "`Arm`" in (kind.__doc__ or "") else kind
            yield inspect.unwrap(function), (*kind.__mro__, told)


def functions() -> Iterator[Documented]:
    """The public functions."""
    for module in modules():
        if not module.startswith(ELSEWHERE):
            for name in owned_names(module):
                value = getattr(import_module(module), name)
                if inspect.isfunction(value):
                    yield inspect.unwrap(value), ()


PUBLIC = {
    f"{function.__module__}.{function.__qualname__}": (function, classes)
    for function, classes in (*(each for kind in OBJECTS for each in methods(kind)), *functions())
}


def arguments(function: Callable[..., Any]) -> set[str]:
    """The arguments whose meaning is not the same everywhere."""
    return inspect.signature(function).parameters.keys() - {"self", "cls", "timeout"}


def undescribed(function: Callable[..., Any]) -> set[str]:
    """The arguments that a docstring does not describe."""
    said = inspect.getdoc(function) or ""
    if "UnsupportedError: " in said.partition("\n")[0]:
        return set()

    return set() if "Args:" in said else arguments(function)


def waits(function: Callable[..., Any]) -> bool:
    """Whether a function may wait for an arm."""
    asked = inspect.iscoroutinefunction(function) or inspect.isasyncgenfunction(function)
    return asked or "timeout" in inspect.signature(function).parameters


def says_what_it_raises(function: Callable[..., Any], classes: tuple[type[Any], ...] = ()) -> bool:
    """Whether a docstring, or that of one of the classes that it belongs to, has a section for errors."""
    return any("Raises:" in (each.__doc__ or "") for each in (function, *classes))


@pytest.mark.parametrize("name", PUBLIC)
def test_what_is_public_says_what_its_arguments_are(name: str) -> None:
    function, _ = PUBLIC[name]
    if function.__name__ not in PLAIN:
        assert not undescribed(function)


@pytest.mark.parametrize("name", [name for name, (function, _) in PUBLIC.items() if waits(function)])
def test_what_waits_for_an_arm_says_what_it_raises(name: str) -> None:
    if PUBLIC[name][0].__name__ not in QUIET:
        assert says_what_it_raises(*PUBLIC[name])


async def move(x: float, *, timeout: float | None = None) -> None:
    """Move."""


def test_what_is_missing_is_found() -> None:
    assert undescribed(move) == {"x"}
    assert waits(move)
    assert not says_what_it_raises(move)
    assert says_what_it_raises(move, (Arm,))
    assert not says_what_it_raises(move, (object,))
