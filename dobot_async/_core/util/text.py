"""Text from other programs, made printable for a log, a terminal and a file."""

from __future__ import annotations

__all__ = ["LONGEST", "printable"]

LONGEST = 200
"""Characters of somebody else's text that are shown."""


def printable(text: str, longest: int = LONGEST) -> str:
    r"""Return a text in printable ASCII on one line, whatever somebody has put into it.

    Control characters, letters that only some terminals have, and what no encoding can write become escapes such as
    `\x1b` and `\u202e`, so that writing it down cannot fail and obeys nothing.

    Args:
        text: Any text.
        longest: Characters that are kept; what is cut off shows as "...".
    """
    shown = text if len(text) <= longest else text[: longest - 3] + "..."
    if shown.isascii() and shown.isprintable():
        return shown

    return "".join(each if each.isascii() and each.isprintable() else escaped(each) for each in shown)


def escaped(character: str) -> str:
    """Return a character as Python writes it."""
    return character.encode("unicode_escape").decode("ascii")
