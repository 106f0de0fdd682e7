"""The families of arms, one line each; and what the places that choose arms by name need of them.

    REGISTERED["ultraarm"] --> arms/ultraarm/family.py: FAMILY --> "dobot_async.arms.ultraarm.bridge_adapter:BRIDGED"

The last is imported when somebody asks for it: nobody pays for arms, or for places, that he does not use. A program may
add a line of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, Generic, TypeVar, cast

__all__ = ["REGISTERED", "Each", "Family", "Parts", "homes"]

T = TypeVar("T")

REGISTERED: dict[str, str] = {
    "magician": "dobot_async.arms.magician.family",
    "mycobot": "dobot_async.arms.mycobot.family",
    "ultraarm": "dobot_async.arms.ultraarm.family",
}
"""The module with the `FAMILY` of each."""


@dataclass(frozen=True, slots=True)
class Family:
    """Where to find what other places need of a family, as "package.module:name"; "" for what it does not have.

    What is found is the part itself, or a mapping with one for each of the family's words.

    Attributes:
        models: Its words beside its name: models that are chosen as an arm is.
        public: The names that it adds to the package, by the modules that they are in.
        simulator: Makes a simulated arm, from a clock.
        scene: A `dobot_async.simulator.scene.SceneArm`, from a simulated arm.
        bridge: A `dobot_async.arms.bridge_adapter.BridgeAdapter`.
        discovery: A `dobot_async.discovery.families.DiscoverableFamily`.
        cli: A `dobot_async.cli.family.FamilyCommands`.
        fleet: A `dobot_async.fleet.families.FleetFamily`.
        program: A `dobot_async.program.Vocabulary`.
        replay: A `dobot_async.traces.replay.Retime`, for an arm that tells of its own clock.
    """

    models: tuple[str, ...] = ()
    public: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    simulator: str = ""
    scene: str = ""
    bridge: str = ""
    discovery: str = ""
    cli: str = ""
    fleet: str = ""
    program: str = ""
    replay: str = ""


class Parts(Mapping[str, T], Generic[T]):
    """One part of all families that have it, by their words."""

    def __init__(self, part: str) -> None:
        self.part = part

    def __getitem__(self, word: str) -> T:
        for name, family in families():
            if word in {name, *family.models} and getattr(family, self.part):
                part: T = found(family, self.part, word)
                return part

        raise KeyError(word)

    def __iter__(self) -> Iterator[str]:
        for name, family in families():
            if getattr(family, self.part):
                yield from (name, *family.models)

    def __len__(self) -> int:
        return sum(1 for _ in self)


class Each(Generic[T]):
    """One part of all families that have it, in their order; may be gone through any number of times."""

    def __init__(self, part: str) -> None:
        self.part = part

    def __iter__(self) -> Iterator[T]:
        for name, family in families():
            if getattr(family, self.part):
                yield found(family, self.part, name)


def families() -> Iterator[tuple[str, Family]]:
    """All of them, by name."""
    for name, module in REGISTERED.items():
        yield name, import_module(module).FAMILY


def found(family: Family, part: str, word: str) -> Any:
    """A part of a family."""
    module, _, name = getattr(family, part).partition(":")
    value: Any = getattr(import_module(module), name)
    return cast("Mapping[str, Any]", value)[word] if isinstance(value, Mapping) else value


def homes() -> dict[str, str]:
    """The public names of all families, each with the module that it is in."""
    return {name: module for _, family in families() for module, names in family.public.items() for name in names}
