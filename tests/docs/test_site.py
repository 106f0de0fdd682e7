"""The site as it was built by `make docs`, which says where: nothing is missing, nothing leads nowhere.

DOBOT_SITE=build/site python -m pytest tests/docs/test_site.py
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from urllib.parse import unquote, urldefrag

import pytest
from dobot_docs.command_rows import rows
from dobot_docs.names import described_at, modules, public_names
from notebook_words import WORDS
from sphinx.util.inventory import InventoryFile

from dobot_async.arms.registry import REGISTERED

NOT_PAGES = {"genindex", "py-modindex", "search", "404"}
CLICKS = 2


@pytest.fixture(scope="module")
def site() -> Path:
    """Where the site is; the tests are skipped where none was built, and fail where one has to be."""
    place = os.environ.get("DOBOT_SITE", "")
    if not place and not os.environ.get("DOBOT_REQUIRE_SITE"):
        pytest.skip("no site was built: make docs builds one, and runs this")

    found = Path(place)
    assert (found / "index.html").is_file(), f"DOBOT_SITE={place!r} is no site"
    return found.resolve()


class Page(HTMLParser):
    """What matters of a page: the links of its own text, its anchors, and what can be read."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.pictures: list[str] = []
        self.anchors: set[str] = set()
        self.words: list[str] = []
        self._inside = 0
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if given.get(name)}
        self._inside += tag == "article"
        if self._inside and tag == "a" and "href" in given:
            self.links.append(given["href"])

        if self._inside and tag == "img":
            self.pictures.append(given["src"])

    def handle_endtag(self, tag: str) -> None:
        self._inside -= tag == "article"

    def handle_data(self, data: str) -> None:
        if self._inside:
            self.words.append(data)

    @property
    def text(self) -> str:
        """All that can be read."""
        return re.sub(r"\s+", " ", "".join(self.words))


@pytest.fixture(scope="module")
def pages(site: Path) -> Mapping[str, Page]:
    """All pages, by their names."""
    found = {path.relative_to(site).with_suffix("").as_posix(): Page(path) for path in site.rglob("*.html")}
    return {name: page for name, page in found.items() if name not in NOT_PAGES and not name.startswith("_")}


def targets(site: Path, name: str, page: Page) -> Iterator[tuple[str, Path, str]]:
    """The links of a page that stay on the site, each with its file and its anchor."""
    for link in page.links + page.pictures:
        address, anchor = urldefrag(link)
        if not re.match(r"[a-z]+:", link):
            here = site / f"{name}.html"
            yield link, (here.parent / unquote(address)).resolve() if address else here, unquote(anchor)


def test_each_public_name_is_on_the_site(site: Path) -> None:
    with (site / "objects.inv").open("rb") as file:
        inventory = InventoryFile.load(file, "", lambda _, address: address)

    known = {name for kind, names in inventory.items() if kind.startswith("py:") for name in names}
    public = {described_at(module, name) for module in modules() for name in public_names(module)}
    missing = sorted(public - known)
    assert len(public) > 200
    assert not missing, f"not on the site: {missing}"


@pytest.mark.parametrize("family", REGISTERED)
def test_each_command_can_be_referred_to(family: str, site: Path, pages: Mapping[str, Page]) -> None:
    module = f"dobot_async.{family}.commands"
    page = pages[f"reference/{family}-commands"]
    found = list(rows(import_module(module)))
    assert {f"{module}.{row.constant}" for row in found} <= page.anchors
    assert not [row.constant for row in found if row.constant not in page.text]


def test_each_page_is_reached_in_two_clicks(site: Path, pages: Mapping[str, Page]) -> None:
    reached, last = {"index"}, {"index"}
    for _ in range(CLICKS):
        files = {file for name in last for _, file, _ in targets(site, name, pages[name]) if file.suffix == ".html"}
        last = {file.relative_to(site).with_suffix("").as_posix() for file in files} & set(pages) - reached
        reached |= last

    assert len(pages) > 80
    assert not set(pages) - reached


def test_no_link_leads_nowhere(site: Path, pages: Mapping[str, Page]) -> None:
    dead = []
    for name, page in pages.items():
        for link, file, anchor in targets(site, name, page):
            other = pages.get(file.relative_to(site).with_suffix("").as_posix()) if file.suffix == ".html" else None
            if not file.is_file() or (anchor and other and anchor not in other.anchors):
                dead.append(f"{name}: {link}")

    assert not dead


@pytest.mark.parametrize("name", WORDS)
def test_notebooks_were_executed(name: str, pages: Mapping[str, Page]) -> None:
    page = pages[f"notebooks/{name}"]
    missing = [word for word in WORDS[name] if re.sub(r"\s+", " ", word) not in page.text]
    assert not missing
    assert "Traceback" not in page.text


@pytest.mark.parametrize("name", ["pick-and-place", "drawing-with-preview", "data-logging"])
def test_notebooks_show_their_pictures(name: str, pages: Mapping[str, Page]) -> None:
    assert pages[f"notebooks/{name}"].pictures


def test_llms_txt_names_each_page_with_its_source(site: Path, pages: Mapping[str, Page]) -> None:
    text = (site / "llms.txt").read_text(encoding="utf-8")
    entries = re.findall(r"^- \[(.+?)\]\(https://[^)]*?/(_sources/[^)]+)\): \S", text, re.MULTILINE)
    assert text.startswith("# dobot-async\n\n> ")
    assert all((site / source).is_file() for _, source in entries)
    named = {re.sub(r"\.(md|ipynb)\.txt$", "", source.removeprefix("_sources/")) for _, source in entries}
    assert named == {name for name in pages if name != "index" and not re.fullmatch(r"decisions/\d{4}-.*", name)}
