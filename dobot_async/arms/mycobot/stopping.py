"""How an arm of the myCobot family is stopped: told, and looked at, until it has said several times that it stands.

STOP, look, STOP, look, ...
"""

from __future__ import annotations

import asyncio
import math

from dobot_async._core.link.correlator import Outcome
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.channel import Channel
from dobot_async.arms.mycobot.standstill import LOOKS
from dobot_async.errors import MotionUnknown

__all__ = ["stop_until_still"]

STOP_TIME = 2.0  # seconds within which an arm stands that has heard that it is to stop
STOP_AGAIN = 0.4  # seconds after which an arm that does not answer is told again to stop, at the most
UNHEARD = 2 * LOOKS  # looks in a row, all of them still, of an arm that has not acknowledged that it is to stop


async def stop_until_still(channel: Channel) -> None:
    """Stop the arm, and return when it has said several times in a row that it stands.

    It is told before each look: where nothing is acknowledged, a stop that was lost may have left a motion to begin
    yet. An arm that is silent is told again and again, for as long as the link lives.

    Raises:
        MotionUnknown: It answers that it still moves, 2 s after it was told.
        ConnectionLost: The link is gone.
    """
    link, model, loop = channel.link, channel.model, asyncio.get_running_loop()
    stop, look = (link.frame(model.row(row), None) for row in (c.STOP, c.IS_MOVING))
    flag = model.row(c.IS_MOVING).reply
    again = max(STOP_AGAIN, channel.patience)
    heard = silent = False
    still, moving_since = 0, math.inf
    while still < (LOOKS if heard else UNHEARD):
        await link.opened()
        try:
            told = await link.send(stop, lambda _: None, timeout=again)
            last = await link.send(look, lambda each: flag.decode(each.params), timeout=again)
            if silent:  # a barrier each time would keep the first answers from those who ask next
                await asyncio.sleep(again)
                silent = link.heard_at < told.sent_at
                continue

            answered = await link.settle(last, again)
        except TimeoutError:
            silent, still, moving_since = True, 0, math.inf
            continue

        heard = heard or told.outcome is Outcome.REPLY
        if not answered:
            continue

        moving = last.value
        still = 0 if moving else still + 1
        moving_since = min(moving_since, loop.time()) if moving else math.inf
        if loop.time() > moving_since + STOP_TIME:
            raise MotionUnknown("the arm was told to stop, and says that it still moves; switch it off")
