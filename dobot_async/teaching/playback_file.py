"""The `.playback` files of DobotStudio, in and out. Their layout is known from one public reader alone.

<root>
    <DobotType/> <StudioVersion/>        two elements that are no points
    <row0>                               then a point each
        <item_0>2</item_0>               0 jump, 1 MOVJ, 2 MOVL, 3 arc
        <item_1>above</item_1>           its name
        <item_2>200</item_2>  ... item_5     x, y, z, r
        <item_6>0</item_6>    ... item_9     the arc's other point
        <item_10>0.5</item_10>           seconds to stay
        <item_11>1</item_11>             gripper: 0 off, 1 closed, 2 open;   or
        <item_12>1</item_12>             suction: 0 off, 1 on
    </row0>

1. What is not known is told (`Recording.remarks`, and the log): never dropped in silence.
2. A document type, and with it entities, is refused: nothing is expanded or fetched.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any
from xml.parsers import expat
from xml.sax.saxutils import escape

from dobot_async.program.text import LARGEST, shortened
from dobot_async.teaching.playback_rows import Element, Row
from dobot_async.teaching.problems import RecordingFileError, RecordingUnfit
from dobot_async.teaching.recording import Gripper, Mode, Recording, TaughtStep, said_once

__all__ = ["read_playback", "write_playback"]

logger: logging.Logger = logging.getLogger("dobot_async.teaching")

HEADS = ("DobotType", "StudioVersion")
STYLES: tuple[Mode, ...] = ("jump", "point", "line", "arc")
GRIPPER: tuple[Gripper, ...] = ("off", 0.0, 100.0)
SUCTION = (False, True)
KNOWN = frozenset(range(13))
ITEM = re.compile(r"item_(\d{1,4})", re.ASCII)
ROW_LEVEL, ITEM_LEVEL = 1, 2
WORDS = {"jump": 0, "point": 1, "line": 2, "arc": 3}


class PlaybackReader:
    """Finds the rows of a file; what is neither a row nor an item of one is a remark."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.elements: list[Element] = []
        self.remarks: list[str] = []
        self._path: list[str] = []
        self._item: int | None = None
        self._parser = expat.ParserCreate()
        self._parser.buffer_text = True
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text
        self._parser.StartDoctypeDeclHandler = self._refuse

    def read(self, data: bytes) -> None:
        """Read all of it; raise RecordingFileError."""
        try:
            self._parser.Parse(data, True)
        except expat.ExpatError as error:
            reason = expat.ErrorString(error.code)
            raise RecordingFileError(self.file, f"line {error.lineno}", f"no XML: {reason}") from None
        except (LookupError, UnicodeError) as error:
            raise RecordingFileError(self.file, "line 1", f"its encoding is not known: {error}") from None

    def remark(self, text: str, line: int | None = None) -> None:
        """Tell of something that is left aside."""
        self.remarks.append(f"line {line or self._parser.CurrentLineNumber}: {text}")

    def _refuse(self, *_: object) -> None:
        line = self._parser.CurrentLineNumber
        raise RecordingFileError(self.file, f"line {line}", "a document type is not read, nor are its entities")

    def _start(self, name: str, attributes: Mapping[str, str]) -> None:
        level = len(self._path)
        self._path.append(name)
        if attributes:
            self.remark(f"the attributes of <{shortened(name)}> are not known: {shortened(', '.join(attributes))}")

        if level == ROW_LEVEL:
            self.elements.append(Element(name, self._parser.CurrentLineNumber))
        elif level >= ITEM_LEVEL:
            self._begin_item(name, level)

    def _begin_item(self, name: str, level: int) -> None:
        element = self.elements[-1]
        found = ITEM.fullmatch(name) if level == ITEM_LEVEL else None
        number = int(found[1]) if found else None
        if number is None or number in element.items:
            twice = " twice" if found else ""
            self.remark(f"<{shortened(name)}>{twice} in <{shortened(element.name)}> is left aside")
        else:
            self._item = number
            element.items[number] = ""

    def _end(self, _: str) -> None:
        self._path.pop()
        if len(self._path) <= ITEM_LEVEL:
            self._item = None

    def _text(self, data: str) -> None:
        if self._item is not None and len(self._path) == ITEM_LEVEL + 1:
            self.elements[-1].items[self._item] += data
        elif data.strip() and len(self._path) <= ITEM_LEVEL:
            self.remark(f"the text {shortened(data.strip())!r} is left aside")


def read_playback(source: str | Path | bytes) -> Recording:
    """Read a file of DobotStudio for the Magician.

    The joints are not in it. Which tool it is, and how far that is from the wrist, is not in it either: tell the arm
    by `set_end_effector` before the recording is played.

    Args:
        source: The file, or what is in it.

    Returns:
        The recording; `remarks` has what is in the file and not known.

    Raises:
        RecordingFileError: It is no such file; the message has the line.
        OSError: It cannot be read.
    """
    if isinstance(source, bytes):
        name, data = "", source
    else:
        name = Path(source).name
        with Path(source).open("rb") as file:
            data = file.read(LARGEST + 1)

    if len(data) > LARGEST:
        raise RecordingFileError(name, "", f"more than {LARGEST >> 20} MB")

    reader = PlaybackReader(name)
    reader.read(data)
    heads, rows = reader.elements[: len(HEADS)], reader.elements[len(HEADS) :]
    for element in heads:
        if {2, 3, 4} <= element.items.keys():
            reader.remark(f"<{shortened(element.name)}> looks like a point, and stands where none does", element.line)

    steps = [step_of(element, reader) for element in rows]
    for remark in reader.remarks:
        logger.warning("%s: %s", name or "playback", remark)

    return Recording("magician", tool=tool_of(steps), steps=said_once(steps), remarks=tuple(reader.remarks))


def tool_of(steps: list[TaughtStep]) -> str:
    """What is on the arm, as far as the steps tell."""
    return next((tool for tool in ("suction", "gripper") for step in steps if getattr(step, tool) is not None), "")


def step_of(element: Element, reader: PlaybackReader) -> TaughtStep:
    """Return the step of a row; raise RecordingFileError."""
    for item, text in element.items.items():
        if item not in KNOWN:
            what = f"item_{item} of <{shortened(element.name)}> is not known: {shortened(text.strip())!r}"
            reader.remark(what, element.line)

    row = Row(element, reader.file)
    mode: Mode | None = row.choice(0, STYLES)
    if mode is None:
        raise row.wrong(0, "is missing")

    try:
        return TaughtStep(
            mode=mode,
            name=one_line(element.items.get(1, "")),
            pose=(row.number(2), row.number(3), row.number(4), row.number(5, 0.0)),
            via=(row.number(6), row.number(7), row.number(8), row.number(9, 0.0)) if mode == "arc" else (),
            pause=row.number(10, 0.0),
            gripper=row.choice(11, GRIPPER),
            suction=row.choice(12, SUCTION),
        )
    except RecordingFileError:
        raise
    except ValueError as error:
        raise RecordingFileError(reader.file, f"line {element.line}", str(error)) from None


def one_line(name: str) -> str:
    """A name as it is, or what is left of one that is not on one line."""
    return name if name.isprintable() else "".join(each for each in " ".join(name.split()) if each.isprintable())


def write_playback(recording: Recording) -> str:
    """Return the text of a file for DobotStudio.

    The joints are not in it, nor is the tool's offset. A tool that has been switched once is in every row from there.

    Args:
        recording: Steps of a Magician.

    Raises:
        RecordingUnfit: It is no Magician's, or a path; or a step goes to joints, opens the gripper partly, or there are
            both suction and gripper.
    """
    problems: list[str] = []
    if recording.family != "magician":
        problems.append(f"DobotStudio's files are a Magician's, and this is of a {recording.family}")

    if recording.path:
        problems.append("DobotStudio's files have points, and no path in time")

    tools = {tool for step in recording.steps for tool in ("suction", "gripper") if getattr(step, tool) is not None}
    if len(tools) > 1:
        problems.append("a row has suction or a gripper, and not both")

    for number, step in enumerate(recording.steps, 1):
        if step.mode == "joints" or len(step.pose) != 4:
            problems.append(f"step {number} has to be a pose of x, y, z and r, with a mode other than 'joints'")

        if step.gripper not in {None, *GRIPPER}:
            problems.append(f"step {number}: the gripper is off, closed or open, not {step.gripper} percent")

    if problems:
        raise RecordingUnfit(problems)

    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<root>", *head_lines()]
    state: dict[str, Any] = {}
    for row, step in enumerate(recording.steps):
        state |= {tool: getattr(step, tool) for tool in tools if getattr(step, tool) is not None}
        lines += [f"    <row{row}>", *(item_line(*item) for item in row_items(step, state)), f"    </row{row}>"]

    return "\n".join([*lines, "</root>", ""])


def head_lines() -> list[str]:
    """The elements before the rows."""
    values = ("Magician", "dobot_async")
    return [f"    <{name}><item_0>{value}</item_0></{name}>" for name, value in zip(HEADS, values, strict=True)]


def row_items(step: TaughtStep, state: Mapping[str, Any]) -> list[tuple[int, str]]:
    """The items of a row."""
    via = step.via or (0.0,) * 4
    items = [(0, str(WORDS[step.mode])), (1, step.name)]
    items += [(item, written(value)) for item, value in enumerate((*step.pose, *via, step.pause), 2)]
    if "gripper" in state:
        items.append((11, str(GRIPPER.index(state["gripper"]))))

    if "suction" in state:
        items.append((12, str(SUCTION.index(state["suction"]))))

    return items


def item_line(item: int, text: str) -> str:
    """An item."""
    return f"        <item_{item}>{escape(text)}</item_{item}>"


def written(value: float) -> str:
    """A number with all its digits, and without an exponent."""
    return format(Decimal(repr(value)), "f")
