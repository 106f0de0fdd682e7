"""`bridge`: one arm, on any transport, for several programs on a network."""

from __future__ import annotations

from contextlib import AbstractAsyncContextManager, AsyncExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dobot_async._core.util.hosts import HostAndPort, is_loopback
from dobot_async.cli.addresses import connectable
from dobot_async.cli.credentials import own_token
from dobot_async.cli.extras import needing
from dobot_async.cli.params import HOST_AND_PORT
from dobot_async.cli.session import CommandSession, run

if TYPE_CHECKING:
    from dobot_async.bridge import Bridge

__all__ = ["FILE", "GROUPS", "bridge", "serve"]

GROUPS = ("wifi", "calibration", "firmware")
FILE = click.Path(exists=True, dir_okay=False, path_type=Path)


@click.command(short_help="Give an arm to programs on a network.")
@click.argument("source", metavar="SOURCE_URL")
@click.argument("listen", metavar="LISTEN_URL...", nargs=-1, required=True)
@click.option(
    "--token",
    envvar="DOBOT_BRIDGE_TOKEN",
    help="What clients have to present. Others on this computer can see the arguments of a program: better set "
    "DOBOT_BRIDGE_TOKEN, or give a file.",
)
@click.option("--token-file", type=FILE, help="A file with the token.")
@click.option("--takeover", is_flag=True, help="Whoever moves the arm last may; else the first one, until it leaves.")
@click.option(
    "--on-vanish",
    type=click.Choice(["stop", "leave"]),
    default="stop",
    show_default=True,
    help="What becomes of a motion whose program has gone.",
)
@click.option("--deny", multiple=True, type=click.Choice(GROUPS), help="Commands that nobody may send; repeatable.")
@click.option("--certificate", type=FILE, help="PEM file with a certificate: tcp and ws speak TLS.")
@click.option("--key", type=FILE, help="PEM file with its key, if that is in another one.")
@click.option("--origin", "origins", multiple=True, help="A web page, https://host, that needs no token; repeatable.")
@click.option(
    "--metrics",
    type=HOST_AND_PORT,
    help="Serve /metrics for Prometheus at HOST:PORT; on another address than this computer's own the token is needed.",
)
@click.pass_obj
def bridge(session: CommandSession, /, token: str | None, token_file: Path | None, **details: Any) -> None:
    """Give the arm at SOURCE_URL to programs on a network, until Ctrl-C.

    LISTEN_URL is one or more of tcp://127.0.0.1:9000, udp://127.0.0.1:8899, ws://127.0.0.1:8765, zenoh://NAME and pty;
    port 0 takes a free one. The first lines of the output are the URLs to connect to, and the token if one had to be
    made up: any address but this computer's own needs one. After them comes a line for whatever happens.
    """
    session.refuse("SOURCE_URL says where the arm is", "url")
    if session.trace:
        raise click.UsageError("a bridge writes no trace: passwords go through it; trace the program that connects")

    token, metrics = own_token(token, token_file), details["metrics"]
    if metrics and not is_loopback(metrics[0]) and token is None:
        raise click.UsageError(f"--metrics at {metrics[0]} needs a token, as it does on every address of others")

    run(serve(session, token=token, **details))


async def serve(
    session: CommandSession, *, source: str, token: str | None, metrics: HostAndPort | None = None, **details: Any
) -> None:
    """Runs the bridge until it is cancelled."""
    from dobot_async.bridge import bridge as bridged

    async with bridged(source, token=token, family=session.arm, **details) as running, AsyncExitStack() as stack:
        urls = [connectable(url) for url in running.urls]
        answer: dict[str, Any] = {"urls": urls}
        text = "\n".join(urls)
        if running.token != token:
            answer["token"] = running.token
            text += f"\ntoken {running.token}"

        if metrics:
            answer["metrics"] = await stack.enter_async_context(served_metrics(running, metrics))
            text += f"\n{answer['metrics']}"

        events = aiter(running.events)
        session.output.answer(answer, text)
        async for event in events:
            session.output.answer(event, str(event))


def served_metrics(running: Bridge[Any], place: HostAndPort) -> AbstractAsyncContextManager[str]:
    """Serves the figures of the bridge and its arm; yields their URL."""
    from dobot_async.metrics import figures_of_bridge, metrics_text, serve_metrics

    with needing("metrics"):
        metrics_text({})

    async def text() -> bytes:
        return metrics_text({running.family.model: await figures_of_bridge(running)})

    return serve_metrics(place, text, token=None if is_loopback(place[0]) else running.token)
