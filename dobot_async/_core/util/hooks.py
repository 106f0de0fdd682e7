"""Functions of users that are called when something happens; what they raise is logged and goes no further."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Generic, ParamSpec

__all__ = ["Hooks"]

P = ParamSpec("P")
logger = logging.getLogger("dobot_async.hooks")


class Hooks(Generic[P]):
    """Who is called at one occasion, in the order in which they were added; false while there is nobody."""

    def __init__(self) -> None:
        self._functions: list[Callable[P, object]] = []

    def add(self, function: Callable[P, object]) -> None:
        """Call a function from now on."""
        self._functions.append(function)

    def remove(self, function: Callable[P, object]) -> None:
        """Call it no more.

        Raises:
            ValueError: It was not added.
        """
        self._functions.remove(function)

    def __bool__(self) -> bool:
        return bool(self._functions)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> None:
        for function in tuple(self._functions):
            try:
                function(*args, **kwargs)
            except Exception:
                logger.exception("%r failed", function)
