"""The command group: the global options, and what becomes of errors. A command is imported when it runs.

`failures` has the exit codes.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dobot_async.arms.registry import Parts
from dobot_async.cli.failures import FAILED, OUTPUT_CLOSED, Interrupted
from dobot_async.errors import DobotError

if TYPE_CHECKING:
    from dobot_async.cli.session import CommandSession

__all__ = ["COMMANDS", "cli"]

SILENT = logging.NullHandler()

COMMANDS = {
    "alarms": ("dobot_async.cli.commands.basics:alarms", "Tell the alarms, with cause and remedy."),
    "bridge": ("dobot_async.cli.commands.bridge:bridge", "Give an arm to programs on a network."),
    "cell": ("dobot_async.cli.commands.cell:cell", "Drive all arms of a cell, or watch them."),
    "decode": ("dobot_async.cli.commands.decode:decode", "Decode the bytes of frames, or lines of text."),
    "demo": ("dobot_async.cli.commands.demo:demo", "Let a simulated arm pick and place."),
    "discover": (
        "dobot_async.cli.commands.discover:discover_arms",
        "Search for arms on USB, in the Wi-Fi, over BLE and on Zenoh.",
    ),
    "draw": ("dobot_async.cli.commands.drawing:draw_file", "Draw a file with a pen: SVG, DXF, G-code, a picture."),
    "engrave": ("dobot_async.cli.commands.drawing:engrave_file", "Engrave a picture or a drawing with the laser."),
    "gcode": ("dobot_async.cli.commands.gcode:gcode", "Run a G-code file on an ultraarm."),
    "home": ("dobot_async.cli.commands.basics:home", "Drive home, which calibrates the arm."),
    "info": ("dobot_async.cli.commands.basics:info", "Tell who the arm is."),
    "jog": ("dobot_async.cli.commands.basics:jog", "Jog in a direction for a time."),
    "mcp": ("dobot_async.cli.commands.mcp:mcp", "Give an arm to language models, by MCP."),
    "monitor": ("dobot_async.cli.commands.monitor:monitor", "Watch pose, queue and alarms."),
    "move": ("dobot_async.cli.commands.basics:move", "Move the tool to a point."),
    "mqtt": ("dobot_async.cli.commands.mqtt:mqtt", "Tell a message broker of an arm, for Home Assistant."),
    "play": ("dobot_async.cli.commands.teach:play_recording", "Play what an arm was taught."),
    "pose": ("dobot_async.cli.commands.basics:pose", "Tell where tool and joints are, in mm and degrees."),
    "run": ("dobot_async.cli.commands.program:run_program", "Run a program file."),
    "serve": ("dobot_async.cli.commands.serve:serve_on_zenoh", "Put an arm on Zenoh, under a name."),
    "simulate": ("dobot_async.cli.commands.simulate:simulate", "Simulate an arm until Ctrl-C."),
    "stop": ("dobot_async.cli.commands.basics:stop", "Stop the arm now, and empty its queue."),
    "suction": ("dobot_async.cli.commands.basics:suction", "Switch the suction cup."),
    "write": ("dobot_async.cli.commands.drawing:write_line", "Write a text with a pen."),
    "teleop": ("dobot_async.cli.commands.teleop:teleop", "Lead the arm by keys, or by targets from a pipe."),
    "teach": ("dobot_async.cli.commands.teach:teach", "Teach the arm, and keep that in a file."),
    "trace": ("dobot_async.cli.commands.traces:trace", "Look at a trace: lines, figures, curves."),
    "wifi": ("dobot_async.cli.commands.wifi:set_up_wifi", "Bring an arm on USB into a Wi-Fi."),
    "panel": ("dobot_async.cli.commands.panel:panel", "Show arms in the browser, and move them there."),
}
"""Where each command is, and what the help says of it."""


class Group(click.Group):
    """A group whose commands are imported when they run, and end with exit codes, never with a traceback for an arm."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - the same for all
        """The names of the commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - the same for all
        """Imports a command."""
        if cmd_name not in COMMANDS:
            return None

        module, _, name = COMMANDS[cmd_name][0].partition(":")
        command: click.Command = getattr(import_module(module), name)
        accept_behind(command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - the same for all
        """Writes the list of the commands, and imports none of them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])

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
            let_go_of_output()
            ctx.exit(OUTPUT_CLOSED)
        except (DobotError, OSError) as error:
            ctx.obj.output.fail(error)
            if isinstance(error, OSError) and not isinstance(error, DobotError):
                let_go_of_output()

            ctx.exit(FAILED)


def let_go_of_output() -> None:
    """Throws away what is still buffered: it must not be written, and fail once more, when the interpreter ends."""
    if sys.stdout is not None:
        try:
            sys.stdout.flush()
        except (OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class ArmWord(click.ParamType[str]):
    """The word of a family, or of one of its models."""

    name = "arm"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Reads a word."""
        words = list(Parts[Any]("cli"))
        if str(value).lower() not in words:
            self.fail(f"{value!r} is none of {', '.join(words)}", param, ctx)

        return str(value).lower()


def global_options() -> list[click.Option]:
    """The options that stand before a command, or behind it."""
    return [
        click.Option(
            ["--url"],
            help="Where the arm is: serial:///dev/ttyUSB0, serial://COM3, udp://192.168.1.20, tcp://host:port, ble: or "
            "sim: (a simulated one). Default: DOBOT_URL.",
        ),
        click.Option(
            ["--token-file"],
            type=click.Path(exists=True, dir_okay=False, path_type=Path),
            metavar="FILE",
            help="A file with the token of the bridge at --url. Default: the variable DOBOT_TOKEN.",
        ),
        click.Option(
            ["--arm"],
            type=ArmWord(),
            metavar="ARM",
            help=f"Which arm it is: {', '.join(Parts[Any]('cli'))}.  [default: magician]",
        ),
        click.Option(["--json", "as_json"], is_flag=True, help="Answer in JSON alone on standard output."),
        click.Option(
            ["--trace"],
            type=click.Path(dir_okay=False, writable=True, allow_dash=True),
            metavar="FILE",
            help="Record what goes over the connection into FILE, one JSON object a line; - is standard error.",
        ),
    ]


def accept_behind(command: click.Command) -> None:
    """Lets a command, and those below it, take the global options too, unless it has one of that name itself."""
    own = {option for parameter in command.params for option in parameter.opts}
    for option in global_options():
        if not own & set(option.opts):
            option.hidden, option.expose_value, option.callback = True, False, note
            command.params.append(option)

    if isinstance(command, click.Group):
        for each in command.commands.values():
            accept_behind(each)


def note(ctx: click.Context, option: click.Parameter, value: Any) -> None:
    """Takes what was given behind the command."""
    if value and option.name:
        take(ctx.obj, option.name, value)


def take(session: CommandSession, name: str, value: Any) -> None:
    """Takes the value of a global option."""
    from dobot_async.cli.output import Output

    session.given.add({"as_json": "json"}.get(name, name))
    if name == "as_json":
        session.output = Output(as_json=True)
    else:
        setattr(session, name, value)


@click.group(
    cls=Group,
    params=[*global_options()],
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(package_name="dobot-async")
@click.pass_context
def cli(ctx: click.Context, /, **options: Any) -> None:
    """Drive a desktop robot arm, or watch it.

    The options may stand before the command, or behind it. Exit codes: 0 done, 1 the arm or the link failed, 2 wrong
    usage, and nothing was sent, 130 Ctrl-C. Ctrl-C stops the arm first.
    """
    from dobot_async.cli.output import Output
    from dobot_async.cli.session import CommandSession

    # What is of interest is told in one line at the end; without a handler Python writes warnings to standard error.
    logging.getLogger("dobot_async").addHandler(SILENT)
    ctx.obj = CommandSession(os.environ.get("DOBOT_URL") or None, "magician", None, Output(as_json=False))
    for name, value in options.items():
        if value:
            take(ctx.obj, name, value)
