"""Fuzzes for a while: `python tests/fuzz/fuzz.py [--seconds 60] [TARGET ...]`, all targets unless some are named.

With atheris the coverage of dobot_async guides it; what it found interesting is kept in build/fuzz/TARGET for the next
run. Without it hypothesis makes the inputs, beginning with the corpus. An input that fails is kept in
tests/fuzz/corpus/TARGET as crash-*.bin, so that the test suite fails too until that is mended; exit code 1.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import subprocess
import sys
import time
import traceback
from pathlib import Path

HERE = Path(__file__).parent
CORPUS = HERE / "corpus"
BUILD = HERE.parents[1] / "build" / "fuzz"
NAMES = (
    "parser",
    "layouts",
    "session",
    "alarms",
    "program",
    "mycobot_parser",
    "mycobot_arm",
    "ultraarm_answers",
    "ultraarm_arm",
    "ultraarm_gcode",
)
LONGEST = 2048
ROUND = 500


def main() -> int:
    """Runs each target in a process of its own, for atheris never gives one back."""
    options = argparse.ArgumentParser(description="Fuzz dobot_async.")
    options.add_argument("targets", nargs="*", metavar="TARGET", help=f"one of {', '.join(NAMES)}")
    options.add_argument("--seconds", type=int, default=60, help="for each target")
    options.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    given = options.parse_args()
    if not set(given.targets) <= set(NAMES):
        options.error(f"there are the targets {', '.join(NAMES)}")

    guided = importlib.util.find_spec("atheris") is not None
    if given.here:
        run = with_atheris if guided else with_hypothesis
        return run(given.targets[0], given.seconds)

    if not guided:
        print("atheris is not installed (extra `fuzz`): random inputs, not guided by coverage", flush=True)

    failed = []
    for name in given.targets or NAMES:
        print(f"== {name}", flush=True)
        command = [sys.executable, __file__, "--here", "--seconds", str(given.seconds), name]
        if subprocess.run(command, check=False).returncode:
            failed.append(name)

    print(f"failed: {', '.join(failed)}" if failed else "nothing found")
    return bool(failed)


def with_atheris(name: str, seconds: int) -> int:
    """Ends the process itself."""
    import atheris

    with atheris.instrument_imports(include=["dobot_async"]):
        from fuzz_targets import TARGETS

    found = BUILD / name
    found.mkdir(parents=True, exist_ok=True)
    settings = {
        "max_total_time": seconds,
        "max_len": LONGEST,
        "timeout": 20,
        "verbosity": 1,
        "print_final_stats": 1,
        "artifact_prefix": f"{CORPUS / name}/",
    }
    arguments = [f"-{setting}={value}" for setting, value in settings.items()]
    atheris.Setup([sys.argv[0], *arguments, str(found), str(CORPUS / name)], TARGETS[name])
    atheris.Fuzz()
    return 0


def with_hypothesis(name: str, seconds: int) -> int:
    """Rounds of random inputs, with parts of the corpus among them, until the time is over."""
    from fuzz_targets import TARGETS
    from hypothesis import HealthCheck, given, settings
    from hypothesis import strategies as st

    def slices(data: bytes) -> st.SearchStrategy[bytes]:
        return st.slices(len(data)).map(data.__getitem__)

    seeds = [path.read_bytes() for path in sorted((CORPUS / name).iterdir())]
    parts = st.one_of(st.sampled_from(seeds), st.binary(max_size=64), st.sampled_from(seeds).flatmap(slices))
    inputs = st.lists(parts, max_size=6).map(b"".join)
    last, count = b"", 0

    @settings(max_examples=ROUND, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(inputs)
    def attempt(data: bytes) -> None:
        nonlocal last, count
        last, count = data, count + 1
        TARGETS[name](data)

    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            attempt()
        except Exception:  # noqa: BLE001 - whatever it is, it is the finding
            digest = hashlib.sha1(last, usedforsecurity=False).hexdigest()
            (CORPUS / name / f"crash-{digest}.bin").write_bytes(last)
            traceback.print_exc()
            return 1

    print(f"{count} inputs")
    return 0


if __name__ == "__main__":
    sys.exit(main())
