"""One run of the command line: which arm, how it is reached, what signals do.

    command --> Session.ask --> run (signals cancel it) --> kind.connect --> question(arm) --> answer

A signal cancels the work; the connection's block then stops the arm on its way out, however often the signal comes.
"""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeVar

import click

from dobot_async.cli.arms import FAMILIES
from dobot_async.cli.credentials import with_token
from dobot_async.cli.failures import Interrupted
from dobot_async.cli.family import FamilyCommands
from dobot_async.cli.output import Output
from dobot_async.cli.trace import tracing
from dobot_async.program import VOCABULARIES, Vocabulary
from dobot_async.transports import SCHEMES

__all__ = ["CommandSession", "run"]

T = TypeVar("T")

# A terminal that is closed must not leave an arm moving, either.
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT") if hasattr(signal, name)]


@dataclass(slots=True)
class CommandSession:
    """What the global options say, before the command or behind it.

    Attributes:
        url: Of the arm, None if none was given.
        arm: Its family's word, or its model's.
        trace: The file for every frame, "-" for standard error.
        output: Where to speak.
        commanding: Whether an arm is held that stops if the work is interrupted.
        token_file: A file with the token of the bridge at `url`.
        given: The names of the options that were given, not those that came from the environment.
    """

    url: str | None
    arm: str
    trace: str | None
    output: Output
    commanding: bool = False
    token_file: Path | None = None
    given: set[str] = field(default_factory=set[str])

    @property
    def family(self) -> FamilyCommands:
        """The arm's family."""
        return FAMILIES[self.arm]

    @property
    def vocabulary(self) -> Vocabulary:
        """What programs of the arm are written in; raises UsageError if it has none."""
        if self.arm not in VOCABULARIES:
            raise click.UsageError(f"there are no programs for --arm {self.arm}")

        return VOCABULARIES[self.arm]

    def only(self, *arms: str) -> None:
        """Raises UsageError for a command that the arm's family does not have."""
        if self.arm not in arms:
            raise click.UsageError(f"this is for --arm {' or '.join(arms)} alone, not for {self.arm}")

    def refuse(self, reason: str, *options: str) -> None:
        """Raises UsageError if one of these options was given: what has no effect is not to look as if it had."""
        for option in options:
            if option in self.given:
                raise click.UsageError(f"--{option}: {reason}")

    def target(self) -> str:
        """The URL of the arm; raises UsageError if there is none."""
        if self.url:
            return with_token(self.url, self.token_file)

        forms = "; ".join(form for _, form in SCHEMES.values())
        raise click.UsageError(f"which arm? Give --url or set DOBOT_URL, to one of: {forms}")

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
    ) -> AsyncGenerator[Any]:
        """Connects to the session's arm, or to a URL, with the trace that was asked for."""
        url = url or self.target()
        with tracing(self.trace) as trace:
            record = {"record": trace} if trace else {}
            kind = self.family.kind
            async with kind.connect(url, control=control, queue=queue, on_error=on_error, **record) as arm:
                self.commanding = control and on_error == "stop"
                yield arm


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
