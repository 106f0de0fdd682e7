"""Brings an arm to phones and browsers: BLE (or any other way) on one side, WebSocket on the other.

    python ble_to_websocket_bridge.py [ble: | ble://NAME | serial:///dev/ttyUSB0 | ...] [ws://0.0.0.0:8765]

For a Raspberry Pi beside the arm; dobot-bridge.service starts it with the computer, and phone.html is a page that shows
the pose and has a stop button. The token that clients need is in DOBOT_BRIDGE_TOKEN, or made up and printed.

Without arguments it bridges a simulated arm, asks it for its pose as a phone would, and ends.
"""

from __future__ import annotations

import asyncio
import os
import struct
import sys
from secrets import token_urlsafe

from websockets.asyncio.client import connect

from dobot_async.bridge import bridge

ARM = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("DOBOT_URL")
LISTEN = sys.argv[2] if len(sys.argv) > 2 else "ws://0.0.0.0:8765"
GET_POSE = bytes.fromhex("AA AA 02 0A 00 F6")


async def main() -> None:
    """Bridges until Ctrl-C; the arm stops if a phone that moves it goes away, or if this ends."""
    if ARM is None:
        async with bridge("sim:", listen="ws://127.0.0.1:0", token=token_urlsafe()) as running:
            await ask_as_a_phone_would(running.url, running.token)

        return

    # Nobody in the network is to learn, or change, the password of the Wi-Fi.
    token = os.environ.get("DOBOT_BRIDGE_TOKEN")
    async with bridge(ARM, listen=LISTEN, token=token, deny=["wifi", "calibration", "firmware"]) as running:
        print(f"bridge    {ARM} at {running.url}")
        if running.token != token:
            print(f"token     {running.token}")

        async for event in running.events:
            print(event, flush=True)


async def ask_as_a_phone_would(url: str, token: str | None) -> None:
    """Connects, says the token, and reads the pose; any language that has WebSocket can do so."""
    async with connect(url) as phone:
        await phone.send(f"TOKEN {token}")
        await phone.send(GET_POSE)
        reply = await phone.recv()
        assert isinstance(reply, bytes)
        x, y, z, r, *_ = struct.unpack("<8f", reply[5:37])
        print(f"pose      {x:.2f} {y:.2f} {z:.2f} mm, {r:.2f} degrees")


try:
    asyncio.run(main())
except KeyboardInterrupt:
    print("ended")
