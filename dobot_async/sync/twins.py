"""Which blocking class stands for which asynchronous one, where that is known only when a program runs."""

from __future__ import annotations

from typing import Any

from dobot_async import Magician as AsyncMagician
from dobot_async import MyCobot as AsyncMyCobot
from dobot_async import UltraArm as AsyncUltraArm
from dobot_async.arms.magician.queue import Batch as AsyncBatch
from dobot_async.arms.mycobot.queue import CobotBatch as AsyncCobotBatch
from dobot_async.arms.ultraarm.queue import UltraArmBatch as AsyncUltraArmBatch
from dobot_async.sync.magician import Batch, Magician
from dobot_async.sync.mycobot import CobotBatch, MyCobot
from dobot_async.sync.ultraarm import UltraArm, UltraArmBatch

__all__ = ["AnyArm", "asynchronous_of", "blocking_of", "twin_of"]

AnyArm = Magician | MyCobot | UltraArm
"""A blocking arm of any family."""

TWINS: dict[type[Any], type[Any]] = {
    AsyncMagician: Magician,
    AsyncMyCobot: MyCobot,
    AsyncUltraArm: UltraArm,
    AsyncBatch: Batch,
    AsyncCobotBatch: CobotBatch,
    AsyncUltraArmBatch: UltraArmBatch,
}


def twin_of(value: Any) -> Any:
    """Return the twin of an object, or itself if it has none."""
    twin = next((twin for kind, twin in TWINS.items() if isinstance(value, kind)), None)
    return twin(value) if twin else value


def asynchronous_of(kind: type[Any]) -> type[Any]:
    """Return the asynchronous class of a blocking one.

    Raises:
        TypeError: It is none.
    """
    for asynchronous, twin in TWINS.items():
        if kind is twin:
            return asynchronous

    raise TypeError(f"expected a class of dobot_async.sync, such as Magician, not {kind!r}")


def blocking_of(kind: type[Any]) -> type[Any]:
    """Return the blocking class of an asynchronous arm, whatever a fleet has made of it."""
    return next(twin for asynchronous, twin in TWINS.items() if issubclass(kind, asynchronous))
