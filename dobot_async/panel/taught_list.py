"""The list of taught steps of one arm: recorded, ordered, edited, played, saved and loaded from a page."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

from dobot_async.panel.arms import ArmView
from dobot_async.panel.problems import PanelRefusal
from dobot_async.teaching import Recorder, Recording, RecordingUnfit, TaughtStep, check_recording, play
from dobot_async.teaching.files import from_json, to_json
from dobot_async.teaching.playback_file import read_playback, write_playback

if TYPE_CHECKING:
    from dobot_async.panel.arm_tasks import ArmTask
    from dobot_async.panel.station import Station

__all__ = ["Taught"]

MOST = 1000  # steps
numbers: itertools.count[int] = itertools.count(1)
CHANGES = ("mode", "pause", "name", "suction", "gripper")


class Taught:
    """The steps of one arm; they stay when the arm is connected anew.

    Attributes:
        recording: What was taught, None until the arm was connected for the first time.
    """

    def __init__(self, station: Station) -> None:
        self.recording: Recording | None = None
        self._station = station
        self._loaded: tuple[str, Recording] | None = None

    def connected(self, view: ArmView) -> None:
        """The arm is there."""
        if self.recording is None:
            self.recording = Recorder(view.arm).recording

        self._tell()

    def set(self, steps: Sequence[TaughtStep]) -> None:
        """Take other steps; raise Refusal if they are too many."""
        if len(steps) > MOST:
            raise PanelRefusal("wrong", f"a list has {MOST} steps at most")

        self.recording = replace(self._known, steps=tuple(steps))
        self._tell()

    async def take(self, view: ArmView, **details: Any) -> Mapping[str, Any]:
        """Take the place where the arm is."""
        step = await Recorder(view.arm).point(**details)
        self.set([*self._known.steps, step])
        return {"index": len(self._known.steps) - 1}

    def remove(self, index: int) -> None:
        """Take a step out."""
        out = self._at(index)
        self.set([step for number, step in enumerate(self._known.steps) if number != out])

    def move(self, index: int, to: int) -> None:
        """Put a step at another place of the list."""
        steps = list(self._known.steps)
        step = steps.pop(self._at(index))
        steps.insert(min(max(to, 0), len(steps)), step)
        self.set(steps)

    def edit(self, index: int, changes: Mapping[str, Any]) -> None:
        """Change how a step is reached, and what is done there."""
        unknown = set(changes) - set(CHANGES)
        if unknown:
            raise ValueError(f"changes are of {', '.join(CHANGES)}, not {', '.join(sorted(unknown))}")

        steps = list(self._known.steps)
        steps[index] = replace(steps[self._at(index)], **changes)
        self.set(steps)

    async def play(self, view: ArmView, work: ArmTask, **options: Any) -> None:
        """Let the arm do it."""
        works = self._station.works

        def report(done: int, of: int) -> None:
            works.get_on(work, done / of)

        await play(view.arm, self._known, progress=report, **options)

    def text(self, suffix: str) -> str:
        """Return it as a file; raise ValueError if such a file cannot hold it."""
        return write_playback(self._known) if suffix == "playback" else to_json(self._known)

    async def add(self, data: bytes, name: str) -> dict[str, Any]:
        """Read a file, and keep what is in it for `load`; raise ValueError if that is none of this arm's family."""
        found = await asyncio.to_thread(read, data, name)
        known = self._known
        if found.family != known.family:
            raise ValueError(f"it is of a {found.family}, and this is a {known.family}")

        if found.path:
            raise ValueError("it has a path in time, and no steps: dobot-async play plays it")

        if len(found.steps) > MOST:
            raise PanelRefusal("wrong", f"a list has {MOST} steps at most")

        self._loaded = f"r{next(numbers)}", found
        return {"file": self._loaded[0], "steps": len(found.steps), "remarks": list(found.remarks)}

    def load(self, file: str) -> None:
        """Take what was read from a file in place of the list."""
        if self._loaded is None or self._loaded[0] != file:
            raise PanelRefusal("file", "this file is not here any more: load it again")

        known = self._known
        self.recording = replace(self._loaded[1], model=self._loaded[1].model or known.model)
        self._tell()

    @property
    def _known(self) -> Recording:
        if self.recording is None:
            raise PanelRefusal("link", f"{self._station.name} was not connected yet")

        return self.recording

    def _at(self, index: int) -> int:
        if not 0 <= index < len(self._known.steps):
            raise ValueError(f"there are the steps 0 to {len(self._known.steps) - 1}, not {index}")

        return index

    def _tell(self) -> None:
        """Tell everybody the list, and what keeps the arm from playing it."""
        station, recording = self._station, self._known
        problems: Sequence[str] = ()
        if recording.steps and station.connected:
            try:
                check_recording(recording, station.view.arm)
            except RecordingUnfit as error:
                problems = error.problems

        modes = station.view.modes if station.connected else ()
        station.hub.publish(
            "recording",
            station.name,
            steps=[asdict(step) for step in recording.steps],
            problems=list(problems),
            modes=list(modes),
        )


def read(data: bytes, name: str) -> Recording:
    """Read a file."""
    if name.lower().endswith(".playback"):
        return read_playback(data)

    try:
        return from_json(data.decode(), name)
    except UnicodeDecodeError:
        raise ValueError(f"{name}: it is no text in UTF-8") from None
