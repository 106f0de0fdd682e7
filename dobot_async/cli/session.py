"""One run of the command line: which arm, how it is reached, what signals do.

    command --> Session.ask --> run (signals cancel it) --> kind.connect --> question(arm) --> answer

A signal cancels the work; the connection's block then stops the arm on its way out, however often the signal comes.
"""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Sequence
from contextlib import asynccontextmanager, nullcontext
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import click

from dobot_async._core.link.link import Link
from dobot_async.cli.credentials import with_token
from dobot_async.cli.families import FAMILIES, Family
from dobot_async.cli.output import Output
from dobot_async.cli.trace import Trace, tracing
from dobot_async.transports import SCHEMES

__all__ = ["ARMS", "Interrupted", "Session", "run"]

T = TypeVar("T")

ARMS = tuple(FAMILIES)
"""The families, by the words of `--arm`."""

# A terminal that is closed must not leave an arm moving, either.
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


class Interrupted(Exception):
    """A signal ended the work, and everything was closed.

    Attributes:
        number: The signal's.
        problems: What went wrong on the way out, such as an arm that did not acknowledge its stop.
    """

    def __init__(self, number: int, problems: Sequence[str]) -> None:
        super().__init__(number)
        self.number = number
        self.problems = problems


@dataclass(slots=True)
class Session:
    """What the options before the command say.

    Attributes:
        url: Of the arm, None if none was given.
        arm: One of `ARMS`.
        trace: The file for every frame, "-" for standard error.
        output: Where to speak.
        commanding: Whether an arm is held that stops if the work is interrupted.
    """

    url: str | None
    arm: str
    trace: str | None
    output: Output
    commanding: bool = False

    @property
    def family(self) -> Family:
        """The arm's family."""
        return FAMILIES[self.arm]

    def only(self, *arms: str) -> None:
        """Raises UsageError for a command that the arm's family does not have."""
        if self.arm not in arms:
            raise click.UsageError(f"this is for --arm {' or '.join(arms)} alone, not for {self.arm}")

    def ask(
        self,
        question: Callable[[Any], Awaitable[T]],
        *,
        control: bool = True,
        queue: Literal["fresh", "keep"] = "fresh",
        on_error: Literal["stop", "leave"] = "stop",
    ) -> T:
        """Connects, as the `connect` of its family does, and returns what the arm answers to one question."""

        async def asked() -> T:
            async with self.connect(control=control, queue=queue, on_error=on_error) as arm:
                return await question(arm)

        return run(asked())

    @asynccontextmanager
    async def connect(
        self,
        url: str | None = None,
        *,
        control: bool = True,
        queue: Literal["fresh", "keep"] = "fresh",
        on_error: Literal["stop", "leave"] = "stop",
    ) -> AsyncIterator[Any]:
        """Connects to the session's arm, or to a URL, with the trace that was asked for."""
        url = url or (self.url and with_token(self.url))
        if not url:
            forms = "; ".join(form for _, form in SCHEMES.values())
            raise click.UsageError(f"which arm? Give --url or set DOBOT_URL, to one of: {forms}")

        with tracing(self.trace, self.family.describe) if self.trace else nullcontext() as trace:
            kind = traced(self.family.kind, trace) if trace else self.family.kind
            async with kind.connect(url, control=control, queue=queue, on_error=on_error) as arm:
                self.commanding = control and on_error == "stop"
                yield arm


def traced(kind: Any, trace: Trace) -> Any:
    """Returns a kind of arm whose link tells a trace of every frame, those of the greeting included."""

    class Traced(kind):  # type: ignore[misc]
        def __init__(self, link: Link[Any], **options: Any) -> None:
            super().__init__(link, **options)
            link.on_frame.add(trace)

    return Traced


def run(work: Coroutine[Any, Any, T]) -> T:
    """Runs work to its end and returns its result.

    Raises:
        Interrupted: SIGINT, SIGTERM or SIGHUP ended it.
        click.UsageError: The library refused an argument, or the URL.
    """
    received: list[int] = []
    before = {number: signal.getsignal(number) for number in SIGNALS}

    async def cancellable() -> T:
        loop = asyncio.get_running_loop()
        task = asyncio.current_task()
        assert task

        def cancel(number: int, _: object) -> None:
            received.append(number)
            if not loop.is_closed():
                loop.call_soon_threadsafe(task.cancel)

        # Not the loop's own handlers: those end with the loop, and the next signal would hit whatever comes after it.
        for number, handler in before.items():
            # Whoever started this with a signal ignored (nohup, a shell's background) wants it ignored.
            if handler is not signal.SIG_IGN:
                signal.signal(number, cancel)

        return await work

    try:
        return asyncio.run(cancellable())
    except BaseException as error:
        if received:
            raise Interrupted(received[0], getattr(error, "__notes__", ())) from None

        if isinstance(error, ValueError):
            raise click.UsageError(str(error)) from error

        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if received else handler)
