"""What has to be declared to an arm before it does something: its rail, and what each pin is for.

An arm acknowledges a motion along a rail that it does not know of, and an output at a pin that is not configured, and
does nothing. So it is asked once, and what it says is kept until it may have forgotten it.
"""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, cast

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.errors import UnsupportedError

__all__ = ["ANALOG", "INPUT", "OUTPUT", "PWM", "Declarations", "PinUse", "told_rail"]

Q = TypeVar("Q")
R = TypeVar("R")


class Ask(Protocol):
    """Reads something of the arm."""

    def __call__(self, command: Command[Q, R], value: Q | None = None) -> Awaitable[R]:
        """Return the answer."""
        ...


@dataclass(frozen=True, slots=True)
class PinUse:
    """A use of a pin: what it is called, and the functions that allow it."""

    name: str
    functions: tuple[c.IOFunction, ...]


OUTPUT = PinUse("an output", (c.IOFunction.DO,))
PWM = PinUse("a PWM output", (c.IOFunction.PWM,))
INPUT = PinUse("an input", (c.IOFunction.DI, c.IOFunction.DIPU, c.IOFunction.DIPD))
ANALOG = PinUse("an analog input", (c.IOFunction.ADC,))

RAIL_KEYS = {c.JOGKey.EP_DOWN, c.JOGKey.EN_DOWN}


class Declarations:
    """What an arm was told, as far as it is known.

    Args:
        ask: Reads something of the arm.
    """

    def __init__(self, ask: Ask) -> None:
        self._ask = ask
        self._known: dict[int | str, Any] = {}
        self._queued: dict[int | str, Any] = {}

    def forget(self, *, all_of_them: bool = True) -> None:
        """Ask again, after the queue was emptied, or the arm may have been switched off and on."""
        self._queued.clear()
        if all_of_them:
            self._known.clear()

    def told(self, value: Any, *, queued: bool = False) -> None:
        """The arm has taken a command."""
        for key, found in declared(value).items():
            if queued:
                self._queued[key] = found
                self._known.pop(key, None)
            else:
                self._known[key] = found

    async def check(self, values: Iterable[Any], *, queued: bool = False) -> None:
        """Return if commands, in their order, need nothing that was not declared.

        Args:
            values: Their parameters.
            queued: Whether they go through the queue, behind what was declared there.

        Raises:
            ValueError: One does; the message says what to call.
        """
        before = dict(self._queued) if queued else {}
        for value in values:
            before |= declared(value)
            if needs_rail(value) and not await self._find("rail", before, bool):
                raise ValueError(
                    "the arm was not told that it stands on a rail: await arm.set_rail() first, "
                    "with version=AccessoryVersion.V2 for a newer one"
                )

            for address, use in pins(value):
                await self.check_pin(address, use, before)

    async def check_pin(self, address: int, use: PinUse, before: Mapping[int | str, Any] | None = None) -> None:
        """Return if a pin is configured for a use; raise ValueError, with what to call, if it is not."""
        function = await self._find(address, before or {}, use.functions.__contains__)
        if function not in use.functions:
            raise ValueError(
                f"pin {address} is not configured as {use.name} (but as {c.IOFunction(function).name}): "
                f"await arm.configure_io({address}, IOFunction.{use.functions[0].name}) first"
            )

    async def _find(self, key: int | str, before: Mapping[int | str, Any], enough: Callable[[Any], bool]) -> Any:
        """What was declared; the arm is asked where that is not known, or not enough: another program may have told."""
        if key in before:
            return before[key]

        if key not in self._known or not enough(self._known[key]):
            if isinstance(key, int):
                self._known[key] = (await self._ask(c.GET_IO_MULTIPLEXING, key)).multiplex
            else:
                self._known[key] = await self._ask(c.GET_DEVICE_WITH_L)

        return self._known[key]


def told_rail(place: float) -> float:
    """Return a place on the rail, mm; raise UnsupportedError for what an arm without one tells."""
    if math.isnan(place):
        raise UnsupportedError("the arm has no rail, or was not told of it: await arm.set_rail() first")

    return place


def declared(value: Any) -> dict[int | str, Any]:
    """What a command declares: the function of a pin, by its address, or the rail."""
    match value:
        case c.IOMultiplexing(address, function):
            return {address: function}
        case c.DeviceWithL(is_with_l):
            return {"rail": bool(is_with_l)}
        case _:
            return {}


def needs_rail(value: Any) -> bool:
    """Whether a command moves the arm along a rail."""
    return isinstance(value, (c.PTPWithLCmd, c.PTPPOWithLCmd)) or (
        isinstance(value, c.JOGCmd) and value.cmd in RAIL_KEYS
    )


def pins(value: Any) -> list[tuple[int, PinUse]]:
    """The pins that a command uses."""
    find = PINS.get(cast("type[object]", type(value)))
    return find(value) if find else []


PINS: Mapping[type, Callable[[Any], list[tuple[int, PinUse]]]] = {
    c.IODO: lambda value: [(value.address, OUTPUT)],
    c.IOPWM: lambda value: [(value.address, PWM)],
    c.TRIGCmd: lambda value: [(value.address, INPUT if value.mode is c.TriggerMode.IO else ANALOG)],
    c.PTPPOCmd: lambda value: [(each.address, OUTPUT) for each in value.outputs],
    c.PTPPOWithLCmd: lambda value: [(each.address, OUTPUT) for each in value.outputs],
}
