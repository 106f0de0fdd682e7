"""`discover`: which arms there are, on USB, in the Wi-Fi, over BLE and on Zenoh; and the options of the search."""

from __future__ import annotations

from collections.abc import Sequence

import click

from dobot_async.cli.params import ABOVE_ZERO, AddressType
from dobot_async.cli.session import CommandSession, run
from dobot_async.discovery import SOURCES, DiscoveryProblem, DiscoverySource, Found, discover
from dobot_async.discovery.found import printable
from dobot_async.discovery.wifi import WiFiModules
from dobot_async.discovery.zenoh import ZenohArms

__all__ = ["broadcast_option", "discover_arms"]

HEADINGS = "URL", "ARM", "WHAT IT SAYS OF ITSELF"
UNNAMED = "-"


def broadcast_option(command: click.decorators.FC) -> click.decorators.FC:
    """Adds the option that says where to ask in the Wi-Fi."""
    return click.option(
        "--broadcast",
        type=AddressType(),
        multiple=True,
        metavar="ADDRESS[:PORT]",
        help="Where to ask for arms in the Wi-Fi, in place of the broadcast address of each network; "
        "may be given several times.",
    )(command)


@click.command("discover")
@click.option("--timeout", type=ABOVE_ZERO, default=3.0, show_default=True, help="Seconds to listen.")
@click.option("--probe", is_flag=True, help="Connect to each, with reads alone, and ask who it is.")
@click.option("--source", "names", type=click.Choice(list(SOURCES)), multiple=True, help="Search there only.")
@broadcast_option
@click.option("--zenoh", type=click.Path(), metavar="CONFIG", help="A configuration file of Zenoh's to search with.")
@click.option(
    "--connect", multiple=True, metavar="ENDPOINT", help="Where to connect to for arms on Zenoh: tcp/host:7447."
)
@click.pass_obj
def discover_arms(
    session: CommandSession,
    timeout: float,
    probe: bool,
    names: tuple[str, ...],
    broadcast: Sequence[tuple[str, int]],
    zenoh: str | None,
    connect: tuple[str, ...],
) -> None:
    """Search for arms on USB, in the Wi-Fi, over BLE and on Zenoh.

    A USB port is listed if its chip is one that arms have; --probe tells whether there is an arm. Where a search
    fails, a line on standard error says so, and the others go on.
    """
    session.refuse("a search finds arms of all kinds, wherever they are", "url", "arm", "trace")
    own: dict[str, DiscoverySource] = {}
    if broadcast:
        own[WiFiModules.name] = WiFiModules(broadcast)

    if zenoh or connect or ZenohArms.name in names:
        own[ZenohArms.name] = ZenohArms(zenoh, connect)

    sources = [own.get(name, name) for name in SOURCES if name in (names or SOURCES)]
    problems: list[DiscoveryProblem] = []

    def tell(problem: DiscoveryProblem) -> None:
        problems.append(problem)
        tell_problem(problem)

    async def search() -> list[Found]:
        return [each async for each in discover(timeout=timeout, sources=sources, probe=probe, on_problem=tell)]

    with session.output.working("searching"):
        found = run(search())

    told = [{"source": problem.source, "message": problem.message} for problem in problems]
    session.output.answer({"arms": found, "problems": told}, table(found))


def tell_problem(problem: DiscoveryProblem) -> None:
    """Prints a line on standard error."""
    click.echo(f"warning: the search by {problem.source} failed: {problem.message}", err=True)


def table(found: Sequence[Found]) -> str:
    """What was found, a line each, in columns."""
    if not found:
        return "nothing found"

    rows = [HEADINGS, *(cells(each) for each in found)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEADINGS) - 1)]
    return "\n".join("  ".join((*map(str.ljust, row, widths), row[-1])) for row in rows)


def cells(found: Found) -> tuple[str, str, str]:
    """The cells of a line."""
    words = [found.description]
    if found.info:
        version = found.info.version and f"firmware {found.info.version}"
        words = [found.info.name, found.info.serial_number, version, found.description]
    elif found.problem:
        words.append(f"no answer: {found.problem}")

    words.extend(f"also at {url}" for url in found.also)
    return found.url, " or ".join(found.families), printable(", ".join(filter(None, words))) or UNNAMED
