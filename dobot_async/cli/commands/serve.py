"""`serve`: an arm under a name on Eclipse Zenoh, for the programs of other machines."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import click

from dobot_async.cli.commands.bridge import FILE, GROUPS, serve
from dobot_async.cli.session import CommandSession, run

__all__ = ["serve_on_zenoh"]


@click.command("serve", short_help="Put an arm on Zenoh, under a name.")
@click.argument("source", metavar="SOURCE_URL")
@click.option("--name", required=True, help="What it is called: programs connect to zenoh://NAME.")
@click.option("--zenoh", "config", type=FILE, metavar="CONFIG", help="A configuration file of Zenoh's, for everything.")
@click.option("--listen", multiple=True, metavar="ENDPOINT", help="Where to listen: tcp/0.0.0.0:7447; repeatable.")
@click.option("--connect", multiple=True, metavar="ENDPOINT", help="A router to connect to: tcp/host:7447; repeatable.")
@click.option("--lan", is_flag=True, help="Be found, and used, by everybody in this network. There is no password.")
@click.option("--takeover", is_flag=True, help="Whoever moves the arm last may; else the first one, until it leaves.")
@click.option(
    "--on-vanish",
    type=click.Choice(["stop", "leave"]),
    default="stop",
    show_default=True,
    help="What becomes of a motion whose program has gone.",
)
@click.option("--deny", multiple=True, type=click.Choice(GROUPS), help="Commands that nobody may send; repeatable.")
@click.pass_obj
def serve_on_zenoh(
    session: CommandSession,
    /,
    name: str,
    config: Path | None,
    listen: tuple[str, ...],
    connect: tuple[str, ...],
    lan: bool,
    **details: Any,
) -> None:
    """Put the arm at SOURCE_URL on Eclipse Zenoh, until Ctrl-C.

    Without --zenoh, --listen, --connect or --lan it can be reached from this computer alone. The first line of the
    output is a URL to connect to. After it comes a line for whatever happens.
    """
    session.refuse("SOURCE_URL says where the arm is", "url")
    if session.trace:
        raise click.UsageError("a server writes no trace: passwords go through it; trace the program that connects")

    if lan and (config or listen or connect):
        raise click.UsageError("--lan is Zenoh's own way to find everybody; the other options say whom to find instead")

    ways = {
        "config": str(config) if config else "",
        "listen": ",".join(listen),
        "connect": ",".join(connect),
        "lan": "yes" if lan else "",
    }
    query = urlencode({way: value for way, value in ways.items() if value}, safe="/:,[]")
    place = f"zenoh://{name}{'?' if query else ''}{query}"
    run(serve(session, token=None, listen=[place], **details))
