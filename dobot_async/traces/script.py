"""The recorded requests and replies of a connection, in the order of a replay; no I/O.

    recorded      GetPose  SetPTPCmd  GetIndex  GetIndex  SetPTPCmd
    asked again   GetPose  SetPTPCmd  GetIndex                       --> what was said to that one, with its delay

1. A command is the next one of the same bytes that was recorded. It sets the clock of the replay to when that was.
2. A question is the next one of the same bytes that was asked behind all that was heard by now, if that was not much
   later than it is now, or behind a motion that is still to come. Asked later than then it sets the clock back.
3. A question that is asked more often than it was recorded gets its last reply again; not while the arm was silent.
4. A request that was never recorded, or a command repeated that was recorded once, is not answered; the second time
   the replay ends.
"""

from __future__ import annotations

import bisect
import math

from dobot_async.traces.exchanges import JUNK, Exchanges, RecordedRequest
from dobot_async.traces.reader import Trace

__all__ = ["Script", "Unrecorded"]

SLACK = 0.25
"""Seconds by which a question may come earlier than it did, and for which an answer may be outstanding."""


class Unrecorded(Exception):
    """Something was asked that is not in the recording."""


class Script:
    """What is said to what is asked; see the module.

    Args:
        trace: Of one connection.

    Attributes:
        opening: What came before anything was asked.
    """

    def __init__(self, trace: Trace) -> None:
        recorded = Exchanges(trace)
        self.opening: RecordedRequest = recorded.opening
        self._asked, self._came, self._end = recorded.asked, recorded.came, recorded.end
        self._known: dict[bytes, list[RecordedRequest]] = {}
        self._secret = [each for each in self._asked if each.secret]
        for each in self._asked:
            if not each.secret:
                self._known.setdefault(b"".join(part for part in each.raw if part), []).append(each)

        self._unanswered: set[bytes] = set()
        self._next = 0  # the first one behind the last command
        self._used: dict[bytes, int] = {}  # the place behind the last one of these bytes
        self._behind = 0.0  # what is to be added to the time of now for the trace's

    def begin(self, now: float) -> None:
        """Begin at a time in seconds."""
        self._behind = self.opening.t - now

    def asked(self, data: bytes, now: float, heard: int) -> RecordedRequest:
        """Return what was recorded of a request.

        Args:
            data: What is sent.
            now: When, in seconds.
            heard: The number of the last piece that was delivered.

        Raises:
            Unrecorded: It was never sent, and now comes for the second time.
        """
        data = data.lstrip(JUNK)  # which ended a half frame that the arm might have had
        known = self._known.get(data) or [each for each in self._secret if each.fits(data)]
        if not known:
            return self._unknown(data, now)

        write = known[0].write
        least = self._next if write else max(self._next, self._used.get(data, 0))
        following = (each for each in known if each.place >= least and (write or each.number > heard))
        found = next(following, None)
        if found is None or not (write or self._has_come(found, now)):
            return self._again(known, data, now, least)

        self._used[data] = found.place + 1
        if write:
            self._next = found.place + 1

        # Who asks later than then lets the clock wait; who asks a little earlier does not hurry it.
        self._behind = found.t - now if write else min(self._behind, found.t - now)
        return found

    def _has_come(self, found: RecordedRequest, now: float) -> bool:
        """Whether a question may be asked already: up to `SLACK` earlier, but not before a motion that was recorded."""
        early = found.t - (now + self._behind)
        between = self._asked[self._next : found.place] if early > 0 else ()
        return early <= SLACK and not any(each.once for each in between)

    def _unknown(self, data: bytes, now: float) -> RecordedRequest:
        """Leave what was never asked unanswered, as if it had been lost; the second time the replay ends."""
        if not self._silent(now) and data in self._unanswered:
            raise Unrecorded(f"the trace has no answer to {data.hex(' ')[:60]}: is this the program that was recorded?")

        self._unanswered.add(data)
        return RecordedRequest(-1, -1, now)

    def _silent(self, now: float) -> bool:
        """Whether the arm did not answer, at this time of the recording, although it was asked."""
        clock = min(now + self._behind, self._end)
        last = bisect.bisect_right(self._came, clock) - 1
        since = self._came[last] if last >= 0 else -math.inf
        unanswered = bisect.bisect_right(self._asked, since, key=lambda each: each.t)
        return unanswered < len(self._asked) and self._asked[unanswered].t < clock - SLACK

    def _again(self, known: list[RecordedRequest], data: bytes, now: float, least: int) -> RecordedRequest:
        """Return what is said to what is asked more often than it was: as the last time, but by an arm that speaks."""
        if self._silent(now):
            return RecordedRequest(-1, -1, now)

        if known[0].once:
            return self._unknown(data, now)

        clock = now + self._behind
        answered = [each for each in known if each.pieces]
        before = sum(each.place < least or each.t <= clock for each in answered)
        found = answered[max(before - 1, 0)] if answered else known[-1]
        self._used[data] = max(least, found.place + 1)
        return found
