"""Who may come in at a panel: each door is tried as an attacker would, over real sockets."""

from __future__ import annotations

import asyncio
import io
import json
import logging
from collections.abc import AsyncIterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from panel_rig import Shown, browser, page, shown, until

from dobot_async import ConnectFailed
from dobot_async.arms.magician import commands as c
from dobot_async.bridge.handshake import PENDING
from dobot_async.panel import Role, panel
from dobot_async.panel.access import Access
from dobot_async.panel.pending_connections import MOST

OPERATOR, VIEWER = "operator-token-4711", "viewer-token-0815"
CERTIFICATE = Path(__file__).parents[1] / "bridge" / "localhost.pem"


@pytest.fixture
async def rig() -> AsyncIterator[Shown]:
    async with shown(operator_token=OPERATOR, viewer_token=VIEWER) as found:
        yield found


async def status(rig: Shown, path: str = "", *, method: str = "GET", cookie: str = "", **headers: str) -> int:
    """What a request without a browser's manners is answered with."""
    if cookie:
        headers["Cookie"] = cookie

    async with (
        aiohttp.ClientSession() as http,
        http.request(method, f"{rig.panel.url}{path}", headers=headers, allow_redirects=False) as answer,
    ):
        return answer.status


async def cookie_of(rig: Shown, token: str) -> str:
    """The cookie that a token gives."""
    async with aiohttp.ClientSession() as http, http.get(f"{rig.panel.url}?token={token}") as answer:
        assert answer.status == 200
        found = answer.headers["Set-Cookie"]
        for word in ("HttpOnly", "SameSite=Strict", "Path=/"):
            assert word in found

        return found.partition(";")[0]


async def opens(rig: Shown, **headers: str) -> int:
    """What a request for a WebSocket is answered with; 101 if it is one."""
    async with aiohttp.ClientSession() as http:
        try:
            async with http.ws_connect(f"{rig.panel.url}ws", headers=headers):
                return 101
        except aiohttp.WSServerHandshakeError as error:
            return error.status


async def test_a_token_gives_a_cookie_that_is_not_the_token(rig: Shown) -> None:
    cookie = await cookie_of(rig, OPERATOR)
    assert OPERATOR not in cookie
    assert cookie != await cookie_of(rig, VIEWER)
    async with aiohttp.ClientSession() as http, http.get(f"{rig.panel.url}?token={OPERATOR}") as answer:
        assert answer.headers["Cache-Control"] == "no-store"
        assert answer.headers["Referrer-Policy"] == "no-referrer"
        assert OPERATOR not in await answer.text()


@pytest.mark.parametrize("path", ["", "static/index.html", "static/../web.py", "recordings/arm.json", "nothing"])
async def test_nothing_is_to_be_had_without_a_cookie(rig: Shown, path: str) -> None:
    assert await status(rig, path) == 401
    assert await status(rig, path, cookie=f"dobot_panel_{rig.panel.port}=0") == 401
    assert await status(rig, path, cookie=f"dobot_panel_{rig.panel.port}={OPERATOR}") == 401


@pytest.mark.parametrize("token", ["", "x", OPERATOR[:-1], OPERATOR + "x", "%00", "\udc80", "ü" * 100])
async def test_a_wrong_token_gives_nothing(rig: Shown, token: str) -> None:
    async with (
        aiohttp.ClientSession() as http,
        http.get(rig.panel.url, params={"token": token.encode(errors="surrogateescape").decode("latin-1")}) as answer,
    ):
        assert answer.status == 401
        assert "Set-Cookie" not in answer.headers


async def test_a_cookie_of_another_port_is_none(rig: Shown) -> None:
    _, _, value = (await cookie_of(rig, OPERATOR)).partition("=")
    assert await status(rig, cookie=f"dobot_panel_1={value}") == 401


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:{port}",
        "localhost:1",
        "127.0.0.1",
        "127.0.0.1.evil.example:{port}",
        "a@127.0.0.1:{port}",
        "",
        "[",
        "127.0.0.1:x",
    ],
)
async def test_another_host_is_not_served(rig: Shown, host: str) -> None:
    """A name that somebody has made to lead here is how a page of his would read what this server says."""
    cookie = await cookie_of(rig, OPERATOR)
    host = host.format(port=rig.panel.port)
    origin = f"http://{host}"
    assert await status(rig, cookie=cookie, Host=host) in {400, 421}
    assert await status(rig, f"?token={OPERATOR}", Host=host) in {400, 421}
    assert await opens(rig, Cookie=cookie, Host=host, Origin=origin) in {400, 421}


@pytest.mark.parametrize("host", ["localhost:{port}", "127.0.0.1:{port}", "[::1]:{port}", "192.168.1.7:{port}"])
async def test_addresses_and_own_names_are_served(rig: Shown, host: str) -> None:
    cookie, host = await cookie_of(rig, OPERATOR), host.format(port=rig.panel.port)
    assert await opens(rig, Cookie=cookie, Host=host, Origin=f"http://{host}") == 101


@pytest.mark.parametrize(
    "origin",
    [
        None,
        "null",
        "http://evil.example",
        "http://127.0.0.1:1",
        "http://127.0.0.1",
        "http://localhost:{port}",
        "file://",
        "x",
    ],
)
async def test_another_page_opens_no_socket_and_uploads_nothing(rig: Shown, origin: str | None) -> None:
    cookie = await cookie_of(rig, OPERATOR)
    headers = {"Origin": origin.format(port=rig.panel.port)} if origin else {}
    assert await opens(rig, Cookie=cookie, **headers) == 403
    assert await status(rig, "files?arm=arm&name=a.svg", method="POST", cookie=cookie, **headers) == 403
    assert await status(rig, "recordings/arm?name=a.json", method="POST", cookie=cookie, **headers) == 403


async def test_another_page_gets_nothing_by_its_browser(rig: Shown) -> None:
    cookie = await cookie_of(rig, OPERATOR)
    for where in ("cross-site", "same-site"):
        assert await status(rig, "recordings/arm.json", cookie=cookie, **{"Sec-Fetch-Site": where}) == 403

    assert await status(rig, "recordings/arm.json", cookie=cookie, **{"Sec-Fetch-Site": "same-origin"}) == 200


async def test_every_answer_tells_the_browser_what_to_allow(rig: Shown) -> None:
    cookie = await cookie_of(rig, OPERATOR)
    for path, given in (("", ""), ("recordings/arm.json", cookie), ("nothing", cookie)):
        async with (
            aiohttp.ClientSession() as http,
            http.get(f"{rig.panel.url}{path}", headers={"Cookie": given} if given else {}) as answer,
        ):
            policy = answer.headers["Content-Security-Policy"]
            assert "default-src 'none'" in policy
            assert "script-src 'self'" in policy
            assert "unsafe" not in policy
            assert "frame-ancestors 'none'" in policy
            assert answer.headers["X-Content-Type-Options"] == "nosniff"
            assert answer.headers["X-Frame-Options"] == "DENY"


async def test_nothing_outside_of_its_folder_is_served(rig: Shown) -> None:
    cookie = await cookie_of(rig, OPERATOR)
    for path in (
        "static/%2e%2e/web.py",
        "static/..%2fweb.py",
        "static/%2fetc/passwd",
        "static/%00",
        "static//etc/passwd",
    ):
        reader, writer = await asyncio.open_connection("127.0.0.1", rig.panel.port)
        writer.write(f"GET /{path} HTTP/1.1\r\nHost: 127.0.0.1:{rig.panel.port}\r\nCookie: {cookie}\r\n\r\n".encode())
        line = await reader.readline()
        writer.close()
        await writer.wait_closed()
        assert line.split()[1] in {b"404", b"400"}, path


async def test_a_viewer_looks_on_and_stops_and_nothing_else(rig: Shown) -> None:
    async with page(rig, Role.VIEWER) as viewer:
        assert viewer.last("hello")["role"] == "viewer"
        asked: dict[str, dict[str, Any]] = {
            "take_lease": {},
            "home": {},
            "move_to": {"x": 220.0, "y": 0.0, "z": 40.0},
            "jog": {"direction": "x+", "press": 1, "tick": 1},
            "laser": {"on": True},
            "arm_laser": {"seconds": 10},
            "teach_take": {},
            "recover": {},
        }
        for do, more in asked.items():
            assert await viewer.refused(do, arm="arm", **more) == "role"

        await viewer.get("stop", arm="arm")
        await viewer.get("stop")

    cookie = await cookie_of(rig, VIEWER)
    for path in ("files?arm=arm&name=a.svg", "recordings/arm?name=a.json"):
        assert await status(rig, path, method="POST", cookie=cookie, **rig.origin) == 403

    assert not [each for each in rig.sim.arm.executed if each.command.moves]


async def test_an_operator_without_the_lease_moves_nothing(rig: Shown) -> None:
    async with page(rig) as one:
        asked: dict[str, dict[str, Any]] = {
            "home": {},
            "jog": {"direction": "x+", "press": 1, "tick": 1},
            "beat": {"press": 1, "tick": 1},
        }
        for do, more in asked.items():
            assert await one.refused(do, arm="arm", **more) == "lease"

    assert not [each for each in rig.sim.arm.executed if each.command.moves]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "null",
        "{",
        '{"do": 1}',
        '{"do": "none"}',
        '{"do": "home"}',
        '{"do": "home", "arm": "other"}',
        '{"do": "home", "arm": ["arm"]}',
        '{"do": "stop", "arm": null}',
        "[" * 2000,
        '{"id": "x", "do": "ping", "more": 1e999}',
        '{"do": "check", "arm": "arm", "x": NaN}',
    ],
)
async def test_what_makes_no_sense_is_refused_in_words(rig: Shown, text: str) -> None:
    async with page(rig) as one:
        before = len(one.of("reply"))
        await one.socket.send_str(text)
        if '"ping"' not in text:
            await until(lambda: len(one.of("reply")) > before)
            answer = one.of("reply")[before]
            assert answer["ok"] is False or answer["value"]["ok"] is False
            assert "Traceback" not in json.dumps(answer)

        await one.get("ping")


@pytest.mark.parametrize(
    ("do", "more"),
    [
        ("move_to", {"x": "220"}),
        ("move_to", {"x": 1e9}),
        ("move_to", {}),
        ("move_to", {"x": 220.0, "q": 1}),
        ("move_to", {"x": True}),
        ("move_to", {"x": 900.0, "y": 0.0, "z": 0.0}),
        ("move_joints", {"joints": [0, 0, 0]}),
        ("move_joints", {"joints": [500, 0, 0, 0]}),
        ("step", {"direction": "up", "size": 1}),
        ("step", {"direction": "x+", "size": 1000}),
        ("suction", {"on": 1}),
        ("conveyor", {"speed": 0.5}),
        ("teach_remove", {"index": 0}),
        ("teach_edit", {"index": 0, "changes": 1}),
        ("draw", {"file": "f9", "plane": {"x": 200, "y": 0, "z": 0, "q": 1}}),
        ("laser", {"on": True}),
    ],
)
async def test_wrong_arguments_move_nothing(rig: Shown, do: str, more: dict[str, Any]) -> None:
    async with page(rig) as one:
        await one.get("take_lease", arm="arm")
        assert await one.refused(do, arm="arm", **more) == "wrong"

    assert not [each for each in rig.sim.arm.executed if each.command.moves or each.command is c.SET_END_EFFECTOR_LASER]


@pytest.mark.full
async def test_a_page_that_floods_is_sent_away(rig: Shown) -> None:
    async with page(rig) as one, page(rig, Role.VIEWER) as other:
        await one.get("take_lease", arm="arm")
        for _ in range(2000):
            if one.socket.closed:
                break

            await one.socket.send_str('{"do": "ping"}')

        await until(one.ended.is_set)
        assert one.last("reply")["error"]["kind"] == "rate"
        await until(lambda: other.last("lease")["holder"] is None)
        await other.get("ping")


async def test_a_message_that_is_too_long_ends_the_connection(rig: Shown) -> None:
    async with page(rig) as one:
        await one.socket.send_str("x" * 10_000)
        await until(one.ended.is_set)

    async with page(rig) as one:
        await one.socket.send_bytes(b"x")
        await until(one.ended.is_set)


async def test_a_file_that_is_too_large_is_not_read(rig: Shown) -> None:
    cookie = await cookie_of(rig, OPERATOR)
    url = f"{rig.panel.url}files?arm=arm&name=a.svg"
    headers = {"Cookie": cookie, **rig.origin}

    async def endless() -> AsyncIterator[bytes]:
        for _ in range(80):
            yield b" " * 65536

    async with aiohttp.ClientSession() as http:
        async with http.post(url, data=io.BytesIO(b" " * (5 * 2**20)), headers=headers) as answer:
            assert answer.status == 413

        with suppress(aiohttp.ClientError):  # it may hang up while more is sent
            async with http.post(url, data=endless(), headers=headers) as answer:
                assert answer.status == 413


async def test_uploads_are_not_taken_without_end(rig: Shown) -> None:
    cookie = await cookie_of(rig, OPERATOR)
    async with aiohttp.ClientSession() as http:
        found = []
        for _ in range(14):
            async with http.post(
                f"{rig.panel.url}recordings/arm?name=a.json", data=b"{}", headers={"Cookie": cookie, **rig.origin}
            ) as answer:
                found.append(answer.status)

    assert found[0] == 400
    assert found[-1] == 429


async def test_who_never_asks_is_cut_and_keeps_nobody_out(rig: Shown, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dobot_async.panel.pending_connections.HANDSHAKE", 0.5)
    connections = [await asyncio.open_connection("127.0.0.1", rig.panel.port) for _ in range(MOST + 40)]
    for _, writer in connections[::2]:
        writer.write(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")  # a request that does not end

    async with page(rig) as one:
        await one.get("ping")
        async with asyncio.timeout(20):
            for reader, writer in connections:
                with suppress(ConnectionError):
                    await reader.read()

                writer.close()

        await one.get("ping")


async def test_of_who_says_nothing_a_few_are_kept_with_tls_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dobot_async.panel.pending_connections.HANDSHAKE", 60.0)
    monkeypatch.setattr("dobot_async.panel.start.HANDSHAKE", 60.0, raising=False)  # wherever TLS is begun
    async with shown(certificate=CERTIFICATE) as rig:
        connections = [await asyncio.open_connection("127.0.0.1", rig.panel.port) for _ in range(PENDING + 20)]
        async with asyncio.timeout(20):
            for reader, _ in connections[:20]:  # long before their time is over
                with suppress(ConnectionError):
                    assert not await reader.read()

        async with browser() as http, http.get(rig.panel.operator_url, ssl=False) as answer:
            assert answer.status == 200

        for _, writer in connections:
            writer.close()


async def test_connections_that_have_gone_cost_nobody_his_place(rig: Shown, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dobot_async.panel.pending_connections.HANDSHAKE", 60.0)
    reader, slow = await asyncio.open_connection("127.0.0.1", rig.panel.port)
    for _ in range(PENDING + 10):
        other, writer = await asyncio.open_connection("127.0.0.1", rig.panel.port)
        writer.write(b"no HTTP\r\n\r\n")
        await other.read()
        writer.close()

    slow.write(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{rig.panel.port}\r\n\r\n".encode())
    assert (await reader.readline()).startswith(b"HTTP/1.1 401")
    slow.close()


async def test_secrets_are_in_no_log(rig: Shown, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG):
        cookie = await cookie_of(rig, OPERATOR)
        await status(rig, "?token=wrong-but-secret-too")
        await status(rig, cookie=f"dobot_panel_{rig.panel.port}=evil-4711")
        async with page(rig) as one:
            await one.get("name", name="Ann")
            await one.get("take_lease", arm="arm")

    assert "Ann (operator" in caplog.text
    for secret in (OPERATOR, VIEWER, "wrong-but-secret-too", cookie.partition("=")[2], "evil-4711"):
        assert secret not in caplog.text

    assert OPERATOR not in repr(Access(OPERATOR, VIEWER))


async def test_names_of_strangers_are_shown_in_plain_text(rig: Shown) -> None:
    async with page(rig) as one, page(rig, Role.VIEWER) as other:
        assert await one.refused("name", name="two\nlines") == "wrong"
        await one.get("name", name="Zoë \U0001f600<b>")
        await one.get("take_lease", arm="arm")
        await until(lambda: other.last("lease")["holder"])
        assert other.last("lease")["holder"].startswith("Zo\\xeb \\U0001f600<b> (operator")


@pytest.mark.parametrize("host", ["0.0.0.0", "192.0.2.1", "::"])
async def test_others_are_served_with_tokens_alone(host: str) -> None:
    given: list[dict[str, Any]] = [{}, {"operator_token": OPERATOR}, {"viewer_token": VIEWER}]
    for options in given:
        with pytest.raises(ValueError, match="operator_token="):
            async with panel({}, host=host, port=0, **options):
                pass


@pytest.mark.parametrize(
    "options",
    [
        {"operator_token": "short", "viewer_token": VIEWER},
        {"operator_token": "with a blank here", "viewer_token": VIEWER},
        {"operator_token": OPERATOR, "viewer_token": OPERATOR},
        {"names": ["http://x/"]},
        {"key": "k.pem"},
        {"certificate": "none.pem"},
    ],
)
async def test_wrong_options_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"token|name|key|certificate"):
        async with panel({}, port=0, **options):
            pass


async def test_a_port_that_is_taken(rig: Shown) -> None:
    with pytest.raises(ConnectFailed, match=str(rig.panel.port)):
        async with panel(object_with_link(), port=rig.panel.port):
            pass


def object_with_link() -> Any:
    """An arm of which nothing is used."""

    class Link:
        url = "sim:"

    class Arm:
        link = Link()

    return Arm()


async def test_behind_a_proxy_it_has_the_proxys_name() -> None:
    async with shown(operator_token=OPERATOR, viewer_token=VIEWER, names=["panel.example.org"]) as rig:
        cookie = await cookie_of(rig, OPERATOR)
        for origin, answer in {
            "https://panel.example.org": 101,
            "http://panel.example.org": 101,
            "https://evil.example": 403,
        }.items():
            assert await opens(rig, Cookie=cookie, Host="panel.example.org", Origin=origin) == answer

        assert await opens(rig, Cookie=cookie, Host="other.example.org", Origin="https://other.example.org") == 421


async def test_tls() -> None:
    async with shown(certificate=CERTIFICATE) as rig:
        assert rig.panel.operator_url.startswith("https://")
        async with browser() as http:
            async with http.get(rig.panel.operator_url, ssl=False) as answer:
                assert "Secure" in answer.headers["Set-Cookie"]

            async with http.ws_connect(f"{rig.panel.url}ws", headers=rig.origin, ssl=False) as socket:
                assert json.loads((await socket.receive()).data)["type"] == "hello"

        reader, writer = await asyncio.open_connection("127.0.0.1", rig.panel.port)
        writer.write(b"GET / HTTP/1.1\r\n\r\n")
        assert not (await reader.read(5)).startswith(b"HTTP")
        writer.close()
