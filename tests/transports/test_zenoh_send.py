"""What a client sends to an arm on Zenoh, while Zenoh takes nothing."""

from __future__ import annotations

import asyncio
import threading
from urllib.parse import urlsplit

import anyio
import pytest

from dobot_async.transports.zenoh import messages as zenoh_messages
from dobot_async.transports.zenoh.config import ZenohConfig
from dobot_async.transports.zenoh.messages import HEADER, SendQueue
from dobot_async.transports.zenoh.transport import ZenohTransport

pytest.importorskip("zenoh")


async def test_a_send_never_waits_and_what_is_sent_is_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zenoh_messages, "LAST_WORDS", 0.1)
    taken: list[bytes] = []
    takes = threading.Event()

    def put(message: bytes) -> None:
        takes.wait()
        taken.append(message)

    transport = ZenohTransport(ZenohConfig.of(urlsplit("zenoh://arm"), serving=False))
    transport._up = SendQueue(put, lambda why: transport._break(ConnectionResetError(why)), "test")
    for number in range(10):
        sending = asyncio.create_task(transport.send(bytes((number,)) * 100))
        if number % 2:
            await asyncio.sleep(0)

        sending.cancel()
        await asyncio.wait([sending], timeout=1)
        assert sending.cancelled() is not bool(number % 2)  # before its turn, or done

    with pytest.raises(anyio.BrokenResourceError):
        while True:
            await transport.send(bytes(8192))
            await asyncio.sleep(0)

    begun = asyncio.get_running_loop().time()
    await transport.aclose()
    assert asyncio.get_running_loop().time() - begun < 1
    takes.set()
    transport._up._thread.join()
    data = b"".join(message[HEADER.size :] for message in taken)
    assert data.startswith(b"".join(bytes((number,)) * 100 for number in range(1, 10, 2)))
    assert set(data[500:]) == {0}
