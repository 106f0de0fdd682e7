"""How an ultraArm is stopped: what it is told, and how often it has to say that it stands; a test makes the answers."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from virtual import virtual

from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.answers import Status
from dobot_async.arms.ultraarm.stopper import RELEASE_AND_STATUS, STOP_AND_STATUS, UltraArmStopper
from dobot_async.errors import CommandRejected

Answer = Callable[["FakePoller"], int]


class FakePoller:
    """Answers how often in a row the arm was at rest.

    Attributes:
        rests: So often.
        rows: What the arm was told.
    """

    size = 3

    def __init__(self, answer: Answer) -> None:
        self.rests = 0
        self.rows: list[Any] = []
        self._answer = answer

    def begin(self) -> None:
        """Begins anew."""
        self.rests = 0

    async def poll(self, row: Any, *, timeout: float, urgent: bool) -> Status:
        """Answers at once."""
        assert urgent
        self.rows.append(row)
        self.rests = self._answer(self)
        return Status(0, self.rests > 0)


def stopper(answer: Answer) -> tuple[UltraArmStopper, FakePoller, list[object]]:
    """A stopper, its arm, and what was noted of the power."""
    noted: list[object] = []
    poller: Any = FakePoller(answer)
    state: Any = SimpleNamespace(note=lambda command, _: noted.append(command))
    return UltraArmStopper(poller, state, "release"), poller, noted


@virtual
async def test_an_arm_that_says_once_that_it_rests_is_asked_again() -> None:
    said = iter([1, 0, 1, 2])
    stop, arm, noted = stopper(lambda _: next(said))
    await stop.stop()
    assert arm.rows == [STOP_AND_STATUS] * 4
    assert not noted


@virtual
async def test_an_arm_that_goes_on_loses_its_power() -> None:
    stop, arm, noted = stopper(lambda arm: 2 * (RELEASE_AND_STATUS in arm.rows))
    await stop.stop()
    assert arm.rows[-1] is RELEASE_AND_STATUS
    assert noted == [c.RELEASE]


@virtual
async def test_an_arm_that_goes_on_without_power_is_told() -> None:
    stop, arm, _ = stopper(lambda _: 0)
    with pytest.raises(CommandRejected, match="switch it off"):
        await stop.stop()

    assert 1 < arm.rows.count(RELEASE_AND_STATUS) < 10


@virtual
async def test_a_jog_that_does_not_end_is_stopped_like_anything_else() -> None:
    stop, arm, noted = stopper(lambda arm: 2 * (RELEASE_AND_STATUS in arm.rows))
    await stop.end_jog(lambda: False)
    assert arm.rows[-1] is RELEASE_AND_STATUS
    assert noted == [c.RELEASE]


@virtual
async def test_a_jog_in_front_of_queued_motions_is_not_waited_for() -> None:
    stop, arm, _ = stopper(lambda _: 0)
    await stop.end_jog(lambda: True)
    assert arm.rows == [STOP_AND_STATUS]
