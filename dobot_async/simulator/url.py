"""`sim:` with a simulation of its own, or `sim://NAME` of one that runs in this process."""

from __future__ import annotations

import inspect
from contextlib import AsyncExitStack
from urllib.parse import SplitResult

from dobot_async._core.protocol.transport import Transport
from dobot_async.errors import ConnectFailed
from dobot_async.simulator.endpoints import MODELS, simulate
from dobot_async.simulator.faults import MEANS, PROBABILITIES, TIMES, Faults
from dobot_async.simulator.memory import MemoryTransport, running
from dobot_async.transports.options import Option, options

__all__ = ["open_url"]

FAULT_OPTIONS = dict.fromkeys((*PROBABILITIES, *TIMES, *MEANS), float)
HOMING = {"homed": Option(lambda text: bool(("false", "true").index(text)), "true or false")}


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
