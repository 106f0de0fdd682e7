"""Arms on Zenoh: found by name, moved by one, watched by many, and stopped when their mover has gone."""

from __future__ import annotations

import asyncio
import json
from contextlib import AsyncExitStack, suppress
from pathlib import Path
from typing import Any

import anyio
import pytest
import zenoh
from bridge_rig import IN_TIME, Plain, Rig, ask, bridged, client, far, until
from zenoh_rig import configured, connect_to, endpoint, keep, place, session, warm_up, written

from dobot_async import ConnectFailed, ConnectionLost, Magician, discover
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import encode
from dobot_async.bridge import Limits, bridge
from dobot_async.discovery.zenoh import ZenohArms
from dobot_async.fleet import Fleet
from dobot_async.transports import open_transport
from dobot_async.transports.zenoh.messages import DATA, END, HEADER

GET_POSE = encode(ask(c.GET_POSE))


@pytest.fixture(scope="module", autouse=True)
def runtime() -> None:
    warm_up()


@pytest.fixture(autouse=True)
def no_configuration(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ZENOH_CONFIG", raising=False)


def on_its_way(rig: Rig) -> bool:
    return not rig.sim.arm.device.idle


# --- an arm like any other ---


async def test_an_arm_on_zenoh_is_an_arm_like_any_other() -> None:
    async with bridged(place()) as rig, Magician.connect(rig.url) as arm:
        async with arm.queue.batch() as batch:
            moves = [batch.move_to(200 + 5 * step, 0, 40) for step in range(20)]

        await moves[-1]
        await arm.move_to(220, 30, 40)
        assert (await arm.get_pose()).y == pytest.approx(30, abs=0.1)
        assert [move.x for move in rig.executed(c.SET_PTP_CMD)] == [*(200 + 5 * step for step in range(20)), 220]
        assert rig.bridge.holder
        assert rig.bridge.holder.startswith("zenoh:")
        assert not rig.told("stopped")


async def test_one_moves_the_arm_and_others_watch_it() -> None:
    async with bridged([place(), "tcp://127.0.0.1:0"]) as rig, Magician.connect(rig.url) as mover:
        async with (
            Magician.connect(rig.url, control=False) as watcher,
            Magician.connect(rig.bridge.urls[1], control=False) as other,
        ):
            await mover.move_to(220, 0, 40)
            assert (await watcher.get_pose()).x == pytest.approx((await other.get_pose()).x) == pytest.approx(220)
            async with client(rig.url) as second:
                await second.send(far())
                assert await second.hears_nothing()

        assert "moves the arm" in rig.told("refused")[0]
        assert len(rig.executed(c.SET_PTP_CMD)) == 1


async def test_many_reads_at_once_get_their_own_answers() -> None:
    async with bridged(place()) as rig, Magician.connect(rig.url, control=False) as arm:
        poses, infos = await asyncio.gather(
            asyncio.gather(*(arm.get_pose() for _ in range(100))), asyncio.gather(*(arm.get_info() for _ in range(100)))
        )
        assert {pose.x for pose in poses} == {poses[0].x}
        assert {info.name for info in infos} == {"Dobot Magician"}
        assert arm.link.stats.timeouts == arm.link.stats.unexpected == 0


async def test_a_burst_of_answers_arrives_whole() -> None:
    burst = 1000
    async with bridged(place(), limits=Limits(frames=1e6, data=1e7)) as rig, client(rig.url) as plain:
        await plain.send(*[ask(c.GET_POSE)] * burst)
        assert [(await plain.receive()).id for _ in range(burst)] == [c.GET_POSE.id] * burst


async def test_a_router_passes_everything_on() -> None:
    router = endpoint()
    async with session(mode="router", listen__endpoints=[router]):
        async with bridged(f"zenoh://left?connect={router}") as rig, Magician.connect(rig.url) as arm:
            await arm.move_to(220, 0, 40)
            assert connect_to(rig.url) == router

        assert rig.executed(c.SET_PTP_CMD)


async def test_a_file_of_zenohs_says_everything(tmp_path: Path) -> None:
    where = endpoint()
    served = written(tmp_path / "server.json5", listen__endpoints=[where])
    used = written(tmp_path / "client.json5", connect__endpoints=[where])
    async with bridged(f"zenoh://left?config={served}") as rig:
        assert rig.url == "zenoh://left"
        async with Magician.connect(f"zenoh://left?config={used}", control=False) as arm:
            await arm.get_pose()


async def test_the_environment_may_name_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with bridged(place()) as rig:
        file = written(tmp_path / "client.json5", connect__endpoints=[connect_to(rig.url)])
        monkeypatch.setenv("ZENOH_CONFIG", str(file))
        async with Magician.connect("zenoh://left", control=False) as arm:
            await arm.get_pose()


# --- who has gone ---


async def test_a_mover_that_goes_in_the_middle_of_a_motion_stops_the_arm() -> None:
    async with bridged(place(), speed=1) as rig:
        async with client(rig.url) as mover:
            await mover.ask(c.SET_QUEUED_CMD_START_EXEC)
            await mover.send(far(), far(-100))
            await mover.receive()
            await until(lambda: on_its_way(rig))

        await until(lambda: rig.told("stopped"))
        await until(lambda: rig.sim.arm.device.idle)
        assert rig.executed(c.SET_PTP_CMD) == []
        assert rig.bridge.holder is None


async def test_a_motion_is_left_to_end_if_the_bridge_is_told_so() -> None:
    async with bridged(place(), on_vanish="leave", speed=10) as rig:
        async with client(rig.url) as mover:
            await mover.ask(c.SET_QUEUED_CMD_START_EXEC)
            await mover.send(far())
            await mover.receive()

        await until(lambda: rig.executed(c.SET_PTP_CMD))
        assert not rig.told("stopped")


async def test_whoever_is_taken_over_hears_that_its_connection_has_ended() -> None:
    async with bridged(place(), takeover=True) as rig, Magician.connect(rig.url) as first:
        await first.move_to(220, 0, 40)
        async with Magician.connect(rig.url) as second:
            await second.move_to(220, 10, 40)
            with pytest.raises(ConnectionLost, match="the bridge has ended this connection"):
                await first.get_pose()


async def test_the_end_of_the_server_is_the_end_of_the_connection() -> None:
    async with AsyncExitStack() as stack:
        rig = await stack.enter_async_context(bridged(place()))
        async with Magician.connect(rig.url, control=False) as arm:
            await stack.aclose()
            with pytest.raises(ConnectionLost, match=r"served|ended"):
                await arm.get_pose()


async def test_a_program_that_may_reconnect_finds_the_server_again() -> None:
    where = f"zenoh://left?listen={endpoint()}"
    async with AsyncExitStack() as stack:
        sim = await stack.enter_async_context(bridged())
        served = AsyncExitStack()
        url = (await served.enter_async_context(bridge(sim.url, listen=where))).url
        async with Magician.connect(url, reconnect=True) as arm:
            await arm.move_to(220, 0, 40)
            await served.aclose()
            await until(lambda: arm.link.state.value.value == "reopening")
            async with bridge(sim.url, listen=where):
                await arm.move_to(220, 10, 40)

            assert arm.link.outages >= 1


async def test_what_is_closed_stays_closed() -> None:
    async with bridged(place()) as rig:
        transport = await open_transport(rig.url, arm="magician")
        await transport.send(GET_POSE)
        assert await transport.receive()
        await transport.aclose()
        await transport.aclose()
        for call in (transport.receive(), transport.send(GET_POSE)):
            with pytest.raises(anyio.ClosedResourceError):
                await call


async def test_a_connection_that_is_cancelled_while_it_opens_leaves_nothing() -> None:
    async with bridged(place()) as rig:
        for rounds in range(10):
            opening = asyncio.create_task(open_transport(rig.url, arm="magician"))
            for _ in range(2 * rounds):
                await asyncio.sleep(0.001)

            opening.cancel()
            for transport in await asyncio.gather(opening, return_exceptions=True):
                if not isinstance(transport, BaseException):
                    await transport.aclose()

        await until(lambda: rig.bridge.clients == 0)


# --- messages ---


class Stranger:
    """A client that speaks Zenoh alone, and makes mistakes."""

    def __init__(self, own: zenoh.Session, name: str = "left") -> None:
        self.session = own
        self.link = f"dobot/{name}/@link/{own.zid()}"
        self.heard = keep(own, f"{self.link}/down")

    async def enter(self, introduction: bytes = b'{"version": 1, "who": "stranger"}', tries: int = 100) -> str:
        """The answer to the question whether it may come in."""
        for _ in range(tries):
            replies = await asyncio.to_thread(self._get, introduction)
            if replies and "not been seen" not in replies[0]:
                return replies[0]

            await asyncio.sleep(0.02)

        return "no answer"

    def _get(self, introduction: bytes) -> list[str]:
        replies = self.session.get(self.link, payload=introduction, timeout=5)
        return [reply.err.payload.to_string() if reply.err else "" for reply in replies]

    def send(self, number: int, data: bytes) -> None:
        self.session.put(
            f"{self.link}/up", HEADER.pack(number, DATA) + data, congestion_control=zenoh.CongestionControl.BLOCK
        )

    def flood(self) -> None:
        """Sends more than anybody may."""
        for number in range(2000):
            self.send(number, GET_POSE * 100)

    async def ended(self) -> str:
        """Why its connection has ended."""
        await until(lambda: self.heard and HEADER.unpack_from(self.heard[-1][1])[1] == END)
        return self.heard[-1][1][HEADER.size :].decode()


async def test_a_message_that_is_lost_ends_the_connection() -> None:
    async with bridged(place()) as rig, session(rig.url) as own:
        stranger = Stranger(own)
        token = own.liveliness().declare_token(stranger.link)
        assert await stranger.enter() == ""
        stranger.send(0, GET_POSE)
        stranger.send(0, GET_POSE)
        await until(lambda: stranger.heard)
        stranger.send(2, GET_POSE)
        assert await stranger.ended() == "1 messages were lost on the way"
        stranger.send(3, GET_POSE)
        await until(lambda: len(stranger.heard) == 3)
        assert await stranger.ended() == "its connection has ended"
        withdraw(token)


async def test_who_shows_no_token_or_speaks_otherwise_is_not_let_in() -> None:
    async with bridged(place()) as rig, session(rig.url) as own:
        stranger = Stranger(own)
        assert await stranger.enter(tries=10) == "no answer"
        stranger.send(0, encode(far()))
        assert await stranger.ended() == "its connection has ended"
        token = own.liveliness().declare_token(stranger.link)
        for wrong in (b"", b"\xff", b"[]", b'{"version": 99}'):
            assert "speaks version 1" in await stranger.enter(wrong)

        assert rig.bridge.clients == 0
        withdraw(token)


async def test_who_floods_is_cut_and_others_do_not_notice() -> None:
    async with bridged(place()) as rig, session(rig.url) as own, Magician.connect(rig.url) as mover:
        stranger = Stranger(own)
        token = own.liveliness().declare_token(stranger.link)
        assert await stranger.enter(b'{"version": 1, "who": "\\u001b[31mbad"}') == ""
        await asyncio.to_thread(stranger.flood)
        assert await stranger.ended()
        await mover.move_to(220, 0, 40)
        assert rig.executed(c.SET_PTP_CMD)
        assert not [event for event in rig.happened if "\x1b" in str(event)]
        withdraw(token)


async def test_a_server_that_loses_an_answer_is_not_believed() -> None:
    where = endpoint()
    async with session(listen__endpoints=[where]) as server:
        name: list[str] = []

        def admit(query: zenoh.Query) -> None:
            name.append(str(query.key_expr))
            query.reply(query.key_expr, b"")

        server.declare_queryable("dobot/left/@link/*", zenoh.handlers.Callback(admit, indirect=False))
        token = server.liveliness().declare_token(f"dobot/left/@arm/magician/{server.zid()}")
        transport = await open_transport(f"zenoh://left?connect={where}", arm="magician")
        for number in (0, 1, 1, 3):
            server.put(f"{name[0]}/down", HEADER.pack(number, DATA) + b"%d" % number)

        assert [await transport.receive(), await transport.receive()] == [b"0", b"1"]
        with pytest.raises(anyio.BrokenResourceError) as broken:
            await transport.receive()

        assert "1 messages were lost" in str(broken.value.__cause__)
        await transport.aclose()
        withdraw(token)


async def test_who_receives_nothing_is_told_so_and_memory_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dobot_async.transports.zenoh.transport.UNREAD", 1000)
    async with bridged(place()) as rig:
        transport = await open_transport(rig.url, arm="magician")
        with pytest.raises(anyio.BrokenResourceError) as broken:
            while True:
                await transport.send(GET_POSE)
                await asyncio.sleep(0.001)

        assert "unread" in str(broken.value.__cause__)
        received = 0
        with pytest.raises(anyio.BrokenResourceError):
            while True:
                received += len(await transport.receive())

        assert 0 < received <= 1000
        await transport.aclose()


async def test_an_introduction_that_is_a_bomb_is_none() -> None:
    async with bridged(place()) as rig, session(rig.url) as own:
        stranger = Stranger(own)
        token = own.liveliness().declare_token(stranger.link)
        for bomb in (b"[" * 1000, b"[" * 100_000, b'{"version": 1, "who": "%s"}' % (b"x" * 2000)):
            assert "speaks version 1" in await stranger.enter(bomb)

        assert await stranger.enter() == ""
        withdraw(token)


async def test_who_is_no_client_is_not_answered_without_end() -> None:
    async with bridged(place()) as rig, session(rig.url) as own, Magician.connect(rig.url) as mover:
        stranger = Stranger(own)
        token = own.liveliness().declare_token(stranger.link)
        for number in range(2000):
            stranger.send(number, GET_POSE)

        await until(lambda: stranger.heard)
        await mover.move_to(220, 0, 40)
        assert len(stranger.heard) < 1000
        withdraw(token)


async def test_a_name_that_is_everybody_ends_nobody() -> None:
    async with bridged(place()) as rig, session(rig.url) as own, Magician.connect(rig.url) as mover:
        token = own.liveliness().declare_token("dobot/left/@link/*")
        told = keep(own, "dobot/left/@link/*/down")
        for name in ("*", "**", "$*"):
            with suppress(zenoh.ZError):
                own.put(f"dobot/left/@link/{name}/up", b"x")

        await mover.move_to(220, 0, 40)
        await mover.get_pose()
        assert not [key for key, _ in told if "*" in key]
        withdraw(token)


async def test_of_two_servers_of_one_name_that_begin_together_one_serves() -> None:
    router = endpoint()
    async with session(mode="router", listen__endpoints=[router]), AsyncExitStack() as stack:
        begun = await asyncio.gather(
            *(stack.enter_async_context(bridged(f"zenoh://left?connect={router}")) for _ in range(3)),
            return_exceptions=True,
        )
        failed = [each for each in begun if isinstance(each, BaseException)]
        assert len(failed) == 2
        assert all(isinstance(each, ConnectFailed) for each in failed)
        async with Magician.connect(f"zenoh://left?connect={router}", control=False) as arm:
            assert await arm.get_pose()


@pytest.mark.parametrize("token", ["evil\x1b[31m/@arm/magician/1", "x\ny/@arm/magician/2", "left/@arm/m\x1b[2J/3"])
def test_a_name_that_a_terminal_would_obey_is_no_arm(token: str) -> None:
    assert ZenohArms()._found(f"dobot/{token}") is None
    assert ZenohArms()._found("dobot/left/@arm/magician/1234abcd")


async def test_a_server_that_goes_while_it_lets_somebody_in_has_just_gone() -> None:
    where = endpoint()
    async with session(listen__endpoints=[where]) as server:
        token = server.liveliness().declare_token(f"dobot/left/@arm/magician/{server.zid()}")

        def admit(query: zenoh.Query) -> None:
            withdraw(token)
            query.reply(query.key_expr, b"")

        server.declare_queryable("dobot/left/@link/*", zenoh.handlers.Callback(admit, indirect=False))
        with pytest.raises((ConnectFailed, anyio.BrokenResourceError), match=r"just gone|^$"):
            transport = await open_transport(f"zenoh://left?connect={where}", arm="magician")
            try:
                await transport.receive()
            finally:
                await transport.aclose()


# --- names ---


async def test_an_arm_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dobot_async.transports.zenoh.transport.PRESENT", 0.3)
    async with bridged(place()) as rig:
        with pytest.raises(ConnectFailed, match="no arm called right is on Zenoh"):
            await open_transport(rig.url.replace("left", "right"), arm="magician")

        with pytest.raises(ConnectFailed, match="is a magician, and not a myarm300"):
            await open_transport(rig.url, arm="myarm300")


async def test_a_name_is_given_once() -> None:
    async with bridged(place()) as rig:
        with pytest.raises(ConnectFailed, match="an arm called left is on Zenoh already"):
            async with bridge("sim:", listen=f"zenoh://left?connect={connect_to(rig.url)}"):
                pass

        async with session(rig.url) as own:
            token = own.liveliness().declare_token("dobot/left/@arm/magician/other")
            await until_found(ZenohArms(connect=(connect_to(rig.url),)), 2)
            with pytest.raises(ConnectFailed, match="2 arms are called left"):
                await open_transport(rig.url, arm="magician")

            withdraw(token)


def withdraw(token: Any) -> None:
    """Takes a token back."""
    token.undeclare()


async def until_found(arms: ZenohArms, number: int) -> None:
    """Returns when so many arms are there."""
    async with asyncio.timeout(IN_TIME):
        while len([found async for found in discover(sources=[arms], timeout=0.2)]) < number:
            pass


async def test_discover_lists_the_arms_that_are_there_with_who_they_are() -> None:
    router = endpoint()
    async with (
        session(mode="router", listen__endpoints=[router]),
        bridged(f"zenoh://left?connect={router}"),
        bridged(f"zenoh://right?connect={router}") as right,
    ):
        right.sim.arm.state.set(c.SET_DEVICE_SN, "SN2")
        arms = ZenohArms(connect=(router,))
        await until_found(arms, 2)
        found = [each async for each in discover(sources=[arms], timeout=1, probe=True)]
        assert [each.url for each in found] == [f"zenoh://{name}?connect={router}" for name in ("left", "right")]
        assert [each.info.serial_number for each in found if each.info] == ["DTSIM00000000001", "SN2"]
        assert all(each.families == ("magician",) for each in found)


@pytest.mark.parametrize(
    "wrong",
    [
        "zenoh://",
        "zenoh://a/b",
        "zenoh://*",
        "zenoh://$x",
        "zenoh://@arm",
        "zenoh://left?connect=host",
        "zenoh://l?lan=no",
    ],
)
async def test_a_wrong_url_is_said_to_be_wrong(wrong: str) -> None:
    with pytest.raises(ValueError, match="zenoh"):
        await open_transport(wrong, arm="magician")

    with pytest.raises(ValueError, match=r"zenoh|endpoints|yes"):
        async with bridge("sim:", listen=wrong):
            pass


async def test_a_wrong_file_is_said_to_be_wrong(tmp_path: Path) -> None:
    (tmp_path / "bad.json5").write_text("{mode: 'nonsense'}")
    for file in ("none.json5", "bad.json5"):
        with pytest.raises(ValueError, match="cannot use the Zenoh configuration") as wrong:
            await open_transport(f"zenoh://left?config={tmp_path / file}", arm="magician")

        assert ".rs:" not in str(wrong.value)

    taken = endpoint()
    async with session(listen__endpoints=[taken]):
        with pytest.raises(ConnectFailed, match="Zenoh cannot be started"):
            async with bridge("sim:", listen=f"zenoh://left?listen={taken}"):
                pass


# --- readings ---


async def test_readings_are_published_while_somebody_wants_them() -> None:
    async with bridged(place()) as rig, Magician.connect(rig.url) as arm:
        before = rig.bridge.link.stats.sent
        async with session(rig.url) as own:
            kept = keep(own, "dobot/**")
            await until(lambda: {key for key, _ in kept} == {f"dobot/left/{name}" for name in READINGS})
            await arm.move_to(220, 0, 40)
            told = len(kept)
            await until(lambda: len([key for key, _ in kept[told:] if key.endswith("motion")]) > 1)
            await until(lambda: len([key for key, _ in kept[told:] if key.endswith("pose")]) > 1)

        last = {key.rpartition("/")[2]: json.loads(data) for key, data in kept}
        assert {name: set(last[name]) for name in last} == READINGS
        assert last["pose"]["x"] == pytest.approx(220, abs=0.1)
        assert (last["motion"]["moving"], last["motion"]["controller"]) == (False, rig.bridge.holder)
        assert last["alarms"]["alarms"][0]["name"] == "COMMON_RESET"
        assert (last["link"]["state"], last["link"]["clients"]) == ("open", 1)
        assert last["link"]["sent"] > before

        # Nobody looks any more: what goes to the arm is what its mover asks.
        await until_quiet(rig)


async def until_quiet(rig: Rig) -> None:
    """Returns when nothing goes to the arm in a while that is longer than the time between two readings."""
    async with asyncio.timeout(IN_TIME):
        before = -1
        while rig.bridge.link.stats.sent != before:
            before = rig.bridge.link.stats.sent
            await asyncio.sleep(0.5)


READINGS = {
    "pose": {"time", "x", "y", "z", "r", "j1", "j2", "j3", "j4"},
    "motion": {"time", "index", "moving", "controller"},
    "alarms": {"time", "alarms"},
    "link": {
        *("time", "state", "outages", "clients", "controller", "sent", "received", "repeated", "lost", "timeouts"),
        *("unexpected", "junk_bytes", "bad_frames"),
    },
}


async def test_a_mover_is_seen_to_move() -> None:
    async with bridged(place(), speed=1) as rig, session(rig.url) as own, client(rig.url) as mover:
        kept = keep(own, "dobot/left/motion")
        await mover.ask(c.SET_QUEUED_CMD_START_EXEC)
        await mover.send(far())
        await mover.receive()
        await until(lambda: kept and json.loads(kept[-1][1])["moving"])
        await stop(mover)


async def stop(mover: Plain) -> None:
    """Stops the arm."""
    await mover.ask(c.SET_QUEUED_CMD_FORCE_STOP_EXEC)


def test_the_rig_is_confined_to_this_computer() -> None:
    config = configured()
    assert config.get_json("listen/endpoints") == "[]"
    assert config.get_json("scouting/multicast/enabled") == "false"


# --- a cell across machines ---


async def test_a_fleet_moves_arms_of_two_servers_and_stops_them_together() -> None:
    async with bridged(place("left"), speed=2) as one, bridged(place("right"), speed=2) as other:
        async with Fleet.connect({"left": one.url, "right": other.url}) as fleet:
            await asyncio.gather(*(fleet[name].queue.move_to(200, 100, 40) for name in ("left", "right")))
            await until(lambda: on_its_way(one) and on_its_way(other))
            await fleet.stop()
            assert not on_its_way(one)
            assert not on_its_way(other)

        assert one.executed(c.SET_PTP_CMD) == other.executed(c.SET_PTP_CMD) == []
