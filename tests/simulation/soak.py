"""Runs many seeds, on all cores: `make soak SEEDS=100000`, or one with its trace: `soak.py --seed N --verbose`.

`--of cell` takes the scenario of a cell instead of that of one arm; `--of guards`, `--of lost` and `--of stops` those
of guarded arms whose tools are watched, of arms that lose their places, and of cells that are stopped. A seed that
fails is printed with the command that replays it. `--memory` works in one process for hours of simulated time, and
prints how much memory it takes.
"""

from __future__ import annotations

import argparse
import gc
import logging
import os
import sys
import time
import warnings
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from importlib import import_module
from itertools import count, islice
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol

CHUNK = 20
SHOWN = 10
PLAIN_INTERVAL = 10.0  # seconds between two lines where there is no terminal
SCENARIOS = {
    "arm": "scenario",
    "cell": "scenario_of_a_cell",
    "guards": "scenario_of_guards",
    "stops": "scenario_of_stops",
    "lost": "scenario_of_lost_places",
}
FOLDERS = [str(Path(__file__).parents[1] / name) for name in ("simulation", "fleet", "support", "")]
Result = tuple[int, str, dict[str, float]]


class Progress(Protocol):
    """Takes note of how many seeds are done, and how many of them failed."""

    def __call__(self, done: int, failed: int) -> None: ...


def say(text: str) -> None:
    """Prints a line at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def scenario(of: str) -> Any:
    """The module whose `run_seed` runs a seed."""
    sys.path += [folder for folder in FOLDERS if folder not in sys.path]
    return import_module(SCENARIOS[of])


def run(seed: int, of: str) -> Result:
    """Runs a seed; returns why it failed, or an empty text, and its figures."""
    warnings.simplefilter("ignore")
    logging.getLogger("dobot_async").setLevel(logging.CRITICAL + 1)
    try:
        return seed, "", asdict(scenario(of).run_seed(seed))
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001 - whatever it is, it is this seed's
        return seed, f"{type(error).__name__}: {error}", {}


def results(seeds: range, jobs: int, of: str) -> Iterator[Result]:
    """Runs seeds in several processes; yields their results in order."""
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), max_tasks_per_child=None) as pool:
        try:
            yield from pool.map(partial(run, of=of), seeds, chunksize=CHUNK)
        finally:
            pool.shutdown(cancel_futures=True)


def soak(seeds: range, jobs: int, most: int, of: str) -> int:
    """Runs seeds; returns the exit code."""
    started = time.monotonic()
    failed = done = 0
    total: dict[str, float] = {}
    with progress(len(seeds)) as advanced:
        for seed, failure, figures in results(seeds, jobs, of):
            done += 1
            for name, number in figures.items():
                total[name] = total.get(name, 0) + number

            if failure:
                failed += 1
                if failed <= SHOWN:
                    say(f"seed {seed}: {failure}\n    {replay(seed, of)}")

            advanced(done, failed)
            if failed >= most:
                break

    seconds = time.monotonic() - started
    say(
        f"{done} seeds, {failed} failed, {seconds:.0f} s, {done / seconds:.0f} seeds/s; "
        + ", ".join(f"{name} {number:.0f}" for name, number in total.items())
    )
    return 1 if failed else 0


def replay(seed: int, of: str) -> str:
    """The command that runs a seed again, with its trace."""
    return f"python {os.path.relpath(Path(__file__))} --of {of} --seed {seed} --verbose"


@contextmanager
def progress(seeds: int) -> Iterator[Progress]:
    """A bar on a terminal; elsewhere a line now and then."""
    started = time.monotonic()
    try:
        from rich.progress import Progress as Bar
    except ImportError:
        pass
    else:
        if sys.stdout.isatty():
            with Bar() as bar:
                task = bar.add_task("seeds", total=seeds)

                def advanced(done: int, failed: int) -> None:
                    rate = done / (time.monotonic() - started)
                    bar.update(task, completed=done, description=f"{failed} failed, {rate:.0f} seeds/s")

                yield advanced
            return

    said = started

    def advanced_plainly(done: int, failed: int) -> None:
        nonlocal said
        now = time.monotonic()
        if now - said > PLAIN_INTERVAL:
            said = now
            say(f"{done} of {seeds} seeds, {failed} failed, {done / (now - started):.0f} seeds/s")

    yield advanced_plainly


def memory(hours: float, seeds: Iterable[int], of: str) -> int:
    """Works in one process for so many simulated hours; prints the memory that it takes, about 20 times."""
    simulated, printed = 0.0, 0.0
    step = hours * 3600 / 20
    for number, seed in enumerate(seeds, start=1):
        _, failure, figures = run(seed, of)
        if failure:
            say(f"seed {seed}: {failure}\n    {replay(seed, of)}")

        simulated += figures.get("seconds", 0.0)
        if simulated >= printed:
            gc.collect()
            say(f"{simulated / 3600:6.2f} h simulated, {number:6} seeds, {resident() / 1e6:7.1f} MB")
            printed += step

        if simulated >= hours * 3600:
            break

    return 0


def resident() -> int:
    """Bytes of this process in memory, where the system tells; else 0."""
    try:
        return int(Path("/proc/self/statm").read_text("ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return 0


def verbose(seed: int, of: str) -> int:
    """Runs one seed with its trace."""
    warnings.simplefilter("ignore")
    say(str(scenario(of).run_seed(seed, say)))
    return 0


def main(arguments: Any = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description="Deterministic simulation tests, many seeds of them.")
    parser.add_argument("--of", choices=SCENARIOS, default="arm", help="which scenario")
    parser.add_argument("--seeds", type=int, default=10_000, help="how many")
    parser.add_argument("--first", type=int, default=0, help="the first one")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--most", type=int, default=100, help="failures after which it ends")
    parser.add_argument("--seed", type=int, help="run this one alone")
    parser.add_argument("--verbose", action="store_true", help="with --seed: print every frame")
    parser.add_argument("--memory", type=float, metavar="HOURS", help="one process, so many simulated hours")
    given = parser.parse_args(arguments)
    if given.seed is not None:
        if given.verbose:
            return verbose(given.seed, given.of)

        return soak(range(given.seed, given.seed + 1), 1, 1, given.of)

    if given.memory is not None:
        return memory(given.memory, islice(count(given.first), 10**9), given.of)

    return soak(range(given.first, given.first + given.seeds), given.jobs, given.most, given.of)


if __name__ == "__main__":
    sys.exit(main())
