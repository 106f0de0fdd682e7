"""The page itself: it loads whole and from nobody else, is small, is seen, reads well, and fits a phone."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from panel_stage import DESKTOP, PHONE, Stage, until
from PIL import Image
from playwright.async_api import Page, expect

pytest_plugins = ["panel_browser"]

pytestmark = pytest.mark.full

AXE = "4.14.1"
AXE_SHA512 = "FHfa+lmNjQZfJz1q8wKqIDwC6DExcHt/pkjNQb09a3NPjCKg2rhu5qb2S4r76ASyFNNtuFooJpZe37OgudVGtQ=="
LARGEST_LOAD = 400_000
SERIOUS = {"serious", "critical"}
NO_WEBGL = """
const getContext = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    return kind.startsWith("webgl") ? null : getContext.call(this, kind, ...rest);
};
"""
TABS = ("Jog", "Go to", "Tools", "Teach", "Draw", "Status")


@pytest.fixture(scope="session")
def axe(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The program that looks for what people with disabilities cannot use; for tests alone, so npm has to have it."""
    npm = shutil.which("npm")
    if not npm:
        pytest.skip("npm is not installed, and axe-core comes from there")

    folder = tmp_path_factory.mktemp("axe")
    command = [npm, "pack", f"axe-core@{AXE}", "--json"]
    packed = subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True)
    if packed.returncode:
        pytest.skip(f"npm does not reach axe-core: {packed.stderr.strip()[-200:]}")

    archive = folder / json.loads(packed.stdout)[0]["filename"]
    assert base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode() == AXE_SHA512
    shutil.unpack_archive(archive, folder, filter="data")
    return (folder / "package/axe.min.js").read_text()


async def violations(page: Page, axe: str) -> list[str]:
    """What is serious."""
    session = await page.context.new_cdp_session(page)
    await session.send("Runtime.evaluate", {"expression": axe})  # the page's own policy lets no script in
    run = "axe.run(document, {resultTypes: ['violations']}).then(result => JSON.stringify(result.violations))"
    answer = await session.send("Runtime.evaluate", {"expression": run, "awaitPromise": True, "returnByValue": True})
    found: list[dict[str, Any]] = json.loads(answer["result"]["value"])
    return [
        f"{each['id']}: {node['html'][:160]}: {node['failureSummary'][:200]}"
        for each in found
        if each["impact"] in SERIOUS
        for node in each["nodes"]
    ]


async def test_nothing_goes_wrong_and_nobody_else_is_asked(magician: Stage) -> None:
    for name, device in (("phone", PHONE), ("desktop", DESKTOP)):
        shown = await magician.open(device, solid=True)
        await shown.picture(f"{name}-watching")
        await shown.take_control()
        for tab in TABS:
            await shown.tab(tab)
            await shown.picture(f"{name}-{tab.lower().replace(' ', '-')}")
            wide = await shown.page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
            assert wide[0] <= wide[1], f"{tab} is wider than the {name}"

        shown.check()
        await shown.page.get_by_role("button", name="Release").click()
        await expect(shown.page.get_by_role("button", name="Take control")).to_be_visible()
        await shown.context.close()


async def test_the_first_load_is_small(magician: Stage) -> None:
    phone = await magician.open(PHONE, solid=True)
    await phone.page.wait_for_selector('.view[data-kind="3d"]')
    loaded = await phone.page.evaluate(
        "performance.getEntriesByType('resource').concat(performance.getEntriesByType('navigation'))"
        ".reduce((sum, each) => sum + each.transferSize, 0)"
    )
    assert 100_000 < loaded <= LARGEST_LOAD


async def test_the_picture_shows_the_arm_and_moves_with_it(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP, solid=True)
    await desktop.page.wait_for_selector('.view[data-kind="3d"]')
    canvas = desktop.page.locator("canvas.picture")

    async def colours() -> dict[Any, int]:
        picture = Image.open(io.BytesIO(await canvas.screenshot())).convert("RGB")
        return {colour: count for count, colour in picture.getcolors(2**24) or []}

    seen: list[dict[Any, int]] = []
    for _ in range(40):
        seen.append(await colours())
        if len(seen[-1]) > 200:
            break

    before = seen[-1]
    assert len(before) > 200, "the picture is blank"
    assert any(blue > 150 and blue > 1.8 * red for red, _, blue in before), "there is no arm in it"
    await desktop.take_control()
    await magician.hold(desktop, "Jog y+")
    await until(lambda: magician.where()[1] > 5.0, "the arm does not move")
    await desktop.page.mouse.up()
    await magician.stands()
    assert await colours() != before
    desktop.check()


async def test_without_webgl_the_picture_is_flat(magician: Stage) -> None:
    phone = await magician.open(
        PHONE,
        solid=True,
        script=NO_WEBGL,
    )
    await phone.page.wait_for_selector('.view[data-kind="2d"]')
    await expect(phone.page.get_by_text("no WebGL")).to_be_visible()
    await phone.picture("phone-flat")
    picture = Image.open(io.BytesIO(await phone.page.locator("canvas.picture").screenshot())).convert("RGB")
    assert len(picture.getcolors(2**24) or []) > 30, "the picture is blank"
    await phone.take_control()
    await magician.hold(phone, "Jog y+")
    await phone.page.mouse.up()
    await magician.stands()
    phone.check()


@pytest.mark.parametrize("theme", ["light", "dark"])
async def test_everybody_can_use_it(magician: Stage, axe: str, theme: str) -> None:
    for device in (PHONE, DESKTOP):
        shown = await magician.open(device, solid=True, color_scheme=theme)
        assert await violations(shown.page, axe) == []
        await shown.take_control()
        for tab in TABS if device is PHONE else ("Jog",):
            await shown.tab(tab)
            assert await violations(shown.page, axe) == [], tab

        await shown.picture(f"{'phone' if device is PHONE else 'desktop'}-{theme}")
        await shown.context.close()


async def test_a_theme_that_was_chosen_is_kept(magician: Stage) -> None:
    desktop = await magician.open(DESKTOP, color_scheme="light")
    await desktop.page.get_by_role("button", name="Dark theme").click()
    await desktop.page.reload()
    await expect(desktop.page.get_by_role("button", name="Light theme")).to_be_visible()
    assert await desktop.page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(18, 22, 27)"


def test_texts_are_in_one_file() -> None:
    """No part says a sentence of its own: a quoted text with a space between two words is in texts.js alone."""
    import re

    from dobot_async import panel

    scripts = Path(panel.__file__).parent / "static/js"
    sentence = re.compile(r"""["'`][A-Z][a-z]+ [a-z]+[^"'`]*["'`]""")
    for path in scripts.rglob("*.js"):
        if path.name != "texts.js":
            code = re.sub(r"^\s*(//|\*|/\*).*$|\s//\s.*$", "", path.read_text(), flags=re.MULTILINE)
            assert not sentence.findall(code), path.name
