"""What all tests share: time can be virtual, and no test leaves anything behind.

Which tests run without `--full`, and how many examples a property tries: quick_suite. No property has a deadline, for
how long an example takes is the machine's affair.

A test marked `virtual_time` runs on a loop whose clock jumps over every wait: an hour passes in no time, and a wait
that nothing can end fails the test instead of hanging. Such a test does no real I/O.
"""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path

import async_solipsism
import pytest

pytest_plugins = ["quick_suite"]

DESCRIPTORS = Path("/proc/self/fd")
ROUNDS = 200

OWNED_BY_THE_LOOP = ("asyncio_", "asyncio-waitpid", "AnyIO worker thread")


def pytest_configure(config: pytest.Config) -> None:
    """Registers the mark, and lets programs that tests start hear the signals that a background job ignores."""
    for name in ("SIGINT", "SIGHUP", "SIGQUIT"):
        number = getattr(signal, name, None)  # not every system has them all
        if number and signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, lambda *_: None)  # what is ignored stays so in programs, what is handled does not

    config.addinivalue_line("markers", "virtual_time: the clock jumps over every wait; no real I/O")


def pytest_asyncio_loop_factories(
    config: pytest.Config, item: pytest.Item
) -> Mapping[str, Callable[[], asyncio.AbstractEventLoop]]:
    """Chooses the loop of an async test."""
    if item.get_closest_marker("virtual_time"):
        return {"virtual": async_solipsism.EventLoop}

    return {"real": asyncio.new_event_loop}


@pytest.fixture(autouse=True)
def nothing_left(request: pytest.FixtureRequest) -> Iterator[None]:
    """Fails a test that leaves a thread or a file descriptor behind; an async one also for a task."""
    before = threads() | descriptors()
    if request.node.get_closest_marker("asyncio"):
        request.getfixturevalue("nothing_left_in_loop")
        before = threads()

    yield

    after = threads()
    if not request.node.get_closest_marker("asyncio"):
        after |= descriptors()

    left = after - before
    assert not left, f"left behind: {sorted(left)}"


@pytest.fixture
async def nothing_left_in_loop() -> AsyncIterator[None]:
    """The part of `nothing_left` that has to look while the loop lives, for its end hides what it owned."""
    before = descriptors()

    yield

    for _ in range(3):
        await asyncio.sleep(0)

    tasks = asyncio.all_tasks() - {asyncio.current_task()}
    assert not tasks, f"left behind: {tasks}"

    # A peer that has just been disconnected closes its own end when it hears of it.
    for _ in range(ROUNDS):
        left = descriptors() - before
        if not left:
            break

        await asyncio.sleep(0.005)

    assert not left, f"left behind: {sorted(left)}"


def threads() -> set[str]:
    """All threads but those that the loop ends itself."""
    return {
        f"thread {thread.name} {thread.ident}"
        for thread in threading.enumerate()
        if not thread.name.startswith(OWNED_BY_THE_LOOP)
    }


def descriptors() -> set[str]:
    """All open file descriptors, where the system shows them."""
    found = set()
    for entry in DESCRIPTORS.iterdir() if DESCRIPTORS.is_dir() else ():
        with suppress(OSError):
            found.add(f"descriptor {entry.name} {entry.readlink()}")

    return found
