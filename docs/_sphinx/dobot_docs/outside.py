"""What pages say to those who read the files themselves, made fit for the site.

Links to files outside of docs/ lead to the page that shows the file: an example is on the page of examples. What has no
page of its own is a download, as MyST does it; a folder, or a page elsewhere, is in the repository. A link that leads
nowhere stays as it is, and fails the build. A page that shows a file of the root has its text. And the list of
decisions, a README as others are, is told to be the parent of each of them.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import PurePosixPath

from sphinx.application import Sphinx

from dobot_docs.names import ROOT

__all__ = ["REPOSITORY", "SHOWN", "register", "rewrite", "text_of"]

REPOSITORY = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["urls"]["Repository"]
RELATIVE = re.compile(r"\]\((?![a-z]+:|#)([^)\s]+)\)")
LINK = re.compile(r"\]\(((?:\.\./)+)([\w./-]+)(#[\w-]+)?\)")
SHOWN: Mapping[str, str] = {
    "project/changelog": "CHANGELOG.md",
    "project/contributing": "CONTRIBUTING.md",
    "project/readme": "README.md",
    "project/security-policy": "SECURITY.md",
}
"""The pages that show a file of the root."""

PAGES: Mapping[str, str] = {
    "examples": "reference/examples.md",
    **{file: f"{document}.md" for document, file in SHOWN.items()},
}
DECISIONS = "decisions/README"
CHILDREN = "\n\n```{toctree}\n:hidden:\n:glob:\n\n[0-9]*\n```\n"
EXAMPLES = re.compile(r"examples/(\w+)\.py")


def text_of(document: str, text: str) -> str:
    """Return what a page says on the site, from what its file says."""
    if document in SHOWN:
        text = RELATIVE.sub(r"](../../\1)", (ROOT / SHOWN[document]).read_text(encoding="utf-8"))

    return rewrite(document, text) + (CHILDREN if document == DECISIONS else "")


def rewrite(document: str, text: str) -> str:
    """Return the text of a page with its links to files outside of docs/ changed to those of pages."""
    depth = document.count("/")

    def changed(match: re.Match[str]) -> str:
        up, target, anchor = match.groups()
        page = PAGES.get(target.rstrip("/"))
        if up.count("../") != depth + 1:
            return match[0]

        if target.startswith("docs/"):
            page = target.removeprefix("docs/")
        elif example := EXAMPLES.fullmatch(target):
            page, anchor = PAGES["examples"], f"#{example[1]}py"
        elif page is None and is_of_the_repository(target):
            return f"]({REPOSITORY}/tree/main/{target}{anchor or ''})"

        return match[0] if page is None else f"]({relative(page, depth)}{anchor or ''})"

    return LINK.sub(changed, text)


def is_of_the_repository(target: str) -> bool:
    """Whether a target is a folder, or a page outside of docs/."""
    path = ROOT / target
    return path.is_dir() or (path.suffix == ".md" and path.is_file())


def relative(page: str, depth: int) -> str:
    """The way from a page so many folders deep to another."""
    return str(PurePosixPath(*[".."] * depth, page))


def read(app: Sphinx, document: str, content: list[str]) -> None:
    """What Sphinx asks for each page that it reads."""
    content[0] = text_of(document, content[0])
    if document in SHOWN:
        app.env.note_dependency(str(ROOT / SHOWN[document]))


def register(app: Sphinx) -> None:
    """Listen for pages."""
    app.connect("source-read", read)
