"""Every benchmark runs, briefly, and says something; speed is not asserted."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parent.parent / "benchmarks"
BRIEF = {"bench_parser.py": ["--frames", "500"]}


@pytest.mark.parametrize("name", sorted(path.name for path in BENCHMARKS.glob("bench_*.py")))
def test_runs_and_reports(name: str) -> None:
    command = [sys.executable, "-X", "dev", "-W", "error", str(BENCHMARKS / name), "--json", *BRIEF[name]]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert json.loads(done.stdout)["rows"]
