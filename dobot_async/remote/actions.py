"""The actions that remote callers may request, as dataclasses with typed fields; and their JSON form.

    {"do": "move", "x": 220, "y": 0, "z": 40} --> Move(x=220.0, y=0.0, z=40.0) --check--> --run--> what is said of it

An action is checked twice: its fields when it is made, its reach, workspace and speed when the arm is known. Nothing is
sent by either.
"""

from __future__ import annotations

import math
import types
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol, Union, cast, get_args, get_origin, get_type_hints

if TYPE_CHECKING:
    from dobot_async.remote.site import RemoteArm

__all__ = ["ACTIONS", "Action", "Note", "Strict", "Way", "action", "parse_action"]

Note = Callable[[str], None]
"""Called with what is being done at the moment."""

Way = tuple[tuple[float, float, float], ...]
"""Places along the way of a tool, mm."""

LONGEST_TEXT = 200_000
"""Characters of a text that somebody gives."""


class Action(Protocol):
    """One action."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    @property
    def do(self) -> str:
        """Its name."""
        ...

    def check(self, on: RemoteArm) -> None:
        """Raise ValueError, with the reason, if this arm cannot do it, or may not."""
        ...

    def ways(self, on: RemoteArm, start: tuple[float, float, float]) -> list[Way]:
        """Return the ways on which the tool works, seen from where it begins; for a picture."""
        ...

    async def run(self, on: RemoteArm, note: Note) -> dict[str, Any]:
        """Do it, and return what is to be said of it when the arm has done it."""
        ...


class Strict:
    """For those who read actions with pydantic: there are no other fields."""

    __pydantic_config__: ClassVar[dict[str, object]] = {"extra": "forbid"}


ACTIONS: dict[str, type[Action]] = {}
"""All actions, by their names."""


def action(kind: Any) -> Any:
    """Add a class to the actions."""
    ACTIONS[kind.do] = kind
    return kind


def parse_action(given: Mapping[str, Any]) -> Action:
    """Return the action of a JSON object.

    Args:
        given: Its name as `do`, and its fields.

    Raises:
        ValueError: There is no such action, or it has no such field, or a field is missing or of another kind.
    """
    name = given.get("do")
    if not isinstance(name, str) or name not in ACTIONS:
        raise ValueError(f"do: one of {', '.join(ACTIONS)}, not {shown(name)}")

    kind = ACTIONS[name]
    known = {each.name: each for each in fields(cast(Any, kind))}
    for key in given:
        if key not in known:
            raise ValueError(f"{name} has no {shown(key)}; it takes: {', '.join(list(known)[1:]) or 'nothing'}")

    for key, each in known.items():
        if key not in given and each.default is MISSING and each.default_factory is MISSING:
            raise ValueError(f"{name} needs {key}")

    hints = hints_of(kind)
    values = {key: to_field(f"{name}: {key}", value, hints[key]) for key, value in given.items()}
    make: Callable[..., Action] = kind
    return make(**values)


@cache
def hints_of(kind: type) -> dict[str, Any]:
    """The types of its fields, without what is said of them for schemas."""
    return get_type_hints(kind)


def to_field(name: str, value: Any, hint: Any) -> Any:
    """A JSON value as a field's; raise ValueError for one of another kind."""
    if get_origin(hint) in {Union, types.UnionType}:
        if value is None and type(None) in get_args(hint):
            return None

        (hint,) = [each for each in get_args(hint) if each is not type(None)]

    if get_origin(hint) is Literal:
        if value in get_args(hint):
            return value

        raise ValueError(f"{name} is one of {', '.join(map(str, get_args(hint)))}, not {shown(value)}")

    if hint is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf

        if math.isfinite(number):
            return number

    if hint is bool and isinstance(value, bool):
        return value

    if hint is str and isinstance(value, str) and len(value) <= LONGEST_TEXT:
        return value

    kinds = {float: "a finite number", bool: "true or false", str: "a text"}
    raise ValueError(f"{name} must be {kinds[hint]}, not {shown(value)}")


def shown(value: object) -> str:
    """What somebody said, as it may be shown."""
    text = ascii(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
