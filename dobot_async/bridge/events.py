"""The events of a bridge; those that any peer can cause are limited in number."""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from dataclasses import dataclass

from dobot_async._core.util.events import Events
from dobot_async._core.util.text import printable
from dobot_async.bridge.limits import Allowance

__all__ = ["BridgeEvent", "BridgeLog"]

logger: logging.Logger = logging.getLogger("dobot_async.bridge")
RATES = {"turned away": 0.5, "connected": 1.0, "left": 1.0, "cut": 1.0, "refused": 2.0}
"""Events a second of a kind that whoever reaches a port can cause; more of them are counted, and not told."""
BURST = 40


@dataclass(frozen=True, slots=True)
class BridgeEvent:
    """What happened at a bridge, in printable ASCII whatever a peer has sent.

    A kind of event that any peer can cause is told 40 times at once, then once or twice a second; the next one says
    how many were left out.

    Attributes:
        what: "connected", "left", "turned away", "cut", "refused", "lease", "released", "stopped", "link".
        client: Whose affair it is, "" if it is nobody's.
        detail: More of it, in words.
    """

    what: str
    client: str
    detail: str

    def __str__(self) -> str:
        return ": ".join(filter(None, (self.client, self.what, self.detail)))


class BridgeLog:
    """Publishes and logs what happens.

    Attributes:
        events: What happened.
    """

    def __init__(self) -> None:
        self.events: Events[BridgeEvent] = Events()
        now = asyncio.get_running_loop().time
        self._rates = {what: Allowance(rate, now, most=BURST) for what, rate in RATES.items()}
        self._left_out: Counter[str] = Counter()

    def tell(self, what: str, client: str, detail: str) -> None:
        """Tell an event, unless too many of its kind were told just now; the next one says how many were left out."""
        if rate := self._rates.get(what):
            if rate.wait:
                self._left_out[what] += 1
                return

            rate.spend(1)
            if left_out := self._left_out.pop(what, 0):
                detail = f"{detail} (and {left_out} more that are not told one by one)"

        event = BridgeEvent(what, printable(client), printable(detail))
        self.events.publish(event)
        logger.info("%s", event)
