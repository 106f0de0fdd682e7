"""Simulated arms, for programs without asyncio. They live in the arms' thread, and are looked at there."""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from copy import copy
from enum import Enum
from typing import TYPE_CHECKING, Any, Generic, Literal, cast, overload

from dobot_async.simulator import Faults, SimulatedMagician, SimulatedMyCobot, SimulatedUltraArm
from dobot_async.simulator import Simulation as AsyncSimulation
from dobot_async.simulator import simulate as simulate_asynchronously
from dobot_async.simulator.endpoints import MyCobotModel
from dobot_async.simulator.scene import Mount, Scene
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twin import BlockingContext, Twin

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    A = TypeVar("A", default=Any)
else:
    from typing import TypeVar

    A = TypeVar("A")

__all__ = ["Simulation", "simulate"]

T = TypeVar("T")


class Simulation(Twin[AsyncSimulation[A]], Generic[A]):
    """A simulated arm that can be reached; A is its class, such as SimulatedMagician.

    What is read of `arm` and `scene` is read in the arms' thread; lists are copies of what was there then.
    """

    __slots__ = ()

    @property
    def url(self) -> str:
        """What to connect to; "sim:" URLs in programs of this package, others from anywhere."""
        return self.asynchronous.url

    @property
    def environment(self) -> dict[str, str]:
        """What other programs need in their environment to reach it."""
        return self.asynchronous.environment

    @property
    def outages(self) -> list[tuple[float, float]]:
        """When a stall or a silence that was drawn began on a line, and when it ends, in the loop's seconds."""
        return list(self.asynchronous.outages)

    @property
    def arm(self) -> A:
        """The arm: its pose, executed commands, alarms, inputs and outputs, counters."""
        return inside(self.asynchronous.arm)

    @property
    def faults(self) -> Faults:
        """What the line does to messages; may be changed at any time."""
        return inside(self.asynchronous.faults)

    @property
    def scene(self) -> Scene:
        """What the arm stands in; raises RuntimeError if it was simulated without one."""
        return inside(self.asynchronous.scene)

    def unplug(self) -> None:
        """Breaks the line of every client, as pulling the cable does; what is on the way is lost."""
        PORTAL.look(self.asynchronous.unplug)

    def vanish(self) -> None:
        """The arm neither reads nor answers any more what its clients of now send; their connections stay open.

        As when its computer loses power or its network: nothing tells the clients. New ones can connect.
        """
        PORTAL.look(self.asynchronous.vanish)

    def end(self) -> None:
        """Breaks all lines, for good."""
        PORTAL.look(self.asynchronous.end)


class Inside:
    """An object of the arms' thread: what is read of it, set or called, is so there."""

    __slots__ = ("_object",)

    _object: object

    def __init__(self, value: object) -> None:
        object.__setattr__(self, "_object", value)

    def __getattr__(self, name: str) -> Any:
        return PORTAL.look(lambda: seen(getattr(self._object, name)))

    def __setattr__(self, name: str, value: object) -> None:
        PORTAL.look(lambda: setattr(self._object, name, value))

    def __dir__(self) -> list[str]:
        return dir(self._object)

    def __eq__(self, other: object) -> bool:
        return bool(self._object == (other._object if isinstance(other, Inside) else other))

    def __hash__(self) -> int:
        return hash(self._object)

    def __repr__(self) -> str:
        return PORTAL.look(lambda: repr(self._object))


def inside(value: T) -> T:
    """Return an object of the arms' thread, as it is to be used elsewhere."""
    return cast(T, Inside(value))


def seen(value: Any) -> Any:
    """Return what was read of an object, so that it can be used in another thread: lists and the like as copies."""
    kind: Any = cast(Any, type(value))
    if issubclass(kind, (list, set, deque)):
        return copy(value)

    if issubclass(kind, Mapping):
        return {key: seen(value[key]) for key in value}

    if callable(value) and not isinstance(value, type):
        return called_there(value)

    params: Any = getattr(kind, "__dataclass_params__", None)
    is_value = issubclass(kind, (Enum, tuple)) or (params and params.frozen)
    return Inside(value) if kind.__module__.startswith("dobot_async") and not is_value else value


def called_there(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that calls another one in the arms' thread."""

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        return PORTAL.look(lambda: seen(function(*args, **kwargs)))

    return call


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
) -> AbstractContextManager[Simulation[SimulatedMagician]]: ...
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
) -> AbstractContextManager[Simulation[SimulatedMyCobot]]: ...
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
) -> AbstractContextManager[Simulation[SimulatedUltraArm]]: ...
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
) -> AbstractContextManager[Simulation[Any]]: ...


def simulate(
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
) -> AbstractContextManager[Simulation[Any]]:
    """Runs a simulated arm for the length of a block.

    Args:
        model: "magician", "myarm300", "mycobot280" or another of that family, "ultraarm".
        listen: "memory" (this process only), "pty" ("pty:?baud=115200" for a line as slow as the real one),
            "tcp://127.0.0.1:0" or "udp://127.0.0.1:0" (0: any free port), or "ble" (Linux).
        speed: Simulated seconds per second.
        seed: Of the faults.
        faults: What the line does to messages.
        clock: Simulated seconds; by default the event loop's own time, times `speed`.
        scene: What the arm works in, alone or with others; while arms are in it, look at it by `sim.scene`.
        mount: How it stands there, and its tool; by default at the origin, with a suction cup.
        details: What else the model takes: `options`, `quirks`; a Magician also `limits` and `homed`.

    Raises:
        ValueError: No such model, no such place to listen at, or the scene has no room for the arm.
        OSError: The place is taken, or dbus-daemon, which BLE needs, is not installed.
    """
    given: dict[str, Any] = {"listen": listen, "speed": speed, "seed": seed, "faults": faults, "clock": clock}
    given |= {"scene": scene, "mount": mount, **details}
    return BlockingContext(lambda: simulate_asynchronously(model, **given), Simulation[Any], f"simulate({model!r})")
