"""Who may do what: two operators, a viewer, a stranger's page; and what becomes of a page that comes back."""

from __future__ import annotations

import pytest
from panel_stage import DESKTOP, PHONE, Stage, until
from playwright.async_api import expect

from dobot_async.arms.magician import commands as c

pytest_plugins = ["panel_browser"]

pytestmark = pytest.mark.full

EVIL = "<!doctype html><title>another page</title>"
TRIES = """() => new Promise(resolve => {
    const socket = new WebSocket(`ws://${location.host}/ws`), answers = [];
    const values = { x: 200, direction: "y+", press: 1, tick: 1, on: true };
    const tries = ["take_lease", "home", "move_to", "jog", "teach_take", "suction"];
    socket.onmessage = ({ data }) => {
        const message = JSON.parse(data);
        if (message.type === "hello") {
            const arm = message.arms[0].name;
            tries.forEach((what, id) => socket.send(JSON.stringify({ id, do: what, arm, ...values })));
        }
        if (message.type === "reply") answers.push([message.ok, message.error?.kind]);
        if (answers.length === tries.length) resolve(answers);
    };
})"""
ATTACK = """async address => {
    const socket = await new Promise(resolve => {
        const made = new WebSocket(`ws://${address}/ws`);
        made.onmessage = () => resolve("let in");
        made.onclose = () => resolve("refused");
    });
    const ask = (path, options) => fetch(`http://${address}${path}`, { credentials: "include", ...options })
        .then(answer => answer.status, () => "blocked");
    return [socket, await ask("/files?arm=arm&name=a.svg", { method: "POST", body: "<svg/>" }), await ask("/")];
}"""


async def test_a_second_operator_takes_over_in_sight_of_the_first(magician: Stage) -> None:
    first, second = await magician.open(PHONE), await magician.open(DESKTOP)
    await first.take_control()
    await expect(second.page.get_by_text("controls this arm", exact=False).first).to_be_visible()
    await expect(second.page.get_by_role("button", name="Jog y+", exact=True)).to_be_disabled()
    await magician.hold(first, "Jog y+")
    await second.page.get_by_role("button", name="Take control").click()
    await expect(second.page.get_by_role("dialog")).to_contain_text("If you take over, the arm stops")
    await second.picture("desktop-take-over")
    await expect(second.page.locator("#stop")).to_be_enabled()
    await second.page.get_by_role("button", name="Take over").click()
    await expect(first.page.get_by_text("has taken control of this arm")).to_be_visible()
    await first.picture("phone-taken-over")
    await magician.stands()
    await expect(first.page.get_by_role("button", name="Jog y+", exact=True)).to_be_disabled()
    await expect(second.page.get_by_role("button", name="Jog y+", exact=True)).to_be_enabled()
    await first.page.mouse.up()
    await magician.hold(second, "Jog y\u2212")
    await second.page.mouse.up()
    await magician.stands()


async def test_a_take_over_that_is_not_confirmed_does_nothing(magician: Stage) -> None:
    first, second = await magician.open(PHONE), await magician.open(DESKTOP)
    await first.take_control()
    holder = magician.panel.holder()
    await second.page.get_by_role("button", name="Take control").click()
    await second.page.get_by_role("button", name="Cancel").click()
    await expect(second.page.get_by_role("dialog")).to_have_count(0)
    assert magician.panel.holder() == holder


async def test_the_stop_can_be_pressed_while_a_dialog_is_open(magician: Stage) -> None:
    first, second = await magician.open(PHONE), await magician.open(PHONE)
    await first.take_control()
    await magician.hold(first, "Jog y+")
    await second.page.get_by_role("button", name="Take control").click()
    await expect(second.page.get_by_role("dialog")).to_be_visible()
    await second.page.locator("#stop").tap()
    await expect(second.page.get_by_text("Stopped", exact=True)).to_be_visible()
    await magician.stands()


async def test_a_viewer_sees_all_moves_nothing_and_stops(magician: Stage) -> None:
    operator, viewer = await magician.open(DESKTOP), await magician.open(PHONE, viewer=True)
    await expect(viewer.page.get_by_text("You are watching")).to_be_visible()
    await expect(viewer.page.get_by_role("button", name="Take control")).to_have_count(0)
    await viewer.picture("phone-viewer")
    for tab in ("Jog", "Go to", "Tools", "Teach", "Draw"):
        await viewer.tab(tab)
        enabled = "[...document.querySelectorAll('.group.shown :is(button, input, select):not(:disabled)')].length"
        assert await viewer.page.evaluate(enabled) == 0, tab

    await operator.take_control()
    await magician.hold(operator, "Jog y+")
    await viewer.page.locator("#stop").tap()
    await expect(operator.page.get_by_text("You no longer control this arm")).to_be_visible()
    await magician.stands()


async def test_a_viewer_that_makes_the_page_try_moves_nothing(magician: Stage) -> None:
    viewer = await magician.open(PHONE, viewer=True)
    before = len(magician.sim.arm.executed)
    answers = await viewer.page.evaluate(TRIES)
    assert answers == [[False, "role"]] * 6
    assert len(magician.sim.arm.executed) == before
    assert magician.panel.holder() is None


async def test_a_page_of_another_origin_gets_nowhere(magician: Stage) -> None:
    """Another site, in the browser of an operator who is signed in here."""
    operator = await magician.open(PHONE)
    strange = await operator.context.new_page()
    await strange.route("http://evil.example/**", lambda route: route.fulfill(body=EVIL, content_type="text/html"))
    await strange.goto("http://evil.example/")
    address = f"127.0.0.1:{magician.cut.port}"
    outcome = await strange.evaluate(ATTACK, address)
    assert outcome[0] == "refused"
    assert outcome[1] in {"blocked", 403}
    assert outcome[2] in {"blocked", 403}


async def test_a_browser_without_the_token_is_told_how_to_come_in(magician: Stage) -> None:
    context = await magician.browser.new_context(**PHONE)
    page = await context.new_page()
    answer = await page.goto(f"http://127.0.0.1:{magician.cut.port}/")
    assert answer
    assert answer.status == 401
    assert "token" in await page.inner_text("body")
    await context.close()


async def test_a_reload_in_the_middle_of_a_motion_stops_it_and_the_page_works(magician: Stage) -> None:
    phone = await magician.open(PHONE)
    await phone.take_control()
    await phone.tab("Tools")
    await magician.arm.set_speed(5)
    await phone.tab("Go to")
    for axis, value in {"x": "180", "y": "120", "z": "60"}.items():
        await phone.page.locator(f"[data-axis={axis}]").fill(value)

    await expect(phone.page.get_by_text("Within reach")).to_be_visible()
    await phone.page.get_by_role("button", name="Move", exact=True).click()
    await magician.moves()
    await phone.page.reload()
    await magician.stands()
    assert [each.outcome for each in magician.sim.arm.executed if each.command is c.SET_PTP_CMD][-1:] == ["aborted"]
    await until(lambda: magician.panel.holder() is None, "a page that was reloaded keeps the lease")
    await expect(phone.page.locator("#panel-go")).to_be_visible()
    await phone.take_control()
    await phone.tab("Jog")
    await magician.hold(phone, "Jog y+")
    await phone.page.mouse.up()
    await magician.stands()
    phone.check()
