"""What all blocking classes are made of: an asynchronous object, and the way to it."""

from __future__ import annotations

import os
from collections.abc import AsyncIterable, AsyncIterator, Callable, Generator, Iterator
from contextlib import AbstractAsyncContextManager, AbstractContextManager, closing
from types import TracebackType
from typing import Any, Generic, Self, TypeVar

from dobot_async.sync.portal import PORTAL

__all__ = ["BlockingContext", "Items", "Twin", "held", "same"]

A = TypeVar("A")
T = TypeVar("T")


def same(value: T) -> T:
    """Return a value that needs no twin."""
    return value


class Twin(Generic[A]):
    """An object that stands for an asynchronous one, from any thread.

    Attributes:
        asynchronous: What it stands for; to be used in the arms' thread only, see `dobot_async.sync.run`.
    """

    __slots__ = ("asynchronous",)

    def __init__(self, asynchronous: A) -> None:
        self.asynchronous: A = asynchronous

    def __eq__(self, other: object) -> bool:
        return self.asynchronous is getattr(other, "asynchronous", other)

    def __hash__(self) -> int:
        return hash(id(self.asynchronous))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.asynchronous!r}>"


class BlockingContext(AbstractContextManager[T], Generic[A, T]):
    """An asynchronous block, to be used with `with`.

    Args:
        make: Makes the asynchronous context manager, in the arms' thread.
        twin: Makes what the block yields of what the asynchronous one yields.
        name: What it is, for the log.
    """

    def __init__(
        self, make: Callable[[], AbstractAsyncContextManager[A, Any]], twin: Callable[[A], T], name: str = "a block"
    ) -> None:
        self._make = make
        self._twin = twin
        self._name = name
        self._entered: AbstractAsyncContextManager[A, Any] | None = None
        self._process = 0

    def __enter__(self) -> T:
        if self._process:
            raise RuntimeError("a block is entered once")

        self._process = os.getpid()
        PORTAL.hold()
        try:
            value = PORTAL.run(self._enter)
            PORTAL.opened(self)
            return self._twin(value)
        except BaseException as error:
            try:
                self.leave(error)  # an interruption may have come when it was entered already
            finally:
                PORTAL.release()

            raise

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> bool:
        if self._process != os.getpid():
            return False  # forked: it is the parent's

        try:
            return self.leave(error)
        finally:
            PORTAL.release()

    def leave(self, error: BaseException | None) -> bool:
        """End it, once; return whether the error goes no further."""
        PORTAL.closed(self)
        return PORTAL.run(lambda: self._exit(error))

    def leave_soon(self, error: BaseException) -> None:
        """Begin to end it, as by an error, without waiting."""
        PORTAL.begin(lambda: self._exit(error))

    def __repr__(self) -> str:
        return self._name

    async def _enter(self) -> A:
        manager = self._make()
        value = await manager.__aenter__()
        self._entered = manager
        return value

    async def _exit(self, error: BaseException | None) -> bool:
        entered, self._entered = self._entered, None
        if entered is None:
            return False

        if error is None:
            return bool(await entered.__aexit__(None, None, None))

        return bool(await entered.__aexit__(type(error), error, error.__traceback__))


class Items(Iterator[T]):
    """An asynchronous iterator, to be used with `for`; `close` ends it, and so does whoever forgets it.

    Args:
        make: Makes the asynchronous iterable, in the arms' thread.
        twin: Makes what is yielded of what the asynchronous one yields.
    """

    def __init__(self, make: Callable[[], AsyncIterable[Any]], twin: Callable[[Any], T]) -> None:
        self._iterator: AsyncIterator[Any] = PORTAL.look(lambda: make().__aiter__())
        self._twin = twin

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> T:
        try:
            return self._twin(PORTAL.run(self._next))
        except StopAsyncIteration:
            raise StopIteration from None

    def close(self) -> None:
        """End it, and what it does."""
        PORTAL.run(self._close)

    async def _next(self) -> Any:
        return await anext(self._iterator)

    async def _close(self) -> None:
        close = getattr(self._iterator, "aclose", None)
        if close:
            await close()


def held(items: Items[T]) -> Generator[T, None, None]:
    """Yield items that belong to no block: while they are iterated over, the arms' thread is there."""
    with PORTAL.held(), closing(items):
        yield from items
