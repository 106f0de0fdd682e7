"""Belts carry pieces, and sensors see them, at the right time whatever else happens."""

from __future__ import annotations

import asyncio

import pytest
from virtual import virtual

from dobot_async import ColorPort, InfraredPort, IOFunction, Magician, MyCobot
from dobot_async.arms.magician import commands as c
from dobot_async.arms.mycobot import commands as cobot
from dobot_async.simulator import simulate
from dobot_async.simulator.scene import Belt, Block, ColorSpot, LightBeam, Mount, Piece, Scene

BELT = Belt("belt", (200, 150), (300, 60, 40), mm_per_pulse=0.01)
"""From x 50 to 350 at y 150; 5000 pulses/s are 50 mm/s."""
EYE = LightBeam((250, 200, -90), (250, 100, -90), port=InfraredPort.GP2)
RED = Piece("red", (100, 150), (20, 20, 20), color="red")


async def until(arm: Magician, *, seen: bool) -> None:
    """Asks a beam every 10 ms until it sees something, or nothing any more."""
    for _ in range(1000):
        if await arm.get_infrared(InfraredPort.GP2) == seen:
            return

        await asyncio.sleep(0.01)

    raise AssertionError("the beam never changed")


@virtual
async def test_a_belt_carries_what_stands_on_it() -> None:
    scene = Scene(pieces=[RED, Piece("beside", (100, 0))], belts=[BELT])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.conveyor(5000, distance=6000)
        assert scene.pieces["red"].position == pytest.approx((160, 150, -98), abs=0.02)
        await arm.conveyor(-5000, distance=2000)

    assert scene.pieces["red"].position == pytest.approx((140, 150, -98), abs=0.02)
    assert scene.pieces["red"].on == "belt"
    assert scene.pieces["beside"].position == pytest.approx((100, 0, -138))


@virtual
async def test_what_a_belt_carries_beyond_its_end_falls() -> None:
    scene = Scene(pieces=[RED], belts=[BELT], blocks=[Block("crate", (380, 150), (60, 60, 5))])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.conveyor(5000)
        await asyncio.sleep(10)
        await arm.conveyor(0)

    assert scene.pieces["red"].on == "crate"
    assert scene.pieces["red"].position == pytest.approx((351, 150, -133), abs=1)
    (event,) = scene.events
    assert (event.kind, event.what, event.arm) == ("off the belt", "red", "")


@virtual
async def test_a_light_beam_sees_a_piece_pass() -> None:
    scene = Scene(pieces=[RED], belts=[BELT], sensors=[EYE])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        assert not await arm.get_infrared(InfraredPort.GP2)
        await arm.set_infrared_sensor(InfraredPort.GP2)
        assert not await arm.get_infrared(InfraredPort.GP2)
        await arm.conveyor(5000)
        await until(arm, seen=True)

        assert scene.pieces["red"].position[0] == pytest.approx(240, abs=2)
        assert not await arm.get_infrared(InfraredPort.GP4)
        await until(arm, seen=False)

        assert scene.pieces["red"].position[0] == pytest.approx(260, abs=2)


@pytest.mark.cases(1)
@pytest.mark.parametrize("pause", [0.001, 0.02, 1.7])
@virtual
async def test_the_arm_itself_waits_for_a_beam_at_a_pin(pause: float) -> None:
    """It ends its wait when the piece is there, however seldom anybody asks."""
    beam = LightBeam(EYE.at, EYE.to, pin=4)
    scene = Scene(pieces=[RED], belts=[BELT], sensors=[beam])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.configure_io(4, IOFunction.DI)
        async with arm.queue.batch() as batch:
            batch.conveyor(5000)
            batch.wait_for_input(4)
            last = batch.conveyor(0)

        for _ in range(round(5 / pause)):
            await asyncio.sleep(pause)
            assert sim.arm.alarms

        await last
        assert scene.pieces["red"].position[0] == pytest.approx(240, abs=0.6)


@pytest.mark.parametrize(("color", "flags"), [("red", (1, 0, 0)), ("blue", (0, 0, 1)), ("wood", (0, 0, 0))])
@virtual
async def test_a_colour_sensor_sees_the_nearest_piece(color: str, flags: tuple[int, int, int]) -> None:
    spot = ColorSpot((250, 0, -125), (350, 0, -125), port=ColorPort.GP4)
    scene = Scene(pieces=[Piece("far", (330, 0), color="green"), Piece("near", (290, 0), color=color)], sensors=[spot])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        seen = []
        for port in (None, ColorPort.GP2, ColorPort.GP4):
            if port is not None:
                await arm.set_color_sensor(port)

            await asyncio.sleep(0.5)
            seen.append(await arm.get_color())

        assert seen == [c.Color(0, 0, 0), c.Color(0, 0, 0), c.Color(*flags)]


@virtual
async def test_a_socket_without_a_colour_sensor_tells_nothing_of_another_one() -> None:
    spot = ColorSpot((250, 0, -125), (350, 0, -125), port=ColorPort.GP4)
    scene = Scene(pieces=[Piece("red", (290, 0), color="red")], sensors=[spot])
    async with simulate(scene=scene, homed=True) as sim, Magician.connect(sim.url) as arm:
        for port, seen in ((ColorPort.GP4, "red"), (ColorPort.GP2, ""), (ColorPort.GP4, "red")):
            await arm.set_color_sensor(port)
            await asyncio.sleep(0.5)
            assert (await arm.get_color()).name == seen


@pytest.mark.parametrize("plugged", c.AccessoryVersion)
@pytest.mark.parametrize("switched", c.AccessoryVersion)
@virtual
async def test_a_sensor_of_the_other_version_sees_nothing(
    plugged: c.AccessoryVersion, switched: c.AccessoryVersion
) -> None:
    beam = LightBeam((250, 0, -125), (350, 0, -125), port=InfraredPort.GP4, version=plugged)
    spot = ColorSpot(beam.at, beam.to, version=plugged)
    scene = Scene(pieces=[Piece("red", (290, 0), color="red")], sensors=[beam, spot])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.set_infrared_sensor(InfraredPort.GP4, version=switched)
        await arm.set_color_sensor(ColorPort.GP2, version=switched)
        await asyncio.sleep(0.5)
        fits = plugged is switched
        assert await arm.get_infrared(InfraredPort.GP4) == fits
        assert (await arm.get_color()).r == fits


@virtual
async def test_a_piece_that_the_arm_holds_is_seen() -> None:
    spot = ColorSpot((200, 100, -138), (200, 100, -100), port=ColorPort.GP2)
    scene = Scene(pieces=[Piece("red", (250, 0), color="red")], sensors=[spot])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.set_color_sensor(ColorPort.GP2)
        await arm.move_to(250, 0, 20)
        await arm.move_to(250, 0, -53.5)
        await arm.suction(True)
        await arm.wait(0.3)
        await arm.move_to(250, 0, 20)
        assert not (await arm.get_color()).r
        await arm.move_to(200, 100, 20)
        await arm.move_to(200, 100, -45)
        assert (await arm.get_color()).r


@virtual
async def test_a_hand_puts_pieces_into_the_beam_and_takes_them_away() -> None:
    scene = Scene(pieces=[RED], belts=[BELT], sensors=[EYE])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.set_infrared_sensor(InfraredPort.GP2)
        scene.put("red", 250, 150)
        await asyncio.sleep(0.5)
        assert await arm.get_infrared(InfraredPort.GP2)
        scene.remove("red")
        await asyncio.sleep(0.5)
        assert not await arm.get_infrared(InfraredPort.GP2)
        scene.add(Piece("blue", (250, 150)))
        await asyncio.sleep(0.5)
        assert await arm.get_infrared(InfraredPort.GP2)


async def test_a_belt_that_stops_between_two_looks_has_brought_the_piece_into_the_beam() -> None:
    """It runs for 5 ms, at 100 mm/s, and the piece is 0.3 mm from the beam."""
    now = 0.0
    scene = Scene(pieces=[Piece("red", (239.7, 150), (20, 20, 20))], belts=[BELT], sensors=[EYE])
    async with simulate(scene=scene, clock=lambda: now) as sim:
        now = 1.0
        assert scene.time == 1.0
        sim.arm.perform(c.SET_E_MOTOR, c.EMotor(0, is_enabled=True, speed=10_000))
        now = 1.005
        sim.arm.perform(c.SET_E_MOTOR, c.EMotor(0, is_enabled=False, speed=0))
        assert not sim.arm.infrared[InfraredPort.GP2]
        now = 2.0
        assert scene.pieces["red"].position[0] == pytest.approx(240.2)
        assert sim.arm.infrared[InfraredPort.GP2]


@virtual
async def test_the_belt_and_the_sensors_are_those_of_the_arm_that_they_are_plugged_into() -> None:
    eye = LightBeam(EYE.at, EYE.to, port=InfraredPort.GP2, arm="right")
    belt = Belt("belt", (200, 150), (300, 60, 40), mm_per_pulse=0.01, motor=1, arm="left")
    scene = Scene(pieces=[RED], belts=[belt], sensors=[eye])
    async with (
        simulate(scene=scene, mount=Mount(name="left")) as one,
        simulate(scene=scene, mount=Mount(name="right", x=400, y=300)) as other,
        Magician.connect(one.url) as left,
        Magician.connect(other.url) as right,
    ):
        await right.conveyor(5000, distance=14000, motor=1)
        await left.conveyor(5000, distance=14000, motor=0)
        assert scene.pieces["red"].position[0] == pytest.approx(100)
        await left.conveyor(5000, distance=14000, motor=1)
        assert scene.pieces["red"].position[0] == pytest.approx(240, abs=0.02)
        for arm in (left, right):
            await arm.set_infrared_sensor(InfraredPort.GP2)

        await left.conveyor(5000, distance=1000, motor=1)
        assert [await arm.get_infrared(InfraredPort.GP2) for arm in (left, right)] == [False, True]


@virtual
async def test_a_mycobot_has_a_beam_at_a_pin_of_its_atom() -> None:
    beam = LightBeam((250, 0, -130), (350, 0, -130), pin=19)
    scene = Scene(sensors=[beam])
    async with simulate("mycobot280", scene=scene) as sim, MyCobot.connect(sim.url, model="mycobot280") as arm:
        assert not (await arm.request(cobot.GET_DIGITAL_INPUT, 19)).level
        scene.add(RED)
        scene.put("red", 300, 0)
        await asyncio.sleep(0.5)
        assert (await arm.request(cobot.GET_DIGITAL_INPUT, 19)).level


@pytest.mark.parametrize(
    ("model", "what", "words"),
    [
        ("mycobot280", {"belts": [BELT]}, "plug it into a Magician"),
        ("ultraarm", {"belts": [BELT]}, "plug it into a Magician"),
        ("ultraarm", {"sensors": [EYE]}, "no input"),
        ("mycobot280", {"sensors": [EYE]}, "give pin="),
        ("mycobot280", {"sensors": [ColorSpot((0, 0, 0), (0, 0, 1))]}, "no colour sensor"),
    ],
)
async def test_what_does_not_fit_into_an_arm_is_refused(model: str, what: dict[str, list[object]], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        async with simulate(model, scene=Scene(**what)):  # type: ignore[arg-type]
            pass


def test_a_beam_is_plugged_in_once() -> None:
    with pytest.raises(ValueError, match="one of port= and pin="):
        LightBeam((0, 0, 0), (1, 0, 0))

    with pytest.raises(ValueError, match="mm_per_pulse of belt"):
        Belt("belt", (0, 0), (1, 1, 1), mm_per_pulse=0)

    with pytest.raises(ValueError, match="motor of belt is 0 or 1"):
        Belt("belt", (0, 0), (1, 1, 1), motor=2)
