"""The figures of arms as Prometheus reads them, and who gets them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from bridge_rig import bridged
from prometheus_client.parser import text_string_to_metric_families
from virtual import virtual

from dobot_async import Arm, ArmAlarm, Magician, MyCobot, UltraArm
from dobot_async._core.util.hosts import host_and_port, is_for_us
from dobot_async.metrics import figures_of, figures_of_bridge, metrics_text, read_figures, serve_metrics
from dobot_async.simulator import simulate

Samples = dict[tuple[str, ...], float]


def parsed(text: bytes) -> Samples:
    """The samples by name and labels, as Prometheus' own parser has them."""
    return {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(text.decode())
        for sample in family.samples
    }


@virtual
async def test_a_link_tells_what_went_over_it_and_what_was_lost() -> None:
    async with simulate("magician", speed=50, seed=3) as sim, Magician.connect(sim.url) as arm:
        before = parsed(metrics_text({"left": figures_of(arm)}))
        assert before["dobot_link_losses_total", "left"] == 0
        sim.faults.loss, sim.faults.latency = 0.3, 0.004
        for _ in range(40):
            await arm.get_pose(timeout=20)

        sim.faults.loss = 0.0
        await arm.get_pose()
        told = parsed(metrics_text({"left": await read_figures(arm)}))

    assert told["dobot_link_up", "left"] == 1
    assert told["dobot_link_losses_total", "left"] > 0
    assert told["dobot_link_repeats_total", "left"] > 0
    assert told["dobot_link_requests_total", "left"] >= told["dobot_link_replies_total", "left"] > 40
    assert 0.001 < told["dobot_link_round_trip_seconds", "left"] < 0.1
    assert told["dobot_alarms", "left"] == 1  # that it was switched on


@virtual
async def test_motions_are_counted_by_how_they_ended_and_alarms_by_how_many_there_are() -> None:
    async with simulate("magician", speed=50) as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(200, 0, 40)
        await arm.move_to(220, 0, 40)
        with pytest.raises(ArmAlarm):
            await arm.move_to(900, 0, 40)

        motion = await arm.queue.move_to(200, 100, 40)
        pending = parsed(metrics_text({"a": figures_of(arm)}))
        await arm.stop()
        told = parsed(metrics_text({"a": await read_figures(arm)}))
        assert motion.ended

    assert pending["dobot_queue_pending", "a"] == pending["dobot_moving", "a"] == 1
    assert "dobot_alarms" not in {name for name, *_ in pending}
    assert told["dobot_motions_total", "a", "done"] == 2
    assert told["dobot_motions_total", "a", "ArmAlarm"] == 1
    assert told["dobot_motions_total", "a", "MotionStopped"] == 1
    assert told["dobot_queue_pending", "a"] == told["dobot_moving", "a"] == 0
    assert told["dobot_alarms", "a"] == len(sim.arm.alarms) > 0


@virtual
async def test_arms_of_all_families_have_figures() -> None:
    async with (
        MyCobot.connect("sim:?speed=50") as cobot,
        UltraArm.connect("sim:?speed=50") as ultraarm,
        Magician.connect("sim:?speed=50", control=False) as magician,
    ):
        await cobot.power_on()
        await cobot.home()
        await ultraarm.home()
        arms: dict[str, Arm] = {"c": cobot, "u": ultraarm, "m": magician}
        told = parsed(metrics_text({name: await read_figures(arm) for name, arm in arms.items()}))

    assert [told["dobot_motions_total", name, "done"] for name in "cum"] == [1, 1, 0]
    assert [told["dobot_alarms", name] for name in "cum"] == [0, 0, 1]


@virtual
async def test_an_arm_that_does_not_answer_has_no_alarms_to_tell_and_the_rest() -> None:
    async with simulate("magician") as sim, Magician.connect(sim.url) as arm:
        sim.faults.silent = True
        told = parsed(metrics_text({"a": await read_figures(arm)}))

    assert "dobot_alarms" not in {name for name, *_ in told}
    assert told["dobot_link_up", "a"] == 1


async def test_a_bridge_tells_of_its_arm_and_its_clients() -> None:
    async with bridged() as rig:
        idle = parsed(metrics_text({"arm": await figures_of_bridge(rig.bridge)}))
        async with Magician.connect(rig.url) as arm:
            await arm.queue.move_to(200, 100, 40)
            await arm.queue.wait(5)
            busy = parsed(metrics_text({"arm": await figures_of_bridge(rig.bridge)}))
            await arm.stop()

        stopped = parsed(metrics_text({"arm": await figures_of_bridge(rig.bridge)}))

    assert (idle["dobot_bridge_clients", "arm"], idle["dobot_lease_held", "arm"]) == (0, 0)
    assert (busy["dobot_bridge_clients", "arm"], busy["dobot_lease_held", "arm"]) == (1, 1)
    assert busy["dobot_moving", "arm"] == 1
    assert stopped["dobot_bridge_stops_total", "arm"] > busy["dobot_bridge_stops_total", "arm"]
    assert idle["dobot_alarms", "arm"] == 1  # that it was switched on


class Asked:
    """Counts how often the figures were asked for."""

    def __init__(self) -> None:
        self.times = 0

    async def __call__(self) -> bytes:
        self.times += 1
        return b"figures\n"


@asynccontextmanager
async def served(token: str | None = None) -> AsyncIterator[tuple[Asked, int]]:
    asked = Asked()
    async with serve_metrics(("127.0.0.1", 0), asked, token=token) as url:
        yield asked, int(url.split(":")[2].split("/")[0])


async def get(port: int, request: bytes) -> bytes:
    """What is answered to these bytes."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(request)
    try:
        async with asyncio.timeout(20):
            return await reader.read()
    finally:
        writer.close()
        await writer.wait_closed()


HOST = b"Host: 127.0.0.1\r\n"


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"GET /metrics HTTP/1.1\r\n" + HOST + b"\r\n", b"200"),
        (b"GET /metrics?x=1 HTTP/1.1\r\nHost: localhost:9464\r\n\r\n", b"200"),
        (b"GET /metrics HTTP/1.1\r\nHost: rebound.example\r\n\r\n", b"421"),
        (b"GET /metrics HTTP/1.1\r\n\r\n", b"421"),
        (b"GET /metrics HTTP/1.1\r\n" + HOST + HOST + b"\r\n", b"421"),
        (b"GET / HTTP/1.1\r\n" + HOST + b"\r\n", b"404"),
        (b"POST /metrics HTTP/1.1\r\n" + HOST + b"\r\n", b"405"),
        (b"\xff\x00\xfe\r\n\r\n", b"421"),
        (b"GET /metrics" + 9000 * b"x", b""),
    ],
)
async def test_only_the_page_is_served(request_: bytes, status: bytes) -> None:
    async with served() as (asked, port):
        answer = await get(port, request_)
        assert answer.split(b" ")[1:2] == ([status] if status else [])
        assert (b"figures" in answer) == (status == b"200") == bool(asked.times)


@pytest.mark.parametrize(
    ("header", "status"),
    [
        (b"", b"401"),
        (b"Authorization: Bearer wrong\r\n", b"401"),
        (b"Authorization: Bearer geheim\r\n", b"200"),
        (b"Authorization: Basic geheim\r\n", b"401"),
        (b"Authorization: Bearer gehe\xefm\r\n", b"401"),
    ],
)
async def test_a_token_is_asked_for(header: bytes, status: bytes) -> None:
    async with served("geheim") as (_, port):
        answer = await get(port, b"GET /metrics HTTP/1.1\r\n" + HOST + header + b"\r\n")
        assert answer.split(b" ")[1] == status


async def test_who_asks_often_does_not_load_the_line() -> None:
    async with served() as (asked, port):
        request = b"GET /metrics HTTP/1.1\r\n" + HOST + b"\r\n"
        answers = await asyncio.gather(*(get(port, request) for _ in range(10)))
        assert all(answer.endswith(b"figures\n") for answer in answers)
        assert asked.times < 10


async def test_those_who_say_nothing_keep_nobody_out() -> None:
    async with served() as (_, port):
        silent = [await asyncio.open_connection("127.0.0.1", port) for _ in range(40)]
        assert b"figures" in await get(port, b"GET /metrics HTTP/1.1\r\n" + HOST + b"\r\n")
        for _, writer in silent:
            writer.close()


async def test_another_address_than_this_computers_needs_a_token() -> None:
    with pytest.raises(ValueError, match="token"):
        async with serve_metrics(("0.0.0.0", 0), Asked()):
            pass


@pytest.mark.parametrize(
    ("host", "good"),
    [
        ("127.0.0.1:80", True),
        ("[::1]:80", True),
        ("localhost", True),
        ("Lab.example:80", True),
        ("evil.example", False),
        ("localhost.evil.example", False),
        ("localhost@evil.example", False),
        ("127.0.0.1.evil.example", False),
        ("", False),
        ("[::1", False),
        ("localhost/", False),
    ],
)
def test_a_name_of_another_server_is_none_of_ours(host: str, good: bool) -> None:
    assert is_for_us(host, ["lab.example"]) == good


@pytest.mark.parametrize("text", ["", "9464", "host", "host:x", "host:99999", "a@b:1", "h:1/x", "[::1:5"])
def test_a_place_is_a_host_and_a_port(text: str) -> None:
    with pytest.raises(ValueError, match="HOST:PORT"):
        host_and_port(text)

    assert host_and_port("[::1]:5") == ("::1", 5)
