"""`mcp`: arms for language models, by the Model Context Protocol, on standard input and output or by HTTP."""

from __future__ import annotations

import asyncio
import secrets
from pathlib import Path
from typing import Any

import click

from dobot_async._core.util.hosts import HostAndPort, is_loopback
from dobot_async.cli.addresses import connectable
from dobot_async.cli.commands.bridge import FILE
from dobot_async.cli.extras import needing
from dobot_async.cli.params import HOST_AND_PORT
from dobot_async.cli.session import CommandSession, run
from dobot_async.cli.sites import of_a_site, site_of, token_of

__all__ = ["mcp"]

VARIABLE = "DOBOT_MCP_TOKEN"


@click.command(short_help="Give an arm to language models, by MCP.")
@of_a_site
@click.option("--http", type=HOST_AND_PORT, help="Serve streamable HTTP at HOST:PORT; else one client by stdio.")
@click.option(
    "--http-token-file",
    type=FILE,
    help="A file with the token that HTTP clients present; or set DOBOT_MCP_TOKEN.  [default: made up where one is "
    "needed: on any address but this computer's own]",
)
@click.option("--host", "names", multiple=True, help="A name that HTTP clients call this server by; repeatable.")
@click.option("--origin", "origins", multiple=True, help="A web page, https://host, that may come in; repeatable.")
@click.option("--certificate", type=FILE, help="PEM file with a certificate: HTTP speaks TLS.")
@click.option("--key", type=FILE, help="PEM file with its key, if that is in another one.")
@click.pass_obj
def mcp(session: CommandSession, /, http: HostAndPort | None, http_token_file: Path | None, **given: Any) -> None:
    """Give an arm, or those of a cell, to language models, by the Model Context Protocol.

    Without --http it talks to one client by standard input and output, and ends with it. Without --allow-motion it
    only reads and plans. A motion ends with the call, the client or the connection that asked for it: the arm stops.
    """
    details = {name: given.pop(name) for name in ("names", "origins", "certificate", "key")}
    if http is None:
        for name, value in {"http-token-file": http_token_file, **details}.items():
            if value:
                raise click.UsageError(f"--{name.removesuffix('s')} is for --http alone")

    token = token_of(http_token_file, VARIABLE) if http else None
    if http and token is None and not is_loopback(http[0]):
        token = details["made_up"] = secrets.token_urlsafe(24)

    with needing("mcp"):
        run(serve(session, given, http, token, **details))


async def serve(
    session: CommandSession,
    given: dict[str, Any],
    http: HostAndPort | None,
    token: str | None,
    made_up: str | None = None,
    **details: Any,
) -> None:
    """Serve until the client is gone, or this is cancelled."""
    from dobot_async.mcp_server import make_server, serve_http, serve_stdio
    from dobot_async.remote import Works

    async with site_of(session, given) as site:
        session.commanding = site.moves
        server = make_server(Works(site))
        if http is None:
            await serve_stdio(server)
            return

        async with serve_http(server, http, token=token, **details) as url:
            answer = {"url": connectable(url), **({"token": made_up} if made_up else {})}
            session.output.answer(answer, "\n".join([answer["url"], *([f"token {made_up}"] if made_up else [])]))
            await asyncio.Event().wait()
