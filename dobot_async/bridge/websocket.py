"""The WebSocket port: bytes of the protocol in binary messages, cut anywhere.

    HTTP request --> refused, or accepted --> [TOKEN as first text] --> let in --> binary messages --> Host.client.send

The messages are those of the websockets library's own state machine; the connection is the same as for tcp, so that the
same few pending ones are allowed, in the same time.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs, urlsplit

from dobot_async.bridge.handshake import LONGEST_LINE, MOST, TOKEN, Handshakes, PendingConnection
from dobot_async.transports.websocket import PING, PONG_WITHIN, quiet, websockets

__all__ = ["WebSocketConnection"]

BIGGEST_MESSAGE = 4096
BEARER = "Bearer "
ENDED = 1008  # "policy violation": the code for everything that is not the network's fault


class WebSocketConnection(PendingConnection):
    """A WebSocket connection, from its HTTP request on."""

    def __init__(
        self,
        handshakes: Handshakes,
        deliver: Callable[[bytes], None],
        disconnect: Callable[[], None],
        *rest: Any,
        **more: Any,
    ) -> None:
        super().__init__(handshakes, deliver, disconnect, *rest, **more)
        library = websockets("server")
        self._opcodes = websockets("frames").Opcode
        self._socket = library.ServerProtocol(max_size=BIGGEST_MESSAGE, logger=quiet())
        self._loop = asyncio.get_running_loop()
        self._heard = self._loop.time()
        self._accepted = self._known = self._binary = False
        self._received = 0
        self._ping: asyncio.TimerHandle | None = None

    def receive(self, data: bytes) -> None:
        """Take the next bytes of the connection."""
        self._heard = self._loop.time()
        self._received += len(data)
        self._socket.receive_data(data)
        for event in self._socket.events_received():
            if self._away:
                return

            if not self._accepted:
                self._request(event)
            else:
                self._frame(event)

        self._flush()
        if not self._accepted and self._received > MOST:
            self.turn_away("a request that does not end")

    def deliver(self, data: bytes) -> None:
        """Send a binary message."""
        if not self._away:
            self._socket.send_binary(data)
            self._flush()

    def disconnect(self) -> None:
        """Say that it ends, and end it; what it has not read is lost with it."""
        if self._accepted and not self._away:
            self._socket.fail(ENDED, "the bridge has ended this connection")
            self._written()

        super().disconnect()

    def close(self) -> None:
        """Ignores what arrives from now on."""
        super().close()
        if self._ping:
            self._ping.cancel()

    def _request(self, request: Any) -> None:
        """Answer the HTTP request.

        A browser that presents no token must belong to a page that may come without, for it serves any page.
        """
        given, origin = presented(request), request.headers.get_all("Origin")
        guard = self.authenticator
        if given is not None and not guard.knows(given.encode(errors="surrogateescape")):
            self._refuse(HTTPStatus.UNAUTHORIZED, "wrong token\n", "a wrong token")
        elif guard.token is None and not guard.origins.issuperset(filter(None, origin)):
            self._refuse(
                HTTPStatus.FORBIDDEN,
                "this web page may not connect without a token\n",
                f"a web page of {' '.join(origin)}",
            )
        else:
            response = self._socket.accept(request)
            self._socket.send_response(response)
            if response.status_code != HTTPStatus.SWITCHING_PROTOCOLS:
                self._written()
                self.turn_away("a request for something else than a WebSocket")
                return

            self._accepted = True
            self._known = guard.token is None or given is not None
            self._ping = self._loop.call_later(PING, self._look)
            if self._known:
                self.enter()

    def _refuse(self, status: HTTPStatus, told: str, reason: str) -> None:
        self._socket.send_response(self._socket.reject(status, told))
        self._written()
        self.turn_away(reason)

    def _frame(self, frame: Any) -> None:
        """Take one frame; text is for people, and but for the token left out."""
        if frame.opcode in {self._opcodes.TEXT, self._opcodes.BINARY}:
            self._binary = frame.opcode is self._opcodes.BINARY
        elif frame.opcode is not self._opcodes.CONT:
            return

        data = bytes(frame.data)
        if self.peer:
            if self._binary and data:
                self.peer.send(data)
        elif not self._binary and len(data) <= LONGEST_LINE and data.startswith(TOKEN):
            if self.authenticator.knows(data.removeprefix(TOKEN)):
                self.enter()
            else:
                self.turn_away("a wrong token")
        else:
            self.turn_away("a wrong token, or none")

    def _look(self) -> None:
        """Ask whether it is still there, from time to time; end it if it is not."""
        if self._loop.time() > self._heard + PING + PONG_WITHIN:
            PendingConnection.disconnect(self)
            return

        self._ping = self._loop.call_later(PING, self._look)
        if self._socket.state is websockets("server").OPEN:
            self._socket.send_ping(b"")
            self._flush()

    def _flush(self) -> None:
        """Send what there is to send; end the connection when that is the end."""
        if not self._away and self._written():
            self._end()

    def _written(self) -> bool:
        """Send what there is to send; return whether nothing comes after it."""
        out = self._socket.data_to_send()
        for data in filter(None, out):
            self._write(data)

        return b"" in out

    def _end(self) -> None:
        """The WebSocket has ended, in good order or for a breach of its rules."""
        if self.peer:
            PendingConnection.disconnect(self)
        else:
            self.turn_away("no request for a WebSocket, or one that ends at once")


def presented(request: Any) -> str | None:
    """The token in the headers, or the URL, of a request; the last one if there are several."""
    headers = request.headers.get_all("Authorization")
    if headers and headers[-1].startswith(BEARER):
        return str(headers[-1]).removeprefix(BEARER)

    with suppress(ValueError):  # a path that is none
        tokens = parse_qs(urlsplit(str(request.path)).query).get("token", [])
        return tokens[-1] if tokens else None

    return None
