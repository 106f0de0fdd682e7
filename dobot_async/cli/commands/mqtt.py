"""`mqtt`: arms at a message broker, for dashboards and Home Assistant."""

from __future__ import annotations

import os
from contextlib import AsyncExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dobot_async._core.util.hosts import HostAndPort, is_loopback
from dobot_async.cli.commands.bridge import FILE
from dobot_async.cli.extras import needing
from dobot_async.cli.params import ABOVE_ZERO, HOST_AND_PORT
from dobot_async.cli.session import CommandSession, run
from dobot_async.cli.sites import names_of, of_a_site, site_of, token_of

if TYPE_CHECKING:
    from dobot_async.mqtt import Gateway
    from dobot_async.remote import Works

__all__ = ["mqtt"]

PASSWORD, METRICS_TOKEN = "DOBOT_MQTT_PASSWORD", "DOBOT_METRICS_TOKEN"


@click.command(short_help="Tell a message broker of an arm, for Home Assistant.")
@of_a_site
@click.option("--broker", required=True, help="mqtt://[USER@]HOST[:PORT], or mqtts:// with TLS.")
@click.option("--password-file", type=FILE, help="A file with the user's password; or set DOBOT_MQTT_PASSWORD.")
@click.option("--ca", type=FILE, help="PEM file with the certificate of a broker at mqtts://.")
@click.option("--base", default="dobot", show_default=True, help="What all topics begin with.")
@click.option("--id", "identifier", help="What this gateway is called.  [default: as its arms]")
@click.option(
    "--discovery",
    default="homeassistant",
    show_default=True,
    help='What the topics of Home Assistant\'s discovery begin with; "" leaves it out.',
)
@click.option("--interval", type=ABOVE_ZERO, default=1.0, show_default=True, help="Seconds between two readings.")
@click.option(
    "--metrics",
    type=HOST_AND_PORT,
    help="Serve /metrics for Prometheus at HOST:PORT; on another address than this computer's own set "
    "DOBOT_METRICS_TOKEN.",
)
@click.pass_obj
def mqtt(
    session: CommandSession,
    /,
    broker: str,
    password_file: Path | None,
    ca: Path | None,
    metrics: HostAndPort | None,
    **given: Any,
) -> None:
    """Tell a message broker what an arm does, or those of a cell, until Ctrl-C.

    With --allow-motion whoever may publish there can stop an arm, and move it when its session has taken the lease. A
    session that is not heard of any more, and a broker that is lost, stop the arm.
    """
    with needing("mqtt"):
        from dobot_async.mqtt import Gateway, broker_at

    details = {name: given.pop(name) for name in ("base", "identifier", "discovery", "interval")}
    try:
        place = broker_at(broker, password=password_of(password_file), ca=ca)
        Gateway.check(names_of(given), **details)
    except ValueError as error:
        raise click.UsageError(str(error)) from None

    if metrics and not is_loopback(metrics[0]) and token_of(None, METRICS_TOKEN) is None:
        raise click.UsageError(f"--metrics at {metrics[0]} needs a token: set {METRICS_TOKEN}")

    details["broker"] = place
    run(serve(session, given, metrics, **details))


def password_of(file: Path | None) -> str | None:
    """The password in a file, or in the environment."""
    return file.read_text(encoding="utf-8").strip("\r\n") if file else os.environ.get(PASSWORD)


async def serve(session: CommandSession, given: dict[str, Any], metrics: HostAndPort | None, **details: Any) -> None:
    """Run the gateway until it is cancelled."""
    from dobot_async.mqtt import Gateway
    from dobot_async.remote import Works

    async with site_of(session, given) as site, AsyncExitStack() as stack:
        session.commanding = site.moves
        works = Works(site)
        gateway = Gateway(works, **details)
        answer: dict[str, Any] = {"broker": str(details["broker"]), "arms": list(site.arms)}
        text = f"{', '.join(site.arms)} at {answer['broker']}"
        if metrics:
            answer["metrics"] = await stack.enter_async_context(served_metrics(works, gateway, metrics))
            text += f"\n{answer['metrics']}"

        session.output.answer(answer, text)
        await gateway.run(patient=False)


def served_metrics(works: Works, gateway: Gateway, place: HostAndPort) -> Any:
    """Serve the figures of the arms; yields their URL."""
    from dobot_async.metrics import metrics_text, read_figures, serve_metrics

    with needing("metrics"):
        metrics_text({})

    async def text() -> bytes:
        holders = gateway.holders
        held = {on.name: bool(holders[on.name]) if on.name in holders else None for on in works.site}
        return metrics_text({on.name: await read_figures(on.arm, held=held[on.name]) for on in works.site})

    return serve_metrics(place, text, token=token_of(None, METRICS_TOKEN))
