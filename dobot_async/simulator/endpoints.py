"""Where a simulated arm can be reached: in memory, on a pseudo-terminal, over TCP and UDP; all with the same faults.

    client --bytes--> Channel --> Session.receive --> Channel --bytes--> client

Each client has its own session, so that one's half frame never touches another's. There are no tasks: the event loop
calls, and the arm answers.
"""

from __future__ import annotations

import asyncio
import inspect
import itertools
import math
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager, suppress
from functools import partial
from random import Random
from typing import TYPE_CHECKING, Any, Generic, Literal, Protocol, overload
from urllib.parse import SplitResult, urlsplit
from weakref import WeakValueDictionary

import anyio

from dobot_async.errors import ConnectFailed
from dobot_async.families import Parts
from dobot_async.simulator.faults import MEANS, PROBABILITIES, TIMES, Channel, Faults, LineState
from dobot_async.simulator.scene import Mount, Scene
from dobot_async.transports.base import MANY, Option, Transport, options
from dobot_async.transports.baud import AtBaud
from dobot_async.transports.listen import on_tcp, on_udp
from dobot_async.transports.terminal import on_pty

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    from dobot_async.simulator.magician import SimulatedMagician
    from dobot_async.simulator.mycobot import SimulatedMyCobot
    from dobot_async.simulator.ultraarm import SimulatedUltraArm

    A = TypeVar("A", default=Any)
else:
    from typing import TypeVar

    A = TypeVar("A")

__all__ = ["MODELS", "Simulation", "open_url", "simulate"]

MyCobotModel = Literal[
    "mycobot", "myarm300", "mycobot280", "mycobot280pi", "mycobot320", "mecharm270", "mypalletizer260"
]

MODELS: Parts[Callable[..., Any]] = Parts("simulator")
"""The simulated arms by name: each is made with a clock, and has a `session()` for each client."""
BLE_OPTIONS = {"name": str, "address": str, "interval": float, "mtu": int, "packets": int}
PTY_OPTIONS = {"baud": int}
FAULT_OPTIONS = dict.fromkeys((*PROBABILITIES, *TIMES, *MEANS), float)
HOMING = {"homed": Option(lambda text: bool(("false", "true").index(text)), "true or false")}
SILENCE = 1.0  # seconds after which a client that cannot be seen to leave counts as another one
BUFFER = 1 << 16
LEAST_REORDER_WINDOW = 0.005

names = itertools.count(1)
running: WeakValueDictionary[str, Simulation[Any]] = WeakValueDictionary()
"""The simulations of this process, by the host of their `sim://` URLs."""


class Session(Protocol):
    """An arm's side of a connection."""

    def receive(self, data: bytes) -> bytes:
        """Takes bytes of requests, returns those of all replies to what is whole now."""


class Lapse:
    """The seconds of the event loop since this was made, times `speed`."""

    def __init__(self, speed: float) -> None:
        self.speed = speed
        self._now = asyncio.get_running_loop().time
        self._started = self._now()

    def __call__(self) -> float:
        return (self._now() - self._started) * self.speed


class Simulation(Generic[A]):
    """A simulated arm that can be reached; A is its class, such as SimulatedMagician.

    Attributes:
        url: What to connect to.
        arm: The arm: its pose, executed commands, alarms, inputs and outputs, counters.
        faults: What the line does to messages; may be changed at any time.
        environment: What other programs need in their environment to reach it.
        outages: When a stall or a silence that was drawn began on a line, and when it ends, in the loop's seconds.
    """

    def __init__(self, arm: A, faults: Faults, seed: int | None, scene: Scene | None = None) -> None:
        self.url = ""
        self.arm = arm
        self.faults = faults
        self.environment: dict[str, str] = {}
        self.outages: list[tuple[float, float]] = []
        self._scene = scene
        self._random = Random(seed)  # noqa: S311 - repeatable faults, no secrets
        self._clients: dict[Client, None] = {}
        self._departed: list[Client] = []
        self._ended = False

    @property
    def scene(self) -> Scene:
        """What the arm stands in; raises RuntimeError if it was simulated without one."""
        if self._scene is None:
            raise RuntimeError("this arm stands in no scene: simulate(..., scene=Scene(...)) gives it one")

        return self._scene

    def client(
        self,
        deliver: Callable[[bytes], None],
        hang_up: Callable[[], None],
        *,
        ordered: bool,
        hold: Callable[[bool], None] = lambda _: None,
        name: str = "",  # noqa: ARG002 - an arm tells of nobody
    ) -> Client:
        """Called by an endpoint: somebody has connected, and takes replies by `deliver`."""
        arm: Any = self.arm
        client = Client(
            arm.session,
            self.faults,
            self._random,
            deliver,
            hang_up,
            ordered=ordered,
            hold=hold,
            outages=self.outages,
        )
        self._clients[client] = None
        if self._ended:
            self.unplug()  # a connection that was being made when the simulation ended

        return client

    def leave(self, client: Client) -> None:
        """Called by an endpoint: a client has gone. What it has sent before still reaches the arm."""
        if client in self._clients:
            del self._clients[client]
            client.leave()
            self._departed = [each for each in (*self._departed, client) if each.sending]

    def unplug(self) -> None:
        """Breaks the line of every client, as pulling the cable does; what is on the way is lost."""
        clients, departed = list(self._clients), self._departed
        self._clients.clear()
        self._departed = []
        for client in (*clients, *departed):
            client.close()

        for client in clients:
            client.hang_up()

    def vanish(self) -> None:
        """The arm neither reads nor answers any more what its clients of now send; their connections stay open.

        As when its computer loses power or its network: nothing tells the clients. New ones can connect.
        """
        for client in self._clients:
            client.vanish()

    def end(self) -> None:
        """Breaks all lines, for good."""
        self._ended = True
        self.unplug()


class Client:
    """One client's line to the arm and back."""

    def __init__(
        self,
        session: Callable[[], Session],
        faults: Faults,
        random: Random,
        deliver: Callable[[bytes], None],
        hang_up: Callable[[], None],
        *,
        ordered: bool,
        hold: Callable[[bool], None],
        outages: list[tuple[float, float]],
    ) -> None:
        self.hang_up = hang_up
        self._hold = hold
        self._new_session = session
        self._session = session()
        self._loop = asyncio.get_running_loop()
        self._sent = self._loop.time()
        self._gone = self._deaf = False
        state = LineState(outages)
        self._back = Channel(faults, random, deliver, ordered=ordered, state=state, from_arm=True)
        self._there = Channel(faults, random, self._answer, ordered=ordered, state=state)

    @property
    def sending(self) -> bool:
        """Whether something is on the way to the arm."""
        return self._there.carries

    def send(self, data: bytes) -> None:
        """Puts a request on the line."""
        if self._deaf:
            return

        now = self._loop.time()
        if now - self._sent > SILENCE and not self.sending:
            self._session = self._new_session()

        self._sent = now
        self._there.send(data)

    def leave(self) -> None:
        """Nobody hears the arm any more; what is on the way to it goes on."""
        self._gone = True
        self._back.close()

    def close(self) -> None:
        """Forgets what is on the way, both ways."""
        self._gone = True
        self._there.close()
        self._back.close()

    def vanish(self) -> None:
        """The arm hears and says nothing any more; what is sent waits in the system's buffers, or is lost."""
        self._deaf = True
        self.close()
        self._hold(True)

    def _answer(self, data: bytes) -> None:
        replies = self._session.receive(data)
        if replies and not self._gone:
            self._back.send(replies)


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
) -> AsyncIterator[Simulation[Any]]:
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
    clock = clock or Lapse(speed)
    if scene is not None:
        clock = scene.share_clock(clock, speed)
    elif mount is not None:
        raise ValueError("mount says how the arm stands in a scene: give scene= as well")

    arm = MODELS[model](clock, **details)
    simulation = Simulation(arm, faults or Faults(), seed, scene)
    async with AsyncExitStack() as stack:
        if scene is not None:
            stack.callback(scene.attach(model, arm, mount or Mount()))

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
        sockets: dict[str, Callable[..., Awaitable[str]]] = {"tcp": on_tcp, "udp": on_udp}
        serve = sockets.get(place.scheme)
        if serve and place.hostname and place.geturl() == f"{place.scheme}://{place.netloc}":
            return partial(serve, address=place.hostname, port=place.port or 0)

    raise ValueError(f"cannot listen at {listen!r}; use memory, pty, tcp://127.0.0.1:0, udp://127.0.0.1:0 or ble")


async def on_ble(simulation: Simulation, stack: AsyncExitStack, **details: Any) -> str:
    """A BLE module without a radio: clients on this computer find it on a D-Bus of its own."""
    if sys.platform != "linux":
        raise ValueError("ble is simulated by a BlueZ of its own, which only Linux can have")

    try:
        from dobot_async.simulator import ble_rig  # noqa: PLC0415 - other systems have no D-Bus
    except ImportError as error:
        message = f"{error.name} is not installed, and simulated BLE needs it: pip install 'dobot-async[ble-sim]'"
        raise ImportError(message, name=error.name) from error

    return await ble_rig.serve(simulation, stack, **details)


async def on_line(simulation: Simulation, stack: AsyncExitStack, *, baud: int | None = None) -> str:
    """A pseudo-terminal, as fast as the computer or as slow as a serial line."""
    if baud is None:
        return await on_pty(simulation, stack)

    if baud <= 0:
        raise ValueError(f"baud must be above 0, not {baud}")

    return await on_pty(AtBaud(simulation, baud), stack)


LOCAL: dict[str, tuple[Callable[..., Awaitable[str]], Mapping[str, Callable[[str], Any]]]] = {
    "pty": (on_line, PTY_OPTIONS),
    "ble": (on_ble, BLE_OPTIONS),
}
"""Places on this computer that have no address: what serves them, and their options."""


async def in_memory(simulation: Simulation, stack: AsyncExitStack) -> str:
    """Clients in the same process; they open `sim://` and the simulation's name."""
    name = f"arm{next(names)}"
    running[name] = simulation
    stack.callback(running.pop, name, None)
    return f"sim://{name}"


class MemoryTransport:
    """A client's end of a line in memory."""

    def __init__(self, simulation: Simulation, stack: AsyncExitStack | None = None) -> None:
        self._simulation = simulation
        self._stack = stack
        self.in_flight, self.window = (1, 1) if self.reorder_window else (MANY, 16)
        self._arriving, self._arrived = anyio.create_memory_object_stream[bytes](BUFFER)
        self._client = simulation.client(self._deliver, self._arriving.close, ordered=not self.reorder_window)

    @property
    def reorder_window(self) -> float:
        """With jitter, overtaking or doubled messages it is a line for datagrams."""
        faults = self._simulation.faults
        reorder_window = faults.jitter + faults.reorder
        return max(reorder_window, LEAST_REORDER_WINDOW) if reorder_window or faults.dup else 0.0

    async def send(self, data: bytes) -> None:
        """Puts a request on the line."""
        ends = self._arriving.statistics()
        if not ends.open_receive_streams:
            raise anyio.ClosedResourceError

        if not ends.open_send_streams:
            raise anyio.BrokenResourceError

        self._client.send(data)

    def write(self, data: bytes) -> bool:
        """Puts a request on the line; False if it is gone."""
        ends = self._arriving.statistics()
        if ends.open_receive_streams and ends.open_send_streams:
            self._client.send(data)
            return True

        return False

    async def receive(self) -> bytes:
        """Returns the next message."""
        return await self._arrived.receive()

    async def aclose(self) -> None:
        """Hangs up, and ends a simulation that was made for this client alone."""
        self._simulation.leave(self._client)
        self._arriving.close()
        self._arrived.close()
        if self._stack:
            await self._stack.aclose()

    def _deliver(self, data: bytes) -> None:
        """Hands over what fits; a client that never reads loses the rest."""
        with suppress(anyio.WouldBlock):
            self._arriving.send_nowait(data)


async def open_url(url: SplitResult, *, arm: str) -> Transport:
    """Opens `sim:` with a simulation of its own, or `sim://name` of one that runs in this process."""
    if url.path or url.fragment:
        raise ValueError(f"{url.geturl()}: expected sim: with options only, such as sim:?speed=10")

    if url.netloc:
        simulation = running.get(url.netloc)
        if url.query:
            raise ValueError("a simulation that runs already takes no options")

        if simulation is None:
            raise ConnectFailed(f"{url.geturl()}: no such simulation runs in this process; sim: makes one")

        return MemoryTransport(simulation)

    homing = "homed" in inspect.signature(MODELS[arm]).parameters if arm in MODELS else False
    given = options(url, {"speed": float, "seed": int, **FAULT_OPTIONS, **(HOMING if homing else {})})
    if homing:
        given.setdefault("homed", True)  # for first steps; `simulate()` makes an arm as it is after power-up

    faults = Faults(**{name: given.pop(name) for name in FAULT_OPTIONS if name in given})
    async with AsyncExitStack() as stack:
        simulation = await stack.enter_async_context(simulate(arm, faults=faults, **given))
        return MemoryTransport(simulation, stack.pop_all())
