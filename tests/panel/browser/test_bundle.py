"""The vendored three.js is what tools/bundle_three.py makes, and its licence lies beside it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[3]
SCRIPT = ROOT / "tools/bundle_three.py"
VENDOR = ROOT / "dobot_async/panel/static/vendor"
OFFLINE = re.compile("ENOTFOUND|EAI_AGAIN|ECONNREFUSED|ETIMEDOUT|ECONNRESET|ENETUNREACH")


def test_it_is_what_the_script_makes() -> None:
    if not shutil.which("npm"):
        pytest.skip("npm is not installed")

    checked = subprocess.run([sys.executable, SCRIPT, "--check"], check=False, capture_output=True, text=True)
    if checked.returncode and OFFLINE.search(checked.stderr):
        pytest.skip("npm does not reach its registry")

    assert checked.returncode == 0, checked.stderr


def test_it_says_its_version_and_has_its_licence() -> None:
    versions = re.findall(r'^THREE = "([\d.]+)"$', SCRIPT.read_text(), re.MULTILINE)
    assert (VENDOR / "three.js").read_text().startswith(f"/* three.js {versions[0]},")
    assert "three.js authors" in (VENDOR / "three.LICENSE.txt").read_text()


def test_it_has_no_address_and_makes_no_code_of_text() -> None:
    text = (VENDOR / "three.js").read_text()
    assert set(re.findall(r"https?://[^\"'`\s)]+", text)) <= {"http://www.w3.org/1999/xhtml"}
    assert not re.search(r"\beval\(|new Function", text)
