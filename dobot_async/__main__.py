"""`python -m dobot_async` and `dobot-async`: the command line, or one line that says how to install it."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from signal import SIGINT

__all__ = ["main"]

USAGE, INTERRUPTED = 2, 128 + SIGINT


def main() -> None:
    """Runs the command line and exits with its code; 2 if the extra `cli` is not installed."""
    if not (find_spec("click") and find_spec("rich")):
        sys.stderr.write("the command line needs click and rich: pip install dobot-async[cli]\n")
        sys.exit(USAGE)

    try:
        from dobot_async.cli.main import cli

        cli(prog_name="dobot-async")
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
