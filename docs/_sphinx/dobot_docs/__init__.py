"""What the documentation site adds to Sphinx: what comes from the code, and what a Markdown page cannot say itself.

    command-table    every row of a family's table of commands        command_table, wire_formats
    public-names     the names of a module, documented once each       reference
    held-class       the class of what a connected arm holds           reference
    other-modules    documented modules without a page of their own    reference
    examples         each program of examples/                         reference
    device-limits    the ranges of each model                          device_limits

Every page may use them as directives.
"""

from __future__ import annotations

from sphinx.application import Sphinx

from dobot_docs import command_table, device_limits, docstrings, llms, outside, reference

__all__ = ["setup"]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register everything; called by Sphinx."""
    for part in (command_table, device_limits, docstrings, llms, outside, reference):
        part.register(app)

    return {"parallel_read_safe": True, "parallel_write_safe": True}
