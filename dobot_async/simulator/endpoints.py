"""Where a simulated arm can be reached: in memory, on a pseudo-terminal, over TCP and UDP; all with the same faults.

    client --bytes--> Channel --> Session.receive --> Channel --bytes--> client

Each client has its own session, so that one's half frame never touches another's. There are no tasks: the event loop
calls, and the arm answers.
"""

from __future__ import annotations

import asyncio
import itertools
import math
import os
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from functools import partial
from random import Random
from typing import Any, cast
from urllib.parse import SplitResult, urlsplit
from weakref import WeakValueDictionary

import anyio

from dobot_async.errors import ConnectFailed
from dobot_async.simulator.faults import PROBABILITIES, TIMES, Channel, Faults
from dobot_async.simulator.magician import Session, SimulatedMagician
from dobot_async.transports.base import MANY, Transport, options

__all__ = ["MODELS", "Simulation", "open_url", "simulate"]

MODELS: dict[str, Callable[..., SimulatedMagician]] = {"magician": SimulatedMagician}
FAULT_OPTIONS = dict.fromkeys((*PROBABILITIES, *TIMES), float)
SILENCE = 1.0  # seconds after which a client that cannot be seen to leave counts as another one
BUFFER = 1 << 16
LEAST_DISORDER = 0.005

names = itertools.count(1)
running: WeakValueDictionary[str, Simulation] = WeakValueDictionary()
"""The simulations of this process, by the host of their `sim://` URLs."""


class Simulation:
    """A simulated arm that can be reached.

    Attributes:
        url: What to connect to.
        arm: The arm: its pose, executed commands, alarms, inputs and outputs, counters.
        faults: What the line does to messages; may be changed at any time.
    """

    def __init__(self, arm: SimulatedMagician, faults: Faults, seed: int | None) -> None:
        self.url = ""
        self.arm = arm
        self.faults = faults
        self._random = Random(seed)  # noqa: S311 - repeatable faults, no secrets
        self._clients: set[Client] = set()
        self._ended = False

    def client(self, deliver: Callable[[bytes], None], hang_up: Callable[[], None], *, ordered: bool) -> Client:
        """Called by an endpoint: somebody has connected, and takes replies by `deliver`."""
        client = Client(self.arm.session, self.faults, self._random, deliver, hang_up, ordered=ordered)
        self._clients.add(client)
        if self._ended:
            self.unplug()  # a connection that was being made when the simulation ended

        return client

    def leave(self, client: Client) -> None:
        """Called by an endpoint: a client has gone."""
        client.close()
        self._clients.discard(client)

    def unplug(self) -> None:
        """Breaks the line of every client, as pulling the cable does."""
        for client in list(self._clients):
            self.leave(client)
            client.hang_up()

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
    ) -> None:
        self.hang_up = hang_up
        self._new_session = session
        self._session = session()
        self._loop = asyncio.get_running_loop()
        self._heard = self._loop.time()
        self._back = Channel(faults, random, deliver, ordered=ordered)
        self._there = Channel(faults, random, self._answer, ordered=ordered)

    def send(self, data: bytes) -> None:
        """Puts a request on the line."""
        self._there.send(data)

    def close(self) -> None:
        """Forgets what is on the way."""
        self._there.close()
        self._back.close()

    def _answer(self, data: bytes) -> None:
        now = self._loop.time()
        if now - self._heard > SILENCE:
            self._session = self._new_session()

        self._heard = now
        replies = self._session.receive(data)
        if replies:
            self._back.send(replies)


@asynccontextmanager
async def simulate(
    model: str = "magician",
    *,
    listen: str = "memory",
    speed: float = 1.0,
    seed: int | None = None,
    faults: Faults | None = None,
    clock: Callable[[], float] | None = None,
    **details: Any,
) -> AsyncIterator[Simulation]:
    """Runs a simulated arm for the length of a block.

    Args:
        model: "magician".
        listen: "memory" (this process only), "pty", "tcp://127.0.0.1:0" or "udp://127.0.0.1:0" (0: any free port).
        speed: Simulated seconds per second.
        seed: Of the faults.
        faults: What the line does to messages.
        clock: Simulated seconds; by default the event loop's own time, times `speed`.
        details: What else the model takes: `options`, `quirks`.

    Raises:
        ValueError: No such model, or no such place to listen at.
    """
    if model not in MODELS:
        raise ValueError(f"no simulator for {model!r}; there are: {', '.join(MODELS)}")

    if not 0 < speed < math.inf:
        raise ValueError(f"speed must be above 0 and finite, not {speed!r}")

    serve = endpoint(listen)
    loop = asyncio.get_running_loop()
    started = loop.time()
    arm = MODELS[model](clock or (lambda: (loop.time() - started) * speed), **details)
    simulation = Simulation(arm, faults or Faults(), seed)
    async with AsyncExitStack() as stack:
        simulation.url = await serve(simulation, stack)
        stack.callback(simulation.end)
        yield simulation


def endpoint(listen: str) -> Callable[[Simulation, AsyncExitStack], Awaitable[str]]:
    """What serves a place to listen at."""
    local = {"memory": in_memory, "pty": on_pty}
    if listen in local:
        return local[listen]

    with suppress(ValueError):
        place = urlsplit(listen)
        serve = {"tcp": on_tcp, "udp": on_udp}.get(place.scheme)
        if serve and place.hostname and place.geturl() == f"{place.scheme}://{place.netloc}":
            return partial(serve, host=place.hostname, port=place.port or 0)

    raise ValueError(f"cannot listen at {listen!r}; use memory, pty, tcp://127.0.0.1:0 or udp://127.0.0.1:0")


async def in_memory(simulation: Simulation, stack: AsyncExitStack) -> str:
    """Clients in the same process; they open `sim://` and the simulation's name."""
    name = f"arm{next(names)}"
    running[name] = simulation
    stack.callback(running.pop, name, None)
    return f"sim://{name}"


async def on_pty(simulation: Simulation, stack: AsyncExitStack) -> str:
    """A serial port whose other end is the arm."""
    port = PseudoTerminal(simulation)
    stack.callback(port.close)
    return f"serial://{port.path}"


async def on_tcp(simulation: Simulation, stack: AsyncExitStack, *, host: str, port: int) -> str:
    """A TCP port, as a serial server has it."""
    loop = asyncio.get_running_loop()
    server = await loop.create_server(lambda: Connection(simulation), host, port)
    stack.push_async_callback(server.wait_closed)
    stack.callback(server.close)
    return address("tcp", server.sockets[0].getsockname())


async def on_udp(simulation: Simulation, stack: AsyncExitStack, *, host: str, port: int) -> str:
    """A UDP port, as the arm's Wi-Fi has it."""
    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(lambda: Datagrams(simulation), local_addr=(host, port))
    stack.callback(transport.close)
    return address("udp", transport.get_extra_info("sockname"))


def address(scheme: str, name: tuple[Any, ...]) -> str:
    """The URL of a socket."""
    host, port = name[:2]
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}"


class MemoryTransport:
    """A client's end of a line in memory."""

    def __init__(self, simulation: Simulation, stack: AsyncExitStack | None = None) -> None:
        self._simulation = simulation
        self._stack = stack
        self.in_flight, self.window = (1, 1) if self.disorder else (MANY, 16)
        self._arriving, self._arrived = anyio.create_memory_object_stream[bytes](BUFFER)
        self._client = simulation.client(self._deliver, self._arriving.close, ordered=True)

    @property
    def disorder(self) -> float:
        """With jitter, overtaking or doubled messages it is a line for datagrams."""
        faults = self._simulation.faults
        disorder = faults.jitter + faults.reorder
        return max(disorder, LEAST_DISORDER) if disorder or faults.dup else 0.0

    async def send(self, data: bytes) -> None:
        """Puts a request on the line."""
        ends = self._arriving.statistics()
        if not ends.open_receive_streams:
            raise anyio.ClosedResourceError

        if not ends.open_send_streams:
            raise anyio.BrokenResourceError

        self._client.send(data)

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

    given = options(url, {"speed": float, "seed": int, **FAULT_OPTIONS})
    faults = Faults(**{name: given.pop(name) for name in FAULT_OPTIONS if name in given})
    async with AsyncExitStack() as stack:
        simulation = await stack.enter_async_context(simulate(arm, faults=faults, **given))
        return MemoryTransport(simulation, stack.pop_all())


class PseudoTerminal:
    """The arm's end of a pseudo-terminal. Its other end is kept open, so that clients may come and go."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._loop = asyncio.get_running_loop()
        self._master, self._slave = os.openpty()
        import tty  # noqa: PLC0415 - Windows has none, and needs none for the other endpoints

        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._unsent = bytearray()
        self._client = simulation.client(self._deliver, self.close, ordered=True)
        self._loop.add_reader(self._master, self._readable)

    def close(self) -> None:
        """Closes both ends; a client's port breaks."""
        if self._master >= 0:
            self._simulation.leave(self._client)
            self._loop.remove_reader(self._master)
            self._loop.remove_writer(self._master)
            os.close(self._master)
            os.close(self._slave)
            self._master = -1

    def _readable(self) -> None:
        self._client.send(os.read(self._master, BUFFER))

    def _deliver(self, data: bytes) -> None:
        """Writes what fits; a client that never reads loses the rest, as a UART's does."""
        if len(self._unsent) < BUFFER:
            self._unsent += data
            self._write()

    def _write(self) -> None:
        with suppress(BlockingIOError):
            del self._unsent[: os.write(self._master, self._unsent)]

        if self._unsent:
            self._loop.add_writer(self._master, self._write)
        else:
            self._loop.remove_writer(self._master)


class Connection(asyncio.Protocol):
    """One TCP client."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has connected."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._client = self._simulation.client(transport.write, transport.abort, ordered=True)

    def data_received(self, data: bytes) -> None:
        """It has sent something."""
        self._client.send(data)

    def pause_writing(self) -> None:
        """It does not read; what it asks meanwhile waits in the line."""
        self._transport.pause_reading()

    def resume_writing(self) -> None:
        """It reads again."""
        self._transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """It has gone."""
        self._simulation.leave(self._client)


class Datagrams(asyncio.DatagramProtocol):
    """All UDP clients, each known by its address."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._clients: dict[Any, Client] = {}

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The port is open."""
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        """Somebody has sent something."""
        if addr not in self._clients:
            self._clients[addr] = self._simulation.client(
                lambda reply: self._transport.sendto(reply, addr), lambda: self._forget(addr), ordered=False
            )
            if len(self._clients) > MANY:
                self._forget(next(iter(self._clients)))

        self._clients[addr].send(data)

    def _forget(self, addr: Any) -> None:
        """The next datagram from there comes from a new client."""
        self._simulation.leave(self._clients.pop(addr))
