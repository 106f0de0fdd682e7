"""`connect(workspace=...)`: the simulated arms never leave it, and without it the same motions do."""

from __future__ import annotations

import asyncio
import itertools
import math
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quick_suite import examples
from virtual import run_virtual, virtual

from dobot_async import (
    Box,
    CommandRejected,
    Cylinder,
    DobotError,
    Fleet,
    Magician,
    MotionStopped,
    MoveMode,
    MyCobot,
    OutsideWorkspace,
    PTPMode,
    ReplyTimeout,
    UltraArm,
    Workspace,
)
from dobot_async._core.util.shapes import Shape
from dobot_async.arms.magician import commands as c
from dobot_async.arms.mycobot import commands as mycobot
from dobot_async.arms.ultraarm import commands as ultraarm
from dobot_async.fleet import Member
from dobot_async.simulator import DeviceOptions, Simulation, simulate
from dobot_async.simulator.ultraarm.kinematics import forward

XYZ = tuple[float, float, float]
NEAR = 0.2  # mm by which a way between two places that are looked at may be off
SPACE = Workspace(Box(x=(150, 260), y=(-130, 130), z=(0, 120)), forbidden=Cylinder(215, 0, 20, z=(-100, 60)))
COBOT = Workspace(Box(x=(120, 230), y=(-130, 130), z=(120, 260)), forbidden=Box(x=(160, 190), y=(-30, 30)))
DOWN = (180.0, 0.0, -90.0)
SPACES = {"magician": (Magician, SPACE), "mycobot280": (MyCobot, COBOT), "ultraarm": (UltraArm, SPACE)}


def inside(space: Workspace, place: XYZ) -> bool:
    """Whether a place is in a workspace, but for what is too little to count; told without asking the workspace."""
    kept = any(shape.contains(*place, margin=NEAR) for shape in space.allowed)
    return kept and not any(shape.contains(*place, margin=-NEAR) for shape in space.forbidden)


def true_place(sim: Simulation[Any]) -> XYZ:
    """Where the tool of a simulated arm is in truth."""
    if hasattr(sim.arm, "true_pose"):
        pose = sim.arm.true_pose
        return pose.x, pose.y, pose.z

    x, y, z, *_ = sim.arm.coords if hasattr(sim.arm, "coords") else forward(sim.arm.device.joints)
    return x, y, z


@asynccontextmanager
async def traced(sim: Simulation[Any]) -> AsyncIterator[list[XYZ]]:
    """Where the tool comes along while the block lasts."""
    places: list[XYZ] = []

    async def trace() -> None:
        while True:
            places.append(true_place(sim))
            await asyncio.sleep(0.02)

    task = asyncio.create_task(trace())
    try:
        yield places
    finally:
        task.cancel()
        await asyncio.wait([task])
        places.append(true_place(sim))


@asynccontextmanager
async def standing(family: str, workspace: Workspace | None) -> AsyncIterator[tuple[Simulation[Any], Any]]:
    """An arm of a family that stands in its workspace, in front of what is forbidden."""
    kind: Any = SPACES[family][0]
    options: dict[str, Any] = {"model": family} if family == "mycobot280" else {}
    async with simulate(family) as sim:
        async with kind.connect(sim.url, **options) as arm:
            if family != "mycobot280":
                await arm.home()

            if family == "mycobot280":
                await arm.move_joints(0, -30, -60, 0, 0, 0)
                await arm.move_to(150, -80, 200, *DOWN)
            else:
                await arm.move_to(200, -80, 50)

        async with kind.connect(sim.url, workspace=workspace, **options) as arm:
            yield sim, arm


Step = Callable[[Any], Awaitable[None]]


def magician_step(mode: str, x: float, y: float, z: float) -> Step:
    """A motion of a Magician."""
    by = (x - 205) / 2, y / 2, (z - 60) / 2
    steps: dict[str, Step] = {
        "path": lambda arm: arm.path_to(x, y, z),
        "path by": lambda arm: arm.path_to(*by, relative=True),
        "arc": lambda arm: arm.arc((x, y / 2, z), (205, y, 60)),
        "circle": lambda arm: arm.circle((x, y / 2, z), (205, y, 60)),
        "lower": lambda arm: arm.move_to(z=z),
        "joints": lambda arm: arm.move_joints(*arm.kinematics.inverse(x, y, z, 0)),
    }
    if mode in steps:
        return steps[mode]

    if mode.endswith("INC"):
        return lambda arm: arm.move_by(*by, mode=PTPMode[mode])

    return lambda arm: arm.move_to(x, y, z, mode=PTPMode[mode])


def cobot_step(mode: str, x: float, y: float, z: float) -> Step:
    """A straight motion of a myCobot."""
    steps: dict[str, Step] = {
        "to": lambda arm: arm.move_to(x - 30, y, z + 130, *DOWN, mode=MoveMode.LINEAR),
        "partly": lambda arm: arm.move_to(y=y, mode=MoveMode.LINEAR),
        "by": lambda arm: arm.move_by(y=y, mode=MoveMode.LINEAR),
    }
    return steps[mode]


def ultraarm_step(mode: str, x: float, y: float, z: float) -> Step:
    """A motion of an ultraArm."""
    steps: dict[str, Step] = {
        "to": lambda arm: arm.move_to(x, y, z),
        "partly": lambda arm: arm.move_to(y=y),
        "by": lambda arm: arm.move_by(x=(x - 205) / 2, y=y),
        "gcode": lambda arm: arm.run_gcode([f"G1 X{x:.2f} Y{y:.2f} Z{z:.2f}", "G91", f"G1 Y{-y / 2:.2f}"]),
    }
    return steps[mode]


MODES = {
    "magician": (
        magician_step,
        [
            "path",
            "path by",
            "arc",
            "circle",
            "lower",
            "joints",
            "MOVL_INC",
            "MOVJ_XYZ_INC",
            "MOVJ_XYZ",
            "MOVL_XYZ",
            "JUMP_XYZ",
            "JUMP_MOVL_XYZ",
        ],
    ),
    "mycobot280": (cobot_step, ["to", "partly", "by"]),
    "ultraarm": (ultraarm_step, ["to", "partly", "by", "gcode"]),
}
Plan = Sequence[tuple[int, float, float, float]]
plans = st.lists(
    st.tuples(st.integers(0, 11), st.floats(130, 290), st.floats(-160, 160), st.floats(-30, 140)),
    min_size=3,
    max_size=6,
)


async def perform(family: str, plan: Plan, workspace: Workspace | None) -> tuple[list[XYZ], int]:
    """Where the arm comes along on motions, each of which may be refused; and how many were."""
    make, modes = MODES[family]
    refused = 0
    async with standing(family, workspace) as (sim, arm), traced(sim) as places:
        for mode, *place in plan:
            try:
                await make(modes[mode % len(modes)], *(round(each, 1) for each in place))(arm)
            except ValueError:
                refused += 1
            except DobotError:  # out of the arm's reach
                await arm.recover()

    return places, refused


@pytest.mark.cases(1)
@pytest.mark.parametrize("family", list(MODES))
@settings(max_examples=examples(15), deadline=None)
@given(plan=plans)
def test_an_arm_never_leaves_its_workspace(family: str, plan: Plan) -> None:
    async def run() -> None:
        places, _ = await perform(family, plan, SPACES[family][1])
        assert all(inside(SPACES[family][1], place) for place in places)

    run_virtual(run())


@pytest.mark.full
@pytest.mark.parametrize("family", list(MODES))
@virtual
async def test_without_a_workspace_the_same_motions_leave_it(family: str) -> None:
    space = SPACES[family][1]
    plan = [(mode, 215, y, 40) for mode in range(12) for y in (80, -80)]
    places, refused = await perform(family, plan, space)
    assert all(inside(space, place) for place in places)
    assert refused
    places, refused = await perform(family, plan, None)
    assert not all(inside(space, place) for place in places)


@pytest.mark.cases(2)
@pytest.mark.parametrize("family", list(MODES))
@pytest.mark.parametrize("direction", ["y-", "y+", "j1-"])
@virtual
async def test_a_jog_is_stopped_before_the_edge(family: str, direction: str) -> None:
    space = SPACES[family][1]
    async with standing(family, space) as (sim, arm), traced(sim) as places:
        with pytest.raises(MotionStopped, match="would have come"):
            await arm.jog(direction, 20)

    assert all(inside(space, place) for place in places)
    assert math.dist(places[0], places[-1]) > 5
    async with standing(family, None) as (sim, arm), traced(sim) as places:
        with suppress(DobotError):
            await arm.jog(direction, 20)

    assert not all(inside(space, place) for place in places)


@pytest.mark.parametrize("family", list(MODES))
@virtual
async def test_a_raw_jog_without_an_end_is_refused(family: str) -> None:
    row: tuple[Any, Any] = {
        "magician": (c.SET_JOG_CMD, c.JOGCmd(False, c.JOGKey.AP_DOWN)),
        "mycobot280": (mycobot.JOG_COORD, mycobot.JogAxis(1, mycobot.Direction.UP, 50)),
        "ultraarm": (ultraarm.JOG_COORD, ultraarm.JogMove(1, ultraarm.JogDirection.POSITIVE, 50)),
    }[family]
    async with standing(family, SPACES[family][1]) as (sim, arm):
        before = true_place(sim)
        with pytest.raises(ValueError, match="workspace"):
            await arm.request(*row)

        await asyncio.sleep(2)
        assert true_place(sim) == before


def count(sim: Simulation[Any]) -> int:
    """How many commands the arm has executed."""
    return len(sim.arm.executed)


RAW: dict[str, tuple[Any, Any]] = {
    "magician": (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 300, 0, 50, 0)),
    "mycobot280": (mycobot.SEND_COORDS, mycobot.ToMove((250.0, 0.0, 200.0, *DOWN), 50, MoveMode.ANGULAR)),
    "ultraarm": (ultraarm.MOVE_LINE, ultraarm.CoordsMove(290, 0, 50)),
}


@pytest.mark.parametrize("family", list(MODES))
@virtual
async def test_whatever_puts_it_a_target_outside_is_refused_before_anything_is_sent(family: str) -> None:
    space = SPACES[family][1]
    x = RAW[family][1].coords[0] if family == "mycobot280" else RAW[family][1].x
    async with standing(family, space) as (sim, arm):
        executed = count(sim)
        rest = (0, 200, *DOWN) if family == "mycobot280" else (0, 50)
        calls: list[Callable[[], Any]] = [
            lambda: arm.move_to(x, *rest),
            lambda: arm.queue.put(*RAW[family]),
            lambda: arm.queue.stream([arm.queue.put(*RAW[family])]),
        ]
        for call in calls:
            with pytest.raises(OutsideWorkspace, match=rf"the target \({x:g}, 0, \d+\) mm is outside of Box\(x="):
                await call()

        with pytest.raises(OutsideWorkspace):
            async with arm.queue.batch() as batch:
                batch.wait(0)
                batch.put(*RAW[family])

        await asyncio.sleep(1)
        assert count(sim) == executed
        assert arm.queue.pending == 0


@pytest.mark.parametrize("family", list(MODES))
@virtual
async def test_a_batch_is_looked_at_as_a_whole(family: str) -> None:
    make, modes = MODES[family]
    way = modes.index("MOVL_XYZ") if family == "magician" else modes.index("to")
    async with standing(family, SPACES[family][1]) as (sim, arm):
        executed = count(sim)
        with pytest.raises(OutsideWorkspace, match=r"the way to .* through .*, which is forbidden"):
            async with arm.queue.batch() as batch:
                first: Any = make(modes[way], 200, -60, 50)(batch)
                make(modes[way], 200, 80, 50)(batch)

        await asyncio.sleep(1)
        assert count(sim) == executed
        with pytest.raises(MotionStopped, match="not sent"):
            await first


@virtual
async def test_the_queue_goes_on_from_where_it_leads() -> None:
    async with standing("magician", SPACE) as (sim, arm), traced(sim) as places:
        await arm.queue.move_to(250, -80, 90)
        await arm.queue.move_to(250, 80, 90, mode=PTPMode.MOVL_XYZ)
        await arm.queue.move_to(200, 80, 20)
        with pytest.raises(OutsideWorkspace, match="leads by"):
            await arm.queue.move_to(200, -80, 20)

        with pytest.raises(OutsideWorkspace, match=r"the target \(200, 180, 20\) mm"):
            await arm.queue.move_by(y=100)

        await arm.queue.move_by(y=20)
        await arm.queue.join()

    assert places[-1] == pytest.approx((200, 100, 20), abs=0.01)
    assert all(inside(SPACE, place) for place in places)


@virtual
async def test_a_jump_lifts_no_higher_than_the_workspace() -> None:
    async with standing("magician", SPACE) as (sim, arm):
        await arm.queue.put(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(100, 200))
        with pytest.raises(OutsideWorkspace, match=r"leads by .*, outside of Box"):
            await arm.queue.move_to(200, -30, 50, mode=PTPMode.JUMP_XYZ)

        await arm.queue.join()
        await arm.request(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(20, 100))
        await arm.request(c.SET_PTP_JUMP2_PARAMS, c.PTPJump2Params(20, 25, 100))
        await arm.move_to(200, 80, 50, mode=PTPMode.JUMP_XYZ)
        assert sim.arm.pose.y == pytest.approx(80)


@pytest.mark.parametrize("family", list(MODES))
@virtual
async def test_an_arm_that_stands_outside_may_come_back_and_go_no_further(family: str) -> None:
    make, _ = MODES[family]
    way = "MOVL_XYZ" if family == "magician" else "to"
    async with standing(family, None) as (sim, arm):
        await make(way, 200, -140, 50)(arm)
        url, kind = sim.url, SPACES[family][0]
        assert not inside(SPACES[family][1], true_place(sim))
        options = {"model": family} if family == "mycobot280" else {}
        async with kind.connect(url, workspace=SPACES[family][1], **options) as kept:  # type: ignore[attr-defined]
            with pytest.raises(OutsideWorkspace):
                await make(way, 200, -145, 50)(kept)

            await make(way, 200, -100, 50)(kept)
            assert inside(SPACES[family][1], true_place(sim))


@virtual
async def test_behind_home_targets_alone_are_looked_at_and_increments_wait() -> None:
    async with standing("magician", SPACE) as (_, arm):
        await arm.queue.home()
        with pytest.raises(OutsideWorkspace, match="nothing tells where increments lead"):
            await arm.queue.move_by(z=10)

        with pytest.raises(OutsideWorkspace, match="the target"):
            await arm.queue.move_to(300, 0, 50)

        await arm.queue.move_to(200, 60, 50)
        await arm.queue.move_by(z=10)
        await arm.queue.join()


@virtual
async def test_behind_joints_a_cobot_is_asked_where_it_is_before_the_next_motion_is_sent() -> None:
    async with standing("mycobot280", COBOT) as (sim, arm):
        there = await arm.get_joints()
        await arm.queue.move_joints(*there)
        motion = await arm.queue.move_to(y=80, mode=MoveMode.LINEAR)
        await arm.queue.join()
        assert motion.done
        await arm.move_to(170, 80, 200, *DOWN, mode=MoveMode.LINEAR)
        await arm.queue.move_joints(*await arm.get_joints())
        executed = count(sim)
        refused = await arm.queue.move_to(y=-80, mode=MoveMode.LINEAR)
        with pytest.raises(CommandRejected, match="not sent: the way to"):
            await refused

        assert count(sim) <= executed + 1


@virtual
async def test_what_waits_behind_a_withdrawn_motion_is_not_sent() -> None:
    async with simulate(options=DeviceOptions(capacity=4)) as sim, Magician.connect(sim.url) as first:
        await first.move_to(200, -80, 100)
        async with Magician.connect(sim.url, workspace=SPACE) as arm:
            for _ in range(4):
                await arm.queue.wait(5)

            await arm.queue.wait(0)
            lost = asyncio.create_task(arm.queue.move_to(250, -80, 100, timeout=1))
            await asyncio.sleep(0.1)
            behind = asyncio.create_task(arm.queue.move_to(250, 80, 100, mode=PTPMode.MOVL_XYZ))
            with pytest.raises(ReplyTimeout):
                await lost

            with pytest.raises(MotionStopped, match="begin elsewhere"):
                await behind


@virtual
async def test_joints_are_looked_at_with_the_end_effector_that_the_arm_has() -> None:
    async with standing("magician", SPACE) as (_, arm):
        joints = arm.kinematics.inverse(230, -100, 90, 0)
        await arm.move_joints(*joints)
        await arm.move_to(180, -80, 90)
        await (await arm.queue.put(c.SET_END_EFFECTOR_PARAMS, c.EndEffectorParams(159.7)))
        with pytest.raises(OutsideWorkspace, match="the target"):
            await arm.move_joints(*joints)


@virtual
async def test_a_stored_program_is_looked_at() -> None:
    async with standing("magician", SPACE) as (_, arm):
        with pytest.raises(OutsideWorkspace):
            async with arm.queue.download() as program:
                program.move_to(200, 80, 20)
                program.move_to(200, -80, 20)


@virtual
async def test_gcode_is_looked_at_as_a_whole() -> None:
    async with standing("ultraarm", SPACE) as (sim, arm):
        executed = count(sim)
        with pytest.raises(
            ValueError, match=r"line 3: the way to .* leads by .*\nline 4: the target \(215, 0, 40\)"
        ) as told:
            await arm.run_gcode(["G1 X200 Y-60 Z40", "M3", "G1 Y60", "G0 X215 Y0 Z40"])

        assert "Cylinder(215, 0, 20" in str(told.value)
        assert count(sim) == executed
        with pytest.raises(ValueError, match="set_position"):
            await arm.set_position(0)


@virtual
async def test_an_arm_in_a_fleet_keeps_its_workspace_too() -> None:
    async with simulate() as sim:
        member = Member(sim.url, Magician, {"workspace": SPACE})
        async with Fleet.connect({"left": member}) as fleet:
            arm = fleet["left"]
            await arm.home()
            await arm.move_to(200, -80, 50)
            with pytest.raises(OutsideWorkspace):
                await arm.move_to(200, 80, 50, mode=PTPMode.MOVL_XYZ)


@virtual
async def test_what_is_no_workspace_is_refused_by_all_arms() -> None:
    kinds: tuple[Any, ...] = (Magician, MyCobot, UltraArm)
    for kind in kinds:
        with pytest.raises(TypeError, match="workspace must be a Workspace"):
            async with kind.connect("sim:", workspace="here"):
                pass

    with pytest.raises(TypeError, match="allowed must be"):
        Workspace(allowed=[1])  # type: ignore[list-item]

    with pytest.raises(ValueError, match="allowed, or forbidden"):
        Workspace()


shapes: st.SearchStrategy[Shape] = st.one_of(
    st.builds(lambda x, y, z: Box((x, x + 40), (y, y + 30), (z, z + 50)), *(st.floats(-60, 60) for _ in range(3))),
    st.builds(Cylinder, st.floats(-60, 60), st.floats(-60, 60), st.floats(5, 40), st.just((-30.0, 30.0))),
)
places = st.tuples(*(st.floats(-80, 80) for _ in range(3)))


@given(st.lists(shapes, max_size=2), st.lists(shapes, min_size=1, max_size=2), places, places)
def test_a_straight_way_that_passes_is_inside_everywhere(
    allowed: list[Shape], forbidden: list[Shape], start: XYZ, end: XYZ
) -> None:
    space = Workspace(allowed, forbidden)

    def bad(place: XYZ, margin: float) -> bool:
        out = bool(allowed) and not any(shape.contains(*place, margin=margin) for shape in allowed)
        return out or any(shape.contains(*place, margin=-margin) for shape in forbidden)

    points = [tuple(a + (b - a) * n / 200 for a, b in zip(start, end, strict=True)) for n in range(201)]
    line: list[XYZ] = [(x, y, z) for x, y, z in points]
    try:
        space.check_way([start, end])
    except OutsideWorkspace:
        clear = not any(bad(place, -0.5) for place in line)
        assert not clear
    else:
        came_in = list(itertools.dropwhile(lambda place: bad(place, 0.05), line))
        assert came_in
        assert not any(bad(place, 0.1) for place in came_in)


def test_out_of_a_thin_wall_an_arm_may_go_back_and_not_through() -> None:
    """Both ends of a way may be less deep than its middle: it is looked at every few millimetres."""
    wall = Workspace(forbidden=Box((100, 130), (-200, 200), (0, 200)))
    wall.check_way([(110, 0, 50), (90, 0, 50)])
    with pytest.raises(OutsideWorkspace, match="through Box"):
        wall.check_way([(110, 0, 50), (140, 0, 50)])
