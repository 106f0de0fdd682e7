"""Batches on several arms that start at one instant, for programs without asyncio."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Generic, TypeVar, cast

from dobot_async.fleet import Start
from dobot_async.fleet import Together as AsyncTogether
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twin import Twin
from dobot_async.sync.twins import twin_of

__all__ = ["Together"]

B = TypeVar("B")


class Together(Twin[AsyncTogether[Any]], Generic[B]):
    """The batches of several arms, by name; each verb returns its Motion, to be waited for after the block."""

    __slots__ = ()

    @property
    def start(self) -> Start | None:
        """How they started, once the block has ended."""
        return self.asynchronous.start

    @property
    def skew(self) -> float:
        """Seconds between the first and the last start.

        Raises:
            RuntimeError: The block has not ended yet.
        """
        return self.asynchronous.skew

    def __getitem__(self, name: str) -> B:
        return cast(B, twin_of(self.asynchronous[name]))

    def __iter__(self) -> Iterator[str]:
        return iter(self.asynchronous)

    def __len__(self) -> int:
        return len(self.asynchronous)

    def wait(self) -> None:
        """Returns when all motions are done; raises the first failure when all have ended."""
        PORTAL.run(self.asynchronous.wait)
