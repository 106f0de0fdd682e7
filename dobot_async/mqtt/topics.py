"""The topics of an arm, and of a gateway.

BASE/gateways/ID          "online", and by its last will "offline"
BASE/NAME/state           JSON, retained: pose, alarms, queue, link, what is being done
BASE/NAME/available       "online" while the arm answers, retained
BASE/NAME/lease           JSON, retained: who may move the arm
BASE/NAME/do              commands
BASE/NAME/reply/SESSION   what became of a session's commands
"""

from __future__ import annotations

import re
from dataclasses import dataclass

__all__ = ["OFFLINE", "ONLINE", "SESSION", "Topics", "check_word", "will_topic"]

ONLINE, OFFLINE = "online", "offline"
SESSION = re.compile(r"[A-Za-z0-9_-]{1,64}")
GATEWAYS = "gateways"


def check_word(what: str, word: str) -> str:
    """Return a word that may be a part of a topic; raise ValueError for others."""
    if not SESSION.fullmatch(word) or word == GATEWAYS:
        raise ValueError(f"{what}: 1 to 64 letters, digits, - and _, and not {GATEWAYS}; not {word!r}")

    return word


def will_topic(base: str, identifier: str) -> str:
    """Return where a gateway says that it is there."""
    return f"{base}/{GATEWAYS}/{identifier}"


@dataclass(frozen=True, slots=True)
class Topics:
    """Those of one arm.

    Attributes:
        base: What all begin with.
        name: The arm's.
    """

    base: str
    name: str

    @property
    def state(self) -> str:
        """What the arm does."""
        return f"{self.base}/{self.name}/state"

    @property
    def available(self) -> str:
        """Whether it answers."""
        return f"{self.base}/{self.name}/available"

    @property
    def lease(self) -> str:
        """Who may move it."""
        return f"{self.base}/{self.name}/lease"

    @property
    def do(self) -> str:
        """Commands."""
        return f"{self.base}/{self.name}/do"

    def reply(self, session: str) -> str:
        """What became of the commands of a session."""
        return f"{self.base}/{self.name}/reply/{session}"
