"""URLs in messages: without their secrets."""

from __future__ import annotations

import re
from urllib.parse import unquote

__all__ = ["hidden"]

USER = re.compile(r"(?<=//)[^/?#]*@")
SECRET = re.compile(r"token(?!_file$)|password|secret|key", re.IGNORECASE)
NAME = re.compile(r"[?&;#]([^=?&;#]*)=")


def hidden(url: str) -> str:
    """Returns a URL as it may be shown: without its token, however it is written, and without a user's password."""
    rest, shown = USER.sub("...@", url), ""
    while secret := next((found for found in NAME.finditer(rest) if SECRET.search(unquote(found[1]).strip())), None):
        shown += f"{rest[: secret.end()]}..."
        _, more, rest = rest[secret.end() :].partition("&")
        rest = more + rest

    return shown + rest
