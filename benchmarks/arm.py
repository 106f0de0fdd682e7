"""Simulated arms in a process of their own, so that they take neither time nor memory from who is measured.

    python benchmarks/arm.py '{"listen": "pty:?baud=115200", "speed": 1.0}'

The first line that it prints is a JSON list of URLs. Then each line that it reads is a question, answered with a line
of JSON: `counters`, and `executed`: [name, started, finished] of each command that took its time, in seconds of
`time.monotonic`, which on one computer is the same in all processes. It ends with its input.

Its loop waits with `select`, whose timers are exact to some hundredth of a millisecond where epoll's are to a whole
one: the lines of the arms are as slow as they should be, and not slower.
"""

from __future__ import annotations

import asyncio
import json
import selectors
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import AsyncExitStack, contextmanager
from dataclasses import asdict
from typing import Any

from dobot_async.mycobot import commands as cobot
from dobot_async.simulator import MyCobotQuirks, Simulation, simulate

__all__ = ["AT_ONCE", "Arms", "arms"]

AT_ONCE = 1e6
"""The speed of an arm that executes at once."""
QUIRKS: dict[str, dict[str, Any]] = {
    "myarm300": {"quirks": MyCobotQuirks(acknowledges=frozenset({cobot.SEND_ANGLES}), echo=False, transponder=False)}
}
"""A newer myArm acknowledges motions, and the vendor's library waits for that. A frame that comes byte by byte, as over
a real line, must not count as one in pieces."""


class Arms:
    """Arms in another process.

    Attributes:
        urls: Where they are reached.
    """

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self.urls: list[str] = self._line()

    @property
    def url(self) -> str:
        """Where the first one is reached."""
        return self.urls[0]

    @property
    def counters(self) -> dict[str, int]:
        """What has happened on all connections, of all arms together."""
        answer: dict[str, int] = self._ask("counters")
        return answer

    @property
    def executed(self) -> list[tuple[str, float, float]]:
        """What the first arm has executed: the name, and when it began and ended, by `time.monotonic`."""
        return [(name, started, finished) for name, started, finished in self._ask("executed")]

    def ended(self, name: str) -> list[float]:
        """When each command of a name had ended."""
        return [finished for each, _, finished in self.executed if each == name]

    def _ask(self, question: str) -> Any:
        assert self._process.stdin
        self._process.stdin.write(question + "\n")
        self._process.stdin.flush()
        return self._line()

    def _line(self) -> Any:
        assert self._process.stdout
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError("the simulated arm's process has ended")

        return json.loads(line)


@contextmanager
def arms(listen: str, *, model: str = "magician", speed: float = 1.0, count: int = 1) -> Iterator[Arms]:
    """Runs simulated arms for the length of a block."""
    details = json.dumps({"listen": listen, "model": model, "speed": speed, "count": count})
    command = [sys.executable, __file__, details]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield Arms(process)
        finally:
            assert process.stdin
            process.stdin.close()


async def serve(*, listen: str, model: str, speed: float, count: int) -> None:
    """Runs the arms until the input ends."""
    loop = asyncio.get_running_loop()
    async with AsyncExitStack() as stack:
        simulations = [
            await stack.enter_async_context(
                simulate(model, listen=listen, clock=lambda: time.monotonic() * speed, **QUIRKS.get(model, {}))
            )
            for _ in range(count)
        ]
        print(json.dumps([simulation.url for simulation in simulations]), flush=True)
        questions = asyncio.StreamReader()
        await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(questions), sys.stdin)
        while line := (await questions.readline()).decode().strip():
            print(json.dumps(ANSWERS[line](simulations, speed)), flush=True)


def counters(simulations: list[Simulation], _: float) -> dict[str, int]:
    """All arms' counters, added up."""
    total: dict[str, int] = {}
    for simulation in simulations:
        figures = simulation.arm.counters
        for name, figure in asdict(figures).items():
            total[name] = total.get(name, 0) + int(figure)

    return total


def executed(simulations: list[Simulation], speed: float) -> list[tuple[str, float, float]]:
    """What the first arm has executed."""
    return [(each.name, each.started / speed, each.finished / speed) for each in simulations[0].arm.executed]


ANSWERS = {"counters": counters, "executed": executed}


def main() -> None:
    """Runs what the first argument says."""
    with asyncio.Runner(loop_factory=lambda: asyncio.SelectorEventLoop(selectors.SelectSelector())) as runner:
        runner.run(serve(**json.loads(sys.argv[1])))


if __name__ == "__main__":
    main()
