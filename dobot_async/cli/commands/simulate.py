"""`simulate`: a simulated arm that other programs can connect to."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import Any

import click

from dobot_async.cli.addresses import connectable
from dobot_async.cli.params import ABOVE_ZERO, AddressType
from dobot_async.cli.session import CommandSession, run

__all__ = ["simulate"]

FAULTS = {
    "loss": "Probability that a message is lost.",
    "corrupt": "Probability that one of its bytes is changed.",
    "dup": "Probability that it arrives twice.",
    "split": "Probability that it arrives in two parts.",
    "noise": "Probability that junk comes before it.",
}
DELAYS = {"latency": "Seconds that a message takes.", "jitter": "Seconds that it may take on top, at random."}


def faults(command: click.decorators.FC) -> click.decorators.FC:
    """Adds the options for a bad line."""
    for name, text in reversed(DELAYS.items()):
        command = click.option(f"--{name}", type=click.FloatRange(0), default=0.0, help=text)(command)

    for name, text in reversed(FAULTS.items()):
        command = click.option(f"--{name}", type=click.FloatRange(0, 1), default=0.0, help=text)(command)

    return command


@click.command()
@click.option(
    "--listen",
    default="pty",
    show_default=True,
    metavar="WHERE",
    help="pty, tcp://127.0.0.1:0 or udp://127.0.0.1:0 (port 0 takes a free one), or ble (Linux).",
)
@click.option("--speed", type=ABOVE_ZERO, default=1.0, help="Simulated seconds per second.")
@click.option("--seed", type=int, help="Of the faults, to have the same ones again.")
@click.option(
    "--announce",
    type=AddressType(),
    metavar="ADDRESS[:PORT]",
    help="Answer searches for arms there, as an arm in the Wi-Fi does; 0.0.0.0 hears all broadcasts. "
    "The arm has to listen at port 8899, as in --listen udp://0.0.0.0:8899.",
)
@faults
@click.pass_obj
def simulate(
    session: CommandSession,
    /,
    listen: str,
    speed: float,
    seed: int | None,
    announce: tuple[str, int] | None,
    **line: float,
) -> None:
    """Simulate an arm until Ctrl-C.

    The first line of the output is the URL to connect to. Of ble, the second one is a variable that clients need in
    their environment.
    """
    session.refuse("a simulated arm has a URL of its own: see --listen", "url")
    session.refuse("trace the program that connects", "trace")
    run(serve(session, session.arm, listen=listen, announce=announce, speed=speed, seed=seed, line=line))


async def serve(
    session: CommandSession,
    arm: str,
    *,
    listen: str,
    announce: tuple[str, int] | None,
    line: dict[str, Any],
    **details: Any,
) -> None:
    """Runs the simulator until it is cancelled."""
    from dobot_async.simulator import Faults, announced
    from dobot_async.simulator import simulate as simulated

    if listen == "memory":
        raise click.UsageError("memory is of no use to other programs; use pty, tcp://127.0.0.1:0 or udp://127.0.0.1:0")

    async with AsyncExitStack() as stack:
        simulation = await stack.enter_async_context(simulated(arm, listen=listen, faults=Faults(**line), **details))
        if announce:
            await stack.enter_async_context(announced(simulation.url, *announce))

        needs = simulation.environment
        url = connectable(simulation.url)
        lines = [url, *(f"{name}={value}" for name, value in needs.items())]
        session.output.answer({"url": url} | ({"environment": needs} if needs else {}), "\n".join(lines))
        await asyncio.Event().wait()
