"""TCP ports on the virtual clock: what async-solipsism leaves out and a bridge asks for."""

from __future__ import annotations

import socket
from typing import Any

import async_solipsism.loop
import async_solipsism.socket
import pytest

__all__ = ["on_the_virtual_clock", "virtual_ports"]


async def numeric(_: Any, host: str, port: int, **more: Any) -> list[Any]:
    """The address itself; there are no names."""
    return [(socket.AF_INET, more.get("type", socket.SOCK_STREAM), 0, "", (host, port))]


def no_option(*_: Any) -> bytes:
    """A system that tells nothing of a connection."""
    return b""


@pytest.fixture
def virtual_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets a test on the virtual clock listen at, and connect to, tcp and ws ports of its own loop."""
    monkeypatch.setattr(async_solipsism.loop.EventLoop, "getaddrinfo", numeric)
    for verb in ("getsockopt", "setsockopt"):
        monkeypatch.setattr(async_solipsism.socket.Socket, verb, no_option, raising=False)


def on_the_virtual_clock(test: Any) -> Any:
    """Marks a test that listens at, and connects to, nothing but tcp and ws ports of its own loop."""
    return pytest.mark.virtual_time(pytest.mark.usefixtures("virtual_ports")(test))
