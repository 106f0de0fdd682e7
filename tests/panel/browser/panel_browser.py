"""A real browser, once for all of these tests.

Where there is none they are skipped; with DOBOT_REQUIRE_BROWSER they fail.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
from panel_stage import Stage, stage
from playwright.async_api import Browser, async_playwright

CHROMIUM = os.environ.get("DOBOT_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
OPTIONS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--remote-debugging-port=0",
]
STARTS_WITHIN = 60.0


@pytest.fixture(scope="session")
def debugging_port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """A chromium that runs, and where it is told what to do."""
    if not CHROMIUM:
        if os.environ.get("DOBOT_REQUIRE_BROWSER"):
            pytest.fail("chromium is missing, and DOBOT_REQUIRE_BROWSER is set")

        pytest.skip("chromium is not installed")

    profile = tmp_path_factory.mktemp("chromium")
    options = [*OPTIONS, f"--user-data-dir={profile}"]
    process = subprocess.Popen([CHROMIUM, *options], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield port_of(process, profile / "DevToolsActivePort")
    finally:
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def port_of(process: subprocess.Popen[bytes], file: Path) -> int:
    """Wait until chromium says where it listens."""
    end = time.monotonic() + STARTS_WITHIN
    while time.monotonic() < end and process.poll() is None:
        if file.exists() and "\n" in file.read_text():
            return int(file.read_text().split()[0])

        time.sleep(0.05)

    pytest.fail(f"chromium did not start (exit code {process.poll()})")


@pytest.fixture
async def browser(debugging_port: int) -> AsyncIterator[Browser]:
    """The browser, for one test."""
    async with async_playwright() as playwright:
        connected = await playwright.chromium.connect_over_cdp(f"http://127.0.0.1:{debugging_port}")
        yield connected
        await connected.close()


@pytest.fixture
async def magician(browser: Browser) -> AsyncIterator[Stage]:
    """A simulated Magician with a scene, its panel, and the browser."""
    async with stage(browser) as made:
        yield made
