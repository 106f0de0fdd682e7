"""How far arms are behind a target that moves: a circle of 60 mm, in two seconds round, over a line of 115,200 baud.

    python -m benchmarks.bench_following [--rounds 10] [--json] [--quick] [--plot FILE]

In virtual time: the line carries its bytes and loses nothing, and neither program takes time of its own, so that the
figures are the same in every run. `lag` is how long ago the target was where the arm is now, on the circle; `off_mm` is
how far the arm is from the circle. "queued" gives each target to the arm's queue, at the same rate, for comparison.
"""

from __future__ import annotations

import asyncio
import math
from argparse import ArgumentParser
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import async_solipsism

import benchmarks.slow_line  # noqa: F401 - it adds its scheme
from benchmarks import svg
from benchmarks.report import Row, percentile, show
from dobot_async import Box, Magician, MyCobot, UltraArm
from dobot_async.simulator import UltraArmQuirks, simulate

RADIUS, HERTZ, RATE = 30.0, 0.5, 30.0  # mm, rounds a second, targets a second
UNDER_WAY = 0.3  # of the time, after which it is looked at
ROUNDS = 10


@dataclass(frozen=True)
class Kind:
    """One way to follow.

    Attributes:
        model: What is simulated.
        family: Its class.
        joints: Where the arm begins: at the circle's centre.
        options: What `following` takes; None queues each target.
        details: What `simulate` takes.
        percent: Of a Magician's speeds and accelerations.
        connect: What `connect` takes.
    """

    model: str
    family: Any
    joints: tuple[float, ...]
    options: dict[str, Any] | None = field(default_factory=dict)
    details: dict[str, Any] = field(default_factory=dict)
    percent: float = 100
    connect: dict[str, Any] = field(default_factory=dict)


MAGICIAN = "magician", Magician, (0.0, 30.0, 40.0, 0.0, 0.0)
ULTRAARM = "ultraarm", UltraArm, (0.0, 15.0, 40.0, 0.0)
COBOT = "mycobot280", MyCobot, (0.0, -30.0, -60.0, 0.0, 0.0, 0.0)
HOMED = {"homed": True}
KINDS = {
    "Magician": Kind(*MAGICIAN, details=HOMED),
    "Magician, 50 %": Kind(*MAGICIAN, details=HOMED, percent=50),
    "Magician, clear": Kind(*MAGICIAN, {"way": "clear"}, HOMED),
    "Magician, workspace": Kind(
        *MAGICIAN, details=HOMED, connect={"workspace": Box((150, 330), (-90, 90), (-50, 150))}
    ),
    "Magician, queued": Kind(*MAGICIAN, None, HOMED),
    "myCobot 280": Kind(*COBOT),
    "ultraArm, no ramps": Kind(
        *ULTRAARM, {"constant_speed": True}, {**HOMED, "quirks": UltraArmQuirks(constant_speed=True)}
    ),
    "ultraArm, ramps": Kind(*ULTRAARM, details=HOMED),
    "ultraArm, ramps, 0.5 s": Kind(*ULTRAARM, {"motion_time": 0.5}, HOMED),
}


@dataclass
class Circle:
    """The target, and what the arm makes of it.

    Attributes:
        sim: The arm.
        centre: Of the circle.
        lags: Seconds, of each moment.
        off: mm, of each moment.
    """

    sim: Any
    centre: tuple[float, float, float]
    lags: list[float] = field(default_factory=list)
    off: list[float] = field(default_factory=list)
    turned: float = 0.0

    def place(self) -> tuple[float, float]:
        """Where the tool is, seen from the centre."""
        pose = getattr(self.sim.arm, "pose", None)
        x, y = (pose.x, pose.y) if pose else self.sim.arm.coords[:2]
        return x - self.centre[0], y - self.centre[1]

    def target(self, angle: float) -> tuple[float, float, float]:
        """A place on the circle."""
        x, y, z = self.centre
        return x + RADIUS * math.cos(angle), y + RADIUS * math.sin(angle), z

    def look(self, angle: float, *, counts: bool) -> None:
        """Take where the arm is while the target is at an angle."""
        x, y = self.place()
        here = math.atan2(y, x)
        self.turned = here + round((self.turned - here) / math.tau) * math.tau
        if counts:
            self.lags.append((angle - self.turned) / (math.tau * HERTZ))
            self.off.append(abs(math.hypot(x, y) - RADIUS))


async def measured(kind: Kind, rounds: int) -> tuple[Row, Circle]:
    """How far an arm is behind."""
    loop = asyncio.get_running_loop()
    async with simulate(kind.model, **kind.details) as sim:
        sim.arm.device.place(kind.joints)
        async with kind.family.connect(sim.url.replace("sim://", "slow://"), **kind.connect) as arm:
            if kind.family is Magician:
                await arm.set_speed(kind.percent)

            pose = await arm.get_pose()
            circle = Circle(sim, (pose.x, pose.y, pose.z))
            await arm.move_to(*circle.target(0))
            seconds, began = rounds / HERTZ, loop.time()

            async def round_and_round(tell: Any) -> None:
                nonlocal began
                began = loop.time()
                while (elapsed := loop.time() - began) < seconds:
                    angle = math.tau * HERTZ * elapsed
                    circle.look(angle, counts=elapsed > UNDER_WAY * seconds)
                    tell(circle.target(angle))
                    await asyncio.sleep(1 / RATE)

            if kind.options is None:
                tasks: list[asyncio.Task[Any]] = []
                await round_and_round(lambda at: tasks.append(asyncio.create_task(arm.queue.move_to(*at))))
                sent, left_at = len(tasks), loop.time()
                await arm.stop()
                await asyncio.gather(*tasks, return_exceptions=True)
            else:
                async with arm.following(rate=RATE, max_speed=200, **kind.options) as follow:
                    await round_and_round(lambda at: setattr(follow, "target", at))
                    sent, left_at = follow.sent, loop.time()

            while sim.arm.device.moving:  # noqa: ASYNC110 - it has no event
                await asyncio.sleep(0.001)

            rest = loop.time() - left_at

    return (
        {
            "lag_p5_ms": round(percentile(circle.lags, 5) * 1000),
            "lag_p50_ms": round(percentile(circle.lags, 50) * 1000),
            "lag_p95_ms": round(percentile(circle.lags, 95) * 1000),
            "off_mm": round(percentile(circle.off, 50), 1),
            "sent_per_s": round(sent / seconds, 1),
            "rests_after_ms": round(rest * 1000),
        },
        circle,
    )


def plot(circles: dict[str, Circle], file: Path) -> None:
    """Draw the lags over the time."""
    curves = {name: [(number / RATE, lag) for number, lag in enumerate(each.lags)] for name, each in circles.items()}
    label = "s behind a target on a circle of 60 mm, 0.5 Hz, 115200 baud"
    file.write_text(svg.lines(label, "s", curves, log=True), encoding="utf-8")


def main() -> None:
    """Prints a table, or one JSON object."""
    options = ArgumentParser(description=__doc__)
    options.add_argument("--rounds", type=int, default=ROUNDS)
    options.add_argument("--json", action="store_true")
    options.add_argument("--quick", action="store_true")
    options.add_argument("--plot", type=Path)
    chosen = options.parse_args()
    rounds = 3 if chosen.quick else chosen.rounds
    rows: list[Row] = []
    circles: dict[str, Circle] = {}
    for name, kind in KINDS.items():
        with asyncio.Runner(loop_factory=async_solipsism.EventLoop) as runner:
            row, circles[name] = runner.run(measured(kind, rounds))

        rows.append({"kind": name, **row})

    if chosen.plot:
        plot(circles, chosen.plot)

    show("following", rows, as_json=chosen.json, rounds=rounds)


if __name__ == "__main__":
    main()
