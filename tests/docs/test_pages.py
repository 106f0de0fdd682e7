"""The pages, and what makes a site of them, without building it: each page is in the index, each name on a page."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Generic, TypeVar

import pytest
from dobot_docs.command_rows import Row, rows
from dobot_docs.device_limits import LIMITS
from dobot_docs.docstrings import literal_blocks, return_type
from dobot_docs.names import INSIDE, TOP, described_at, modules, page_modules, public_names
from dobot_docs.outside import REPOSITORY, SHOWN, rewrite, text_of
from dobot_docs.reference import KINDS, kind_of
from dobot_docs.wire_formats import describe

from dobot_async import DobotError, Magician, MyCobot, UltraArm
from dobot_async.arms.registry import REGISTERED, families

DOCS = Path(__file__).parents[2] / "docs"
INDEX = DOCS / "index.md"
TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)
T = TypeVar("T")


def documents() -> list[str]:
    """All pages, as an index names them."""
    found = [path for pattern in ("*.md", "*.ipynb") for path in DOCS.rglob(pattern)]
    kept = [
        path.relative_to(DOCS)
        for path in found
        if "_sphinx" not in path.parts and ".ipynb_checkpoints" not in path.parts
    ]
    return sorted(path.with_suffix("").as_posix() for path in kept)


def listed() -> list[str]:
    """What the index names."""
    entries = "\n".join(TOCTREE.findall(INDEX.read_text(encoding="utf-8"))).splitlines()
    return [entry for entry in entries if entry and not entry.startswith(":")]


@pytest.mark.parametrize("document", [each for each in documents() if each != "index"])
def test_each_page_is_in_the_index(document: str) -> None:
    is_decision = re.fullmatch(r"decisions/\d{4}-.+", document)
    assert is_decision or document in listed(), (
        f"nobody finds docs/{document}: put `{document}` under a caption of docs/index.md"
    )


def test_the_index_names_pages_that_exist_and_each_once() -> None:
    assert set(listed()) <= set(documents())
    assert len(set(listed())) == len(listed())


def test_each_decision_is_in_the_list_of_decisions() -> None:
    text = (DOCS / "decisions" / "README.md").read_text(encoding="utf-8")
    missing = [path.name for path in sorted((DOCS / "decisions").glob("0*.md")) if f"]({path.name})" not in text]
    assert not missing, f"docs/decisions/README.md has no line for {missing}"


# ---------------------------------------------------------------------------------------------------------------------
# The reference


@pytest.mark.parametrize("module", modules())
def test_each_public_name_is_described_in_a_public_module(module: str) -> None:
    for name in public_names(module):
        home = described_at(module, name)
        assert home.rpartition(".")[0] in modules(), f"{module}.{name} is described nowhere: {home}"


def test_each_kind_of_name_has_its_place_in_the_reference() -> None:
    pages = [DOCS / "errors.md", *(DOCS / "reference").glob("*.md")]
    kinds = [
        kind for page in pages for kind in re.findall(r"^:kind: (\w+)", page.read_text(encoding="utf-8"), re.MULTILINE)
    ]
    assert sorted(kinds) == sorted(KINDS)
    assert {kind_of(getattr(import_module(TOP), name)) for name in public_names(TOP)} <= set(KINDS)


def test_what_is_written_about_is_public() -> None:
    assert {"dobot_async.handling", "dobot_async.grid", "dobot_async.program"} <= set(modules())
    assert modules()[0] == TOP
    assert not [name for name in modules() if "._" in name]
    assert all((DOCS / name).exists() for name in INSIDE)


def test_only_modules_with_a_list_of_names_are_public() -> None:
    nameless = [name for name in modules() if not public_names(name) and "__path__" not in vars(import_module(name))]
    assert not nameless, f"{nameless} are imported by pages or examples, and have no __all__"


# ---------------------------------------------------------------------------------------------------------------------
# Commands, arms, errors


def tables() -> Iterator[Row]:
    for family in REGISTERED:
        yield from rows(import_module(f"dobot_async.{family}.commands"))


@pytest.mark.parametrize("family", REGISTERED)
def test_each_row_of_each_family_is_on_its_page(family: str) -> None:
    page = DOCS / "reference" / f"{family}-commands.md"
    assert page.exists(), f"the family {family} has no page: copy one of docs/reference/*-commands.md"
    assert f"```{{command-table}} dobot_async.{family}.commands" in page.read_text(encoding="utf-8")
    module = import_module(f"dobot_async.{family}.commands")
    assert [row.command for row in rows(module)] == list(module.ALL)


@pytest.mark.parametrize("row", [*tables()], ids=lambda row: f"{row.constant}")
def test_a_row_says_what_its_numbers_are(row: Row) -> None:
    if row.sent.bare or row.answered.bare:
        assert row.meaning, f"{row.constant}: say unit or meaning in a comment at the end of the row's line"


def test_rows_are_described_as_they_lie_on_the_wire() -> None:
    found = {row.constant: row for row in rows(import_module("dobot_async.arms.magician.commands"))}
    assert found["SET_PTP_CMD"].sent.text == "ptp_mode u8, x f32, y f32, z f32, r f32"
    assert found["SET_IODO"].sent.text.startswith("address u8 (1 to 20), level u8 (0 to 1)")
    assert found["GET_DEVICE_TIME"].group == "2.3 Device information"
    assert found["GET_DEVICE_TIME"].meaning == "Milliseconds since power-up."
    cobot = {row.constant: row for row in rows(import_module("dobot_async.arms.mycobot.commands"))}
    assert cobot["GET_COORDS"].answered.text == "one for each of the coords: i16 = mm × 10, degrees × 100"
    ultraarm = {row.constant: row for row in rows(import_module("dobot_async.arms.ultraarm.commands"))}
    assert ultraarm["GET_COORDS"].answered.text == "COORDS[x, y, z, e]"
    assert ultraarm["MOVE_JOINTS"].sent.text == "j1 X, j2 Y, j3 Z, j4 E?, f F (1 to 200)?"


def test_an_unknown_layout_is_told() -> None:
    with pytest.raises(TypeError, match="has no description"):
        describe(object())


def test_each_arm_has_a_card_with_its_ranges_and_what_was_verified() -> None:
    cards = (DOCS / "device-cards.md").read_text(encoding="utf-8")
    arms = [arm for name, family in families() for arm in (family.models or (name,))]
    assert sorted(LIMITS) == sorted(arms)
    for section in cards.split("\n## ")[1:]:
        (arm,) = re.findall(r"^```\{device-limits\} (\w+)", section, re.MULTILINE)
        arms.remove(arm)
        assert re.search(r"hardware( \||:) nothing so\s+far", section, re.IGNORECASE), arm

    assert not arms, f"no card in docs/device-cards.md for {arms}"


def test_each_error_has_its_line() -> None:
    page = (DOCS / "errors.md").read_text(encoding="utf-8")
    values = [getattr(import_module(module), name) for module in modules() for name in public_names(module)]
    errors = {each for each in values if inspect.isclass(each) and issubclass(each, DobotError)} - {DobotError}
    missing = [each.__name__ for each in errors if f"`{each.__name__}`" not in page and not each.__subclasses__()]
    assert len(errors) > 12
    assert not missing, f"docs/errors.md says nothing of {missing}"


# ---------------------------------------------------------------------------------------------------------------------
# What is changed for the site


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("It is so:\n\n    a --> b\n\nThat is it.", "It is so:\n\n::\n\n    a --> b\n\nThat is it."),
        ("    a --> b\n\nThat is it.", "::\n\n    a --> b\n\nThat is it."),
        ("Args:\n    x: mm.\n\n    y: mm.", "Args:\n    x: mm.\n\n    y: mm."),
        ("- one\n\n    more of it", "- one\n\n    more of it"),
        ("One::\n\n    code\n\n    more code", "One::\n\n    code\n\n    more code"),
    ],
)
def test_indented_blocks_of_docstrings_are_literal(text: str, expected: str) -> None:
    assert "\n".join(literal_blocks(text.splitlines())) == expected


def test_what_a_verb_returns_is_told_by_where_it_is() -> None:
    class Verbs(Generic[T]):
        pass

    class Numbers(Verbs[int]):
        pass

    assert return_type(Numbers) == "int"
    assert return_type(Verbs) is None
    assert {return_type(arm) for arm in (Magician, MyCobot, UltraArm)} == {
        "~collections.abc.Coroutine[~typing.Any, ~typing.Any, None]"
    }


@pytest.mark.parametrize(
    ("document", "text", "expected"),
    [
        ("concepts", "[a](../examples/cp_drawing.py)", "[a](reference/examples.md#cp_drawingpy)"),
        ("concepts", "[a](../examples)", "[a](reference/examples.md)"),
        ("concepts", "[a](../examples/zenoh)", f"[a]({REPOSITORY}/tree/main/examples/zenoh)"),
        ("concepts", "[a](../nowhere.md)", "[a](../nowhere.md)"),
        ("concepts", "[a](../README.md#safety)", "[a](project/readme.md#safety)"),
        ("concepts", "[a](../CONTRIBUTING.md#one-test)", "[a](project/contributing.md#one-test)"),
        ("decisions/0001-x", "[a](../../examples)", "[a](../reference/examples.md)"),
        ("project/contributing", "[a](../../docs/testing.md#x)", "[a](../testing.md#x)"),
        ("concepts", "[a](../examples/phone.html) [b](families.md)", "[a](../examples/phone.html) [b](families.md)"),
    ],
)
def test_links_out_of_docs_lead_to_pages(document: str, text: str, expected: str) -> None:
    assert rewrite(document, text) == expected


@pytest.mark.parametrize("document", SHOWN)
def test_a_page_that_shows_a_file_of_the_root_has_its_text(document: str) -> None:
    page = (DOCS / f"{document}.md").read_text(encoding="utf-8")
    shown = (DOCS.parent / SHOWN[document]).read_text(encoding="utf-8")
    assert f"({'../' * 2}{SHOWN[document]})" in page
    assert text_of(document, page).splitlines()[0] == shown.splitlines()[0]


def test_modules_with_a_page_are_described_there_alone() -> None:
    assert len(set(page_modules())) == len(page_modules())
    assert TOP in modules()
