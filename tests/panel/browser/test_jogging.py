"""An arm moves while a hand holds, and not a moment for any other reason: what the simulated arm recorded decides."""

from __future__ import annotations

import asyncio

import pytest
from panel_stage import DESKTOP, PHONE, Stage, distance, until
from playwright.async_api import expect

pytest_plugins = ["panel_browser"]

DEAF = """
for (const type of ["pointerup", "pointercancel", "lostpointercapture"])
    window.addEventListener(type, event => event.stopImmediatePropagation(), true);
"""


async def test_it_moves_while_a_button_is_held_and_stands_when_it_is_let_go(magician: Stage) -> None:
    phone = await magician.open(PHONE, solid=True)
    await phone.take_control()
    await magician.hold(phone, "Jog y+")
    await phone.picture("phone-jogging")
    await phone.page.mouse.up()
    await magician.stands()
    assert magician.where()[1] > 0.3
    phone.check()


@pytest.mark.full
async def test_a_tab_that_is_closed_while_holding_stops_it(magician: Stage) -> None:
    phone = await magician.open(PHONE)
    await phone.take_control()
    await magician.hold(phone, "Jog y+")
    await phone.page.close()
    await magician.stands()
    assert magician.panel.holder() is None


@pytest.mark.full
async def test_a_page_that_crashes_while_holding_stops_it(magician: Stage) -> None:
    phone = await magician.open(PHONE)
    await phone.take_control()
    await magician.hold(phone, "Jog y+")
    session = await phone.context.new_cdp_session(phone.page)
    crash = asyncio.create_task(session.send("Page.crash"))  # there is nobody left to answer
    await magician.stands()
    await until(lambda: magician.panel.holder() is None, "the lease of a crashed page does not end")
    await phone.context.close()
    await asyncio.wait([crash])
    crash.exception()


@pytest.mark.full
async def test_a_page_that_hangs_while_holding_stops_it(magician: Stage) -> None:
    """No event of the page can end it, and its socket stays open: only that its beats do not come."""
    phone = await magician.open(PHONE)
    await phone.take_control()
    await magician.hold(phone, "Jog y+")
    await phone.page.evaluate("setTimeout(() => { const end = Date.now() + 4000; while (Date.now() < end); }, 0)")
    await magician.stands()
    assert magician.panel.holder()


@pytest.mark.full
async def test_a_network_that_is_cut_while_holding_stops_it(magician: Stage) -> None:
    phone = await magician.open(PHONE)
    await phone.take_control()
    await magician.hold(phone, "Jog y+")
    magician.cut.cut = True
    await magician.stands()
    stood = magician.where()
    await expect(phone.page.get_by_text("Connection lost")).to_be_visible(timeout=20_000)
    await expect(phone.page.get_by_text("These were the last readings")).to_be_visible()
    await phone.picture("phone-connection-lost")
    await phone.page.mouse.up()
    magician.cut.cut = False
    await expect(phone.page.get_by_role("button", name="Take control")).to_be_enabled(timeout=20_000)
    assert magician.where() == stood


@pytest.mark.full
async def test_a_release_that_is_never_heard_does_not_keep_it_going(magician: Stage) -> None:
    """The finger is lifted where the page cannot see it: it does not capture the pointer any more, so no beats."""
    phone = await magician.open(PHONE)
    await phone.take_control()
    await phone.page.evaluate(DEAF)
    await magician.hold(phone, "Jog y+")
    await phone.page.mouse.up()
    await expect(phone.page.get_by_text("lost sight of the button")).to_be_visible()
    await magician.stands()


@pytest.mark.full
async def test_a_window_that_loses_the_focus_while_holding_stops_it(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP)
    await desktop.take_control()
    await magician.hold(desktop, "Jog y+")
    await desktop.page.evaluate("window.dispatchEvent(new Event('blur'))")
    await magician.stands()


@pytest.mark.full
async def test_a_key_that_is_held_moves_it(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP)
    await desktop.take_control()
    await desktop.page.get_by_role("button", name="Jog z+", exact=True).focus()
    before = magician.where()
    await desktop.page.keyboard.down("Space")
    await magician.moves()
    await desktop.page.keyboard.up("Space")
    await magician.stands()
    assert magician.where()[2] > before[2] + 0.3
    desktop.check()


@pytest.mark.full
async def test_a_key_that_stays_down_without_repeating_is_not_believed(magician: Stage) -> None:
    """A key that got stuck, or whose release went to another window."""
    desktop = await magician.open(DESKTOP)
    await desktop.take_control()
    await desktop.page.get_by_role("button", name="Jog y+", exact=True).focus()
    await desktop.page.keyboard.down("Space")
    await magician.moves()
    await magician.stands()
    await desktop.page.keyboard.up("Space")


@pytest.mark.full
async def test_the_stop_is_in_reach_and_ends_what_is_held(magician: Stage) -> None:
    phone = await magician.open(PHONE)
    await phone.take_control()
    for tab in ("Jog", "Go to", "Tools", "Teach", "Draw", "Status"):
        await phone.tab(tab)
        await expect(phone.page.locator("#stop")).to_be_in_viewport(ratio=1.0)

    await phone.tab("Jog")
    await magician.hold(phone, "Jog y+")
    await phone.page.keyboard.press("Escape")
    await expect(phone.page.get_by_text("Stopped", exact=True)).to_be_visible()
    await magician.stands()
    stood = magician.where()
    await phone.page.mouse.up()
    assert distance(magician.where(), stood) < 0.01


@pytest.mark.full
async def test_a_step_is_one_step(magician: Stage) -> None:
    phone = await magician.open(PHONE)
    await phone.take_control()
    before = magician.where()
    await phone.page.get_by_role("radio", name="10", exact=True).check(force=True)
    await phone.page.get_by_role("button", name="Move z+ by 10 mm").click()
    await until(lambda: magician.where()[2] > before[2] + 9.0, "the step is not made")
    await magician.stands()
    assert abs(magician.where()[2] - before[2] - 10.0) < 0.1


@pytest.mark.full
async def test_joints_are_jogged_too(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP)
    await desktop.take_control()
    await desktop.page.get_by_role("radio", name="Joints", exact=True).first.check(force=True)
    await magician.hold(desktop, "Jog j1+")
    assert magician.sim.arm.pose.j1 > 0
    await desktop.page.mouse.up()
    await magician.stands()
