"""Simulated arms that can be reached as real ones are."""

from dobot_async.simulator.endpoints import Simulation, simulate
from dobot_async.simulator.faults import Faults

__all__ = ["Faults", "Simulation", "simulate"]
