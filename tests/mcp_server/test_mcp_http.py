"""The server by HTTP: who gets in, and what becomes of the arm when a connection is cut in the middle of a motion."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Any

import pytest
from mcp import Client
from mcp_rig import FAR, IN_TIME, Rig, called, moves, rig, stands, started

from dobot_async.errors import ConnectFailed
from dobot_async.mcp_server import deadline, serve_http

LEGACY, MODERN = "2025-06-18", "2026-07-28"
INITIALIZE = {
    "jsonrpc": "2.0",
    "id": 1,
    "method": "initialize",
    "params": {
        "protocolVersion": LEGACY,
        "capabilities": {},
        "clientInfo": {"name": "test", "version": "1"},
    },
}


@asynccontextmanager
async def served(*, speed: float = 20.0, **details: Any) -> AsyncIterator[tuple[Rig, int]]:
    async with rig(speed=speed) as r, serve_http(r.server, ("127.0.0.1", 0), **details) as url:
        yield r, int(url.split(":")[2].split("/")[0])


class Post:
    """One request, by its bytes; `headers` take the place of the usual ones."""

    def __init__(self, port: int, body: dict[str, Any] | bytes, headers: dict[str, str | None] | None = None) -> None:
        self._port = port
        self._body = body if isinstance(body, bytes) else json.dumps(body).encode()
        self._headers = {
            "Host": f"127.0.0.1:{port}",
            "Content-Type": "application/json",
            "Accept": "application/json, text/event-stream",
            "Content-Length": str(len(self._body)),
            **(headers or {}),
        }

    async def __aenter__(self) -> asyncio.StreamReader:
        reader, self._writer = await asyncio.open_connection("127.0.0.1", self._port)
        lines = [f"{name}: {value}" for name, value in self._headers.items() if value is not None]
        self._writer.write("\r\n".join(["POST /mcp HTTP/1.1", *lines, "", ""]).encode("latin-1") + self._body)
        return reader

    async def __aexit__(self, *_: object) -> None:
        self._writer.transport.abort()


async def head(reader: asyncio.StreamReader) -> tuple[int, dict[str, str]]:
    """The status and the headers of an answer."""
    async with asyncio.timeout(IN_TIME):
        lines = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").split("\r\n")

    return int(lines[0].split()[1]), dict(line.lower().split(": ", 1) for line in lines[1:] if line)


async def status(port: int, headers: dict[str, str | None] | None = None, body: Any = INITIALIZE) -> int:
    """The status of an answer to a request with these headers."""
    async with Post(port, body, headers) as reader:
        return (await head(reader))[0]


@pytest.mark.full
@pytest.mark.parametrize("mode", ["legacy", "auto"])
async def test_tools_are_called_by_http(mode: str) -> None:
    async with rig() as r, serve_http(r.server, ("127.0.0.1", 0)) as url, Client(url, mode=mode) as client:
        await called(client, "move", x=220, y=0, z=40)
        assert moves(r.sim, "done") == [(220, 0, 40)]
        assert (await client.call_tool("move", {"x": 900, "y": 0, "z": 40})).is_error


def move(number: int, *, modern: bool) -> dict[str, Any]:
    """A request for a motion that takes some seconds."""
    meta = {
        "io.modelcontextprotocol/protocolVersion": MODERN,
        "io.modelcontextprotocol/clientInfo": {"name": "test", "version": "1"},
        "io.modelcontextprotocol/clientCapabilities": {},
    }
    params = {"name": "move", "arguments": FAR, "_meta": {"progressToken": 1, **(meta if modern else {})}}
    return {"jsonrpc": "2.0", "id": number, "method": "tools/call", "params": params}


async def session_of(port: int) -> dict[str, str | None]:
    """The headers of a session of the earlier protocol."""
    async with Post(port, INITIALIZE) as reader:
        code, headers = await head(reader)
        assert code == 200

    session: dict[str, str | None] = {"Mcp-Session-Id": headers["mcp-session-id"], "MCP-Protocol-Version": LEGACY}
    assert await status(port, session, {"jsonrpc": "2.0", "method": "notifications/initialized"}) == 202
    return session


async def test_a_connection_that_is_cut_in_the_middle_of_a_motion_stops_the_arm() -> None:
    async with served(speed=1.0) as (r, port):
        session = await session_of(port)
        async with Post(port, move(2, modern=False), session):
            await started(r.sim)

        await stands(r.sim)
        assert r.works.doing("arm") is None


async def test_a_connection_of_the_later_protocol_that_is_cut_stops_the_arm() -> None:
    async with served(speed=1.0) as (r, port):
        headers: dict[str, str | None] = {
            "MCP-Protocol-Version": MODERN,
            "Mcp-Method": "tools/call",
            "Mcp-Name": "move",
        }
        async with Post(port, move(2, modern=True), headers):
            await started(r.sim)

        await stands(r.sim)


async def test_a_session_that_is_ended_by_its_client_stops_the_arm() -> None:
    async with served(speed=1.0) as (r, port):
        session = await session_of(port)
        async with Post(port, move(2, modern=False), session):
            await started(r.sim)
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            lines = [f"{name}: {value}" for name, value in {"Host": "localhost", **session}.items()]
            writer.write("\r\n".join(["DELETE /mcp HTTP/1.1", *lines, "", ""]).encode())
            await head(reader)
            writer.close()
            await stands(r.sim)


async def test_a_server_that_ends_stops_the_arm_and_hangs_up() -> None:
    async with rig(speed=1.0) as r:
        async with serve_http(r.server, ("127.0.0.1", 0)) as url:
            port = int(url.split(":")[2].split("/")[0])
            session = await session_of(port)
            post = Post(port, move(2, modern=False), session)
            await post.__aenter__()
            await started(r.sim)

        await stands(r.sim)
        await post.__aexit__()


BEARER = {"Authorization": "Bearer geheim"}


@pytest.mark.parametrize(
    ("headers", "code"),
    [
        (BEARER, 200),
        ({**BEARER, "Host": "localhost:80"}, 200),
        ({**BEARER, "Host": "lab.example"}, 200),
        ({**BEARER, "Host": "192.168.1.7:8765"}, 200),
        ({**BEARER, "Origin": "https://page.example"}, 200),
        ({}, 401),
        ({"Authorization": "Bearer wrong"}, 401),
        ({"Authorization": "Bearer "}, 401),
        ({"Authorization": "Basic geheim"}, 401),
        ({"Authorization": "geheim"}, 401),
        ({"Authorization": "Bearer gehe\xefm"}, 401),
        ({**BEARER, "authorization": "Bearer geheim"}, 401),
        ({**BEARER, "Host": "rebound.example"}, 421),
        ({**BEARER, "Host": "lab.example.evil.example"}, 421),
        ({**BEARER, "host": "localhost"}, 400),
        ({**BEARER, "Origin": "https://evil.example"}, 403),
        ({**BEARER, "Origin": "null"}, 403),
        ({**BEARER, "Origin": "https://page.example.evil.example"}, 403),
        ({**BEARER, "Content-Type": "text/plain"}, 400),
        ({**BEARER, "Content-Length": "99999999"}, 413),
    ],
)
async def test_who_gets_in(headers: dict[str, str | None], code: int) -> None:
    async with served(token="geheim", names=["lab.example"], origins=["https://page.example"]) as (r, port):
        assert await status(port, headers) == code
        assert not r.sim.arm.executed


async def test_a_page_of_another_server_gets_at_nothing_though_no_token_is_needed() -> None:
    async with served() as (r, port):
        assert await status(port, {}) == 200
        assert await status(port, {"Host": f"rebound.example:{port}"}) == 421
        assert await status(port, {"Origin": "http://evil.example"}) == 403
        assert await status(port, {"Origin": f"http://127.0.0.1:{port}"}) == 403
        assert not r.sim.arm.executed


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"null", b"\xff", b'{"jsonrpc": "2.0"}', b"[" * 50_000])
async def test_garbage_is_refused_and_the_next_request_is_right(body: bytes) -> None:
    async with served() as (r, port):
        assert 400 <= await status(port, {}, body) < 500
        assert await status(port) == 200
        assert not r.sim.arm.executed


@pytest.mark.parametrize("begun", ["", "POST /mcp HT", "POST /mcp HTTP/1.1\r\nHost: {host}\r\nX-Slow: ", "{whole}"])
async def test_who_does_not_say_what_he_wants_holds_no_place(begun: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(deadline, "WHOLE", 0.3)
    async with served() as (r, port):
        whole = f"POST /mcp HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: 9\r\n\r\n{{"
        several = [await asyncio.open_connection("127.0.0.1", port) for _ in range(10)]
        for _, writer in several:
            writer.write(begun.format(host=f"127.0.0.1:{port}", whole=whole).encode())

        async with asyncio.timeout(IN_TIME):
            for reader, writer in several:
                with suppress(ConnectionError):
                    await reader.read()

                writer.transport.abort()

        assert await status(port) == 200
        assert not r.sim.arm.executed


@pytest.mark.full
async def test_who_opens_very_many_connections_keeps_nobody_out() -> None:
    async with served() as (r, port), Client(f"http://127.0.0.1:{port}/mcp") as client:
        silent = [await asyncio.open_connection("127.0.0.1", port) for _ in range(300)]
        async with asyncio.timeout(IN_TIME):
            assert await status(port) == 200
            assert not (await client.call_tool("move", FAR)).is_error
            with suppress(ConnectionError):
                assert await silent[0][0].read() == b""

        assert moves(r.sim)
        for _, writer in silent:
            writer.transport.abort()


async def test_an_answer_has_no_deadline_nor_a_request_that_comes_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(deadline, "WHOLE", 0.5)
    async with served(speed=1.0) as (r, port), Client(f"http://127.0.0.1:{port}/mcp") as client:
        begun = asyncio.get_running_loop().time()
        assert not (await client.call_tool("move", FAR)).is_error
        assert asyncio.get_running_loop().time() - begun > 0.5
        assert moves(r.sim)
        body = json.dumps(INITIALIZE).encode()
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        head_sent = f"POST /mcp HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Type: application/json\r\n"
        head_sent += f"Accept: application/json, text/event-stream\r\nContent-Length: {len(body)}\r\n\r\n"
        for part in (head_sent[:20].encode(), head_sent[20:].encode(), body[:10], body[10:]):
            writer.write(part)
            await writer.drain()
            await asyncio.sleep(0)

        assert (await head(reader))[0] == 200
        writer.transport.abort()


async def test_sessions_are_bounded() -> None:
    async with served() as (_, port):
        codes = [await status(port) for _ in range(20)]
        assert codes[:16] == [200] * 16
        assert set(codes[16:]) == {503}


async def test_where_it_may_listen() -> None:
    async with rig() as r:
        with pytest.raises(ValueError, match="token"):
            async with serve_http(r.server, ("0.0.0.0", 0)):
                pass

        with pytest.raises(ValueError, match="certificate"):
            async with serve_http(r.server, ("127.0.0.1", 0), key="key.pem"):
                pass

        with pytest.raises(ConnectFailed, match="cannot listen"):
            async with serve_http(r.server, ("192.0.2.1", 1), token="geheim"):
                pass
