"""Fixtures for the tests of applications: simulated arms to connect to, behind a good line or a bad one, in a scene.

    async def test_that_the_application_homes(simulated_arm):
        await application(simulated_arm.url)
        assert simulated_arm.arm.executed[-1].name == "SetHOMECmd"

`simulated_arm` and `faulty_arm` are a running `Simulation` each, `simulate_arm` makes further ones; they stand in what
`dobot_scene` returns, which a test suite has of its own. `@pytest.mark.dobot(...)` takes what `simulate()` takes and
what `Faults` has; of marks on a function, its class and its module the nearest says. pytest loads this module by
itself; the simulator is imported when a test asks for an arm. The fixtures need pytest-asyncio, in whichever mode.
"""

from __future__ import annotations

import zlib
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import AsyncExitStack
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
    from dobot_async.simulator.scene import Scene

__all__ = ["dobot_scene", "dobot_settings", "faulty_arm", "pytest_configure", "simulate_arm", "simulated_arm"]

SPEED = 50.0
MAGICIAN = "magician"
FAULTS = (
    *("loss", "corrupt", "dup", "split", "noise", "merge", "stall", "late", "silence"),
    *("latency", "jitter", "reorder", "stall_time", "late_time", "silence_time"),
)
SETTINGS = ("listen", "model", "line", "mount", "speed", "seed", "options", "quirks", "limits", "homed")
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
        check(map(repr, mark.args), mark.kwargs, "@pytest.mark.dobot")
        settings |= mark.kwargs

    request.node.add_report_section("setup", "dobot_async", f"simulated with {settings}")
    return settings


@pytest.fixture
def dobot_scene() -> Scene | None:
    """What the simulated arms of a test stand in: nothing, unless a test suite has a fixture of this name itself.

    @pytest.fixture
    def dobot_scene():
        return Scene(pieces=[Piece("red", (250, 0))])
    """
    return None


@fixture
async def simulated_arm(dobot_settings: dict[str, Any], dobot_scene: Scene | None) -> AsyncIterator[Simulation]:
    """A running simulation of a Magician; `.url` is what to connect to, `.arm` what the test can look into.

    It is in memory, fifty times as fast as a real arm, and its line is good, unless a mark says otherwise.
    """
    async with AsyncExitStack() as stack:
        yield await running(stack, dobot_settings, dobot_scene)


@fixture
async def faulty_arm(dobot_settings: dict[str, Any], dobot_scene: Scene | None) -> AsyncIterator[Simulation]:
    """The same behind a bad line, which loses, damages, doubles and delays messages.

    The same test meets the same chances in each run. A line, or faults, that a mark names take the place of these.
    """
    async with AsyncExitStack() as stack:
        yield await running(stack, {"line": "bad", **dobot_settings}, dobot_scene)


@fixture
async def simulate_arm(
    dobot_settings: dict[str, Any], dobot_scene: Scene | None
) -> AsyncIterator[Callable[..., Awaitable[Simulation]]]:
    """Makes further simulated arms, in the same scene.

    right = await simulate_arm("ultraarm", mount=Mount(x=500, yaw=180, name="right"))

    What is given goes before what the mark says.
    """
    async with AsyncExitStack() as stack:

        async def simulate_another(model: str | None = None, **settings: Any) -> Simulation:
            check((), settings, "simulate_arm")
            named = {} if model is None else {"model": model}
            return await running(stack, dobot_settings | named | settings, dobot_scene)

        yield simulate_another


def check(positional: Any, named: Mapping[str, Any], what: str) -> None:
    """Fails the test unless all settings are known."""
    wrong = [*positional, *sorted(named.keys() - {*SETTINGS, *FAULTS})]
    if wrong:
        pytest.fail(f"{what} takes no {', '.join(wrong)}; it is {MARK}", pytrace=False)


async def running(stack: AsyncExitStack, settings: Mapping[str, Any], scene: Scene | None) -> Simulation:
    """Runs a simulation until the stack is left."""
    from dobot_async.simulator import Faults, simulate
    from dobot_async.simulator.lines import LINES, ORDERED_LINES

    others = {name: value for name, value in settings.items() if name not in FAULTS}
    model, line = others.pop("model", MAGICIAN), others.pop("line", None)
    lines = LINES if model == MAGICIAN else ORDERED_LINES
    if line is not None and line not in lines:
        pytest.fail(f"there is no line {line!r}; there are: {', '.join(lines)}", pytrace=False)

    faults: dict[str, Any] = dict(lines[line]) if line else {}
    faults |= {name: settings[name] for name in FAULTS if name in settings}
    if scene is None and "mount" in others:
        pytest.fail("mount= is for an arm in a scene: have a fixture dobot_scene that returns one", pytrace=False)

    return await stack.enter_async_context(simulate(model, faults=Faults(**faults), scene=scene, **others))
