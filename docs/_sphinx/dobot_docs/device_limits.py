"""The directive `device-limits`: the ranges that the driver checks for an arm, from its own table.

    ```{device-limits} mycobot280
    ```

Units are those of the arm: degrees, and mm for x, y and z.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from dobot_async import JointLimits, UltraArmLimits
from dobot_async.arms.mycobot.models import AXES, MODELS
from dobot_async.ultraarm import commands as ultraarm

__all__ = ["LIMITS", "register"]

Range = tuple[float, float]
Named = Iterable[tuple[str, Range]]


def of_fields(limits: JointLimits | UltraArmLimits) -> Named:
    """The ranges of a class with one field for each."""
    return [(each.name, getattr(limits, each.name)) for each in fields(limits)]


def of_model(name: str) -> Callable[[], Named]:
    """The ranges of a model of the myCobot family."""
    model = MODELS[name]
    joints = [(f"j{number}", each) for number, each in enumerate(model.joint_limits, 1)]
    return lambda: [*joints, *zip(AXES, model.reach, strict=False)]


LIMITS: Mapping[str, Callable[[], Named]] = {
    "magician": lambda: of_fields(JointLimits()),
    "ultraarm": lambda: of_fields(ultraarm.MANUAL_LIMITS),
    **{name: of_model(name) for name in MODELS},
}
"""How to find the ranges of each arm."""


class DeviceLimits(SphinxDirective):
    """See the module."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Make a list of ranges."""
        name: str = self.arguments[0]
        if name not in LIMITS:
            raise self.error(f"no arm {name!r}; there are: {', '.join(LIMITS)}")

        columns = [nodes.colspec(colwidth=width) for width in (40, 30, 30)]
        head = nodes.thead("", line(["Joint or axis", "Lowest", "Highest"]))
        body = nodes.tbody("", *[line([word, *map(text, ends)]) for word, ends in LIMITS[name]()])
        return [nodes.table("", nodes.tgroup("", *columns, head, body, cols=3))]


def text(number: float) -> str:
    """A number, as short as it can be written."""
    return f"{number:g}"


def line(cells: Iterable[str]) -> nodes.row:
    """A row of a table."""
    return nodes.row("", *[nodes.entry("", nodes.paragraph(text=cell)) for cell in cells])


def register(app: Sphinx) -> None:
    """Make the directive known."""
    app.add_directive("device-limits", DeviceLimits)
