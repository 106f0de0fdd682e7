"""What programs of the myCobot family are written in, model by model; all that the model's limits say is checked."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.models import AXES, DEFAULT, MODELS, CobotModel
from dobot_async.arms.mycobot.targets import WAIT
from dobot_async.arms.mycobot.verbs import Verbs
from dobot_async.program.vocabulary import NUMBER, ON_OFF, WHOLE, Verb, Vocabulary, choice, takes

__all__ = ["VOCABULARIES"]

Q = TypeVar("Q")
Result = tuple[Command[Any, Any], Any]
MODES = {"to": c.MoveMode.ANGULAR, "linear": c.MoveMode.LINEAR}
SPEED = {"speed": WHOLE}


class CheckedVerbs(Verbs[Result]):
    """The verbs of a model, each of which returns its command and value if the arm could take them."""

    def __init__(self, model: CobotModel) -> None:
        self._model = model
        self.place: tuple[float, ...] | None = None

    @property
    def model(self) -> CobotModel:
        """What the arm is."""
        return self._model

    def lose_place(self) -> None:
        """Where the tool is depends on a line that is wrong."""
        self.place = None

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Result:
        """Check a command; a line of a program has no timeout."""
        assert timeout is None
        row = command if command is WAIT else self._model.row(command)
        self._model.check(command, value)
        row.request.encode(value)
        if row.moves:
            self.place = value.coords[:3] if isinstance(value, c.ToMove) else None

        return command, value


def vocabulary(model: CobotModel) -> Vocabulary:
    """What programs of a model are written in."""
    axes, joints = AXES[: len(model.reach)], [f"j{number}" for number in range(1, model.joints + 1)]
    verbs = {
        "home": Verb(CheckedVerbs.home, (), 0, SPEED),
        "move": Verb(CheckedVerbs.move_to, takes(NUMBER, *axes), len(axes), {"mode": choice(MODES), **SPEED}),
        "joints": Verb(CheckedVerbs.move_joints, takes(NUMBER, *joints), len(joints), SPEED),
        "joint": Verb(CheckedVerbs.move_joint, (("joint", WHOLE), ("angle", NUMBER)), 2, SPEED),
        "wait": Verb(CheckedVerbs.wait, takes(NUMBER, "seconds"), 1),
        "gripper": Verb(CheckedVerbs.gripper, takes(ON_OFF, "closed"), 1, SPEED),
        "gripper-to": Verb(CheckedVerbs.gripper_to, takes(WHOLE, "percent"), 1, SPEED),
        "color": Verb(CheckedVerbs.color, takes(WHOLE, "red", "green", "blue"), 3),
        "output": Verb(CheckedVerbs.set_pin, (("pin", WHOLE), ("level", ON_OFF)), 2, {"base": ON_OFF}),
    }
    return Vocabulary(model.title, verbs, lambda _options: CheckedVerbs(model))


VOCABULARIES: Mapping[str, Vocabulary] = MappingProxyType(
    {
        "mycobot": vocabulary(MODELS[DEFAULT]),
        **{name: vocabulary(model) for name, model in MODELS.items()},
    }
)
"""By the words of the family and its models."""
