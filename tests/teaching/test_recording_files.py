"""Recordings as files: what was written is read again, and what is wrong in a file is told with its place."""

from __future__ import annotations

import json
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async.teaching import (
    PathSample,
    Recording,
    RecordingFileError,
    RecordingUnfit,
    TaughtStep,
    from_json,
    load_recording,
    read_playback,
    save_recording,
    to_json,
    write_playback,
)
from dobot_async.teaching.recording import said_once

finite = st.floats(allow_nan=False, allow_infinity=False)
names = st.text(st.characters(exclude_categories=("C", "Z")) | st.just(" "), max_size=8)
four = st.tuples(finite, finite, finite, finite)
seconds = st.floats(0, 1e6)


def steps(grippers: st.SearchStrategy[Any], suctions: st.SearchStrategy[Any]) -> st.SearchStrategy[TaughtStep]:
    """Steps that a playback file can hold."""
    common: dict[str, Any] = {"pause": seconds, "name": names, "gripper": grippers, "suction": suctions}
    straight = st.builds(TaughtStep, four, mode=st.sampled_from(["point", "line", "jump"]), **common)
    return straight | st.builds(TaughtStep, four, mode=st.just("arc"), via=four, **common)


NONE = st.none()
GRIPPERS = st.sampled_from([None, "off", 0.0, 100.0])
playable = st.lists(steps(NONE, st.sampled_from([None, False, True])), max_size=6) | st.lists(
    steps(GRIPPERS, NONE), max_size=6
)
any_step = steps(GRIPPERS | st.floats(0, 100), st.sampled_from([None, False, True])) | st.builds(
    TaughtStep, st.just(()), st.lists(finite, min_size=1, max_size=7), mode=st.just("joints"), name=names
)
recordings = st.builds(
    Recording, names, names, names, st.lists(finite, max_size=3), st.lists(any_step, max_size=5)
) | st.builds(
    lambda times, joints: Recording(
        "mycobot",
        "myarm300",
        path=[PathSample(time, joints, joints[:3]) for time in sorted(times)],  # type: ignore[arg-type]
    ),
    st.sets(seconds, max_size=6),
    st.lists(finite, min_size=4, max_size=7).map(tuple),
)


@given(recordings)
def test_json_comes_back_equal(recording: Recording) -> None:
    assert from_json(to_json(recording)) == recording


@given(playable)
def test_a_playback_file_comes_back_equal(found: list[TaughtStep]) -> None:
    recording = Recording("magician", steps=said_once(found))
    again = read_playback(write_playback(recording).encode())
    assert again.steps == recording.steps
    assert not again.remarks


def test_files_are_chosen_by_their_suffix(tmp_path: Path) -> None:
    recording = Recording(
        "magician", "", "suction", (59.7, 0, 0), (TaughtStep((200, 0, 20, 0), (1, 2, 3, 4), name="Über <1> & 2"),)
    )
    save_recording(recording, tmp_path / "part.json")
    save_recording(recording, tmp_path / "part.playback")
    assert load_recording(tmp_path / "part.json") == recording
    assert load_recording(str(tmp_path / "part.playback")).steps == (replace(recording.steps[0], joints=()),)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["part.json", "part.playback"]
    assert json.loads((tmp_path / "part.json").read_text())["version"] == 1


GOOD = '{"format": "dobot_async recording", "version": 1, "family": "magician", '


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no JSON"),
        ("[" * 100_000, "no JSON"),
        ("[]", "no recording"),
        ('{"format": "something"}', "no recording"),
        (GOOD.replace("1", "2") + '"steps": []}', "version 2 is not known; this release reads version 1"),
        (GOOD.replace("1", "true") + '"steps": []}', "version True"),
        (GOOD.replace('"family": "magician", ', '"steps": []}'), "family is missing"),
        (GOOD + '"speed": 3}', "'speed' is none of family, model"),
        (GOOD + '"steps": {}}', "part.json: steps: a list"),
        (GOOD + '"steps": [1]}', "part.json: steps 1: an object, not 1"),
        (GOOD + '"steps": [{"pose": [1, 2, 3, 4]}, {"mode": "line"}]}', "steps 2: pose is missing"),
        (GOOD + '"steps": [{"pose": [1, 2, 3, 4], "mode": "fly"}]}', "steps 1: mode must be 'point' or"),
        (GOOD + '"steps": [{"pose": [1, 2, NaN, 4]}]}', "NaN is no number"),
        (GOOD + '"steps": [{"pose": [1, 2, 1e999, 4]}]}', "finite"),
        (GOOD + '"steps": [{"pose": [1, 2, "3", 4]}]}', "a number, not '3'"),
        (GOOD + '"steps": [{"pose": [1, 2, 3, 4], "suction": 1}]}', "suction cannot be 1"),
        (GOOD + '"steps": [{"pose": [1, 2, 3, 4], "pause": true}]}', "pause cannot be True"),
        (GOOD + '"steps": [{"pose": [1, 2, 3, 4], "pause": -1}]}', "pause must be 0 or more"),
        (GOOD + '"steps": [{"pose": [1, 2, 3, 4], "gripper": 101}]}', "gripper must be 0"),
        (GOOD + '"steps": [{"pose": [1, 2, 3, 4], "name": "a\\nb"}]}', "on one line"),
        (GOOD + '"steps": [{"pose": [1, 2, 3, 4], "mode": "arc"}]}', "via is for the mode 'arc'"),
        (
            GOOD + '"path": [{"time": 1, "joints": [1]}, {"time": 1, "joints": [1]}]}',
            "sample 2 of the path must be later",
        ),
        (GOOD + '"steps": [{"pose": [1]}], "path": [{"time": 1, "joints": [1]}]}', "steps or a path, not both"),
    ],
)
def test_what_is_wrong_in_json_is_told_with_its_place(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "part.json").write_text(text)
    with pytest.raises(RecordingFileError) as caught:
        load_recording(tmp_path / "part.json")

    assert words in str(caught.value)
    assert caught.value.file == "part.json"


def row(number: int, **items: object) -> str:
    """A row, with the names of its items as i0, i1, ..."""
    inner = "".join(f"<item_{name[1:]}>{value}</item_{name[1:]}>" for name, value in items.items())
    return f"<row{number}>{inner}</row{number}>\n"


def file_of(*rows: str, heads: str = "<DobotType><item_0>Magician</item_0></DobotType>\n<StudioVersion/>\n") -> bytes:
    return f'<?xml version="1.0"?>\n<root>\n{heads}{"".join(rows)}</root>'.encode()


PLACE = {"i2": 200, "i3": -10, "i4": 20.5, "i5": 45}


def test_a_playback_file_is_read() -> None:
    found = read_playback(
        file_of(
            row(0, i0=1, i1="above", **PLACE, i6=0, i7=0, i8=0, i9=0, i10=0, i12=0),
            row(1, i0=2, i1="", **PLACE, i10=" 0.5 ", i12=1),
            row(2, i0=0, **PLACE, i12=1),
            row(3, i0=3, **PLACE, i6=1, i7=2, i8=3, i9=4, i12=0),
        )
    )
    pose = (200, -10, 20.5, 45)
    assert found.steps == (
        TaughtStep(pose, name="above", suction=False),
        TaughtStep(pose, mode="line", pause=0.5, suction=True),
        TaughtStep(pose, mode="jump"),
        TaughtStep(pose, mode="arc", via=(1, 2, 3, 4), suction=False),
    )
    assert (found.family, found.tool, found.remarks) == ("magician", "suction", ())


def test_the_gripper_of_a_playback_file() -> None:
    found = read_playback(file_of(*(row(n, i0=1, **PLACE, i11=n) for n in range(3))))
    assert [step.gripper for step in found.steps] == ["off", 0, 100]
    assert found.tool == "gripper"


def test_what_is_not_known_is_told(caplog: pytest.LogCaptureFixture) -> None:
    data = file_of(
        row(0, i0=1, **PLACE, i13="new"),
        row(1, i0=1, **PLACE).replace("<row1>", '<row1 speed="3">text<other>1</other>'),
        row(2, i0=1, **PLACE).replace("<item_0>", "<item_0><deep>9</deep>"),
        row(3, i0=1, **PLACE).replace("</row3>", "<item_2>7</item_2></row3>"),
    )
    with caplog.at_level(logging.WARNING, "dobot_async.teaching"):
        found = read_playback(data)

    assert len(found.steps) == 4
    assert found.steps[3].pose[0] == 200
    for words in ("item_13 of <row0> is not known: 'new'", "speed", "'text'", "<other>", "<deep>", "<item_2> twice"):
        assert sum(words in remark for remark in found.remarks) == 1
        assert words in caplog.text

    assert found.remarks[0].startswith("line ")


def test_a_point_where_a_head_should_be_is_told() -> None:
    found = read_playback(file_of(row(2, i0=1, **PLACE), heads=row(0, i0=1, **PLACE) + row(1, i0=1, **PLACE)))
    assert len(found.steps) == 1
    assert [remark.startswith(f"line {line}: ") for line, remark in zip((3, 4), found.remarks, strict=True)] == [
        True
    ] * 2


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "line 1: no XML"),
        (b"<root>\n<a>\n</root>", "line 3: no XML"),
        (b'<?xml version="1.0" encoding="klingon"?><root/>', "encoding"),
        (file_of(row(0, i1="x", **PLACE)), "line 5: item_0 of <row0> is missing"),
        (file_of(row(0, i0=4, **PLACE)), "item_0 of <row0> must be 0 to 3, not 4"),
        (file_of(row(0, i0=1.5, **PLACE)), "not 1.5"),
        (file_of(row(0, i0=1, i2=1, i3=2)), "item_4 of <row0> cannot be nothing"),
        (
            file_of(row(0, i0=1, **PLACE), row(1, i0=1, **{**PLACE, "i3": "1,5"})),
            "line 6: item_3 of <row1> cannot be 1,5",
        ),
        (file_of(row(0, i0=1, **{**PLACE, "i3": "1e999"})), "item_3"),
        (file_of(row(0, i0=3, **PLACE)), "item_6"),
        (file_of(row(0, i0=1, **PLACE, i10=-1)), "pause must be 0 or more"),
        (file_of(row(0, i0=1, **PLACE, i12=2)), "item_12 of <row0> must be 0 to 1, not 2"),
    ],
)
def test_what_is_wrong_in_a_playback_file_is_told_with_its_line(data: bytes, words: str) -> None:
    with pytest.raises(RecordingFileError) as caught:
        read_playback(data)

    assert words in str(caught.value)


@pytest.mark.parametrize(
    "doctype",
    [
        '<!DOCTYPE root [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>',
        '<!DOCTYPE root [<!ENTITY b SYSTEM "file:///etc/passwd">]>',
        '<!DOCTYPE root SYSTEM "http://127.0.0.1:1/evil.dtd">',
    ],
)
def test_entities_are_refused(doctype: str) -> None:
    data = file_of(row(0, i0=1, i1="&b;", **PLACE)).replace(b"<root>", f"{doctype}<root>".encode())
    with pytest.raises(RecordingFileError, match="line 2: a document type is not read"):
        read_playback(data)


@pytest.mark.parametrize(
    ("recording", "words"),
    [
        (Recording("mycobot", "myarm300", steps=(TaughtStep((1, 2, 3, 4)),)), "a Magician's"),
        (Recording("magician", path=(PathSample(0, (1, 2, 3, 4)),)), "no path"),
        (Recording("magician", steps=(TaughtStep((1, 2, 3, 4), (1, 2, 3, 4), "joints"),)), "step 1"),
        (Recording("magician", steps=(TaughtStep((1, 2, 3, 4), gripper=40),)), "not 40.0 percent"),
        (Recording("magician", steps=(TaughtStep((1, 2, 3, 4), gripper=0, suction=True),)), "not both"),
    ],
)
def test_what_a_playback_file_cannot_hold_is_refused(tmp_path: Path, recording: Recording, words: str) -> None:
    with pytest.raises(RecordingUnfit, match=words):
        save_recording(recording, tmp_path / "part.playback")

    assert not list(tmp_path.iterdir())
