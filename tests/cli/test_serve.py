"""`dobot-async serve`, and programs on Zenoh, as processes: killed, cut off, and started again."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from collections.abc import AsyncIterator, Iterator

import pytest
from bridge_rig import bridged, until
from zenoh_rig import endpoint, line, place, processes_ended, program, warm_up

from dobot_async import ConnectionLost, Magician, MotionUnknown
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import Simulation, simulate

TCP = "tcp://127.0.0.1:0"
MOVER = """
import asyncio, sys
from dobot_async import Magician

async def main():
    async with Magician.connect(sys.argv[1]) as arm:
        await arm.queue.move_to(200, 100, 40)
        await arm.queue.move_to(200, -100, 40)
        print("moving", flush=True)
        await asyncio.sleep(3600)

asyncio.run(main())
"""


@pytest.fixture(scope="module", autouse=True)
def runtime() -> None:
    warm_up()


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    yield
    processes_ended()


@pytest.fixture
async def sim() -> AsyncIterator[Simulation]:
    async with simulate(listen=TCP, speed=20) as simulation:
        yield simulation


def served(arm: str, *options: str, name: str = "left", json_answer: bool = False) -> tuple[str, ...]:
    """The arguments of a server."""
    return "-m", "dobot_async", *(["--json"] if json_answer else []), "serve", "--name", name, *options, arm


async def test_it_prints_where_it_is_and_what_happens_and_ends_with_ctrl_c(sim: Simulation) -> None:
    async with program(*served(sim.url, "--listen", "tcp/127.0.0.1:0")) as server:
        url = await line(server)
        assert url.startswith("zenoh://left?connect=tcp/127.0.0.1:")
        async with program("-m", "dobot_async", "--url", url, "--json", "move", "220", "0", "40") as mover:
            output, errors = await mover.communicate()
            assert (mover.returncode, errors) == (0, b"")
            assert json.loads(output)["x"] == pytest.approx(220, abs=0.1)

        told = [await line(server) for _ in range(4)]
        assert sorted(each.split(": ")[1] for each in told) == ["connected", "lease", "left", "released"]
        server.send_signal(signal.SIGINT)
        output, errors = await server.communicate()
        assert (server.returncode, output, errors) == (130, b"", b"")


@pytest.mark.full
async def test_json_is_one_object_and_discover_lists_the_arm(sim: Simulation) -> None:
    where = endpoint()
    async with program(*served(sim.url, "--listen", where, json_answer=True)) as server:
        assert json.loads(await line(server)) == {"urls": [f"zenoh://left?connect={where}"]}
        search = ("discover", "--source", "zenoh", "--connect", where, "--timeout", "1", "--probe")
        async with program("-m", "dobot_async", "--json", *search) as found:
            output, errors = await found.communicate()
            assert errors == b""
            (arm,) = json.loads(output)["arms"]
            assert (arm["url"], arm["info"]["serial_number"]) == (f"zenoh://left?connect={where}", "DTSIM00000000001")


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (("sim:",), 2, "--name"),
        (("--name", "a/b", "sim:"), 2, "expected zenoh://name"),
        (("--name", "left", "--lan", "--listen", "tcp/127.0.0.1:0", "sim:"), 2, "--lan"),
        (("--name", "left", "--listen", "nonsense", "sim:"), 2, "expected endpoints"),
        (("--name", "left", "--zenoh", "missing.json5", "sim:"), 2, "missing.json5"),
        (("--name", "left", "--connect", "tcp/127.0.0.1:1", "sim:"), 1, "Zenoh cannot be started"),
        (("--name", "left", "tcp://127.0.0.1:1"), 1, "cannot reach"),
    ],
)
async def test_wrong_usage_and_no_arm(arguments: tuple[str, ...], code: int, told: str) -> None:
    async with program("-m", "dobot_async", "serve", *arguments) as server:
        output, errors = await server.communicate()
        assert (server.returncode, output) == (code, b"")
        assert told in errors.decode()


# --- killed ---


async def test_a_mover_that_is_killed_leaves_no_arm_in_motion() -> None:
    async with bridged(place(), speed=1) as rig, program("-c", MOVER, rig.url) as mover:
        assert await line(mover) == "moving"
        await until(lambda: not rig.sim.arm.device.idle)
        mover.kill()
        await until(lambda: rig.told("stopped"))
        await until(lambda: rig.sim.arm.device.idle)
        assert rig.executed(c.SET_PTP_CMD) == []
        assert rig.executed(c.SET_PTP_CMD, "aborted")


async def test_a_server_that_is_killed_is_a_lost_connection() -> None:
    async with (
        simulate(listen=TCP, speed=1) as sim,
        program(*served(sim.url, "--listen", "tcp/127.0.0.1:0")) as server,
        Magician.connect(await line(server)) as arm,
    ):
        motion = await arm.queue.move_to(200, 100, 40)
        server.kill()
        with pytest.raises((ConnectionLost, MotionUnknown)):
            await motion

        with pytest.raises(ConnectionLost, match="who served it is not on Zenoh any more"):
            await arm.get_pose()


@pytest.mark.full
async def test_a_program_goes_on_when_a_killed_server_is_started_again(sim: Simulation) -> None:
    where = endpoint()
    async with (
        program(*served(sim.url, "--listen", where)) as server,
        Magician.connect(await line(server), reconnect=True) as arm,
    ):
        await arm.move_to(220, 0, 40)
        server.kill()
        await until(lambda: arm.link.state.value.value == "reopening")
        async with program(*served(sim.url, "--listen", where)) as again:
            assert await line(again)
            for y in range(5):
                await arm.move_to(220, y, 40)

        places = [each.value.y for each in sim.arm.executed if each.command is c.SET_PTP_CMD]
        assert places == [0, 0, 1, 2, 3, 4]


# --- cut off ---


@pytest.fixture
def cable() -> Iterator[Cable]:
    """A cable between two networks of this test's own."""
    laid = Cable(f"dobot{os.getpid()}")
    if not laid.lay():
        pytest.skip("this user may not make network namespaces")

    yield laid
    laid.remove()


class Cable:
    """Two network namespaces and a cable between them; nothing of it is in the computer's own network."""

    def __init__(self, name: str) -> None:
        self.left, self.right = f"{name}-l", f"{name}-r"
        self.address = "198.18.0.1"
        self._ip = shutil.which("ip") or "ip"

    def lay(self) -> bool:
        """Whether that is allowed here."""
        try:
            self._run("netns", "add", self.left)
        except (OSError, subprocess.CalledProcessError):
            return False

        self._run("netns", "add", self.right)
        self._run("-n", self.left, "link", "add", "cable", "type", "veth", "peer", "cable", "netns", self.right)
        for end, address in ((self.left, self.address), (self.right, "198.18.0.2")):
            self._run("-n", end, "link", "set", "lo", "up")
            self._run("-n", end, "address", "add", f"{address}/24", "dev", "cable")
            self._run("-n", end, "link", "set", "cable", "up")

        return True

    def inside(self, end: str) -> tuple[str, ...]:
        """What a command line begins with that runs at an end."""
        return self._ip, "netns", "exec", end

    def plug(self, state: str) -> None:
        """Takes the cable out ("down"), or puts it in ("up")."""
        self._run("-n", self.right, "link", "set", "cable", state)

    def remove(self) -> None:
        """Removes it."""
        for end in (self.left, self.right):
            self._run("netns", "del", end)

    def _run(self, *arguments: str) -> None:
        subprocess.run([self._ip, *arguments], capture_output=True, check=True)


LOSING = MOVER.replace("await asyncio.sleep(3600)", "await arm.queue.join()")


@pytest.mark.full
async def test_a_cable_that_is_pulled_out_stops_the_arm_and_tells_the_mover(cable: Cable) -> None:
    where = f"tcp/{cable.address}:7447"
    async with (
        program(*served("sim:?speed=0.2", "--listen", where), before=cable.inside(cable.left)) as server,
        program("-c", LOSING, await line(server), before=cable.inside(cable.right)) as mover,
    ):
        assert await line(mover) == "moving"
        cable.plug("down")
        told = [await line(server)]
        while "stopped" not in told[-1]:
            told.append(await line(server))

        assert not [each for each in told if ": left" in each]
        _, errors = await mover.communicate()
        assert mover.returncode == 1
        assert "ConnectionLost" in errors.decode()
        assert "who served it is not on Zenoh any more, or cannot be reached" in errors.decode()

        cable.plug("up")
        url = f"zenoh://left?connect={where}"
        again = ("-m", "dobot_async", "--url", url, "--json", "pose")
        async with program(*again, before=cable.inside(cable.right)) as reader:
            output, _ = await reader.communicate()
            assert json.loads(output)["x"]


async def reads(url: str, cable: Cable) -> tuple[int | None, str]:
    """How a program on the other computer ends, that asks for the pose, and what it says."""
    arguments = ("-m", "dobot_async", "--url", url, "--json", "pose")
    async with program(*arguments, before=cable.inside(cable.right)) as reader:
        output, _ = await reader.communicate()
        return reader.returncode, output.decode()


@pytest.mark.full
async def test_an_arm_is_for_its_own_computer_unless_it_is_given_to_everybody(cable: Cable) -> None:
    for options, found in (((), False), (("--lan",), True)):
        async with program(*served("sim:", *options), before=cable.inside(cable.left)) as server:
            assert await line(server) == "zenoh://left"
            code, told = await reads("zenoh://left", cable)
            assert (code == 0) == found
            assert ("no arm called left is on Zenoh" in told) != found


@pytest.mark.full
async def test_an_arm_that_is_given_to_everybody_is_discovered(cable: Cable) -> None:
    async with program(*served("sim:", "--lan"), before=cable.inside(cable.left)) as server:
        await line(server)
        search = ("-m", "dobot_async", "--json", "discover", "--source", "zenoh", "--timeout", "2")
        async with program(*search, before=cable.inside(cable.right)) as found:
            output, _ = await found.communicate()
            assert [arm["url"] for arm in json.loads(output)["arms"]] == ["zenoh://left"]
