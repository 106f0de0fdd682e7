"""What a person does with an arm: move it to a place, recover it, teach it, let it draw, lead it."""

from __future__ import annotations

import json
from contextlib import suppress

import pytest
from panel_stage import DESKTOP, PHONE, Stage, distance, until
from playwright.async_api import expect

from dobot_async.arms.magician import commands as c

pytest_plugins = ["panel_browser"]

pytestmark = pytest.mark.full

LOGO = b"""<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">
<path d="M5 5 H35 V35 H5 Z M12 20 L20 28 L30 12" fill="none" stroke="black"/></svg>"""
GAMEPAD = """
const pad = { id: "A gamepad", index: 0, connected: true, mapping: "standard", timestamp: 0, axes: [0, 0, 0, 0],
    buttons: Array.from({ length: 17 }, () => ({ pressed: false, value: 0 })) };
window.pad = pad;
navigator.getGamepads = () => [pad];
window.plug = () => window.dispatchEvent(new Event("gamepadconnected"));
"""


async def test_typed_coordinates_are_checked_and_reached(magician: Stage) -> None:
    phone = await magician.open(PHONE)
    await phone.take_control()
    await phone.tab("Go to")
    x = phone.page.locator("[data-axis=x]")
    move = phone.page.get_by_role("button", name="Move", exact=True)
    await x.fill("900")
    await expect(phone.page.locator('.go .verdict[data-state="bad"]')).to_be_visible()
    await expect(move).to_be_disabled()
    await phone.picture("phone-out-of-reach")
    await x.fill("210")
    await expect(phone.page.get_by_text("Within reach")).to_be_visible()
    await move.click()
    await until(lambda: abs(magician.where()[0] - 210) < 0.1, "the arm does not get there")
    await magician.stands()
    assert not [each for each in magician.sim.arm.executed if each.outcome != "done"]


async def test_an_alarm_is_told_in_words_and_recovered_from(magician: Stage) -> None:
    phone = await magician.open(PHONE)
    await phone.take_control()
    magician.sim.arm.raise_alarm(0x40)
    recover = phone.page.get_by_role("button", name="Recover")
    await expect(recover).to_be_visible()
    await expect(phone.page.get_by_text("What to do")).to_be_visible()
    await phone.picture("phone-alarm")
    await recover.click()
    await until(lambda: not magician.sim.arm.alarms, "the alarm stays")
    await expect(recover).to_have_count(0)
    await magician.hold(phone, "Jog y+")
    await phone.page.mouse.up()
    await magician.stands()


async def test_three_points_are_taught_put_in_order_and_played(magician: Stage) -> None:
    phone = await magician.open(PHONE, solid=True)
    await phone.take_control()
    taught = [(200.0, -60.0, 60.0), (230.0, 0.0, 40.0), (200.0, 60.0, 60.0)]
    for count, place in enumerate(taught, 1):
        await magician.arm.move_to(*place)
        await phone.tab("Teach")
        await phone.page.get_by_role("button", name="Take this point").click()
        await expect(phone.page.locator(".steps li")).to_have_count(count)

    await phone.page.get_by_role("button", name="Move up: Point 3").click()
    await expect(phone.page.locator(".steps li").nth(1)).to_contain_text("y 60.0")
    await phone.page.get_by_role("button", name="Edit: Point 1").click()
    await phone.page.get_by_label("Name").fill("the first")
    await phone.page.get_by_label("Stay").fill("0.1")
    await phone.picture("phone-edit-point")
    await phone.page.get_by_role("button", name="Save", exact=True).click()
    await expect(phone.page.locator(".steps li").first).to_contain_text("the first")
    await phone.page.locator(".teach").scroll_into_view_if_needed()
    await phone.picture("phone-taught")

    before = len(magician.sim.arm.executed)
    await phone.page.locator(".teach").get_by_label("Speed").fill("100")
    await phone.page.get_by_role("button", name="Play").click()
    wanted = [taught[0], taught[2], taught[1]]

    def reached() -> list[tuple[float, float, float]]:
        done = magician.sim.arm.executed[before:]
        return [(each.value.x, each.value.y, each.value.z) for each in done if each.command is c.SET_PTP_CMD]

    await until(lambda: len(reached()) >= 3, "it is not played")
    assert all(distance(one, other) < 0.5 for one, other in zip(reached(), wanted, strict=True))
    phone.check()


async def test_a_recording_is_saved_and_loaded(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP)
    await desktop.take_control()
    await desktop.page.get_by_role("button", name="Take this point").click()
    await expect(desktop.page.locator(".steps li")).to_contain_text("Point 1")
    async with desktop.page.expect_download() as downloading:
        await desktop.page.get_by_role("link", name="Save as .json").click()

    kept = await (await downloading.value).path()
    recording = json.loads(kept.read_text())
    assert len(recording["steps"]) == 1
    await desktop.page.get_by_role("button", name="Remove: Point 1").click()
    await expect(desktop.page.get_by_text("No points yet")).to_be_visible()
    await desktop.page.set_input_files(
        ".teach input[type=file]", {"name": "kept.json", "mimeType": "application/json", "buffer": kept.read_bytes()}
    )
    await expect(desktop.page.locator(".steps li")).to_contain_text("Point 1")
    await desktop.page.set_input_files(
        ".teach input[type=file]", {"name": "bad.json", "mimeType": "application/json", "buffer": b"no recording"}
    )
    await expect(desktop.page.locator(".toast.error")).to_be_visible()
    await expect(desktop.page.locator(".steps li")).to_contain_text("Point 1")


async def test_a_drawing_is_placed_by_dragging_and_drawn(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP, solid=True)
    await desktop.take_control()
    await magician.arm.move_to(230, 0, 0)
    await desktop.page.set_input_files("#draw-file", {"name": "logo.svg", "mimeType": "image/svg+xml", "buffer": LOGO})
    width, x, y = (desktop.page.get_by_label(name, exact=True).last for name in ("Width", "x", "y"))
    await width.fill("40")
    await x.fill("200")
    await y.fill("-20")
    await desktop.page.get_by_label("Height of the surface").fill("0")
    await desktop.page.get_by_label("Lift between strokes").fill("5")
    start = desktop.page.get_by_role("button", name="Draw", exact=True).last
    await expect(start).to_be_enabled(timeout=20_000)
    await expect(desktop.page.locator(".draw .hint")).to_contain_text("stroke")

    plan = desktop.page.locator("canvas.plan")
    await plan.scroll_into_view_if_needed()
    await plan.focus()
    await desktop.page.keyboard.press("Shift+ArrowUp")
    await expect(x).to_have_value("210")
    box = await plan.bounding_box()
    assert box
    await desktop.page.mouse.move(box["x"] + 40, box["y"] + 40)
    await desktop.page.mouse.down()
    await desktop.page.mouse.move(box["x"] + 50, box["y"] + 40, steps=3)
    await desktop.page.mouse.up()
    assert float(await y.input_value()) < -20.0
    await expect(start).to_be_enabled(timeout=20_000)
    await expect(desktop.page.get_by_text("All of it is within reach")).to_be_visible()
    await desktop.picture("desktop-drawing-placed")

    corner = float(await x.input_value()), float(await y.input_value())
    await desktop.page.locator(".draw").get_by_label("Speed").fill("100")
    await start.click()

    def drawn() -> list[tuple[float, float]]:
        return [
            (each.value.x, each.value.y)
            for each in magician.sim.arm.executed
            if each.command is c.SET_CP_CMD and each.value.z < 1.0
        ]

    await until(drawn, "nothing is drawn")
    await desktop.picture("desktop-drawing")
    await expect(start).to_have_text("Draw", timeout=60_000)
    xs, ys = zip(*drawn(), strict=True)
    # 5 of 40 mm of the file are margin, and the file is scaled to 40 mm by what is drawn in it
    assert abs(min(xs) - corner[0]) < 1.0
    assert abs(max(xs) - corner[0] - 40) < 1.0
    assert abs(min(ys) - corner[1]) < 1.0
    assert abs(max(ys) - corner[1] - 40) < 1.0


async def test_a_file_that_is_no_drawing_is_a_message(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP)
    await desktop.take_control()
    await desktop.page.set_input_files(
        "#draw-file", {"name": "bad.svg", "mimeType": "image/svg+xml", "buffer": b"<svg"}
    )
    await expect(desktop.page.locator(".toast.error")).to_contain_text("bad.svg")


async def test_the_arm_follows_a_finger_while_it_is_down(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP)
    await desktop.take_control()
    before = magician.where()
    pad = desktop.page.get_by_role("button", name="x, y: drag here to lead the tool")
    await pad.scroll_into_view_if_needed()
    box = await pad.bounding_box()
    assert box
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    await magician.lead(desktop, middle, (middle[0] - 60, middle[1]))
    assert magician.where()[1] > before[1] + 1
    await desktop.picture("desktop-following")
    await desktop.page.mouse.up()
    await magician.stands()


async def test_the_tool_is_dragged_in_the_picture(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP)
    await desktop.page.wait_for_selector('.view[data-kind="2d"]')  # where a place is a place of the picture
    await desktop.take_control()
    await desktop.page.get_by_label("Drag the tool in the picture").check()
    await magician.arm.move_to(200, 0, 50)
    before = magician.where()
    await desktop.page.locator("canvas.picture").scroll_into_view_if_needed()
    grip = await desktop.page.evaluate(
        """async () => {
            const canvas = document.querySelector("canvas.picture"), pen = canvas.getContext("2d");
            await new Promise(requestAnimationFrame);
            const { data, width, height } = pen.getImageData(0, 0, canvas.width, canvas.height);
            const wanted = getComputedStyle(document.documentElement).getPropertyValue("--view-target").trim();
            const [r, g, b] = [1, 3, 5].map(at => parseInt(wanted.slice(at, at + 2), 16));
            const wide = canvas.clientWidth > 1.2 * canvas.clientHeight;
            const half = wide ? [0.58 * width, height] : [width, 0.58 * height];
            let [x, y, count] = [0, 0, 0];
            for (let row = 0; row < half[1]; row++) for (let column = 0; column < half[0]; column++) {
                const at = 4 * (row * width + column);
                if (data[at] === r && data[at + 1] === g && data[at + 2] === b) { x += column; y += row; count++; }
            }
            const box = canvas.getBoundingClientRect();
            return [box.x + x / count * canvas.clientWidth / width, box.y + y / count * canvas.clientHeight / height];
        }"""
    )
    await magician.lead(desktop, (grip[0], grip[1]), (grip[0], grip[1] - 30))
    assert magician.where()[1] > before[1] + 1
    await desktop.page.mouse.up()
    await magician.stands()


async def test_a_gamepad_leads_while_its_button_is_held(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP, script=GAMEPAD)
    await desktop.take_control()
    before = magician.where()
    await desktop.page.evaluate("plug(); pad.axes[0] = -1")
    await expect(desktop.page.get_by_text("A gamepad", exact=False)).to_be_visible()
    assert magician.where() == before
    for _ in range(6):  # on a busy machine targets come late, and the arm is right to stop
        await desktop.page.evaluate("pad.buttons[5].pressed = true")
        with suppress(AssertionError):
            await until(lambda: magician.where()[1] > before[1] + 2, "the arm does not follow the gamepad", 5.0)
            break

        await desktop.page.evaluate("pad.buttons[5].pressed = false")

    assert magician.where()[1] > before[1] + 2
    await desktop.page.evaluate("pad.buttons[5].pressed = false")
    await magician.stands()
    await desktop.page.evaluate("pad.axes[0] = 0; pad.buttons[5].pressed = true")
    await expect(desktop.page.get_by_text("Following", exact=True)).to_be_visible(timeout=20_000)
    await desktop.page.evaluate("pad.axes[0] = 1; pad.buttons[1].pressed = true")
    await expect(desktop.page.get_by_text("Stopped", exact=True)).to_be_visible()
    await magician.stands()


async def test_suction_and_a_laser_that_one_tap_does_not_switch_on(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP)
    await desktop.take_control()
    suction = desktop.page.get_by_role("switch", name="Suction")
    await suction.click()
    await expect(suction).to_have_attribute("aria-checked", "true")
    await until(lambda: magician.sim.arm.suction, "the pump is not on")
    laser, arming = (
        desktop.page.get_by_role("switch", name="Laser on"),
        desktop.page.get_by_role("button", name="Hold to arm"),
    )
    await expect(laser).to_be_disabled()
    await arming.click()
    await expect(laser).to_be_disabled()
    await arming.scroll_into_view_if_needed()
    box = await arming.bounding_box()
    assert box
    await desktop.page.mouse.move(box["x"] + 20, box["y"] + 20)
    await desktop.page.mouse.down()
    await expect(desktop.page.get_by_text("Armed for")).to_be_visible(timeout=20_000)
    await desktop.page.mouse.up()
    await laser.click()
    await expect(laser).to_have_attribute("aria-checked", "true")
    await until(lambda: magician.sim.arm.laser, "the laser is not on")
    await desktop.page.locator("#stop").click()
    await until(lambda: not magician.sim.arm.laser, "the laser stays on")
