"""`panel`: arms in the browser, watched by anybody who was let in, and moved by one operator at a time."""

from __future__ import annotations

import io
import os
import secrets
import sys
from collections.abc import AsyncGenerator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import click

from dobot_async.cli.addresses import connectable
from dobot_async.cli.credentials import token_in_file
from dobot_async.cli.failures import WrongFile
from dobot_async.cli.params import PROGRAM, TextSource
from dobot_async.cli.session import CommandSession, run

__all__ = ["panel"]

FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
SIMULATED = "sim:"
TOKENS = {"operator": "DOBOT_PANEL_OPERATOR", "viewer": "DOBOT_PANEL_VIEWER"}


@click.command(short_help="Show arms in the browser, and move them there.")
@click.argument("more", metavar="[NAME=URL]...", nargs=-1)
@click.option("--cell", "cell_file", type=PROGRAM, help="A cell file: all its arms, and its zones.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Where to listen; 0.0.0.0 is everywhere.")
@click.option("--port", type=click.IntRange(0, 65535), default=8080, show_default=True, help="0 takes a free one.")
@click.option("--operator-token-file", type=FILE, help="A file with the token of who may move arms.")
@click.option("--viewer-token-file", type=FILE, help="A file with the token of who may look on, and stop them.")
@click.option("--make-tokens", is_flag=True, help="Make tokens up for this run, and show them.")
@click.option("--name", "names", multiple=True, help="How browsers call this server, as behind a proxy; repeatable.")
@click.option("--certificate", type=FILE, help="PEM file with a certificate: the panel speaks TLS.")
@click.option("--key", type=FILE, help="PEM file with its key, if that is in another one.")
@click.option("--qr/--no-qr", default=True, help="Show the address as a QR code, for a phone.")
@click.pass_obj
def panel(
    session: CommandSession, /, more: tuple[str, ...], cell_file: TextSource | None, qr: bool, **options: Any
) -> None:
    """Show arms in the browser, until Ctrl-C.

    One arm by its URL as for every command, several as left=URL right=URL, or those of a cell file. sim: is simulated
    here, with pieces to pick up. The first line of the output is the address to open; it has the token of operators in
    it if that was made up, which it is at 127.0.0.1. For any other --host give both tokens, by files or in
    DOBOT_PANEL_OPERATOR and DOBOT_PANEL_VIEWER, or say --make-tokens. Ctrl-C stops what the panel moves.
    """
    if session.trace:
        raise click.UsageError("a panel writes no trace; trace the program that moves the arm")

    tokens = tokens_of(**{f"{role}_token_file": options.pop(f"{role}_token_file") for role in TOKENS})
    if options.pop("make_tokens"):
        if any(tokens.values()):
            raise click.UsageError("--make-tokens: tokens were given")

        made = {role: secrets.token_urlsafe(24) for role in TOKENS}
    else:
        made = {}

    arms = chosen(session, more, cell_file)
    shown = {f"{role}_token": (made or tokens)[role] for role in TOKENS}
    try:
        run(serve(session, arms, qr=qr, secret=any(tokens.values()), **shown, **options))
    except ImportError as error:  # the extra is missing
        raise click.ClickException(str(error)) from None


def tokens_of(**files: Path | None) -> dict[str, str | None]:
    """Return the token of each role, from a file or the environment; raise UsageError for one that is none."""
    found: dict[str, str | None] = {}
    for role, variable in TOKENS.items():
        file, given = files[f"{role}_token_file"], os.environ.get(variable)
        if given == "":
            raise click.UsageError(f"{variable} is empty; unset it if no token is wanted")

        found[role] = token_in_file(file) if file else given

    return found


def chosen(session: CommandSession, more: tuple[str, ...], cell_file: TextSource | None) -> Any:
    """Return which arms: their URLs by name, or a cell; raise UsageError if that is not said, or twice."""
    if cell_file:
        session.refuse("a cell file has the URLs of the arms, and their families", "url", "arm")
        if more:
            raise click.UsageError("give arms or a cell file, not both")

        return cell_of(cell_file)

    if not more:
        return {"arm": session.target()}

    session.refuse("arms are named here: NAME=URL", "url")
    urls: dict[str, str] = {}
    for each in more:
        name, equals, url = each.partition("=")
        if not (name and equals and url) or not name.isprintable() or name in urls:
            raise click.UsageError(f"expected NAME=URL, each with a name of its own, not {name!r}")

        urls[name] = url

    return urls


def cell_of(file: TextSource) -> Any:
    """Return what is in a cell file; raise WrongFile if that is wrong."""
    from dobot_async.fleet.cell import parse_cell

    try:
        return parse_cell(file.text)
    except ValueError as error:
        raise WrongFile(f"{file.name}: {error}; nothing was sent") from None


@asynccontextmanager
async def connected(session: CommandSession, arms: Any) -> AsyncGenerator[tuple[Any, Any], None]:
    """Yield what a panel is given, and the scene; a cell is connected as a whole."""
    from dobot_async.arms.mycobot.arm import MyCobot
    from dobot_async.fleet import Fleet
    from dobot_async.fleet.cell import Cell
    from dobot_async.fleet.member import Member

    if isinstance(arms, Cell):
        async with Fleet.connect(arms.members, zones=arms.zones, groups=arms.groups) as fleet:
            yield fleet, None

        return

    kind: type[Any] = session.family.kind
    options: Mapping[str, Any] = {}
    if issubclass(kind, MyCobot):
        kind, options = MyCobot, {"model": session.arm}

    if list(arms.values()) == [SIMULATED]:
        async with simulated(session.arm) as sim:
            yield {next(iter(arms)): Member(sim.url, kind, options=options)}, sim.scene
    else:
        yield {name: Member(url, kind, options=options) for name, url in arms.items()}, None


def simulated(arm: str) -> Any:
    """Return a simulated arm among some pieces."""
    from dobot_async.simulator import simulate
    from dobot_async.simulator.scene import Block, Piece, Scene

    scene = Scene(
        pieces=[
            Piece("red", (230, -90), color="red"),
            Piece("green", (200, -90), color="green"),
            Piece("blue", (170, -120), color="blue"),
        ],
        blocks=[Block("pallet", (200, 130), (110, 110, 15))],
    )
    return simulate(arm, scene=scene)


async def serve(session: CommandSession, arms: Any, *, qr: bool, secret: bool, **options: Any) -> None:
    """Run the panel until it is cancelled."""
    from dobot_async.panel import panel as opened

    async with connected(session, arms) as (found, scene), opened(found, scene=scene, **options) as running:
        events = aiter(running.events)
        url = connectable(running.url)
        answer: dict[str, Any] = {"url": url}
        lines = [url]
        if not secret:  # else who runs it knows them, and its output may go to a log
            answer |= {"operator": connectable(running.operator_url), "viewer": connectable(running.viewer_url)}
            lines = [answer["operator"], f"to look on: {answer['viewer']}"]

        if qr and not session.output.as_json:
            lines += filter(None, [code_of(answer.get("operator", url))])

        session.output.answer(answer, "\n".join(lines))
        async for line in events:
            session.output.answer(dict(line), str(line["text"]))


def code_of(url: str) -> str:
    """Return a QR code as text; nothing where it cannot be made, or shown."""
    try:
        import segno
    except ImportError:
        return ""

    out = io.StringIO()
    segno.make(url, micro=False).terminal(out, compact=True, border=2)
    try:
        out.getvalue().encode(getattr(sys.stdout, "encoding", None) or "ascii")
    except UnicodeEncodeError:
        return ""

    return out.getvalue().rstrip("\n")
