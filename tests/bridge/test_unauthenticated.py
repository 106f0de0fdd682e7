"""Unauthenticated peers at a bridge: silent, many, slow, in another protocol. Nothing of theirs reaches the arm."""

from __future__ import annotations

import asyncio
import logging
import socket
import struct
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import urlsplit

import pytest
from bridge_rig import IN_TIME, TCP, ask, bridged, client, far, until
from hypothesis import given, settings
from hypothesis import strategies as st
from quick_suite import examples

from dobot_async import Magician
from dobot_async._core.protocol.transport import MANY
from dobot_async._core.util.text import LONGEST, printable
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import encode
from dobot_async.bridge import handshake
from dobot_async.bridge.families import FAMILIES, family_of
from dobot_async.bridge.handshake import PENDING, Authenticator, Handshakes, TokenHandshake
from dobot_async.bridge.limits import Allowance

TOKEN = "geheim-4711"
PEM = Path(__file__).with_name("localhost.pem")
WS = "ws://127.0.0.1:0"
HELLO = b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"R" * 32 + b"\x20" + b"S" * 32
UPGRADE = (
    b"GET %b HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n%b\r\n"
)


@asynccontextmanager
async def silent(url: str, number: int) -> AsyncIterator[list[socket.socket]]:
    """Connections that say nothing."""
    place = urlsplit(url)
    loop = asyncio.get_running_loop()
    sockets = []
    try:
        for _ in range(number):
            sockets.append(socket.socket())
            sockets[-1].setblocking(False)
            await loop.sock_connect(sockets[-1], (place.hostname or "", place.port or 0))

        yield sockets
    finally:
        for each in sockets:
            each.close()


async def answer_to(url: str, data: bytes) -> bytes:
    """What comes back of a port until it hangs up."""
    place = urlsplit(url)
    reader, writer = await asyncio.open_connection(place.hostname, place.port)
    writer.write(data)
    told = b""
    with suppress(OSError):
        async with asyncio.timeout(IN_TIME):
            while piece := await reader.read(4096):
                told += piece

    writer.close()
    return told


@pytest.mark.parametrize("tls", [False, True], ids=["plain", "tls"])
@pytest.mark.parametrize("listen", [TCP, WS])
async def test_who_says_nothing_is_one_of_a_few_and_keeps_nobody_out(listen: str, tls: bool) -> None:
    served = bridged(listen, token=TOKEN, certificate=PEM if tls else None)
    async with served as rig, silent(rig.url, 3 * PENDING):
        await until(lambda: len(rig.told("turned away")) >= min(2 * PENDING, 40))
        trust = f"&ca={PEM}" if tls else ""
        url = rig.url.replace("127.0.0.1", "localhost") if tls else rig.url
        async with Magician.connect(f"{url}?token={TOKEN}{trust}", control=False) as arm:
            assert await arm.get_pose()


async def test_without_a_token_it_is_the_same() -> None:
    async with bridged() as rig, silent(rig.url, PENDING) as first, silent(rig.url, PENDING + 10):
        for each in first:
            with suppress(ConnectionResetError):
                assert await asyncio.get_running_loop().sock_recv(each, 1) == b""

        assert set(rig.told("turned away")) == {"too many others want to come in"}
        async with client(rig.url) as plain:
            assert await plain.ask(c.GET_POSE)


@pytest.mark.parametrize("tls", [False, True], ids=["plain", "tls"])
@pytest.mark.parametrize("listen", [TCP, WS])
async def test_who_says_nothing_has_not_long(listen: str, tls: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(handshake, "HANDSHAKE", 0.05)
    async with bridged(listen, token=TOKEN, certificate=PEM if tls else None) as rig, silent(rig.url, 1) as (one,):
        with suppress(ConnectionResetError):
            assert await asyncio.get_running_loop().sock_recv(one, 1) == b""

        assert rig.told("turned away") == ["it has not said its token in time"]


async def test_tls_has_not_long_either_where_there_is_no_token(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dobot_async.endpoints.listeners.TLS_WITHIN", 0.05)
    async with bridged(certificate=PEM) as rig, silent(rig.url, 1) as (one,):
        with suppress(ConnectionResetError):
            assert await asyncio.get_running_loop().sock_recv(one, 1) == b""


async def test_a_bridge_ends_while_somebody_agrees_upon_tls() -> None:
    async with AsyncExitStack() as strangers, bridged(certificate=PEM, token=TOKEN) as rig:
        await strangers.enter_async_context(silent(rig.url, 3))
        await until(lambda: any("TLS" in task.get_name() for task in asyncio.all_tasks()))

    assert not [task for task in asyncio.all_tasks() if "TLS" in task.get_name()]


def test_one_address_does_not_crowd_out_another() -> None:
    refused: list[str] = []
    guard = Authenticator(None, frozenset(), lambda _: None, lambda name, _: refused.append(name))
    host: Any = SimpleNamespace()
    handshakes = Handshakes(host, guard, TokenHandshake)

    def connect(name: str) -> None:
        handshakes.client(lambda _: None, lambda: None, ordered=True, name=name)

    connect("tcp://10.0.0.1:1")
    for port in range(10 * PENDING):
        connect(f"tcp://10.0.0.2:{port}")

    connect("tcp://10.0.0.1:2")
    assert "tcp://10.0.0.1:1" not in refused
    assert len(refused) == 9 * PENDING + 2


@pytest.mark.parametrize(
    "first",
    [
        HELLO,
        b"POST / HTTP/1.1\r\n\r\n",
        b"OPTIONS * HTTP/1.1\r\n\r\n",
        b"CONNECT a:1 HTTP/1.1\r\n\r\n",
        b"get / HTTP/1.1\r\n\r\n",
        b"PROPPATCHX / HTTP/1.1\r\n\r\n",
        b"\r\nPOST / HTTP/1.1\r\n\r\n",
        b"M-SEARCH * HTTP/1.1\r\n\r\n",
        b"\0",
        b"\xaaX",
    ],
)
@pytest.mark.parametrize("family", ["magician", "mycobot280", "ultraarm"])
def test_what_begins_otherwise_than_the_arms_own_frames_is_turned_away(family: str, first: bytes) -> None:
    assert family_of(family).begins(first) is False


@pytest.mark.parametrize(
    ("family", "first"), [("magician", b"\xaa"), ("mycobot280", b"\xfe"), ("ultraarm", b"G"), ("ultraarm", b" \r\n")]
)
def test_half_a_beginning_is_waited_for(family: str, first: bytes) -> None:
    assert family_of(family).begins(first) is None


@pytest.mark.parametrize("family", list(FAMILIES))
def test_what_a_bridge_says_itself_begins_as_clients_do(family: str) -> None:
    known = family_of(family)
    for each in (known.greeting, *known.stopping, *known.barriers):
        assert known.begins(bytes(each))


@pytest.mark.parametrize("listen", [TCP, "udp://127.0.0.1:0"])
async def test_a_motion_inside_of_something_else_is_not_executed(listen: str) -> None:
    async with bridged(listen, speed=1.0) as rig, client(rig.url) as plain:
        requests = rig.sim.arm.counters.requests
        await plain.transport.send(HELLO + encode(far()))
        await until(lambda: rig.told("turned away"))
        assert rig.sim.arm.counters.requests == requests
        assert not rig.sim.arm.device.moving
        assert rig.bridge.clients == 0


async def test_a_token_that_nobody_asked_for_is_taken_and_does_not_reach_the_arm() -> None:
    async with bridged() as rig, client(f"{rig.url}?token={TOKEN}") as plain:
        assert await plain.ask(c.GET_POSE)
        assert rig.sim.arm.counters.junk_bytes == 0


@pytest.mark.parametrize(
    ("listen", "origin"),
    [
        (WS, b"Origin: https://\xff\r\n"),
        (WS, b"Origin: https://\x1b[31m\r\n"),
        (WS, b"Origin: https://" + b"a" * 4000 + b"\r\n"),
    ],
)
async def test_whatever_strangers_say_is_made_printable(
    listen: str, origin: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    async with bridged(listen) as rig:
        await answer_to(rig.url, UPGRADE % (b"/", origin))
        await until(lambda: rig.told("turned away"))
        async with client(rig.url) as plain:
            assert await plain.ask(c.GET_POSE)

        if b"\x1b" not in origin:  # no header has that
            assert rig.told("turned away")[0].startswith("a web page of https://")

        for event in rig.happened:
            text = str(event)
            assert text.isascii()
            assert text.isprintable()
            assert len(text) < 2 * LONGEST + 40
            text.encode("cp1252")

    assert all(record.getMessage().isprintable() for record in caplog.records if record.name == "dobot_async.bridge")


@pytest.mark.parametrize(
    ("path", "more"),
    [
        (b"//[", b""),
        (b"/?token=%ff", b""),
        (b"/", b"Origin: https://a.example\r\nOrigin: https://b.example\r\n"),
        (b"/", b"Sec-WebSocket-Key: again\r\n"),
        (b"/", b"Content-Length: 5\r\n"),
        (b"/", b"Authorization: Bearer \xff\r\n"),
    ],
)
async def test_a_strange_request_is_answered_or_hung_up_on_and_harms_nobody(path: bytes, more: bytes) -> None:
    async with bridged(WS, token=TOKEN) as rig:
        await asyncio.wait_for(answer_to(rig.url, UPGRADE % (path, more) + bytes(300)), IN_TIME)
        async with Magician.connect(f"{rig.url}?token={TOKEN}", control=False) as arm:
            assert await arm.get_pose()


async def test_a_request_that_does_not_end_is_turned_away() -> None:
    async with bridged(WS) as rig:
        await answer_to(rig.url, b"GET / HTTP/1.1\r\n" + b"X: " + b"a" * 3000 + (b"\r\nX: " + b"a" * 3000) * 3)
        await until(lambda: rig.told("turned away"))


async def test_two_pages_in_one_request_are_both_to_be_allowed() -> None:
    both = b"Origin: https://good.example\r\nOrigin: https://evil.example\r\n"
    async with bridged(WS, origins=["https://good.example"]) as rig:
        assert (await answer_to(rig.url, UPGRADE % (b"/", both))).startswith(b"HTTP/1.1 403")


async def test_one_more_by_udp_than_there_may_be_is_told() -> None:
    async with bridged("udp://127.0.0.1:0") as rig, AsyncExitStack() as stack:
        for _ in range(MANY):
            one = await stack.enter_async_context(client(rig.url))
            await one.ask(c.GET_DEVICE_NAME)

        more = await stack.enter_async_context(client(rig.url))
        await more.send(ask(c.GET_DEVICE_NAME))
        await until(lambda: rig.told("turned away"))
        assert f"{MANY} others" in rig.told("turned away")[0]


@pytest.mark.parametrize("listen", [TCP, "udp://127.0.0.1:0", WS])
async def test_a_token_may_be_long(listen: str) -> None:
    token = "x" * 200
    async with bridged(listen, token=token) as rig, Magician.connect(f"{rig.url}?token={token}", control=False) as arm:
        assert await arm.get_pose()


async def test_what_strangers_cause_is_told_a_few_times_and_then_counted() -> None:
    async with bridged(token=TOKEN) as rig:
        now = 0.0
        rig.bridge._log._rates["turned away"] = Allowance(0.5, lambda: now, most=40)
        for _ in range(1000):
            rig.bridge.turned_away("tcp://127.0.0.1:1", "a wrong token")

        await until(lambda: rig.told("turned away"))
        assert len(rig.told("turned away")) < 50
        now = 10.0
        rig.bridge.turned_away("tcp://127.0.0.1:1", "a wrong token")
        await until(lambda: "more that are not told" in rig.told("turned away")[-1])


@pytest.mark.parametrize("reset", [False, True])
async def test_who_leaves_before_it_is_let_in_leaves_nothing(reset: bool) -> None:
    async with bridged([TCP, WS], token=TOKEN, certificate=PEM) as rig:
        for url in rig.bridge.urls:
            async with silent(url, 5) as sockets:
                for each in sockets if reset else []:
                    each.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))

        await until(lambda: not [task for task in asyncio.all_tasks() if "TLS" in task.get_name()])
        assert rig.bridge.clients == 0


@settings(max_examples=examples(30))
@given(st.text())
def test_any_text_is_made_printable(text: str) -> None:
    shown = printable(text)
    assert shown.isascii()
    assert shown.isprintable()
    if text.isascii() and text.isprintable() and len(text) <= LONGEST:
        assert shown == text
