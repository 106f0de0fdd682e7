"""The arms that a server shares, and their limits: the options of `mcp` and `mqtt`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from dobot_async.cli.credentials import token_in_file
from dobot_async.cli.failures import WrongFile
from dobot_async.cli.params import FINITE, PERCENT, PROGRAM, TextSource
from dobot_async.cli.session import CommandSession

if TYPE_CHECKING:
    from dobot_async.fleet.cell import Cell
    from dobot_async.fleet.member import Member
    from dobot_async.remote import Site

__all__ = ["names_of", "of_a_site", "site_of", "token_of"]

F = TypeVar("F", bound=Callable[..., Any])
OPTIONS = (
    click.option("--cell", type=PROGRAM, help="A cell file (TOML), in place of a single arm."),
    click.option("--name", default="arm", show_default=True, help="What the single arm is called."),
    click.option("--allow-motion", is_flag=True, help="Let others move the arms; else nothing that moves is there."),
    click.option(
        "--speed",
        type=PERCENT,
        default=50.0,
        show_default=True,
        help="Percent of the arms' speeds, at the most.",
    ),
    click.option(
        "--workspace",
        nargs=6,
        type=FINITE,
        metavar="X X Y Y Z Z",
        help="Where the tools may be: from and to, mm, in each arm's own coordinates.  [default: wherever it reaches]",
    ),
)


def of_a_site(function: F) -> F:
    """Add the options."""
    for option in reversed(OPTIONS):
        function = option(function)

    return function


def names_of(given: Mapping[str, Any]) -> list[str]:
    """Return what the arms are called; raise WrongFile for a cell file that is wrong."""
    return [given["name"]] if given["cell"] is None else list(cell_of(given["cell"]).members)


def cell_of(text: TextSource) -> Cell:
    """The cell of a file."""
    from dobot_async.fleet.cell import parse_cell

    try:
        return parse_cell(text.text)
    except ValueError as error:
        raise WrongFile(f"{text.name}: {error}; nothing was sent") from None


def site_of(session: CommandSession, given: Mapping[str, Any]) -> AbstractAsyncContextManager[Site]:
    """Return what connects to the arms.

    Raises:
        UsageError: There is no URL, or there are a URL and a cell.
        WrongFile: The cell file is wrong.
        ValueError: A number is out of range.
    """
    from dobot_async import Box, Workspace
    from dobot_async.remote import open_site

    if session.trace:
        raise click.UsageError("a server writes no trace: trace the bridge, or the program, behind it")

    edges, cell = given["workspace"], given["cell"]
    workspace = Workspace(Box(*(edges[at : at + 2] for at in (0, 2, 4)))) if edges else None
    options: dict[str, Any] = {"allow_motion": given["allow_motion"], "speed": given["speed"], "workspace": workspace}
    if cell is None:
        return open_site(member(session), name=given["name"], **options)

    session.refuse("a cell file has the URLs of the arms, and their families", "url", "arm", "token_file")
    return open_site(cell_of(cell), **options)


def member(session: CommandSession) -> Member[Any]:
    """The arm at --url."""
    from dobot_async import MyCobot
    from dobot_async.fleet.member import Member

    if issubclass(session.family.kind, MyCobot):
        return Member(session.target(), MyCobot, options={"model": session.arm})

    return Member(session.target(), session.family.kind)


def token_of(file: Path | None, variable: str) -> str | None:
    """Return the token that others have to present: of a file, or of an environment variable; None for none."""
    from dobot_async.transports.network import TOKEN, secret

    if file:
        return token_in_file(file)

    token = os.environ.get(variable)
    if token is None:
        return None

    try:
        return secret(token)
    except ValueError:
        raise click.UsageError(f"{variable} must be {TOKEN.expected}") from None
