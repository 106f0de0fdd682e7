"""What an import, the command line and the first motion of a simulated arm take of a processor.

    python -m benchmarks.bench_startup [--rounds 20] [--json] [--quick]

Each is a process of its own, with its modules compiled before. `cpu_ms` is the processor's time, of the process itself
(`resource.getrusage`), the median of all rounds, and `spread` the least and the greatest; `over_ms` is what it takes
beside what stands before it on its line. The first motion counts from the call of `connect` until the arm has accepted
it, the imports of the simulator included, but not that of `Magician`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from benchmarks.report import Row, median, parsed, show

USAGE = (
    "import resource, sys\nu = resource.getrusage(resource.RUSAGE_SELF)\nsys.stderr.write(str(u.ru_utime + u.ru_stime))"
)
FIRST_MOTION = """
import asyncio, sys, time
from dobot_async import Magician

async def main():
    began = time.process_time()
    async with Magician.connect("sim:") as arm:
        await arm.queue.move_to(220, 0, 40)
        sys.stderr.write(str(time.process_time() - began))

asyncio.run(main())
"""
VERSION = f"""
import sys
from dobot_async.__main__ import main

sys.argv = ["dobot-async", "--version"]
try:
    main()
except SystemExit:
    pass
{USAGE}
"""
PROGRAMS = {
    "python": ("", USAGE),
    "import asyncio": ("python", f"import asyncio\n{USAGE}"),
    "import dobot_async": ("python", f"import dobot_async\n{USAGE}"),
    "from dobot_async import Magician": ("import asyncio", f"from dobot_async import Magician\n{USAGE}"),
    "dobot-async --version": ("", VERSION),
    "connect to sim:, first motion": ("", FIRST_MOTION),
}
"""Each with the one that is taken off to tell what it takes itself."""


def seconds_of(program: str, folder: Path) -> float:
    """How long a processor worked for a program, as it says itself."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment["PYTHONPYCACHEPREFIX"] = str(folder)
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=60)
    return float(done.stderr)


def measured(rounds: int) -> list[Row]:
    """The rows."""
    with tempfile.TemporaryDirectory() as name:
        take: Callable[[str], float] = lambda program: seconds_of(program, Path(name)) * 1000  # noqa: E731
        for _, program in PROGRAMS.values():
            take(program)  # compiles

        found: dict[str, list[float]] = {what: [] for what in PROGRAMS}
        for _ in range(rounds):
            for what, (_, program) in PROGRAMS.items():
                found[what].append(take(program))

    rows: list[Row] = []
    for what, (base, _) in PROGRAMS.items():
        middle = median(found[what], 1)
        rows.append(
            {
                "what": what,
                "cpu_ms": middle,
                "spread": f"{min(found[what]):.1f} to {max(found[what]):.1f}",
                "over_ms": round(middle - median(found[base], 1), 1) if base else None,
            }
        )

    return rows


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, rounds=20)
    show("startup", measured(options.rounds), as_json=options.json, rounds=options.rounds)


if __name__ == "__main__":
    main()
