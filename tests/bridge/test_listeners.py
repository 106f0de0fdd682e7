"""Who may connect to a bridge: tokens on each transport, web pages, TLS; nothing unauthenticated reaches the arm."""

from __future__ import annotations

import asyncio
import builtins
import logging
import ssl
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from bridge_rig import IN_TIME, Plain, Rig, ask, bridged, client, until
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from dobot_async import ConnectFailed, Magician, open_transport
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Parser, encode
from dobot_async.bridge.listeners import Listeners

TOKEN = "geheim-4711"
PLACES = ["tcp://127.0.0.1:0", "udp://127.0.0.1:0", "ws://127.0.0.1:0"]
NAME = ask(c.GET_DEVICE_NAME)
PEM = Path(__file__).with_name("localhost.pem")
PAGE = "https://example.org"


async def names_itself(connection: Any) -> bool:
    """Whether the arm answers over a WebSocket."""
    await connection.send(encode(NAME))
    async with asyncio.timeout(IN_TIME):
        (reply,) = Parser().feed(await connection.recv())

    return bool(reply.params == b"Dobot Magician\0")


async def stays_outside(rig: Rig, requests: int) -> None:
    """Checks that an unauthenticated peer was noticed, and that the arm was not."""
    await until(lambda: rig.told("turned away"))
    assert rig.sim.arm.counters.requests == requests
    assert rig.told("connected") == []


@pytest.mark.parametrize("listen", PLACES)
async def test_the_driver_presents_the_token(listen: str) -> None:
    async with bridged(listen, token=TOKEN) as rig, Magician.connect(f"{rig.url}?token={TOKEN}") as arm:
        await arm.move_to(220, 0, 40)
        assert rig.sim.arm.pose.x == pytest.approx(220, abs=0.01)


@pytest.mark.parametrize("listen", PLACES)
@pytest.mark.parametrize("query", ["?token=wrong", ""])
async def test_nothing_reaches_the_arm_without_the_token(listen: str, query: str) -> None:
    async with bridged(listen, token=TOKEN) as rig:
        requests = rig.sim.arm.counters.requests
        with pytest.raises(ConnectFailed) as failed:
            async with Magician.connect(rig.url + query, timeout=0.3):
                pass

        assert "wrong" not in str(failed.value)
        await stays_outside(rig, requests)


@pytest.mark.parametrize(
    "first", [b"TOKEN wrong\n", b"TOKEN \n", b"token geheim-4711\n", b"TOKEN" + b"x" * 300, b"\n", encode(NAME)]
)
async def test_a_stranger_by_tcp_is_hung_up_on(first: bytes) -> None:
    async with bridged(token=TOKEN) as rig, client(rig.url) as plain:
        requests = rig.sim.arm.counters.requests
        await plain.transport.send(first + encode(NAME))
        assert await plain.hung_up()
        await stays_outside(rig, requests)


async def test_the_line_may_come_in_pieces_and_with_the_first_request() -> None:
    async with bridged(token=TOKEN) as rig, client(rig.url) as plain:
        for piece in (b"TO", b"KEN gehe", b"im-4711\r\n" + encode(NAME)):
            await plain.transport.send(piece)
            await asyncio.sleep(0.002)

        assert (await plain.receive()).id == NAME.id


async def test_who_says_nothing_is_hung_up_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dobot_async.bridge.handshake.HANDSHAKE", 0.05)
    async with bridged(token=TOKEN) as rig, client(rig.url) as plain:
        assert await plain.hung_up()
        assert rig.told("turned away") == ["it has not said its token in time"]


async def test_strangers_do_not_keep_others_out() -> None:
    async with bridged(token=TOKEN) as rig:
        place = urlsplit(rig.url)
        assert place.hostname
        strangers = [await asyncio.open_connection(place.hostname, place.port) for _ in range(40)]
        async with client(f"{rig.url}?token={TOKEN}") as plain:
            assert (await plain.ask(c.GET_DEVICE_NAME)).id == NAME.id

        for _, writer in strangers:
            writer.close()


async def test_a_sender_of_datagrams_is_known_once_it_has_said_the_token() -> None:
    async with bridged("udp://127.0.0.1:0", token=TOKEN) as rig, client(rig.url) as plain:
        await plain.transport.send(encode(NAME))
        await plain.transport.send(b"TOKEN geheim-4711\n")
        assert (await plain.ask(c.GET_DEVICE_NAME)).id == NAME.id
        await plain.transport.send(b"TOKEN wrong\n" + encode(NAME))
        assert (await plain.ask(c.GET_POSE)).id == c.GET_POSE.id
        assert len(rig.told("turned away")) == 2


@pytest.mark.parametrize(
    ("query", "headers", "first"),
    [
        ("", {"Authorization": f"Bearer {TOKEN}"}, None),
        (f"/?token={TOKEN}", {}, None),
        ("", {}, f"TOKEN {TOKEN}"),
        ("", {"Origin": PAGE}, f"TOKEN {TOKEN}\n"),
    ],
    ids=["header", "query", "message", "page"],
)
async def test_a_websocket_presents_it_in_three_ways(query: str, headers: dict[str, str], first: str | None) -> None:
    async with AsyncExitStack() as stack:
        rig = await stack.enter_async_context(bridged("ws://127.0.0.1:0", token=TOKEN))
        connection = await stack.enter_async_context(connect(rig.url + query, additional_headers=headers))
        if first:
            await connection.send(first)

        assert await names_itself(connection)


@pytest.mark.parametrize("first", ["TOKEN wrong", "hello", b"TOKEN geheim-4711", encode(NAME), "TOKEN " + "x" * 300])
async def test_a_stranger_by_websocket_is_hung_up_on(first: str | bytes) -> None:
    async with bridged("ws://127.0.0.1:0", token=TOKEN) as rig, connect(rig.url) as connection:
        requests = rig.sim.arm.counters.requests
        await connection.send(first)
        with pytest.raises(ConnectionClosed):
            await connection.recv()

        await stays_outside(rig, requests)


@pytest.mark.parametrize(("token", "status"), [(None, 403), (TOKEN, 401)])
async def test_a_web_page_is_not_let_in_without_a_token(token: str | None, status: int) -> None:
    async with bridged("ws://127.0.0.1:0", token=token) as rig:
        with pytest.raises(InvalidStatus) as refused:
            await connect(f"{rig.url}/?token=wrong" if token else rig.url, additional_headers={"Origin": PAGE})

        assert refused.value.response.status_code == status
        assert len(rig.told("turned away")) == 1


async def test_a_web_page_may_be_allowed() -> None:
    async with AsyncExitStack() as stack:
        rig = await stack.enter_async_context(bridged("ws://127.0.0.1:0", origins=[PAGE]))
        connection = await stack.enter_async_context(connect(rig.url, additional_headers={"Origin": PAGE}))
        assert await names_itself(connection)


@pytest.mark.parametrize("first", [b"POST / HTTP/1.1\r\n\r\n", b"GET /?x HTTP/1.1\r\n"])
async def test_what_a_browser_posts_to_a_port_does_not_reach_the_arm(first: bytes) -> None:
    async with bridged() as rig, client(rig.url) as plain:
        requests = rig.sim.arm.counters.requests
        for byte in first[:5]:
            await plain.transport.send(bytes((byte,)))

        await plain.transport.send(first[5:] + encode(NAME))
        assert await plain.hung_up()
        await stays_outside(rig, requests)


@pytest.mark.parametrize(
    ("listen", "needed"),
    [
        ("tcp://127.0.0.1:0", False),
        ("tcp://127.1.2.3:0", False),
        ("udp://[::1]:0", False),
        ("ws://localhost:0", False),
        ("pty", False),
        ("tcp://0.0.0.0:0", True),
        ("udp://192.168.1.2:0", True),
        ("ws://[::]:0", True),
        ("tcp://arm.example:0", True),
        ("tcp://127.0.0.1.example:0", True),
    ],
)
def test_a_token_is_made_up_where_others_can_come(listen: str, needed: bool) -> None:
    token = Listeners.of(["pty", listen], None, None, None, ()).token
    assert (token is not None) == needed
    assert len(token or "x" * 32) >= 32
    assert Listeners.of(["pty", listen], "mine", None, None, ()).token == "mine"


def test_a_made_up_token_is_another_one_each_time() -> None:
    assert len({Listeners.of(["ws://[::]:0"], None, None, None, ()).token for _ in range(10)}) == 10


async def test_tls() -> None:
    async with bridged(["tcp://127.0.0.1:0", "wss://localhost:0"], token=TOKEN, certificate=PEM) as rig:
        tcp, wss = rig.bridge.urls
        assert wss.startswith("wss://")
        for url in (tcp, wss):
            async with Magician.connect(f"{url}?token={TOKEN}&ca={PEM}") as arm:
                assert (await arm.get_info()).name == "Dobot Magician"

        with pytest.raises(ConnectFailed, match=r"(?i)certificate"):
            await open_transport(f"{tcp}?ca=system", arm="magician")

        with pytest.raises(ConnectFailed):
            await open_transport(f"{wss}?token={TOKEN}", arm="magician")


async def test_a_client_without_tls_gets_nothing_from_a_door_with_it() -> None:
    async with bridged(certificate=PEM) as rig, client(rig.url) as plain:
        await plain.send(NAME)
        assert await plain.hung_up()
        assert rig.told("connected") == []


async def test_no_token_is_ever_told(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    async with bridged(PLACES, token=TOKEN) as rig:
        for url in rig.bridge.urls:
            async with Magician.connect(f"{url}?token={TOKEN}", control=False) as arm:
                await arm.get_pose()
                assert TOKEN not in arm.link.url

            with pytest.raises(ConnectFailed) as failed:
                async with Magician.connect(f"{url}?token=falsch-0815", timeout=0.3):
                    pass

            assert "falsch-0815" not in str(failed.value)

        async with connect(rig.bridge.urls[2], additional_headers={"Authorization": f"Bearer {TOKEN}"}) as connection:
            assert await names_itself(connection)

        told = caplog.text.replace("websockets.client", "") + str(rig.happened)

    ours = [record.getMessage() for record in caplog.records if record.name.startswith("dobot_async")]
    assert ours
    assert TOKEN not in "".join(ours) + str(rig.happened)
    assert "falsch-0815" not in told


async def test_where_websockets_is_missing_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    original = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name.startswith("websockets"):
            raise ImportError(name)

        return original(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ConnectFailed, match="bridge"):
        await open_transport("ws://127.0.0.1:1", arm="magician")

    with pytest.raises(ConnectFailed, match="bridge"):
        async with bridged("ws://127.0.0.1:0"):
            pass


@pytest.mark.parametrize(
    "url",
    ["ws://", "ws://127.0.0.1:0", "ws://127.0.0.1/path", "ws://127.0.0.1:1?ca=x", "ws://127.0.0.1:1?token=", "ws:"],
)
async def test_a_bad_url_is_refused_before_anything_is_opened(url: str) -> None:
    with pytest.raises(ValueError, match=r"\S"):
        await open_transport(url, arm="magician")


async def test_text_messages_are_no_protocol() -> None:
    async with bridged("ws://127.0.0.1:0") as rig, connect(rig.url) as connection:
        await connection.send("hello")
        assert await names_itself(connection)


async def test_a_message_that_is_too_long_ends_the_connection() -> None:
    async with bridged("ws://127.0.0.1:0") as rig, connect(rig.url) as connection:
        await connection.send(bytes(10_000))
        with pytest.raises(ConnectionClosed):
            await connection.recv()


async def test_the_bridge_ends_while_programs_are_connected() -> None:
    async with bridged([*PLACES, "pty"]) as rig:
        transports = [await open_transport(url, arm="magician") for url in rig.bridge.urls]
        plain = [Plain(transport) for transport in transports]
        await asyncio.gather(*(each.ask(c.GET_DEVICE_NAME) for each in plain))

    for each in (plain[0], plain[2], plain[3]):
        assert await each.hung_up()

    for transport in transports:
        await transport.aclose()


def test_the_certificate_of_the_tests_is_one() -> None:
    ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(PEM)
