"""The files of the page, as they are served: read once, packed once, and looked at again when they change."""

from __future__ import annotations

import gzip
import hashlib
import mimetypes
from dataclasses import dataclass
from pathlib import Path

__all__ = ["StaticFile", "StaticFiles"]

PACKED = (".html", ".js", ".css", ".svg", ".json", ".txt", ".webmanifest", ".map")
TYPES = {".js": "text/javascript", ".mjs": "text/javascript", ".webmanifest": "application/manifest+json"}


@dataclass(frozen=True, slots=True)
class StaticFile:
    """One file.

    Attributes:
        data: Its bytes.
        packed: The same, packed by gzip; b"" where that is no use.
        kind: Its type, as HTTP has it.
        tag: Of what is in it, for browsers that have it already.
        changed: When the file was changed.
    """

    data: bytes
    packed: bytes
    kind: str
    tag: str
    changed: int


class StaticFiles:
    """The files below a folder, and nothing else."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder.resolve()
        self._read: dict[str, StaticFile] = {}

    def get(self, name: str) -> StaticFile | None:
        """Return a file by its path in the folder; None if there is none."""
        path = (self._folder / name).resolve() if "\0" not in name else self._folder
        if not path.is_relative_to(self._folder) or not path.is_file():
            return None

        changed = path.stat().st_mtime_ns
        found = self._read.get(name)
        if found is None or found.changed != changed:
            found = self._read[name] = page_of(path, changed)

        return found


def page_of(path: Path, changed: int) -> StaticFile:
    """Read a file."""
    data, suffix = path.read_bytes(), path.suffix.lower()
    packed = gzip.compress(data, 9, mtime=0) if suffix in PACKED else b""
    kind = TYPES.get(suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    text = kind.startswith("text/") or kind.endswith(("json", "svg+xml"))
    tag = f'"{hashlib.sha256(data).hexdigest()[:20]}"'
    return StaticFile(
        data, packed if len(packed) < len(data) else b"", kind + ("; charset=utf-8" if text else ""), tag, changed
    )
