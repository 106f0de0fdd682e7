"""Cell files: which arms there are, where they stand, and what they share. TOML.

[arms.left]
url = "serial:///dev/ttyUSB0"
family = "magician"                          # or "mycobot" (with model = "..."), "ultraarm"
base = { x = 0, y = 0, z = 0, yaw = 0 }      # mm and degrees, in the cell
group = "loading"
guard = "wait"                               # or "raise", "off"
clearance = 20
limits = { x = [100, 300], z = [0, 200] }    # in the cell
rail = 90                                    # in which direction l grows, in degrees to the left of the arm's x axis
options = { check_reach = true }             # of `connect`

[zones.bin]
box = { x = [150, 250], y = [-50, 50], z = [0, 100] }

[zones.feeder]
cylinder = { x = 200, y = 200, radius = 60 }

[groups.loading]
on_failure = "group"                         # or "fleet", "alone"
"""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NoReturn, cast
from urllib.parse import urlsplit

from dobot_async._core.util.shapes import Box, Cylinder, Shape
from dobot_async._core.util.urls import hidden
from dobot_async.arms.registry import families
from dobot_async.arms.session import check_options
from dobot_async.fleet.families import FAMILIES, AnyArm
from dobot_async.fleet.fleet_arm import Member
from dobot_async.fleet.frames import BaseFrame
from dobot_async.fleet.tables import at, known, number, span, sub, tables, text
from dobot_async.program.text import read_text, shortened
from dobot_async.transports import SCHEMES

__all__ = ["Cell", "parse_cell", "read_cell"]

ARM_KEYS = ("url", "family", "model", "base", "group", "guard", "clearance", "limits", "rail", "options")


@dataclass(frozen=True, slots=True)
class Cell:
    """What a cell file says.

    Attributes:
        members: The arms.
        zones: The zones, by name.
        groups: Which arms stop when one of a group fails.
    """

    members: Mapping[str, Member[AnyArm]]
    zones: Mapping[str, Shape | None]
    groups: Mapping[str, Any]


def read_cell(path: Path) -> Cell:
    """Reads a cell file; raises ValueError, with the place in it, if it is wrong."""
    try:
        return parse_cell(read_text(path))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def parse_cell(text: str) -> Cell:
    """Returns what the text of a cell file says; raises ValueError, with the place in it, if it is wrong."""
    try:
        whole = tomllib.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None

    known(whole, ("arms", "zones", "groups"), "the file")
    arms, zones, groups = (tables(whole.get(name, {}), name) for name in ("arms", "zones", "groups"))
    if not arms:
        raise ValueError("there are no arms; begin with [arms.NAME] and its url")

    for name in arms:
        check_name(name)

    cell = Cell(
        {name: at(f"arms.{name}", member, table) for name, table in arms.items()},
        {name: at(f"zones.{name}", shape, table) for name, table in zones.items()},
        {name: at(f"groups.{name}", on_failure, table) for name, table in groups.items()},
    )
    for name, each in cell.members.items():
        if each.group is not None and each.group not in cell.groups:
            raise ValueError(f"arms.{name}.group: there is no [groups.{each.group}]")

    return cell


def member(table: Mapping[str, Any]) -> Member[AnyArm]:
    """An arm."""
    known(table, ARM_KEYS, "an arm")
    url, family = text(table, "url"), text(table, "family", "magician")
    if urlsplit(url).scheme not in SCHEMES:
        forms = "; ".join(form for _, form in SCHEMES.values())
        raise ValueError(f"url: {hidden(url)!r} has no scheme that leads to an arm; use one of: {forms}")

    kinds = {each.name: each.arm for each in FAMILIES}
    if family not in kinds:
        raise ValueError(f"family: one of {', '.join(kinds)}, not {family!r}")

    options = dict(sub(table, "options"))
    if "model" in table:
        options["model"] = text(table, "model")

    options = at("options", partial(connect_options, family, kinds[family]), options)

    limits = sub(table, "limits")
    return Member(
        url,
        cast("type[AnyArm]", kinds[family]),
        options=options,
        base=at("base", frame, sub(table, "base")),
        group=text(table, "group") if "group" in table else None,
        guard=cast(Any, text(table, "guard", "off")),
        clearance=number(table, "clearance", 0.0),
        limits=at("limits", box, limits) if limits else None,
        rail=number(table, "rail") if "rail" in table else None,
    )


def connect_options(family: str, kind: type[Any], table: Mapping[str, Any]) -> dict[str, Any]:
    """What `connect` of a family is given; raises ValueError for what it does not take."""
    parameters = inspect.signature(kind.connect).parameters
    defaults = {name: LIKE.get(name, each.default) for name, each in parameters.items() if name not in UNSUITABLE}
    known(table, [name for name in defaults if kinds_of(defaults[name])], f"connect of a {family}")
    found = {name: option(name, defaults[name], value) for name, value in table.items()}
    model, words = found.get("model"), (family, *dict(families())[family].models)
    if model is not None and model not in words:
        raise ValueError(f"model: one of {', '.join(words[1:])}, not {model!r}")

    given: dict[str, Any] = {**defaults, **found}
    check_options(given["queue"], given["on_error"], given["timeout"], given["reply_timeout"])
    return found


def option(name: str, default: object, value: Any) -> Any:
    """The value of an option, of the kind that its default is of; raises ValueError for others."""
    kinds, found = kinds_of(default), value
    if isinstance(value, bool):
        right = bool in kinds
    elif isinstance(value, list):
        right = tuple in kinds
        found = span({name: value}, name) if right else None
    elif isinstance(value, int | float):
        right = float in kinds
        number({name: value}, name)
    else:
        right = isinstance(value, kinds)

    return found if right else wrong_kind(name, cast(object, value))


def kinds_of(default: object) -> tuple[type[Any], ...]:
    """What may be written in the place of a default; nothing if it is no kind that TOML has."""
    return next((kinds for kind, kinds in KINDS.items() if isinstance(default, kind)), ())


def wrong_kind(name: str, value: object) -> NoReturn:
    """Raises ValueError."""
    raise ValueError(f"{name}: {value!r} is not what it takes")


UNSUITABLE = {"url"}
LIKE: Mapping[str, object] = {"reply_timeout": (0.1, 0.5)}
"""A value for options that have none of their kind as their default, since it depends on the URL."""

KINDS: Mapping[type[Any], tuple[type[Any], ...]] = {
    bool: (bool,),
    tuple: (float, tuple),
    int: (float,),
    float: (float,),
    str: (str,),
    type(None): (bool, float, str),
}
"""What an option may be, by the type of its default."""


def check_name(name: str) -> None:
    """Raises ValueError for a name that a line of a program could not have before its colon."""
    if not name.isprintable() or len(name) > LONGEST or name.strip() != name or not name or set(name) & set(":,#*"):
        raise ValueError(f"arms.{shortened(name)!r}: a name has 1 to {LONGEST} characters, and none of : , # *")


LONGEST = 64


def frame(table: Mapping[str, Any]) -> BaseFrame:
    """Where an arm stands."""
    names = ("x", "y", "z", "yaw")
    known(table, names, "a base")
    return BaseFrame(*(number(table, name, 0.0) for name in names))


def shape(table: Mapping[str, Any]) -> Shape | None:
    """A zone: a box, a cylinder, or nowhere in particular."""
    known(table, tuple(SHAPES), "a zone")
    if len(table) > 1:
        raise ValueError("either a box or a cylinder")

    for name in table:
        return cast(Shape, at(name, SHAPES[name], sub(table, name)))

    return None


def box(table: Mapping[str, Any]) -> Box:
    """A box; an axis that is not given is endless."""
    known(table, ("x", "y", "z"), "a box")
    if not table:
        raise ValueError("a box has x, y or z, each [lowest, highest]")

    return Box(**{name: span(table, name) for name in table})


def cylinder(table: Mapping[str, Any]) -> Cylinder:
    """A cylinder; without z it is endless."""
    known(table, ("x", "y", "radius", "z"), "a cylinder")
    height = {"z": span(table, "z")} if "z" in table else {}
    return Cylinder(number(table, "x"), number(table, "y"), number(table, "radius"), **height)


SHAPES: Mapping[str, Callable[[Mapping[str, Any]], Shape]] = {"box": box, "cylinder": cylinder}


def on_failure(table: Mapping[str, Any]) -> str:
    """Who stops when an arm of a group fails."""
    known(table, ("on_failure",), "a group")
    found = text(table, "on_failure", "fleet")
    if found not in {"fleet", "group", "alone"}:
        raise ValueError(f'on_failure: "fleet", "group" or "alone", not {found!r}')

    return found
