"""What a page does with an arm, over real sockets: what the simulated arm recorded decides."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from endurance import endure
from panel_rig import ARM, Shown, browser, page, shown, until

from dobot_async import Box, Fleet, Magician, MotionStopped, MyCobot, PTPMode, UltraArm
from dobot_async.arms.magician import commands as c
from dobot_async.bridge import bridge
from dobot_async.fleet.member import Member
from dobot_async.panel import Role, panel
from dobot_async.simulator import simulate
from dobot_async.simulator.scene import Block, Piece, Scene
from dobot_async.teaching import load_recording

FAST = 20.0
SQUARE = (
    b'<svg xmlns="http://www.w3.org/2000/svg" width="20mm" height="20mm">'
    b'<rect width="20" height="20" fill="none" stroke="black"/></svg>'
)


@pytest.fixture
async def rig() -> AsyncIterator[Shown]:
    async with shown(speed=FAST) as found:
        yield found


def executed(rig: Shown, command: Any) -> list[Any]:
    """What the arm has done of a row, to its end."""
    return [each.value for each in rig.sim.arm.executed if each.command is command and each.outcome == "done"]


async def upload(rig: Shown, data: bytes, name: str, where: str = "files") -> tuple[int, dict[str, Any]]:
    """Drop a file on the page."""
    path = f"files?arm={ARM}&name={name}" if where == "files" else f"recordings/{ARM}?name={name}"
    async with browser() as http:
        await (await http.get(rig.panel.operator_url)).read()
        async with http.post(f"{rig.panel.url}{path}", data=data, headers=rig.origin) as answer:
            return answer.status, await answer.json()


async def test_a_page_is_told_what_there_is(rig: Shown) -> None:
    async with page(rig, Role.VIEWER) as one:
        arm = one.last("hello")["arms"][0]
        assert (arm["name"], arm["family"], len(arm["joints"])) == (ARM, "magician", 4)
        assert "x+" in arm["jog"]["tool"]
        assert "j1+" in arm["jog"]["joint"]
        state = one.last("state")
        assert len(state["points"]) == len(arm["shape"]) + 1
        assert state["points"][-1] == pytest.approx([state["pose"][each] for each in "xyz"], abs=0.1)
        await until(lambda: one.last("link").get("requests"))
        await until(lambda: one.last("alarms"))
        (alarm,) = one.last("alarms")["alarms"]
        assert (alarm["name"], alarm["harmless"]) == ("COMMON_RESET", True)


@pytest.mark.cases(2)
@pytest.mark.parametrize(
    ("model", "kind", "pose", "joints"),
    [
        ("magician", Magician, {"x": 220.0, "y": 30.0, "z": 40.0}, [10.0, 30.0, 40.0, 0.0]),
        ("mycobot280", MyCobot, {"x": 150.0, "y": 50.0, "z": 200.0}, [10.0, -20.0, 30.0, 0.0, 0.0, 0.0]),
        ("mypalletizer260", MyCobot, {"x": 150.0, "y": 50.0, "z": 100.0}, [10.0, 20.0, 10.0, 0.0]),
        ("ultraarm", UltraArm, {"x": 220.0, "y": 30.0, "z": 40.0}, [10.0, 20.0, 30.0, 0.0]),
    ],
)
async def test_every_family_is_driven_alike(
    model: str, kind: type[Any], pose: dict[str, float], joints: list[float]
) -> None:
    options = {"model": model} if kind is MyCobot else {}
    async with (
        simulate(model, speed=FAST) as sim,
        panel({ARM: Member(sim.url, kind, options=options)}, port=0) as running,
    ):
        rig = Shown(sim, running)
        async with page(rig) as one:
            await one.get("take_lease", arm=ARM)
            await one.get("home", arm=ARM)
            await one.get("move_joints", arm=ARM, joints=joints)
            assert (await one.get("check", arm=ARM, joints=joints))["ok"]
            await until(lambda: one.last("state")["joints"] == pytest.approx(joints, abs=1))
            state, arm = one.last("state"), one.last("arm")["arm"]
            assert state["points"][-1] == pytest.approx([state["pose"][each] for each in "xyz"], abs=1)
            assert len(state["points"]) == len(arm["shape"]) + 1
            await one.get("step", arm=ARM, direction="j1+", size=5.0)
            await until(lambda: one.last("state")["joints"][0] == pytest.approx(joints[0] + 5, abs=1))
            if kind is not MyCobot:  # which solves its coordinates as it likes
                await one.get("move_to", arm=ARM, **pose)
                await until(lambda: all(abs(one.last("state")["pose"][k] - v) < 1 for k, v in pose.items()))
                await one.get("step", arm=ARM, direction="z+", size=10.0)
                await until(lambda: abs(one.last("state")["pose"]["z"] - pose["z"] - 10) < 1)

            assert (await one.get("outline", arm=ARM, z=50.0))["rings"]
            number, press = await one.press("j1+", speed=50)
            await one.hold(press, lambda: one.last("jog").get("state") == "moving")
            await one.send("release", arm=ARM, press=press)
            await until(lambda: one.reply(number))


async def test_viewers_see_what_the_operator_does(rig: Shown) -> None:
    async with page(rig) as one, page(rig, Role.VIEWER) as viewer:
        await one.get("name", name="Ann")
        await one.get("take_lease", arm=ARM)
        await until(lambda: viewer.last("lease")["holder"])
        assert "Ann" in viewer.last("lease")["holder"]
        await one.get("move_to", arm=ARM, x=220.0, y=0.0, z=40.0)
        texts = [item["text"] for message in viewer.of("queue") for item in message["items"]]
        assert "move to x 220, y 0, z 40" in texts
        assert viewer.last("queue")["items"] == []


async def test_tools_are_told_and_the_pump_stays(rig: Shown) -> None:
    async with page(rig) as one:
        await one.get("take_lease", arm=ARM)
        await one.get("suction", arm=ARM, on=True)
        await until(lambda: one.last("io")["suction"] is True)
        await one.get("gripper", arm=ARM, closed=True)
        await one.get("configure_pin", arm=ARM, pin=4, use="output")
        await one.get("output", arm=ARM, pin=4, level=True)
        await one.get("configure_pin", arm=ARM, pin=5, use="input")
        await one.get("watch_inputs", arm=ARM, pins=[5])
        await until(lambda: "5" in one.last("io")["inputs"])
        assert one.last("io")["outputs"] == {"4": True}
        assert await one.refused("gripper_to", arm=ARM, percent=50) == "unsupported"
        await one.get("release_lease", arm=ARM)

    assert executed(rig, c.SET_END_EFFECTOR_SUCTION_CUP)[-1].is_sucked


async def test_the_laser_is_on_only_while_it_is_armed() -> None:
    async with shown() as rig, page(rig) as one:
        await one.get("take_lease", arm=ARM)
        assert await one.refused("laser", arm=ARM, on=True) == "wrong"
        await one.get("arm_laser", arm=ARM, seconds=1)
        await one.get("laser", arm=ARM, on=True)
        await until(lambda: one.last("io")["laser"] is True)
        await until(lambda: one.last("io")["laser"] is False)
        assert not executed(rig, c.SET_END_EFFECTOR_LASER)[-1].is_on


async def test_what_burns_or_turns_ends_with_its_page(rig: Shown) -> None:
    async with page(rig) as one:
        await one.get("take_lease", arm=ARM)
        await one.get("arm_laser", arm=ARM, seconds=60)
        await one.get("laser", arm=ARM, on=True)
        await one.get("conveyor", arm=ARM, speed=2000)
        await until(lambda: one.last("io")["conveyor"] == 2000)

    await until(lambda: not executed(rig, c.SET_END_EFFECTOR_LASER)[-1].is_on)
    await until(lambda: not executed(rig, c.SET_E_MOTOR)[-1].speed)


async def test_an_alarm_is_told_in_words_and_recovered_from(rig: Shown) -> None:
    async with page(rig) as one:
        await one.get("take_lease", arm=ARM)
        await one.get("home", arm=ARM)
        rig.sim.arm.raise_alarm(0x51)
        answer = await one.ask("move_to", arm=ARM, x=220.0, y=0.0, z=40.0)
        assert answer["error"]["kind"] == "alarm"
        await until(
            lambda: any("step" in each["cause"] and not each["harmless"] for each in one.last("alarms")["alarms"])
        )
        await one.get("recover", arm=ARM)
        await one.get("move_to", arm=ARM, x=220.0, y=0.0, z=40.0)
        await until(lambda: one.last("alarms")["alarms"] == [])


async def test_three_points_are_taught_put_in_order_kept_and_played(rig: Shown, tmp_path: Path) -> None:
    places = [(220.0, 0.0, 40.0), (220.0, 50.0, 40.0), (240.0, 50.0, 60.0)]
    async with page(rig) as one:
        await one.get("take_lease", arm=ARM)
        await one.get("home", arm=ARM)
        for x, y, z in places:
            await one.get("move_to", arm=ARM, x=x, y=y, z=z)
            await one.get("teach_take", arm=ARM, name=f"at {x:g}")

        await one.get("teach_move", arm=ARM, index=2, to=0)
        await one.get("teach_edit", arm=ARM, index=1, changes={"mode": "line", "pause": 0.1})
        assert await one.refused("teach_edit", arm=ARM, index=1, changes={"pose": [1, 2, 3]}) == "wrong"
        assert [step["name"] for step in one.last("recording")["steps"]] == ["at 240", "at 220", "at 220"]
        before = len(executed(rig, c.SET_PTP_CMD))
        await one.get("teach_play", arm=ARM)
        played = executed(rig, c.SET_PTP_CMD)[before:]
        assert [(round(each.x), round(each.y)) for each in played] == [(240, 50), (220, 0), (220, 50)]
        assert played[1].ptp_mode is PTPMode.MOVL_XYZ
        await until(lambda: any(item["progress"] for message in one.of("queue") for item in message["items"]))

        async with browser() as http:
            await (await http.get(rig.panel.viewer_url)).read()
            for suffix in ("json", "playback"):
                async with http.get(f"{rig.panel.url}recordings/{ARM}.{suffix}") as answer:
                    assert answer.status == 200
                    (tmp_path / f"kept.{suffix}").write_bytes(await answer.read())

        assert len(load_recording(tmp_path / "kept.playback").steps) == 3
        await one.get("teach_clear", arm=ARM)
        status, found = await upload(rig, (tmp_path / "kept.playback").read_bytes(), "kept.playback", "recordings")
        assert (status, found["steps"]) == (200, 3)
        await one.get("teach_load", arm=ARM, file=found["file"])
        await until(lambda: len(one.last("recording")["steps"]) == 3)
        await one.get("teach_remove", arm=ARM, index=0)
        await until(lambda: len(one.last("recording")["steps"]) == 2)
        status, found = await upload(rig, b"no recording", "kept.json", "recordings")
        assert (status, found["error"]["kind"]) == (400, "wrong")


async def test_a_drawing_is_shown_checked_and_drawn(rig: Shown) -> None:
    plane = {"x": 210, "y": -10, "z": -20, "lift": 10}
    async with page(rig) as one:
        await one.get("take_lease", arm=ARM)
        await one.get("home", arm=ARM)
        await one.get("end_effector", arm=ARM, tool="pen")
        status, found = await upload(rig, SQUARE, "square.svg")
        assert status == 200
        assert found["svg"].startswith("<svg")
        assert found["bounds"][2] == pytest.approx(found["bounds"][3])
        far = await one.get("preview", arm=ARM, file=found["file"], plane={**plane, "x": 400}, size=[20, 20])
        assert far["problems"]
        near = await one.get("preview", arm=ARM, file=found["file"], plane=plane, size=[20, 20])
        assert near["problems"] == []
        assert near["seconds"] > 0
        assert all(210 <= x <= 231 and -11 <= y <= 11 for line in near["lines"] for x, y, _ in line)
        assert await one.refused("draw", arm=ARM, file=found["file"], plane={**plane, "x": 400}) == "wrong"
        assert await one.refused("draw", arm=ARM, file=found["file"], plane=plane, tool="laser") == "wrong"
        assert await one.get("draw", arm=ARM, file=found["file"], plane=plane, size=[20, 20]) == {"strokes": 1}
        ways = executed(rig, c.SET_CP_CMD)
        assert {(round(each.x), round(each.y)) for each in ways} >= {(210, -10), (230, -10), (230, 10), (210, 10)}


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.svg", b"no SVG"),
        ("a.svg", b""),
        ("a.svg", b'<!DOCTYPE x [<!ENTITY a "b">]><svg>&a;</svg>'),
        ("a.png", b"\x89PNG\r\n\x1a\n" + b"\0" * 100),
        ("a.dxf", b"0\nSECTION\n"),
        ("a.gcode", b"G1 Xnan"),
        ("a.exe", b"MZ"),
        ("", b""),
    ],
)
async def test_a_bad_file_is_a_message(rig: Shown, name: str, data: bytes) -> None:
    status, found = await upload(rig, data, name)
    assert status == 400
    assert found["error"]["kind"] == "wrong"
    assert "Traceback" not in found["error"]["text"]
    status, _ = await upload(rig, SQUARE, "square.svg")
    assert status == 200


async def test_nothing_is_asked_while_nobody_looks(rig: Shown) -> None:
    async with page(rig, Role.VIEWER) as one:
        await until(lambda: len(one.of("state")) > 3)

    await until(lambda: rig.panel.pages == 0)
    await asyncio.sleep(0.2)
    before = rig.sim.arm.counters.requests
    await asyncio.sleep(0.5)
    assert rig.sim.arm.counters.requests == before > 4


async def test_several_commands_are_done_in_their_order_and_a_stop_ends_all(rig: Shown) -> None:
    async with page(rig) as one, page(rig, Role.VIEWER) as viewer:
        await one.get("take_lease", arm=ARM)
        await one.get("home", arm=ARM)
        numbers = [await one.send("move_to", arm=ARM, x=220.0, y=y, z=40.0) for y in (0.0, 50.0, 100.0)]
        await until(lambda: all(one.reply(number) for number in numbers))
        assert [round(each.y) for each in executed(rig, c.SET_PTP_CMD)] == [0, 50, 100]

        number = await one.send("teach_play", arm=ARM)
        await until(lambda: one.reply(number))
        numbers = [await one.send("move_to", arm=ARM, x=220.0, y=y, z=z) for y, z in ((-150.0, 0.0), (150.0, 50.0)) * 4]
        await until(lambda: len(one.last("queue")["items"]) >= 4)
        await viewer.get("stop")
        await until(lambda: all(one.reply(number) for number in numbers))
        kinds = {answer["error"]["kind"] for number in numbers if (answer := one.reply(number)) and not answer["ok"]}
        assert kinds == {"stopped"}
        here = rig.sim.arm.pose
        await asyncio.sleep(0.2)
        assert rig.sim.arm.pose == here
        assert await one.refused("move_to", arm=ARM, x=220.0) == "lease"


async def test_two_things_that_need_the_arm_alone_do_not_go_together() -> None:
    async with shown() as rig, page(rig) as one:
        await one.get("take_lease", arm=ARM)
        _, press = await one.press("y+")
        await one.hold(press, lambda: one.last("jog").get("state") == "moving")
        assert await one.refused("teach_play", arm=ARM) == "busy"
        assert await one.refused("home", arm=ARM) == "busy"
        await one.send("release", arm=ARM, press=press)
        await until(lambda: one.last("jog")["state"] == "ended")


async def test_an_arm_that_was_lost_is_connected_anew() -> None:
    async with (
        simulate(listen="tcp://127.0.0.1:0", speed=FAST) as sim,
        panel({ARM: Member(sim.url, Magician)}, port=0) as running,
    ):
        rig = Shown(sim, running)
        async with page(rig) as one:
            await one.get("take_lease", arm=ARM)
            sim.unplug()
            await until(lambda: one.last("lease")["holder"] is None)
            seen = len(one.of("state"))
            await until(lambda: len(one.of("state")) > seen + 3)
            await one.get("take_lease", arm=ARM)
            await one.get("move_to", arm=ARM, x=220.0, y=0.0, z=40.0)


async def test_an_arm_that_is_not_there_is_said_to_be_so() -> None:
    async with simulate(listen="tcp://127.0.0.1:0") as sim:
        url = sim.url

    async with panel({ARM: Member(url, Magician)}, port=0) as running, browser() as http:
        await (await http.get(running.operator_url)).read()
        async with http.ws_connect(f"{running.url}ws", headers={"Origin": running.url.rstrip("/")}) as socket:
            seen: list[Any] = []
            async with asyncio.timeout(20):
                while not any(each["type"] == "link" and each["why"] for each in seen):
                    seen.append(json.loads((await socket.receive()).data))

            await socket.send_str(json.dumps({"id": 1, "do": "take_lease", "arm": ARM}))
            while seen[-1]["type"] != "reply":
                seen.append(json.loads((await socket.receive()).data))

            assert seen[-1]["error"]["kind"] == "link"


def holds(shared: Any) -> bool:
    """Whether somebody has the lease of a bridge."""
    return shared.holder is not None


async def test_behind_a_bridge_its_lease_is_taken_and_given_back() -> None:
    async with (
        simulate(speed=FAST) as sim,
        bridge(sim.url, listen="tcp://127.0.0.1:0") as shared,
        panel({ARM: Member(shared.url, Magician)}, port=0) as running,
    ):
        rig = Shown(sim, running)
        async with page(rig) as one:
            assert not holds(shared)
            async with Magician.connect(shared.url) as other:
                await other.move_to(220, 0, 40)
                assert await one.refused("take_lease", arm=ARM) == "lease"
                await one.get("stop", arm=ARM)  # anybody may

            await until(lambda: shared.holder is None)
            await one.get("take_lease", arm=ARM)
            assert holds(shared)
            await one.get("move_to", arm=ARM, x=230.0, y=0.0, z=40.0)
            await one.get("release_lease", arm=ARM)
            await until(lambda: shared.holder is None)
            async with Magician.connect(shared.url) as other:
                await other.move_to(220, 0, 40)


async def test_a_program_shares_its_arm_with_pages() -> None:
    async with simulate(speed=FAST) as sim, Magician.connect(sim.url) as arm:
        async with panel(arm, port=0) as running, page(Shown(sim, running)) as one:
            await one.get("take_lease", arm=ARM)
            await arm.move_to(220, 0, 40)
            assert running.holder() == one.last("hello")["you"]
            waiting = asyncio.create_task(reserve(running, arm))
            await asyncio.sleep(0.1)
            assert not waiting.done()
            await one.get("release_lease", arm=ARM)
            await until(lambda: running.holder() == "the program")
            assert await one.refused("take_lease", arm=ARM, takeover=True) == "lease"
            await waiting
            await one.get("take_lease", arm=ARM)

            moving = asyncio.create_task(arm.move_to(220, 150, 40))
            await until(lambda: arm.queue.pending)
            await one.get("stop", arm=ARM)
            with pytest.raises(MotionStopped):
                await moving

        await arm.move_to(220, 0, 40)  # the panel has ended, and the arm is the program's


async def reserve(running: Any, arm: Magician) -> None:
    """Keep the arm for a moment."""
    async with running.reserved():
        await arm.move_to(230, 0, 40)
        await asyncio.sleep(0.5)


async def test_a_fleet_is_shown_with_its_zones_and_stopped_as_a_whole() -> None:
    async with simulate(speed=FAST) as left, simulate("mycobot280", speed=FAST) as right:
        members: dict[str, Member[Any]] = {
            "left": Member(left.url, Magician, guard="wait"),
            "right": Member(right.url, MyCobot, options={"model": "mycobot280"}),
        }
        async with (
            Fleet.connect(members, zones={"bin": Box(x=(150, 250), y=(100, 200))}) as fleet,
            panel(fleet, port=0) as running,
        ):
            rig = Shown(left, running)
            async with page(rig) as one:
                hello = one.last("hello")
                assert hello["zones"] == [
                    {"name": "bin", "kind": "box", "x": [150, 250], "y": [100, 200], "z": [None, None]}
                ]
                assert [each["name"] for each in hello["arms"]] == ["left", "right"]
                await one.get("take_lease", arm="left")
                await one.get("home", arm="left")
                async with fleet.zone("bin"):
                    number = await one.send("move_to", arm="left", x=200.0, y=150.0, z=40.0)
                    await asyncio.sleep(0.5)
                    assert not one.reply(number)  # it waits until nobody else is in it

                await until(lambda: one.reply(number))
                await one.get("stop")


async def test_a_scene_is_shown() -> None:
    scene = Scene(pieces=[Piece("red", (250, 0), color="red")], blocks=[Block("pallet", (180, 120), (60, 60, 20))])
    async with (
        simulate(scene=scene, speed=FAST) as sim,
        panel({ARM: Member(sim.url, Magician)}, port=0, scene=scene) as running,
        page(Shown(sim, running)) as one,
    ):
        await until(lambda: one.last("scene"))
        things = {each["name"]: each for each in one.last("scene")["things"]}
        assert things["red"]["at"] == [250.0, 0.0, -138.0]
        assert things["pallet"]["size"] == [60, 60, 20]
        scene.put("red", 200, 0)
        await until(lambda: one.last("scene")["things"][0]["at"][0] == 200)


KILLED = """
import asyncio, json, sys
import aiohttp

async def main(base, url):
    jar = aiohttp.CookieJar(unsafe=True)
    async with aiohttp.ClientSession(cookie_jar=jar) as http:
        await (await http.get(url)).read()
        async with http.ws_connect(base + "ws", headers={"Origin": base.rstrip("/")}) as socket:
            tick, started = 0, False
            await socket.send_str(json.dumps({"do": "take_lease", "arm": "arm"}))
            async for message in socket:
                found = json.loads(message.data)
                if found["type"] == "tick":
                    do = "beat" if started else "jog"
                    more = {} if started else {"direction": "y+"}
                    await socket.send_str(json.dumps({"do": do, "arm": "arm", "press": 1, "tick": found["n"], **more}))
                    started = True

asyncio.run(main(*sys.argv[1:]))
"""


async def test_the_arm_stands_when_the_program_of_the_page_is_killed() -> None:
    async with shown() as rig, page(rig, Role.VIEWER) as viewer:
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-c", KILLED, rig.panel.url, rig.panel.operator_url
        )
        try:
            await until(lambda: rig.sim.arm.pose.y > 5)
        finally:
            process.kill()
            await process.wait()

        await until(lambda: viewer.last("lease")["holder"] is None)
        await until(lambda: viewer.last("state")["moving"] is False)
        here = rig.sim.arm.pose
        await asyncio.sleep(0.5)
        assert rig.sim.arm.pose == here
        (jog,) = [each for each in rig.sim.arm.executed if each.command is c.SET_JOG_CMD and each.value.cmd]
        assert jog.outcome == "done"


async def test_a_page_that_answers_nothing_stops_its_arm_and_frees_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """As behind a network that takes everything and gives nothing: no end of the connection ever comes."""
    monkeypatch.setattr("dobot_async.panel.web.PINGS", 2.0)
    async with shown(speed=0.5) as rig, browser() as http:
        await (await http.get(rig.panel.operator_url)).read()
        async with http.ws_connect(f"{rig.panel.url}ws", headers=rig.origin, autoping=False) as socket:
            await socket.send_str(json.dumps({"do": "take_lease", "arm": ARM}))
            await until(rig.panel.holder)
            await socket.send_str(json.dumps({"do": "move_to", "arm": ARM, "x": 200.0, "y": 150.0, "z": 40.0}))
            await until(lambda: rig.sim.arm.pose.y > 1)
            await until(lambda: not rig.panel.holder())
            before = rig.sim.arm.pose
            await asyncio.sleep(0.3)
            assert before == rig.sim.arm.pose
            assert rig.panel.pages == 0


async def test_pages_that_come_and_go_on_a_bad_line_leave_nothing() -> None:
    found = await endure(60.0 if os.environ.get("PROMISES") == "all" else 1.0, every=2.0, rest=2.0)
    assert found.presses
    assert found.is_fine, str(found)


async def test_the_panel_ends_with_what_it_moves() -> None:
    async with simulate() as sim, browser() as http:
        async with panel({ARM: Member(sim.url, Magician)}, port=0) as running:
            await (await http.get(running.operator_url)).read()
            socket = await http.ws_connect(f"{running.url}ws", headers=Shown(sim, running).origin)
            await socket.send_str(json.dumps({"do": "take_lease", "arm": ARM}))
            while json.loads((await socket.receive()).data)["type"] != "tick":
                pass

            await socket.send_str(json.dumps({"do": "move_to", "arm": ARM, "x": 200.0, "y": 150.0, "z": 40.0}))
            await until(lambda: sim.arm.pose.y > 5)  # the page is still there when the block ends

        here = sim.arm.pose
        await asyncio.sleep(0.3)
        assert sim.arm.pose == here
