"""The token of a bridge, for the command line: from a file or the environment, where no list of processes shows it."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import parse_qs, quote, urlsplit

import click

__all__ = ["own_token", "with_token"]

TOKEN, BRIDGE_TOKEN = "DOBOT_TOKEN", "DOBOT_BRIDGE_TOKEN"
SCHEMES = {"tcp", "udp", "ws", "wss"}


def with_token(url: str, file: Path | None) -> str:
    """Returns a URL with the token that --token-file or DOBOT_TOKEN gives for it; one of its own comes first.

    Raises UsageError for a file where no token is presented, or where the URL has one.
    """
    takes, has = urlsplit(url).scheme in SCHEMES, {"token", "token_file"} & parse_qs(urlsplit(url).query).keys()
    if file and (has or not takes):
        raise click.UsageError("--token-file is for a bridge at tcp, udp, ws or wss, whose URL has no token")

    token = os.environ.get(TOKEN)
    if not takes or has or not (file or token):
        return url

    more = f"token_file={quote(str(file))}" if file else f"token={quote(token or '')}"
    return f"{url}{'&' if '?' in url else '?'}{more}"


def own_token(token: str | None, file: Path | None) -> str | None:
    """Returns the token that a bridge is to ask for; raises UsageError for two of them, or an empty one."""
    if token is None and os.environ.get(BRIDGE_TOKEN) == "" and not file:
        raise click.UsageError(f"{BRIDGE_TOKEN} is empty; unset it if no token is wanted")

    source = click.get_current_context().get_parameter_source("token")
    if file and source is click.core.ParameterSource.COMMANDLINE:
        raise click.UsageError("give --token or --token-file, not both")

    return token_in_file(file) if file else token


def token_in_file(file: Path) -> str:
    """Returns the token in a file; raises UsageError if there is none."""
    from dobot_async.transports.network import token_in

    try:
        return token_in(file)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
