"""The command group: the options that come before a command, and what becomes of errors.

Exit codes:

    0        done
    1        the arm or the link failed; one line on standard error says how
    2        wrong usage
    128 + n  signal n ended it: 130 Ctrl-C, 143 SIGTERM; 141 if nobody reads the output any more
"""

from __future__ import annotations

import logging
import os
import signal
import sys
from typing import Any

import click

from dobot_async.cli.bridge import bridge
from dobot_async.cli.cell import cell
from dobot_async.cli.commands import COMMANDS
from dobot_async.cli.credentials import token_file_option
from dobot_async.cli.decode import decode
from dobot_async.cli.demo import demo
from dobot_async.cli.discover import discover_arms
from dobot_async.cli.gcode import gcode
from dobot_async.cli.monitor import monitor
from dobot_async.cli.output import Output
from dobot_async.cli.program import run_program
from dobot_async.cli.serve import serve_on_zenoh
from dobot_async.cli.session import ARMS, Interrupted, Session
from dobot_async.cli.simulate import simulate
from dobot_async.cli.wifi import set_up_wifi
from dobot_async.errors import DobotError

__all__ = ["cli"]

FAILED = 1
SILENT = logging.NullHandler()
OUTPUT_CLOSED = 141  # what a shell reports of a program that SIGPIPE ended


class Group(click.Group):
    """A group whose commands end with the exit codes above, never with a traceback for what an arm does."""

    def invoke(self, ctx: click.Context) -> Any:
        """Runs a command."""
        try:
            return super().invoke(ctx)
        except Interrupted as interrupted:
            if ctx.obj.commanding:
                click.echo("; ".join(["interrupted; the arm was told to stop", *interrupted.problems]), err=True)

            ctx.exit(128 + interrupted.number)
        except (KeyboardInterrupt, click.Abort):
            ctx.exit(128 + signal.SIGINT)
        except BrokenPipeError:
            # What is still buffered must not be written when the interpreter ends.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            ctx.exit(OUTPUT_CLOSED)
        except (DobotError, OSError) as error:
            ctx.obj.output.fail(error)
            ctx.exit(FAILED)


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option(
    "--url",
    envvar="DOBOT_URL",
    help="Where the arm is: serial:///dev/ttyUSB0, serial://COM3, udp://192.168.1.20, tcp://host:port, ble: or sim: "
    "(a simulated one). Default: DOBOT_URL.",
)
@token_file_option
@click.option("--arm", type=click.Choice(list(ARMS)), default="magician", show_default=True, help="Which arm it is.")
@click.option("--json", "as_json", is_flag=True, help="Answer with one JSON object on standard output.")
@click.option(
    "--trace",
    type=click.Path(dir_okay=False, writable=True, allow_dash=True),
    metavar="FILE",
    help="Write every frame to and from the arm to FILE, decoded, one JSON object a line; - is standard error.",
)
@click.version_option(package_name="dobot-async")
@click.pass_context
def cli(ctx: click.Context, url: str | None, arm: str, as_json: bool, trace: str | None) -> None:
    """Drive a desktop robot arm, or watch it.

    Exit codes: 0 done, 1 the arm or the link failed, 2 wrong usage, 130 Ctrl-C. Ctrl-C stops the arm first.
    """
    # What is of interest is told in one line at the end; without a handler Python writes warnings to standard error.
    logging.getLogger("dobot_async").addHandler(SILENT)
    ctx.obj = Session(url, arm, trace, Output(as_json))


for command in (
    demo,
    *COMMANDS,
    run_program,
    gcode,
    monitor,
    cell,
    discover_arms,
    set_up_wifi,
    simulate,
    bridge,
    serve_on_zenoh,
    decode,
):
    cli.add_command(command)
