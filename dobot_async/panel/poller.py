"""Polls an arm while a page is connected: once for all pages, leaving half of the line's time to other requests.

    pose     at most 20 a second            alarms, link    once a second
    inputs   twice a second, those that a page shows

Nothing is polled while no page is connected.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from statistics import median
from typing import TYPE_CHECKING, Any

from dobot_async.errors import ConnectionLost, DobotError
from dobot_async.panel.arms import ArmView
from dobot_async.panel.reach import reach_of_view

if TYPE_CHECKING:
    from dobot_async.panel.station import Station

__all__ = ["PERIOD", "ArmPoller"]

PERIOD = 0.05
SELDOM = 1.0
INPUTS = 0.5
UNREACHABLE = 1.0  # seconds until an arm that did not answer is asked again
MOVES = 0.02  # degrees between two readings from which on a joint moves
KEPT = 20  # readings of which the round trip is the middle one


class ArmPoller:
    """Reads one arm.

    Attributes:
        reach: Where the tool can be, as far as a few numbers tell; {} until that is known.
        pose: The coordinates that were read last.
    """

    def __init__(self, station: Station) -> None:
        self.reach: dict[str, Any] = {}
        self.pose: dict[str, float] = {}
        self._station = station
        self._now = asyncio.get_running_loop().time
        self._trips: deque[float] = deque(maxlen=KEPT)
        self._inputs: dict[int, bool] = {}
        self._rail: float | None = None
        self._joints: tuple[float, ...] = ()
        self._trouble = ""

    async def run(self, view: ArmView) -> None:
        """Read until it is cancelled, or the link is gone."""
        hub, due = self._station.hub, {"seldom": -math.inf, "inputs": -math.inf}
        self.reach = await reach_of_view(view)
        self._station.described()
        self.tools_changed()
        while True:
            await hub.watched.wait()
            began = self._now()
            try:
                await self._read_pose(view)
                if began >= due["seldom"]:
                    due["seldom"] = began + SELDOM
                    await self._read_alarms(view)
                    self._tell_link(view, "")

                if began >= due["inputs"] and self._station.watched_inputs:
                    due["inputs"] = began + INPUTS
                    await self._read_inputs(view)
            except ConnectionLost:
                return
            except (DobotError, ValueError) as error:
                self._tell_link(view, str(error))
                await asyncio.sleep(UNREACHABLE)
                continue

            taken = self._now() - began
            await asyncio.sleep(max(PERIOD - taken, taken))

    def tools_changed(self) -> None:
        """Tell what the tools do."""
        station = self._station
        if not station.connected:
            return

        tools = station.view.tools
        station.hub.publish(
            "io",
            station.name,
            suction=tools.suction,
            gripper=tools.gripper,
            laser=tools.laser,
            armed=round(station.armed, 1),
            conveyor=next(iter((tools.conveyor or {}).values()), 0) if tools.conveyor is not None else None,
            rail=self._rail,
            outputs={str(pin): level for pin, level in (tools.outputs or {}).items()},
            inputs={str(pin): level for pin, level in self._inputs.items()},
        )

    async def _read_pose(self, view: ArmView) -> None:
        began = self._now()
        pose = await view.arm.get_pose()
        self._trips.append(self._now() - began)
        joints = tuple(pose.joints)
        moving = any(abs(a - b) > MOVES for a, b in zip(joints, self._joints, strict=False))
        self._joints, self.pose = joints, view.pose(pose)
        self._station.hub.publish(
            "state",
            self._station.name,
            t=self._now(),
            pose=self.pose,
            joints=joints,
            points=view.points(joints),
            moving=moving,
        )

    async def _read_alarms(self, view: ArmView) -> None:
        alarms = await view.arm.get_alarms()
        told = [
            {
                "name": str(getattr(each, "name", type(each).__name__)),
                "cause": str(getattr(each, "cause", each)),
                "remedy": str(getattr(each, "remedy", "")),
                "harmless": view.is_harmless(each),
            }
            for each in alarms
        ]
        self._station.hub.publish("alarms", self._station.name, alarms=told)
        rail = await view.rail_place()
        if rail != self._rail:
            self._rail = rail
            self.tools_changed()

    async def _read_inputs(self, view: ArmView) -> None:
        found = {pin: await view.input(pin) for pin in self._station.watched_inputs}
        if found != self._inputs:
            self._inputs = found
            self.tools_changed()

    def _tell_link(self, view: ArmView, why: str) -> None:
        """Tell how the line is."""
        link, stats = view.arm.link, view.arm.link.stats
        if why != self._trouble:
            self._trouble = why
            if why:
                self._station.log(why, "warning")

        self._station.hub.publish(
            "link",
            self._station.name,
            state=link.state.value.value,
            why=why,
            round_trip=median(self._trips) if self._trips else None,
            requests=stats.sent,
            repeated=stats.repeated,
            lost=stats.timeouts,
            junk=stats.junk_bytes,
            outages=link.outages,
        )
