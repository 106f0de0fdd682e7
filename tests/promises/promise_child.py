"""A user's program that is interrupted: python promise_child.py FAMILY URL CALL, which says when it is under way."""

from __future__ import annotations

import asyncio
import signal
import sys

from promise_families import BY_NAME

CALLS = ("move", "jog", "queue")

__all__ = ["CALLS"]


def say() -> None:
    """Tells who started this program that it may be interrupted now."""
    sys.stdout.write("under way\n")
    sys.stdout.flush()


async def main(name: str, url: str, call: str) -> None:
    """Connects and does what takes long."""
    family = BY_NAME[name]
    async with family.connect(url) as arm:
        asyncio.get_running_loop().call_later(0.2, say)
        if call == "move":
            await arm.move_joints(*family.far)
        elif call == "jog":
            await arm.jog(family.jog, 600)
        else:
            await arm.queue.move_joints(*family.far)
            await arm.queue.join()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # whatever it was started from ignores
    asyncio.run(main(*sys.argv[1:]))
