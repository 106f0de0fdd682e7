"""llms.txt: what the site holds, as one file for programs that read text; see llmstxt.org.

Each page is named with its first sentence, in the order of the site, and linked to its source, which is Markdown.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

__all__ = ["register"]

SOURCES = "_sources/{}.txt"


def sections(app: Sphinx) -> Iterator[tuple[str, list[str]]]:
    """The captions of the first page, each with the documents below it."""
    first = app.env.get_doctree(str(app.config.root_doc))
    for tree in first.findall(addnodes.toctree):
        yield tree["caption"] or "Pages", [document for _, document in tree["entries"]]


def entry(app: Sphinx, document: str) -> str:
    """The line of one page."""
    source = Path(app.env.doc2path(document)).relative_to(app.srcdir).as_posix()
    address = f"{app.config.html_baseurl}{SOURCES.format(source)}"
    title = app.env.titles[document].astext()
    said = next((each.astext() for each in app.env.get_doctree(document).findall(nodes.paragraph)), "")
    sentence = " ".join(said.split()).partition(". ")[0].rstrip(".:")
    return f"- [{title}]({address}): {sentence}."


def write(app: Sphinx, error: Exception | None) -> None:
    """Write the file when the site is whole."""
    if error or app.builder.name != "html":
        return

    lines = [f"# {app.config.project}", "", f"> {app.config.description}", ""]
    for caption, documents in sections(app):
        lines += [f"## {caption}", "", *[entry(app, each) for each in documents], ""]

    (Path(app.outdir) / "llms.txt").write_text("\n".join(lines), encoding="utf-8")


def register(app: Sphinx) -> None:
    """Listen for the end of a build."""
    app.add_config_value("description", "", "html")
    app.connect("build-finished", write)
