"""Clients that are cut off while what they sent still waits in the bridge, unauthenticated peers, and locked keys."""

from __future__ import annotations

from contextlib import AsyncExitStack
from pathlib import Path

import pytest
import trustme
from bridge_rig import TCP, ask, bridged, client, until
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    PrivateFormat,
    load_pem_private_key,
)
from websockets.asyncio.client import connect

from dobot_async import Magician
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import encode
from dobot_async.bridge import Limits
from dobot_async.bridge.handshake import PENDING
from dobot_async.bridge.listeners import Listeners

GET_POSE = encode(ask(c.GET_POSE))


@pytest.mark.parametrize("listen", ["udp://127.0.0.1:0", "pty", TCP])
async def test_what_still_waits_of_a_client_that_is_cut_off_is_forgotten(listen: str) -> None:
    async with bridged([listen, TCP], limits=Limits(silence=0.2, data=4000)) as rig:
        async with client(rig.url) as mover, client(rig.bridge.urls[1]) as other:
            await mover.ask(c.SET_QUEUED_CMD_START_EXEC)
            await mover.transport.send(GET_POSE * 800)
            await other.ask(c.SET_QUEUED_CMD_FORCE_STOP_EXEC)
            await until(lambda: rig.told("cut"))
            if listen != "pty":  # it cannot be closed
                await until(lambda: rig.told("left"))

        await until(lambda: len(rig.told("left")) == 2)


async def test_who_says_nothing_makes_room_for_others() -> None:
    async with bridged("ws://127.0.0.1:0", token="geheim") as rig, AsyncExitStack() as stack:
        first, *_ = [await stack.enter_async_context(connect(rig.url)) for _ in range(PENDING)]
        assert not rig.told("turned away")
        await stack.enter_async_context(connect(rig.url))
        await first.wait_closed()
        assert len(rig.told("turned away")) == 1
        async with Magician.connect(f"{rig.url}?token=geheim", control=False) as arm:
            assert await arm.get_pose()


def test_a_key_with_a_password_is_refused_and_nobody_is_asked_for_it(tmp_path: Path) -> None:
    issued = trustme.CA().issue_cert("localhost")
    key = load_pem_private_key(issued.private_key_pem.bytes(), None)
    secret = BestAvailableEncryption(b"secret")
    pem = tmp_path / "key.pem"
    pem.write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, secret) + issued.cert_chain_pems[0].bytes())
    with pytest.raises(ValueError, match="cannot use the certificate"):
        Listeners.of([TCP], None, pem, None, ())
