"""Simulated arms that can be reached as real ones are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dobot_async._core.util.late import late

if TYPE_CHECKING:
    from dobot_async.simulator.device.work import DeviceOptions
    from dobot_async.simulator.endpoints import simulate
    from dobot_async.simulator.faults import Faults
    from dobot_async.simulator.magician.arm import Quirks, SimulatedMagician
    from dobot_async.simulator.mycobot.arm import MyCobotQuirks, SimulatedMyCobot
    from dobot_async.simulator.simulation import Simulation
    from dobot_async.simulator.ultraarm.arm import SimulatedUltraArm, UltraArmQuirks
    from dobot_async.simulator.wifi_module import announced
else:
    __getattr__ = late(
        __name__,
        {
            "device.work": ("DeviceOptions",),
            "endpoints": ("simulate",),
            "faults": ("Faults",),
            "magician.arm": ("Quirks", "SimulatedMagician"),
            "mycobot.arm": ("MyCobotQuirks", "SimulatedMyCobot"),
            "simulation": ("Simulation",),
            "ultraarm.arm": ("SimulatedUltraArm", "UltraArmQuirks"),
            "wifi_module": ("announced",),
        },
    )

__all__ = [
    "DeviceOptions",
    "Faults",
    "MyCobotQuirks",
    "Quirks",
    "SimulatedMagician",
    "SimulatedMyCobot",
    "SimulatedUltraArm",
    "Simulation",
    "UltraArmQuirks",
    "announced",
    "simulate",
]
