"""The dissector in tshark: over TCP, UDP, a USB bridge and captures of a serial line, however the frames are cut."""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from captures import MAGICIAN, MYCOBOT, ULTRAARM, Said, over_tcp, over_udp, over_usb, write_pcap
from click.testing import CliRunner
from virtual import run_virtual

from dobot_async import Magician, MyCobot, UltraArm
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame
from dobot_async.cli.commands.wireshark import dissector
from dobot_async.cli.main import cli
from dobot_async.simulator import simulate

REQUIRED = os.environ.get("DOBOT_REQUIRE_TSHARK")

pytestmark = pytest.mark.skipif(
    not REQUIRED and not shutil.which("tshark"), reason="tshark is not installed: the dissector is tested with it"
)


@pytest.fixture(scope="module")
def lua(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The dissector as a file."""
    path = tmp_path_factory.mktemp("lua") / "dobot_async.lua"
    path.write_text(CliRunner().invoke(cli, ["trace", "dissector"]).output, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def said() -> dict[str, list[Said]]:
    """What an arm of each family and its driver say, frame by frame."""
    found: dict[str, list[Said]] = {}
    kinds: dict[str, Any] = {"magician": Magician, "mycobot280": MyCobot, "ultraarm": UltraArm}

    async def talk() -> None:
        for model, kind in kinds.items():
            frames = found.setdefault(model, [])
            details: dict[str, Any] = {} if model == "mycobot280" else {"homed": True}
            async with simulate(model, **details) as sim, kind.connect(sim.url) as arm:
                arm.link.on_frame.add(lambda outgoing, frame, into=frames: into.append((outgoing, bytes(frame))))
                await arm.get_pose()
                if model == "mycobot280":
                    await arm.move_joints(10, 20, 30, 0, 0, 0)
                else:
                    await arm.move_to(220, 0, 40)

    run_virtual(talk())
    return found


def tshark(lua: Path, capture: Path, *options: str) -> list[dict[str, Any]]:
    """The layers of each packet, as tshark tells them."""
    command = ["tshark", "-X", f"lua_script:{lua}", "-r", str(capture), "-T", "json", "--no-duplicate-keys", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=True)
    assert "lua" not in done.stderr.lower().replace(str(lua).lower(), ""), done.stderr
    return [packet["_source"]["layers"] for packet in json.loads(done.stdout)]


def values(packets: Sequence[dict[str, Any]], name: str) -> list[str]:
    """All values of a field, in order, wherever in the packets it is."""

    def inside(node: Any) -> Iterator[str]:
        if isinstance(node, list):
            for each in node:
                yield from inside(each)
        elif isinstance(node, dict):
            for key, each in node.items():
                if key == name:
                    yield from each if isinstance(each, list) else [each]
                else:
                    yield from inside(each)

    return list(inside(list(packets)))


PORTS = {"magician": 8899, "mycobot280": 9000, "ultraarm": 9001}
PROTOS = {"magician": "dobot_magician", "mycobot280": "elephant_mycobot", "ultraarm": "elephant_ultraarm"}
LINKS = {"magician": MAGICIAN, "mycobot280": MYCOBOT, "ultraarm": ULTRAARM}
Way = Callable[[str, list[Said]], tuple[int, list[bytes]]]
WAYS: dict[str, Way] = {
    "tcp": lambda model, said: over_tcp(said, PORTS[model]),
    "udp": lambda model, said: over_udp(said, PORTS[model]),
    "usb": lambda _, said: over_usb(said),
    "serial": lambda model, said: (LINKS[model], [data for _, data in said]),
}


@pytest.mark.cases(1)
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("model", PROTOS)
def test_each_frame_is_found(model: str, way: str, lua: Path, said: dict[str, list[Said]], tmp_path: Path) -> None:
    capture = write_pcap(tmp_path / "capture.pcap", *WAYS[way](model, said[model]))
    packets = tshark(lua, capture)
    if model == "ultraarm":
        lines = [line for _, data in said[model] for line in data.decode().replace("\n", "\r").split("\r") if line]
        assert values(packets, "elephant_ultraarm.line") == lines
    else:
        ids = [str(data[3]) for _, data in said[model]]
        found = values(packets, f"{PROTOS[model]}.id")
        assert [str(int(each, 0)) for each in found] == ids


@pytest.mark.full
@pytest.mark.parametrize("way", ["tcp", "udp", "usb"])
def test_values_and_roles_are_told(way: str, lua: Path, said: dict[str, list[Said]], tmp_path: Path) -> None:
    packets = tshark(lua, write_pcap(tmp_path / "a.pcap", *WAYS[way]("magician", said["magician"])))
    assert set(values(packets, "dobot_magician.setptpcmd.x")) == {"220"}
    assert values(packets, "dobot_magician.setptpcmd.z") == ["40"]
    queued = [data for outgoing, data in said["magician"] if not outgoing and data[4] & 2]
    assert len(values(packets, "dobot_magician.index")) == len(queued) > 0
    named = dict(zip(values(packets, "dobot_magician.id"), values(packets, "dobot_magician.command"), strict=True))
    assert named["84"] == "SetPTPCmd"
    roles = {"request" if outgoing else "reply" for outgoing, _ in said["magician"]}
    assert set(values(packets, "dobot_magician.role")) == roles
    cobot = tshark(lua, write_pcap(tmp_path / "b.pcap", *WAYS[way]("mycobot280", said["mycobot280"])))
    assert values(cobot, "elephant_mycobot.sendangles.angles2") == ["20"]
    line = tshark(lua, write_pcap(tmp_path / "c.pcap", *WAYS[way]("ultraarm", said["ultraarm"])))
    assert "G0" in values(line, "elephant_ultraarm.command")
    assert "coordinate control" in values(line, "elephant_ultraarm.section")
    assert any(each.startswith("220.00") for each in values(line, "elephant_ultraarm.values"))


@pytest.mark.cases(1)
@pytest.mark.parametrize("way", ["tcp", "udp", "usb"])
@pytest.mark.parametrize("model", PROTOS)
def test_frames_that_are_cut_or_run_together_are_found(
    model: str, way: str, lua: Path, said: dict[str, list[Said]], tmp_path: Path
) -> None:
    rng = random.Random(model)
    whole = b"".join(data for outgoing, data in said[model] if outgoing)
    cuts = sorted({0, len(whole), *(rng.randrange(40, len(whole)) for _ in range(len(whole) // 12))})
    pieces = [(True, whole[begin:end]) for begin, end in pairwise(cuts)]
    packets = tshark(lua, write_pcap(tmp_path / "capture.pcap", *WAYS[way](model, pieces)))
    name = "elephant_ultraarm.line" if model == "ultraarm" else f"{PROTOS[model]}.id"
    expected = (
        [line.decode() for line in whole.split(b"\r") if line]
        if model == "ultraarm"
        else [str(data[3]) for outgoing, data in said[model] if outgoing]
    )
    found = values(packets, name)
    assert (found if model == "ultraarm" else [str(int(each, 0)) for each in found]) == expected


def test_what_is_no_frame_is_marked_and_hides_nothing(lua: Path, tmp_path: Path) -> None:
    good = bytes(Frame(c.GET_POSE.id, 0, b""))
    bad = good[:-1] + b"\x00"
    packets = tshark(lua, write_pcap(tmp_path / "a.pcap", MAGICIAN, [b"\x12\xaa" + bad + good + b"noise", good]))
    assert values(packets, "dobot_magician.command") == ["GetPose", "GetPose"]
    assert values(packets, "_ws.expert.message").count("these bytes belong to no frame") >= 2


@pytest.mark.full
def test_another_port_is_chosen_by_decode_as(lua: Path, said: dict[str, list[Said]], tmp_path: Path) -> None:
    capture = write_pcap(tmp_path / "capture.pcap", *over_tcp([(True, b"?"), *said["magician"]], 4321))
    chosen = tshark(lua, capture, "-d", "tcp.port==4321,dobot_magician", "-o", "dobot_magician.port:4321")
    roles = ["request" if outgoing else "reply" for outgoing, _ in said["magician"]]
    assert len(values(chosen, "dobot_magician.id")) == len(roles)
    assert values(chosen, "dobot_magician.role") == roles


def test_the_model_of_a_mycobot_is_chosen(lua: Path, tmp_path: Path) -> None:
    from dobot_async.arms.mycobot import commands as cobot
    from dobot_async.arms.mycobot.models import MODELS

    row = MODELS["myarm300"].row(cobot.SEND_ANGLES)
    frame = b"\xfe\xfe" + bytes((2 + 15, row.id)) + row.request.encode(cobot.JointsMove((1,) * 7, 10)) + b"\xfa"
    capture = write_pcap(tmp_path / "capture.pcap", MYCOBOT, [frame])
    found = tshark(lua, capture, "-o", "elephant_mycobot.model:myarm300")
    assert values(found, "elephant_mycobot.sendangles.angles7") == ["1"]


def test_all_commands_of_all_families_are_in_it() -> None:
    source = dissector()
    assert "--@TABLES@" not in source
    for row in c.ALL:
        assert f'"name": "{row.name}"'.replace('"name": ', '["name"] = ') in source
