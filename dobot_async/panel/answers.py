"""What the HTTP side answers with: a file of the page, words, JSON."""

from __future__ import annotations

import json
from typing import Any

from aiohttp import web

from dobot_async.panel.static_files import StaticFile

__all__ = ["as_json", "plain", "safe", "served"]


def served(page: StaticFile | None, request: web.Request) -> web.Response:
    """Answer with a file."""
    if page is None:
        raise web.HTTPNotFound

    headers = {"ETag": page.tag, "Cache-Control": "no-cache", "Content-Type": page.kind, "Vary": "Accept-Encoding"}
    if request.headers.get("If-None-Match") == page.tag:
        return web.Response(status=304, headers=headers)

    if page.packed and "gzip" in request.headers.get("Accept-Encoding", ""):
        return web.Response(body=page.packed, headers=headers | {"Content-Encoding": "gzip"})

    return web.Response(body=page.data, headers=headers)


def plain(status: int, text: str) -> web.Response:
    """Answer in words."""
    return web.Response(status=status, text=text, content_type="text/plain")


def as_json(value: Any, status: int = 200) -> web.Response:
    """Answer in JSON."""
    return web.Response(status=status, text=json.dumps(value), content_type="application/json")


def safe(name: str) -> str:
    """Return a name that a file may have."""
    return "".join(each if each.isascii() and (each.isalnum() or each in "-_") else "_" for each in name) or "recording"
