"""Where a simulated arm can be reached: in memory, on a pseudo-terminal, over TCP and UDP, by BLE; `simulate`.

What a place needs is imported when an arm is served there: most arms are in memory.
"""

from __future__ import annotations

import asyncio
import math
import sys
from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager, suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, overload
from urllib.parse import urlsplit

from dobot_async.arms.registry import Parts
from dobot_async.simulator.faults import Faults
from dobot_async.simulator.memory import in_memory
from dobot_async.simulator.simulation import Simulation
from dobot_async.transports.options import options

if TYPE_CHECKING:
    from dobot_async.simulator.magician.arm import SimulatedMagician
    from dobot_async.simulator.mycobot.arm import SimulatedMyCobot
    from dobot_async.simulator.scene.scene import Scene
    from dobot_async.simulator.scene.things import Mount
    from dobot_async.simulator.ultraarm.arm import SimulatedUltraArm

__all__ = ["MODELS", "simulate"]

MyCobotModel = Literal[
    "mycobot", "myarm300", "mycobot280", "mycobot280pi", "mycobot320", "mecharm270", "mypalletizer260"
]

MODELS: Parts[Callable[..., Any]] = Parts("simulator")
"""The simulated arms by name: each is made with a clock, and has a `session()` for each client."""
BLE_OPTIONS: dict[str, type] = {"name": str, "address": str, "interval": float, "mtu": int, "packets": int}
PTY_OPTIONS = {"baud": int}


class ScaledClock:
    """The seconds of the event loop since this was made, times `speed`."""

    def __init__(self, speed: float) -> None:
        self.speed = speed
        self._now = asyncio.get_running_loop().time
        self._started = self._now()

    def __call__(self) -> float:
        return (self._now() - self._started) * self.speed


@overload
def simulate(
    model: Literal["magician"] = "magician",
    *,
    listen: str = ...,
    speed: float = ...,
    seed: int | None = ...,
    faults: Faults | None = ...,
    clock: Callable[[], float] | None = ...,
    scene: Scene | None = ...,
    mount: Mount | None = ...,
    **details: Any,
) -> AbstractAsyncContextManager[Simulation[SimulatedMagician]]: ...
@overload
def simulate(
    model: MyCobotModel,
    *,
    listen: str = ...,
    speed: float = ...,
    seed: int | None = ...,
    faults: Faults | None = ...,
    clock: Callable[[], float] | None = ...,
    scene: Scene | None = ...,
    mount: Mount | None = ...,
    **details: Any,
) -> AbstractAsyncContextManager[Simulation[SimulatedMyCobot]]: ...
@overload
def simulate(
    model: Literal["ultraarm"],
    *,
    listen: str = ...,
    speed: float = ...,
    seed: int | None = ...,
    faults: Faults | None = ...,
    clock: Callable[[], float] | None = ...,
    scene: Scene | None = ...,
    mount: Mount | None = ...,
    **details: Any,
) -> AbstractAsyncContextManager[Simulation[SimulatedUltraArm]]: ...
@overload
def simulate(
    model: str,
    *,
    listen: str = ...,
    speed: float = ...,
    seed: int | None = ...,
    faults: Faults | None = ...,
    clock: Callable[[], float] | None = ...,
    scene: Scene | None = ...,
    mount: Mount | None = ...,
    **details: Any,
) -> AbstractAsyncContextManager[Simulation[Any]]: ...


@asynccontextmanager
async def simulate(
    model: str = "magician",
    *,
    listen: str = "memory",
    speed: float = 1.0,
    seed: int | None = None,
    faults: Faults | None = None,
    clock: Callable[[], float] | None = None,
    scene: Scene | None = None,
    mount: Mount | None = None,
    **details: Any,
) -> AsyncGenerator[Simulation[Any]]:
    """Runs a simulated arm for the length of a block.

    Args:
        model: "magician", "myarm300", "mycobot280" or another of that family, "ultraarm".
        listen: "memory" (this process only), "pty" ("pty:?baud=115200" for a line as slow as the real one),
            "tcp://127.0.0.1:0" or "udp://127.0.0.1:0" (0: any free port), or "ble" (Linux;
            "ble:?interval=0.03&mtu=23&packets=4" says how good the connection is).
        speed: Simulated seconds per second.
        seed: Of the faults.
        faults: What the line does to messages.
        clock: Simulated seconds; by default the event loop's own time, times `speed`. One that does not run as fast as
            the loop's has an attribute `speed`, so that what the arm tells of its own clock is right.
        scene: What the arm works in, alone or with others: pieces, belts, sensors, what it can run into.
        mount: How it stands there, and its tool; by default at the origin, with a suction cup.
        details: What else the model takes: `options`, `quirks`; a Magician also `limits` and `homed`.

    Raises:
        ValueError: No such model, no such place to listen at, or the scene has no room for the arm.
        OSError: The place is taken, or dbus-daemon, which BLE needs, is not installed.
    """
    if model not in MODELS:
        raise ValueError(f"no simulator for {model!r}; there are: {', '.join(MODELS)}")

    if not 0 < speed < math.inf:
        raise ValueError(f"speed must be above 0 and finite, not {speed!r}")

    serve = endpoint(listen)
    clock = clock or ScaledClock(speed)
    if scene is not None:
        clock = scene.share_clock(clock, speed)
    elif mount is not None:
        raise ValueError("mount says how the arm stands in a scene: give scene= as well")

    arm = MODELS[model](clock, **details)
    simulation = Simulation(arm, faults or Faults(), seed, scene)
    async with AsyncExitStack() as stack:
        if scene is not None:
            stack.callback(scene.attach(model, arm, mount))

        simulation.url = await serve(simulation, stack)
        stack.callback(simulation.end)
        yield simulation


def endpoint(listen: str) -> Callable[[Simulation, AsyncExitStack], Awaitable[str]]:
    """What serves a place to listen at."""
    if listen == "memory":
        return in_memory

    name = listen.partition(":")[0]
    if name in LOCAL:
        serve_locally, known = LOCAL[name]
        place = urlsplit(listen)
        if place.geturl() in {name, f"{name}:?{place.query}"}:
            return partial(serve_locally, **options(place, known))

    with suppress(ValueError):
        place = urlsplit(listen)
        bare = place.geturl() == f"{place.scheme}://{place.netloc}"
        if bare and place.hostname and place.scheme in {"tcp", "udp"}:
            return partial(on_socket, scheme=place.scheme, address=place.hostname, port=place.port or 0)

    raise ValueError(f"cannot listen at {listen!r}; use memory, pty, tcp://127.0.0.1:0, udp://127.0.0.1:0 or ble")


async def on_socket(simulation: Simulation, stack: AsyncExitStack, *, scheme: str, address: str, port: int) -> str:
    """A socket of this computer."""
    from dobot_async.endpoints.listeners import on_tcp, on_udp  # noqa: PLC0415 - see the module

    serve = on_tcp if scheme == "tcp" else on_udp
    return await serve(simulation, stack, address=address, port=port)


async def on_ble(simulation: Simulation, stack: AsyncExitStack, **details: Any) -> str:
    """A BLE module without a radio: clients on this computer find it on a D-Bus of its own."""
    if sys.platform != "linux":
        raise ValueError("ble is simulated by a BlueZ of its own, which only Linux can have")

    try:
        from dobot_async.simulator.ble import testbed as ble_rig  # noqa: PLC0415 - other systems have no D-Bus
    except ImportError as error:
        message = f"{error.name} is not installed, and simulated BLE needs it: pip install 'dobot-async[ble-sim]'"
        raise ImportError(message, name=error.name) from error

    return await ble_rig.serve(simulation, stack, **details)


async def on_line(simulation: Simulation, stack: AsyncExitStack, *, baud: int | None = None) -> str:
    """A pseudo-terminal, as fast as the computer or as slow as a serial line."""
    from dobot_async.endpoints.line_rate import RateLimited  # noqa: PLC0415 - see the module
    from dobot_async.endpoints.pty import on_pty  # noqa: PLC0415

    if baud is None:
        return await on_pty(simulation, stack)

    if baud <= 0:
        raise ValueError(f"baud must be above 0, not {baud}")

    return await on_pty(RateLimited(simulation, baud), stack)


LOCAL: dict[str, tuple[Callable[..., Awaitable[str]], Mapping[str, Callable[[str], Any]]]] = {
    "pty": (on_line, PTY_OPTIONS),
    "ble": (on_ble, BLE_OPTIONS),
}
"""Places on this computer that have no address: what serves them, and their options."""
