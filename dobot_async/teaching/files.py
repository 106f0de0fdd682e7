"""Recordings as JSON, one step a line; what is wrong in a file is told with its place.

{"format": "dobot_async recording", "version": 1, "family": "magician",
"steps": [
{"pose": [250.0, 0.0, 20.0, 0.0], "name": "above"},
{"pose": [250.0, 0.0, -40.0, 0.0], "mode": "line", "suction": true}
]}

A version is raised when an older reader would play something else than was meant.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, cast

from dobot_async.program.text import read_text, shortened
from dobot_async.teaching.playback_file import read_playback, write_playback
from dobot_async.teaching.problems import RecordingFileError
from dobot_async.teaching.recording import PathSample, Recording, TaughtStep

__all__ = ["from_json", "load_recording", "save_recording", "to_json"]

FORMAT, VERSION = "dobot_async recording", 1
PLAYBACK = ".playback"
LISTS: Mapping[str, type[TaughtStep | PathSample]] = {"steps": TaughtStep, "path": PathSample}


def to_json(recording: Recording) -> str:
    """Return the text of a file.

    Args:
        recording: What to write.
    """
    head = {"format": FORMAT, "version": VERSION, **given(recording, without={*LISTS, "remarks"})}
    lines = [json.dumps(head, ensure_ascii=False)[:-1]]
    for name in LISTS:
        entries = [json.dumps(given(each), ensure_ascii=False) for each in getattr(recording, name)]
        if entries:
            lines[-1] += ","
            lines += [f'"{name}": [', *(f"{entry}," for entry in entries[:-1]), entries[-1], "]"]

    return "\n".join(lines) + "}\n"


def given(value: Any, without: Collection[str] = ()) -> dict[str, Any]:
    """What differs from what it is by default."""
    found: dict[str, Any] = {}
    for each in fields(value):
        here = getattr(value, each.name)
        if each.name not in without and (each.default is MISSING or here != each.default):
            found[each.name] = here

    return found


def from_json(text: str, name: str = "") -> Recording:
    """Return the recording in the text of a file.

    Args:
        text: The text.
        name: Of the file, for what is wrong with it.

    Raises:
        RecordingFileError: It is no such text, or of a later version; or something in it is wrong.
    """
    try:
        read: object = json.loads(text, parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        raise RecordingFileError(name, "", f"no JSON: {error}") from None

    found: dict[str, Any] = cast("dict[str, Any]", read) if isinstance(read, dict) else {}
    if found.get("format") != FORMAT:
        raise RecordingFileError(name, "", f'no recording: it has no "format": "{FORMAT}"')

    version = found.get("version")
    if version != VERSION or isinstance(version, bool):
        raise RecordingFileError(name, "", f"version {version!r} is not known; this release reads version {VERSION}")

    head = {key: value for key, value in found.items() if key not in {"format", "version"}}
    for key, kind in LISTS.items():
        entries = head.get(key, [])
        if not isinstance(entries, list):
            raise RecordingFileError(name, key, f"a list, not {shortened(repr(entries))}")

        listed = enumerate(cast("list[object]", entries), 1)
        head[key] = tuple(made(kind, entry, name, f"{key} {number}") for number, entry in listed)

    recording: Recording = made(Recording, head, name, "")
    return recording


def refuse(word: str) -> None:
    """What JSON has no word for."""
    raise ValueError(f"{word} is no number")


def made(kind: type[Any], read: object, name: str, place: str) -> Any:
    """Make a record of what a file has for it."""
    known = [each.name for each in fields(kind) if each.name != "remarks"]
    if not isinstance(read, Mapping):
        raise RecordingFileError(name, place, f"an object, not {shortened(repr(read))}")

    values = cast("Mapping[str, Any]", read)

    for key in values:
        if key not in known:
            raise RecordingFileError(name, place, f"{shortened(repr(key))} is none of {', '.join(known)}")

    for each in fields(kind):
        if each.name not in values and each.default is MISSING:
            raise RecordingFileError(name, place, f"{each.name} is missing")

    for key, value in values.items():
        if isinstance(value, bool) != (key == "suction" and value is not None):
            raise RecordingFileError(name, place, f"{key} cannot be {shortened(repr(value))}")

    try:
        return kind(**values)
    except (ValueError, TypeError, OverflowError) as error:
        raise RecordingFileError(name, place, str(error)) from None


def load_recording(file: str | Path) -> Recording:
    """Read a recording: JSON, or a file of DobotStudio if its name ends with `.playback`.

    Args:
        file: Its path.

    Raises:
        RecordingFileError: Something in it is wrong.
        OSError: It cannot be read.
    """
    path = Path(file)
    if path.suffix.lower() == PLAYBACK:
        return read_playback(path)

    try:
        text = read_text(path)
    except ValueError as error:
        raise RecordingFileError(path.name, "", str(error)) from None

    return from_json(text, path.name)


def save_recording(recording: Recording, file: str | Path) -> None:
    """Write a recording: as JSON, or for DobotStudio if the file's name ends with `.playback`.

    Args:
        recording: What to write.
        file: Its path; an older file stays until the new one is whole.

    Raises:
        ValueError: A `.playback` file cannot hold it; see `write_playback`.
        OSError: It cannot be written.
    """
    path = Path(file)
    text = write_playback(recording) if path.suffix.lower() == PLAYBACK else to_json(recording)
    part = path.with_name(f"{path.name}.part")  # an older file stays as it is until the new one is whole
    part.write_text(text, encoding="utf-8", newline="\n")
    part.replace(path)
