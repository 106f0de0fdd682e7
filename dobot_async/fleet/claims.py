"""Who holds which zones, and who waits for them. No I/O and no clock: each claim is told its answer by a call.

    request --> waiting --free of others, nobody before it--> granted --> release
                   |
                   `--> ZoneDeadlock, ZoneOccupied, or whatever `fail` says

A claim is for one or several zones, all of which it gets at once. Claims on the same zone are granted in the order of
their requests. There is one exception: a claim passes an earlier one that waits, directly or not, for the party that
asks, for that one would otherwise wait for itself. A cycle of waits that is left is a deadlock, and its latest claim is
told so.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field

from dobot_async.errors import DobotError
from dobot_async.fleet.errors import ZoneDeadlock, ZoneOccupied

__all__ = ["Claim", "Claims", "Party"]


@dataclass(eq=False, slots=True)
class Party:
    """Somebody who can hold a zone: an arm, or a program.

    Attributes:
        name: For messages.
        failure: Why it will not leave what it holds; None while all is well.
    """

    name: str
    failure: DobotError | None = None


@dataclass(eq=False, slots=True)
class Claim:
    """A wish for zones, and the hold on them once it is granted.

    Attributes:
        party: Who holds the zones then.
        own: The parties that do not stand in its way: itself, and those that it acts for.
        zones: What it is for.
        answer: Called once: with None when it is granted, with the error when it never will be.
        patient: False gives it an error where it would have to wait.
        stuck: The parties that release nothing as long as it waits: its own, and the arms that wait for its command.
    """

    party: Party
    own: frozenset[Party]
    zones: frozenset[str]
    answer: Callable[[DobotError | None], None] = field(default=lambda _: None)
    patient: bool = True
    stuck: frozenset[Party] = frozenset()

    def __post_init__(self) -> None:
        self.stuck |= self.own


class Claims:
    """All claims of one cell."""

    def __init__(self) -> None:
        self._held: list[Claim] = []
        self._waiting: list[Claim] = []

    @property
    def held(self) -> list[Claim]:
        """The claims that are granted, oldest first."""
        return list(self._held)

    @property
    def waiting(self) -> list[Claim]:
        """The claims that wait, oldest first."""
        return list(self._waiting)

    def holders(self, zone: str) -> list[Party]:
        """Returns who holds a zone."""
        return list(dict.fromkeys(claim.party for claim in self._held if zone in claim.zones))

    def request(self, claim: Claim) -> None:
        """Enters a claim; it may be answered before this returns."""
        self._waiting.append(claim)
        self.settle()
        if not claim.patient and claim in self._waiting:
            self._waiting.remove(claim)
            claim.answer(ZoneOccupied(f"{claim.party.name} may not pass: {self._reason(claim)}"))

    def take(self, claim: Claim) -> None:
        """Grants a claim to who is in the zones already, whoever else holds them."""
        self._held.append(claim)
        self.settle()

    def release(self, claim: Claim, zones: Collection[str] | None = None) -> None:
        """Gives back some zones, all by default; a claim that waits is withdrawn. What is not held does not matter."""
        if claim in self._waiting:
            self._waiting.remove(claim)
        elif claim in self._held:
            claim.zones = frozenset() if zones is None else claim.zones - frozenset(zones)
            if not claim.zones:
                self._held.remove(claim)

        self.settle()

    def fail(self, parties: Collection[Party], error: DobotError) -> None:
        """Ends the waiting of all that act for one of these parties."""
        for claim in [claim for claim in self._waiting if not claim.stuck.isdisjoint(parties)]:
            self._waiting.remove(claim)
            claim.answer(error)

        self.settle()

    def interrupt(self, party: Party, error: DobotError) -> None:
        """Ends the waiting of one party alone."""
        for claim in [claim for claim in self._waiting if claim.party is party]:
            self._waiting.remove(claim)
            claim.answer(error)

        self.settle()

    def settle(self) -> None:
        """Answers all that can be answered; to be called when a party has failed."""
        while True:
            found = next((claim for claim in self._waiting if self._free(claim) and self._next(claim)), None)
            if found:
                self._waiting.remove(found)
                self._held.append(found)
                found.answer(None)
                continue

            refused = next(self._hopeless(), None)
            if refused is None:
                return

            claim, error = refused
            self._waiting.remove(claim)
            claim.answer(error)

    def _foreign(self, claim: Claim) -> Iterator[tuple[Party, str]]:
        """Who stands in the way of a claim, and in which zone; who is in a zone may move in it, even beside others."""
        inside = frozenset[str]().union(*(each.zones for each in self._held if each.party is claim.party))
        for each in self._held:
            if each.party not in claim.own:
                for zone in sorted(each.zones & claim.zones - inside):
                    yield each.party, zone

    def _free(self, claim: Claim) -> bool:
        return next(self._foreign(claim), None) is None

    def _next(self, claim: Claim) -> bool:
        """Whether no earlier claim has a better right."""
        return all(claim in self._behind(earlier) for earlier in self._before(claim))

    def _before(self, claim: Claim) -> list[Claim]:
        """The earlier claims on the same zones that still wait."""
        earlier = self._waiting[: self._waiting.index(claim)]
        return [each for each in earlier if not each.zones.isdisjoint(claim.zones)]

    def _behind(self, claim: Claim) -> set[Claim]:
        """All claims that a claim waits for, directly or not."""
        found: set[Claim] = set()
        todo = [claim]
        while todo:
            each = todo.pop()
            parties = {party for party, _ in self._foreign(each)}
            blocked = [other for other in self._waiting if not other.stuck.isdisjoint(parties)]
            for other in blocked + self._before(each):
                if other not in found:
                    found.add(other)
                    todo.append(other)

        return found

    def _hopeless(self) -> Iterator[tuple[Claim, DobotError]]:
        """Claims that wait for somebody who has failed, or for themselves."""
        for claim in reversed(self._waiting):
            for party, zone in self._foreign(claim):
                if party.failure:
                    yield (
                        claim,
                        ZoneOccupied(f"{party.name} has failed, and may still be in zone {zone}: {party.failure}"),
                    )

            cycle = self._cycle(claim) if claim.patient else []
            if cycle:
                yield claim, ZoneDeadlock(f"a deadlock: {'; '.join(cycle)}")

    def _cycle(self, claim: Claim) -> list[str]:
        """The waits that lead from a claim back to itself, in words; empty if they do not."""
        ways: list[tuple[Claim, list[str]]] = [(claim, [])]
        seen: set[Claim] = set()
        while ways:
            each, words = ways.pop(0)
            for party, zone in self._foreign(each):
                told = [*words, f"{each.party.name} waits for zone {zone}, which {party.name} holds"]
                if party in claim.stuck:
                    return told

                for other in self._waiting:
                    if party in other.stuck and other not in seen:
                        seen.add(other)
                        ways.append((other, told))

        return []

    def _reason(self, claim: Claim) -> str:
        """Why a claim has to wait, in words."""
        held = [f"{party.name} holds zone {zone}" for party, zone in self._foreign(claim)]
        return "; ".join(held) or f"others wait for {', '.join(sorted(claim.zones))}"
