"""Fixtures for the tests of applications: a simulated Magician to connect to, behind a good line or a bad one.

    async def test_that_the_application_homes(simulated_arm):
        await application(simulated_arm.url)
        assert simulated_arm.arm.executed[-1].name == "SetHOMECmd"

Both fixtures are a running `Simulation`. `@pytest.mark.dobot(...)` takes what `simulate()` takes and what `Faults` has;
of marks on a function, its class and its module the nearest says. pytest loads this module by itself; the
simulator is imported when a test asks for an arm. The fixtures need pytest-asyncio, in whichever mode.
"""

from __future__ import annotations

import zlib
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

import pytest

try:
    import pytest_asyncio
except ImportError:
    fixture: Callable[..., Any] = pytest.fixture
else:
    fixture = pytest_asyncio.fixture

if TYPE_CHECKING:
    from dobot_async.simulator import Simulation

__all__ = ["dobot_settings", "faulty_arm", "pytest_configure", "simulated_arm"]

SPEED = 50.0
BAD_LINE: Mapping[str, float] = {"loss": 0.05, "corrupt": 0.05, "dup": 0.05, "latency": 0.001, "jitter": 0.005}
FAULTS = ("loss", "corrupt", "dup", "split", "noise", "latency", "jitter")
SETTINGS = ("listen", "speed", "seed", "options", "quirks", "limits")
MARK = f"dobot({', '.join(f'{name}=...' for name in (*SETTINGS, *FAULTS))}): what simulated arm the fixtures give"


def pytest_configure(config: pytest.Config) -> None:
    """Registers the mark."""
    config.addinivalue_line("markers", MARK)


@pytest.fixture
def dobot_settings(request: pytest.FixtureRequest) -> dict[str, Any]:
    """What the marks of a test say, and the seed: of the test's name, unless a mark gives one.

    Fails the test if a mark says what there is not, or if pytest-asyncio is missing.
    """
    if not request.config.pluginmanager.has_plugin("asyncio"):
        pytest.fail("the arms of dobot_async need pytest-asyncio: pip install pytest-asyncio", pytrace=False)

    settings: dict[str, Any] = {"speed": SPEED, "seed": zlib.crc32(request.node.nodeid.encode())}
    for mark in reversed(list(request.node.iter_markers("dobot"))):
        wrong = [repr(each) for each in mark.args] + sorted(mark.kwargs.keys() - {*SETTINGS, *FAULTS})
        if wrong:
            pytest.fail(f"@pytest.mark.dobot takes no {', '.join(wrong)}; it is {MARK}", pytrace=False)

        settings |= mark.kwargs

    request.node.add_report_section("setup", "dobot_async", f"simulated with {settings}")
    return settings


@fixture
async def simulated_arm(dobot_settings: dict[str, Any]) -> AsyncIterator[Simulation]:
    """A running simulation of a Magician; `.url` is what to connect to, `.arm` what the test can look into.

    It is in memory, fifty times as fast as a real arm, and its line is good, unless a mark says otherwise.
    """
    async with running(dobot_settings) as simulation:
        yield simulation


@fixture
async def faulty_arm(dobot_settings: dict[str, Any]) -> AsyncIterator[Simulation]:
    """The same behind a bad line, which loses, damages, doubles and delays messages.

    The same test meets the same chances in each run. Faults that a mark names take the place of these.
    """
    async with running({**BAD_LINE, **dobot_settings}) as simulation:
        yield simulation


@asynccontextmanager
async def running(settings: Mapping[str, Any]) -> AsyncIterator[Simulation]:
    """Runs a simulation for the length of a block."""
    from dobot_async.simulator import Faults, simulate

    faults = Faults(**{name: settings[name] for name in FAULTS if name in settings})
    others = {name: value for name, value in settings.items() if name not in FAULTS}
    async with simulate("magician", faults=faults, **others) as simulation:
        yield simulation
