"""What one connection writes into a trace: frames, what is no frame, states, events, motions, and how it ended."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar, cast
from weakref import WeakKeyDictionary

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.contract import Frame, LinkState, Unexpected
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.events import Listener
from dobot_async._core.util.hooks import Hooks
from dobot_async._core.util.plain import plain
from dobot_async._core.util.urls import hidden
from dobot_async.errors import ConnectionLost
from dobot_async.traces.file import NamedTrace, TraceFile
from dobot_async.traces.words import MASK, FrameWords

__all__ = ["Record", "RecordSettings", "TraceRecorder", "recorded", "shared"]

T = TypeVar("T")
Record = str | os.PathLike[str] | TraceFile | NamedTrace
"""What `connect(record=)` takes: a path, for a file that is closed at the end of the block; or an open trace."""


@dataclass(frozen=True, slots=True)
class RecordSettings:
    """What a connection is to be recorded with.

    Attributes:
        target: Where to; None for nowhere.
        words: Says what the frames are.
        model: Which arm `connect` was told that it is.
        reply_timeout: Seconds, the least and the most, until a request is sent again.
    """

    target: Record | None
    words: FrameWords
    model: str
    reply_timeout: tuple[float, float]


class RecordedQueue(Protocol):
    """The queue of an arm, as far as a trace is concerned."""

    @property
    def on_motion(self) -> Hooks[[Motion]]:
        """Called with each Motion when it was put, was accepted, and has ended."""
        ...


@contextmanager
def recorded(recording: RecordSettings | None, url: str) -> Generator[TraceRecorder | None]:
    """Record a connection for the length of a block; yields None where that is not wanted.

    Raises:
        TypeError: The target is none.
        OSError: The file cannot be written.
    """
    if recording is None or recording.target is None:
        yield None
        return

    name = recording.target.name if isinstance(recording.target, NamedTrace) else ""
    with shared(recording.target) as file:
        recorder = TraceRecorder(file, recording, hidden(url), name)
        try:
            yield recorder
        except BaseException as error:
            recorder.end(error)
            raise

        recorder.end(None)


@contextmanager
def shared(target: Record) -> Generator[TraceFile]:
    """Open a trace for the length of a block, unless it is open already.

    Raises:
        TypeError: The target is none.
        OSError: The file cannot be written.
    """
    if isinstance(target, NamedTrace):
        yield target.file
    elif isinstance(target, TraceFile):
        yield target
    elif isinstance(cast(object, target), (str, os.PathLike)):
        with TraceFile(target) as file:
            yield file
    else:
        raise TypeError(f"record must be a path or a TraceFile, not {target!r}")


class Heard(Listener[T], Generic[T]):
    """A listener that takes each event at once."""

    def __init__(self, take: Callable[[T], None]) -> None:
        super().__init__(closed=False)
        self._hear = take

    def put(self, event: T) -> None:
        """Take an event."""
        self._hear(event)


class TraceRecorder:
    """Records one connection.

    Args:
        file: Where to.
        recording: What else is told of it.
        url: Of the arm, without secrets.
        name: The arm's, "" where there is only one.
    """

    def __init__(self, file: TraceFile, recording: RecordSettings, url: str, name: str) -> None:
        self._file = file
        self._recording = recording
        self._url = url
        self._name = {"arm": name} if name else {}
        self._link: Link[Any] | None = None
        self._junk = 0
        self._discreet = False  # once something secret was asked for, what is no frame may be a part of it
        self._numbers: WeakKeyDictionary[Motion, int] = WeakKeyDictionary()
        self._count = itertools.count(1)
        self._heard = Heard(self._event), Heard(self._state)

    def watch(self, link: Link[Any], queue: RecordedQueue) -> None:
        """Record a link, from its first frame on, and a queue; call it before anything was sent."""
        self._link = link
        limits = link.limits
        floor, ceiling = self._recording.reply_timeout
        self._file.connected(
            self,
            {
                **self._name,
                "family": self._recording.words.family,
                "model": self._recording.model,
                "url": self._url,
                "in_flight": limits.in_flight,
                "window": limits.window,
                "reorder_window": limits.reorder_window,
                "reply_timeout": [floor, ceiling],
            },
        )
        events, states = self._heard
        link.events.add(events)
        link.state.add(states)
        link.on_lost.add(self._lost)
        link.on_frame.add(self._frame)
        link.on_data.add(self._data)
        queue.on_motion.add(self._motion)

    def end(self, error: BaseException | None) -> None:
        """Record that the connection has ended."""
        self._count_junk(b"")
        fields: dict[str, object] = {"url": self._url}
        if self._link:
            fields["stats"] = plain(self._link.stats)

        if error is not None:
            fields["error"] = told(error)

        self._file.disconnected(self, {**self._name, **fields})

    def _write(self, kind: str, fields: dict[str, object]) -> None:
        self._file.write(kind, {**self._name, **fields})

    def _frame(self, outgoing: bool, frame: Frame) -> None:
        line = self._recording.words.line(frame, outgoing=outgoing)
        self._discreet = self._discreet or line["value"] == MASK
        self._write("frame", line)

    def _data(self, data: bytes) -> None:
        self._count_junk(data)

    def _count_junk(self, data: bytes) -> None:
        """Record what was no frame: how much, and what it was where it was all that came."""
        if not self._link:
            return

        found = self._link.stats.junk_bytes
        count, self._junk = found - self._junk, found
        if count:
            shown = {"raw": data.hex(" ")} if count == len(data) and not self._discreet else {}
            self._write("junk", {"direction": "in", "count": count, **shown})

    def _state(self, state: LinkState) -> None:
        self._write("state", {"state": state.value})

    def _lost(self, error: ConnectionLost) -> None:
        self._write("event", {"event": "ConnectionLost", "text": str(error)})

    def _event(self, event: object) -> None:
        fields: dict[str, object] = {"event": type(event).__name__}
        if isinstance(event, Unexpected):
            # Of its frame there is a line already, with what is secret left out.
            fields["key"] = str(cast("Unexpected[Frame]", event).frame.key)
        else:
            fields["value"] = plain(event)

        self._write("event", fields)

    def _motion(self, motion: Motion) -> None:
        if motion not in self._numbers:
            self._numbers[motion] = next(self._count)

        fields: dict[str, object] = {"motion": self._numbers[motion], "name": motion.name}
        if motion.ended:
            error = motion.exception()
            fields["state"] = "failed" if error else "done"
            if error:
                fields["error"] = told(error)
        elif motion.index is not None:
            fields |= {"state": "accepted", "index": motion.index}
        else:
            fields |= {"state": "put", "value": plain(motion.entry.value)}

        self._write("motion", fields)


def told(error: BaseException) -> str:
    """Return an error as a trace has it."""
    parts = [str(error), *getattr(error, "__notes__", ())]
    return ": ".join([type(error).__name__, *filter(None, ["; ".join(filter(None, parts))])])
