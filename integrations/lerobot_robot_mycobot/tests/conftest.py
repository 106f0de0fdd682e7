"""LeRobot itself, without what only its policies and datasets need: packages that are missing here are stood in for.

Of a class of LeRobot that touches one of them nothing is true here; `Robot`, `Teleoperator`, their configurations and
their discovery do not, they only import it. What was stood in for is in the head of the report.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

HEAVY = frozenset(
    (
        *(
            "PIL",
            "accelerate",
            "av",
            "cv2",
            "datasets",
            "diffusers",
            "einops",
            "gymnasium",
            "imageio",
            "pandas",
            "pyarrow",
        ),
        *("rerun", "safetensors", "torch", "torchvision", "transformers", "wandb"),
    )
)
stood_in: set[str] = set()


class StandIn(type):
    """A class of which everything may be asked while modules are imported."""

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)

        return StandIn(name, (), {})

    def __getitem__(cls, _: object) -> Any:
        return cls

    def __or__(cls, _: object) -> Any:
        return cls

    __ror__ = __or__

    def __call__(cls, *args: Any, **_: Any) -> Any:
        function = args[0] if args else None
        return function if isinstance(function, Callable) else cls  # type: ignore[arg-type] # of a decorator


class StandInModule(ModuleType):
    """A module that has every name."""

    __path__: Sequence[str] = ()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)

        return StandIn(name, (), {})


class Finder(MetaPathFinder, Loader):
    """Finds what is missing; asked last."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """A stand-in for heavy packages alone."""
        top = name.partition(".")[0]
        return ModuleSpec(name, self, is_package=True) if top in HEAVY else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Makes one."""
        stood_in.add(spec.name.partition(".")[0])
        return StandInModule(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Does nothing."""


sys.meta_path.append(Finder())
import lerobot.cameras.utils  # noqa: E402
import lerobot.robots.utils  # noqa: E402
import lerobot.teleoperators.utils  # noqa: E402, F401


def pytest_report_header() -> str:
    """Says what is not LeRobot's own surroundings."""
    return f"stood in for: {', '.join(sorted(stood_in)) or 'nothing'}"
