"""Packages whose names are imported when somebody asks for them: nobody pays for those that he does not use.

if TYPE_CHECKING:
    from package.module import Name        # for type checkers, which do not see the other branch
else:
    __getattr__ = late(__name__, {"module": ("Name",)})
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module

__all__ = ["late"]


def late(package: str, modules: Mapping[str, Sequence[str]]) -> Callable[[str], object]:
    """Return the `__getattr__` of a package.

    Args:
        package: Its name.
        modules: The names of each of its modules that are the package's as well.
    """
    homes = {name: f"{package}.{module}" for module, names in modules.items() for name in names}

    def found(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")

        value = getattr(import_module(homes[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return found
