"""Wrong numbers are ValueErrors in the caller's words, before a byte is sent: C15 and C16.

Not a number, infinite, negative, zero where that is senseless: for options of `connect`, options in URLs, seconds,
speeds and timeouts, of all families. The message names what the caller has written, not what it becomes on the wire.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from promise_arms import BY_NAME, FAMILIES, Family, bench, each_family, simulated
from promise_clock import end_of, on_virtual_clock

from dobot_async import Magician

pytestmark = pytest.mark.timeout(100)
nan, inf = math.nan, math.inf

OF_ALL: dict[str, tuple[Any, ...]] = {
    "timeout": (nan, -1, -inf, 0),
    "reply_timeout": (nan, -1, 0, (0.5, 0.1), (nan, 1), (0.1, nan), (0, 1), (-1, 1)),
    "queue": ("new",),
    "on_error": ("go on",),
}
OWN: dict[str, dict[str, tuple[Any, ...]]] = {
    "magician": {"window": (0, -1, nan)},
    "mycobot": {"gap": (nan, inf, -1), "tolerance": ((nan, 1), (1, nan), (0, 1), (-1, 1), (inf, 1), (1, inf))},
    "ultraarm": {"tolerance": (nan, inf, -1, 0)},
}
OPTIONS = [
    (family.name, name, value)
    for family in FAMILIES
    for name, values in (OF_ALL | OWN[family.name]).items()
    for value in values
]


def refusals(family: str, argument: str) -> tuple[type[Exception], ...]:
    """What a wrong number raises: where whole numbers are wanted, one that is none may be a TypeError."""
    whole = {"window"} | ({"speed"} if family == "mycobot" else set())
    return (ValueError, TypeError) if argument in whole else (ValueError,)


@pytest.mark.parametrize(("family", "name", "value"), OPTIONS)
@on_virtual_clock
async def test_an_option_of_connect_that_makes_no_sense(family: str, name: str, value: Any) -> None:
    async with simulated(BY_NAME[family]) as (sim, lines):

        async def connecting() -> None:
            async with BY_NAME[family].connect(sim.url, **{name: value}):
                pass

        ended = await end_of(connecting(), 30)
        assert isinstance(ended.error, refusals(family, name)), ended
        assert name in str(ended.error)
        assert not any(line.up.messages for line in lines), "something was sent"
        assert all(line.closed for line in lines), "a line was left open"


SIM_URLS = [
    f"sim:?{name}={value}"
    for name, values in {
        "speed": ("nan", "inf", "0", "-1"),
        "loss": ("nan", "inf", "-0.1", "1.1"),
        "corrupt": ("nan", "-1"),
        "dup": ("nan", "2"),
        "latency": ("nan", "inf", "-1"),
        "jitter": ("nan", "inf", "-1"),
        "seed": ("x", "1.5"),
    }.items()
    for value in values
]


@pytest.mark.parametrize("url", SIM_URLS)
@each_family
@on_virtual_clock
async def test_an_option_of_a_simulated_arm_that_makes_no_sense(family: Family, url: str) -> None:
    async def connecting() -> None:
        async with family.connect(url):
            pass

    ended = await end_of(connecting(), 30)
    assert isinstance(ended.error, ValueError), ended
    assert url.partition("?")[2].partition("=")[0] in str(ended.error)


@pytest.mark.parametrize(
    "url",
    [
        *(
            f"udp://127.0.0.1:9?{name}={value}"
            for name in ("disorder", "reorder_window")
            for value in ("nan", "inf", "-1")
        ),
        *(f"serial:///dev/null?baud={value}" for value in ("0", "-1", "nan", "1e400")),
        *(f"ble://arm?pace={value}" for value in ("nan", "inf", "-1")),
    ],
)
async def test_an_option_of_a_line_that_makes_no_sense(url: str) -> None:
    """In real time: what today's driver opens in spite of it is no line in memory."""
    name = url.partition("?")[2].partition("=")[0]
    with pytest.raises(ValueError, match=name):
        async with asyncio.timeout(5), Magician.connect(url, timeout=0.2):
            pass


Call = Callable[[Any, Family, Any], Awaitable[Any]]


async def batched(arm: Any, call: Callable[[Any], Any]) -> None:
    """Calls something in a batch."""
    async with arm.queue.batch() as batch:
        call(batch)


async def batch_within(arm: Any, family: Family, timeout: float) -> None:
    """A batch with a timeout."""
    async with arm.queue.batch(timeout=timeout) as batch:
        batch.move_joints(*family.near)


async def jogging(arm: Any, family: Family, speed: Any) -> None:
    """Jogs at a speed."""
    async with arm.jogging(family.jog, speed=speed):
        pass


async def motion_within(arm: Any, family: Family, timeout: float) -> None:
    """Waits for a motion."""
    motion = await arm.queue.move_joints(*family.near)
    await motion.wait(timeout)


SECONDS = (nan, inf, -1, -0.001)
TIMEOUTS = (nan, -1, -inf)
CALLS: dict[str, tuple[str, tuple[Any, ...], Call]] = {
    "wait": ("seconds", SECONDS, lambda arm, _, value: arm.wait(value)),
    "queue.wait": ("seconds", SECONDS, lambda arm, _, value: arm.queue.wait(value)),
    "batch.wait": ("seconds", SECONDS, lambda arm, _, value: batched(arm, lambda batch: batch.wait(value))),
    "jog": ("seconds", SECONDS, lambda arm, family, value: arm.jog(family.jog, value)),
    "read": ("timeout", TIMEOUTS, lambda arm, family, value: reading(arm, family, value)),
    "request": ("timeout", TIMEOUTS, lambda arm, family, value: arm.request(family.row, None, timeout=value)),
    "link.request": ("timeout", TIMEOUTS, lambda arm, family, value: arm.link.request(family.row, None, timeout=value)),
    "move": ("timeout", TIMEOUTS, lambda arm, family, value: arm.move_joints(*family.near, timeout=value)),
    "home": ("timeout", TIMEOUTS, lambda arm, _, value: arm.home(timeout=value)),
    "queue.move": ("timeout", TIMEOUTS, lambda arm, family, value: arm.queue.move_joints(*family.near, timeout=value)),
    "queue.batch": ("timeout", TIMEOUTS, batch_within),
    "queue.join": ("timeout", TIMEOUTS, lambda arm, _, value: arm.queue.join(timeout=value)),
    "move far away": ("", (nan, inf), lambda arm, family, value: arm.move_joints(value, *family.near[1:])),
    "queue.move far away": ("", (nan, inf), lambda arm, family, value: arm.queue.move_joints(value, *family.near[1:])),
}
WITH_SPEED: dict[str, tuple[str, tuple[Any, ...], Call]] = {
    "jogging": ("speed", (nan, inf, 0, -1, 201), jogging),
    "jog at": ("speed", (nan, inf, 0, -1, 201), lambda arm, family, value: arm.jog(family.jog, 0.1, speed=value)),
    "move at": (
        "speed",
        (nan, inf, 0, -1, 201),
        lambda arm, family, value: arm.move_joints(*family.near, speed=value),
    ),
}
OWN_CALLS: dict[str, dict[str, tuple[str, tuple[Any, ...], Call]]] = {
    "magician": {
        "set_speed": ("velocity", (nan, inf, 0, -5), lambda arm, _, value: arm.set_speed(value)),
        "set_speed of acceleration": ("acceleration", (nan, 0, -5), lambda arm, _, value: arm.set_speed(50, value)),
        "wifi.wait_connected": ("timeout", TIMEOUTS, lambda arm, _, value: arm.wifi.wait_connected(timeout=value)),
    },
    "mycobot": {
        **WITH_SPEED,
        "power_on": ("timeout", TIMEOUTS, lambda arm, _, value: arm.power_on(timeout=value)),
    },
    "ultraarm": WITH_SPEED,
}


async def reading(arm: Any, family: Family, timeout: float) -> None:
    """A read with a timeout."""
    await (arm.get_pose if family.name == "magician" else arm.get_angles)(timeout=timeout)


TABLE = [
    (family.name, name, value)
    for family in FAMILIES
    for name, (_, values, _) in (CALLS | OWN_CALLS[family.name]).items()
    for value in values
]


@pytest.mark.parametrize(("name", "call", "value"), TABLE)
@on_virtual_clock
async def test_a_number_that_makes_no_sense(name: str, call: str, value: Any) -> None:
    family = BY_NAME[name]
    argument, _, run = (CALLS | OWN_CALLS[name])[call]
    async with bench(family, speed=20) as b:
        await asyncio.sleep(0.2)
        before = b.line.up.messages

        async def called() -> None:
            await run(b.arm, family, value)

        ended = await end_of(called(), 30)
        assert isinstance(ended.error, refusals(name, argument)), ended
        assert argument in str(ended.error)
        for word in ("millisecond", "4294967295", "float NaN to integer", "bytes on the wire"):
            assert word not in str(ended.error)

        assert b.line.up.messages == before, "something was sent"


@pytest.mark.parametrize("value", TIMEOUTS)
@each_family
@on_virtual_clock
async def test_a_timeout_of_a_motion_that_makes_no_sense(family: Family, value: float) -> None:
    async with bench(family, speed=20) as b:
        ended = await end_of(motion_within(b.arm, family, value), 30)
        assert isinstance(ended.error, ValueError), ended
        assert "timeout" in str(ended.error)
        await b.arm.queue.join()
