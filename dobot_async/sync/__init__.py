"""The arms without asyncio: the same classes, in which a call returns when it is done.

    with Magician.connect("serial:///dev/ttyUSB0") as arm:
        arm.home()
        motion = arm.queue.move_to(220, 0, 40)
        motion.wait()

Functions that take an arm, such as `pick`, `draw` and `play`, are here as well, and so is `discover`. What is neither,
such as poses, toolpaths, modes and errors, is the same as in `dobot_async`.
"""

from importlib import import_module
from typing import Any

HOMES = {
    "discovery": ("discover",),
    "figures": ("figures_of", "read_figures"),
    "fleet": ("Fleet", "Member"),
    "follow": ("Follow",),
    "handling": ("gripper_holds", "pick", "pick_and_place", "place"),
    "link": ("Link",),
    "magician": ("Magician",),
    "motion": ("Motion",),
    "mycobot": ("MyCobot",),
    "portal": ("run",),
    "simulation": ("Simulation", "simulate"),
    "teaching": ("Recorder", "check_recording", "play", "released"),
    "toolpath": ("Drawing", "check_toolpath", "draw", "engrave", "estimate", "reach_of", "reachable"),
    "together": ("Together",),
    "ultraarm": ("UltraArm",),
}
"""The module of each name, which is imported when the name is first asked for."""

OWN = {name: f"{__name__}.{module}" for module, names in HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return sorted(OWN)

    if name not in OWN:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    value = globals()[name] = getattr(import_module(OWN[name]), name)
    return value


def __dir__() -> list[str]:
    return [*globals(), *OWN]
