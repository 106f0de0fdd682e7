"""The replies to a client's requests: delivered as they come, or in the order of the requests where needed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from dobot_async._core.protocol.contract import Frame
from dobot_async.bridge.requests import ClientRequest

__all__ = ["ClientAnswers"]

F = TypeVar("F", bound=Frame)


class ClientAnswers(Generic[F]):
    """The answers to one client.

    Args:
        in_order: Whether they come in the order of the requests.
        deliver: Sends bytes to the client.
    """

    def __init__(self, *, in_order: bool, deliver: Callable[[bytes], None]) -> None:
        self._in_order = in_order
        self._deliver = deliver
        self._unanswered: deque[ClientRequest[F]] = deque()

    def expect(self, request: ClientRequest[F]) -> None:
        """Take note of a request that came."""
        if self._in_order:
            self._unanswered.append(request)

    def give(self, request: ClientRequest[F], answer: bytes) -> None:
        """Tell the client what has become of a request, as soon as it may hear of it."""
        if not self._in_order:
            for _ in range(request.times if answer else 0):
                self._deliver(answer)

            return

        request.answer = answer * request.times
        while self._unanswered and self._unanswered[0].answer is not None:
            if told := self._unanswered.popleft().answer:
                self._deliver(told)
