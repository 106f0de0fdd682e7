"""What the commands need to know of each family: how one asks an arm of it, and in which words it answers.

A family is one entry of `FAMILIES`, by its word of `--arm`; each is imported when it is asked for.
"""

from __future__ import annotations

from collections.abc import Sequence

import click

from dobot_async.arms.registry import Parts
from dobot_async.cli.family import FamilyCommands

__all__ = ["FAMILIES", "chosen"]

FAMILIES: Parts[FamilyCommands] = Parts("cli")
"""All of them."""


def chosen(value: str | None, choices: Sequence[str], what: str) -> str:
    """The choice that was made, the first one without any; raises UsageError for one that there is not."""
    found = choices[0] if value is None else value.lower()
    if found not in choices:
        raise click.UsageError(f"{what} is one of {', '.join(choices)}, not {value!r}")

    return found
