"""Asyncio driver for desktop robot arms.

async with Magician.connect("serial:///dev/ttyUSB0") as arm:
    await arm.home()
    await arm.move_to(220, 0, 40)
"""

from importlib import import_module
from typing import Any

HOMES = {
    "_core.protocol.contract": ("LinkState", "LinkStats", "Unexpected"),
    "_core.protocol.wire": ("Command",),
    "arms.base": ("Arm",),
    "arms.info": ("DeviceInfo",),
    "discovery": ("DiscoveryProblem", "Found", "discover"),
    "errors": (
        "ArmAlarm",
        "CommandRejected",
        "ConnectFailed",
        "ConnectionLost",
        "DobotError",
        "MotionStopped",
        "MotionUnknown",
        "ProtocolError",
        "ReplyTimeout",
        "UnsupportedError",
    ),
    "fleet.fleet": ("Fleet",),
    "_core.link.link": ("Link",),
    "_core.queue.motion": ("Motion",),
    "_core.util.shapes": ("Box", "Cylinder"),
    "_core.util.workspace": ("OutsideWorkspace", "Workspace"),
    "transports": ("open_transport",),
}
"""Where each public name is at home, beside those of the families, which say it themselves."""


OWN = {name: f"{__name__}.{module}" for module, names in HOMES.items() for name in names}


def homes() -> dict[str, str]:
    """The module of each public name, which is imported when the name is first asked for: nobody pays for the rest."""
    from dobot_async.arms.registry import homes as of_families  # noqa: PLC0415 - for the same reason

    return OWN | of_families()


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return sorted(homes())

    home = OWN.get(name) or (None if name.startswith("_") else homes().get(name))
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    value = globals()[name] = getattr(import_module(home), name)
    return value


def __dir__() -> list[str]:
    return [*globals(), *homes()]
