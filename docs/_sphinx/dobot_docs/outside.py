"""What pages say to those who read the files themselves, made fit for the site.

Links to files outside of docs/ lead to the page that shows the file: an example is on the page of examples, and what
has no page of its own is a download, as MyST does it. A link that leads nowhere stays as it is, and fails the build. And
the list of decisions, a README as others are, is told to be the parent of each of them.
"""

from __future__ import annotations

import re
from pathlib import PurePosixPath

from sphinx.application import Sphinx

__all__ = ["register", "rewrite"]

LINK = re.compile(r"\]\(((?:\.\./)+)([\w./-]+)(#[\w-]+)?\)")
PAGES = {
    "README.md": "index.md",
    "CHANGELOG.md": "project/changelog.md",
    "CONTRIBUTING.md": "project/contributing.md",
    "SECURITY.md": "project/security-policy.md",
    "examples": "reference/examples.md",
}
DECISIONS = "decisions/README"
CHILDREN = "\n\n```{toctree}\n:hidden:\n:glob:\n\n[0-9]*\n```\n"
EXAMPLES = re.compile(r"examples/(\w+)\.py")


def rewrite(document: str, text: str) -> str:
    """Return the text of a page with its links to files outside of docs/ changed to those of pages."""
    depth = document.count("/")

    def changed(match: re.Match[str]) -> str:
        up, target, anchor = match.groups()
        page = PAGES.get(target.rstrip("/"))
        if up.count("../") != depth + 1:
            return match[0]

        if example := EXAMPLES.fullmatch(target):
            page, anchor = PAGES["examples"], f"#{example[1]}py"

        return match[0] if page is None else f"]({relative(page, depth)}{anchor or ''})"

    return LINK.sub(changed, text)


def relative(page: str, depth: int) -> str:
    """The way from a page so many folders deep to another."""
    return str(PurePosixPath(*[".."] * depth, page))


def read(_app: Sphinx, document: str, content: list[str]) -> None:
    """What Sphinx asks for each page that it reads."""
    content[0] = rewrite(document, content[0]) + (CHILDREN if document == DECISIONS else "")


def register(app: Sphinx) -> None:
    """Listen for pages."""
    app.connect("source-read", read)
