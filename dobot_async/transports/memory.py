"""Two ends in one process: what one sends, the other receives, message by message and in order."""

from __future__ import annotations

import math

import anyio
from anyio.streams.stapled import StapledObjectStream

from dobot_async._core.protocol.transport import MANY, Transport
from dobot_async.transports.stream import StreamTransport

__all__ = ["memory_pair"]


def memory_pair(*, in_flight: int = MANY, window: int = 16, buffer: float = math.inf) -> tuple[Transport, Transport]:
    """Returns the two ends of a line in memory.

    Args:
        in_flight: How many requests may be unanswered at a time.
        window: How many queued commands may be unacknowledged at a time.
        buffer: Messages that may lie on the way before a sender waits.
    """
    there_send, there_receive = anyio.create_memory_object_stream[bytes](buffer)
    back_send, back_receive = anyio.create_memory_object_stream[bytes](buffer)
    ends = StapledObjectStream(there_send, back_receive), StapledObjectStream(back_send, there_receive)
    near, far = (StreamTransport(end, in_flight=in_flight, window=window) for end in ends)
    return near, far
