"""A simulated arm that clients reach by lines of their own; all lines have the same faults.

    client --bytes--> Channel --> Session.receive --> Channel --bytes--> client

Each client has its own session, so that one's half frame never touches another's. There are no tasks: the event loop
calls, and the arm answers.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from random import Random
from typing import TYPE_CHECKING, Any, Generic, Protocol

from dobot_async.simulator.faults import Faults, FaultyChannel, LineState

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    from dobot_async.simulator.scene.scene import Scene

    A = TypeVar("A", default=Any)
else:
    from typing import TypeVar

    A = TypeVar("A")

__all__ = ["ArmSession", "SimulatedClient", "Simulation"]

SILENCE = 1.0  # seconds after which a client that cannot be seen to leave counts as another one


class ArmSession(Protocol):
    """An arm's side of a connection."""

    def receive(self, data: bytes) -> bytes:
        """Takes bytes of requests, returns those of all replies to what is whole now."""
        ...


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
        self._clients: dict[SimulatedClient, None] = {}
        self._departed: list[SimulatedClient] = []
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
        disconnect: Callable[[], None],
        *,
        ordered: bool,
        pause_reading: Callable[[bool], None] = lambda _: None,
        name: str = "",  # noqa: ARG002 - an arm tells of nobody
    ) -> SimulatedClient:
        """Called by an endpoint: somebody has connected, and takes replies by `deliver`."""
        arm: Any = self.arm
        client = SimulatedClient(
            arm.session,
            self.faults,
            self._random,
            deliver,
            disconnect,
            ordered=ordered,
            pause_reading=pause_reading,
            outages=self.outages,
        )
        self._clients[client] = None
        if self._ended:
            self.unplug()  # a connection that was being made when the simulation ended

        return client

    def leave(self, client: SimulatedClient) -> None:
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
            client.disconnect()

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


class SimulatedClient:
    """One client's line to the arm and back."""

    def __init__(
        self,
        session: Callable[[], ArmSession],
        faults: Faults,
        random: Random,
        deliver: Callable[[bytes], None],
        disconnect: Callable[[], None],
        *,
        ordered: bool,
        pause_reading: Callable[[bool], None],
        outages: list[tuple[float, float]],
    ) -> None:
        self.disconnect = disconnect
        self._pause_reading = pause_reading
        self._new_session = session
        self._session = session()
        self._loop = asyncio.get_running_loop()
        self._sent = self._loop.time()
        self._gone = self._ignoring = False
        state = LineState(outages)
        self._back = FaultyChannel(faults, random, deliver, ordered=ordered, state=state, from_arm=True)
        self._there = FaultyChannel(faults, random, self._answer, ordered=ordered, state=state)

    @property
    def sending(self) -> bool:
        """Whether something is on the way to the arm."""
        return self._there.carries

    def send(self, data: bytes) -> None:
        """Puts a request on the line."""
        if self._ignoring:
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
        self._ignoring = True
        self.close()
        self._pause_reading(True)

    def _answer(self, data: bytes) -> None:
        replies = self._session.receive(data)
        if replies and not self._gone:
            self._back.send(replies)
