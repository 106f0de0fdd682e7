"""Commands that need an extra: a library that is missing is wrong usage, and told in one line."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

import click

__all__ = ["needing"]


@contextmanager
def needing(extra: str) -> Generator[None]:
    """While this is entered, a library that is missing ends the command, with the extra that has it."""
    try:
        yield
    except ImportError as error:
        name = error.name or str(error)
        raise click.UsageError(
            f"{name} is not installed, and this needs it: pip install 'dobot-async[{extra}]'"
        ) from None
