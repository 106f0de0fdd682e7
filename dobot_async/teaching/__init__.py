"""Teach an arm, keep what it was taught, and let it play that back.

    arm --Recorder--> Recording --save_recording--> part.json, part.playback
                          |
                          `--check_recording--> play(arm, recording)

The steps of a recording are in the words of the arm's family: no family plays another one's.
"""

from __future__ import annotations

from dobot_async.teaching.files import from_json, load_recording, save_recording, to_json
from dobot_async.teaching.playback_file import read_playback, write_playback
from dobot_async.teaching.player import play
from dobot_async.teaching.problems import RecordingFileError, RecordingUnfit
from dobot_async.teaching.recorder import Recorder, released
from dobot_async.teaching.recording import PathSample, Recording, TaughtStep
from dobot_async.teaching.registry import check_recording

__all__ = [
    "PathSample",
    "Recorder",
    "Recording",
    "RecordingFileError",
    "RecordingUnfit",
    "TaughtStep",
    "check_recording",
    "from_json",
    "load_recording",
    "play",
    "read_playback",
    "released",
    "save_recording",
    "to_json",
    "write_playback",
]
