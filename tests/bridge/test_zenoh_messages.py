"""Messages on Zenoh: in order, once or not at all; and nobody waits who sends them."""

from __future__ import annotations

import asyncio
import threading

import pytest
import zenoh
from bridge_rig import until
from hypothesis import given
from hypothesis import strategies as st

from dobot_async.transports.zenoh import messages as zenoh_messages
from dobot_async.transports.zenoh.messages import DATA, END, HEADER, MESSAGE, MOST, Lost, Numbered, SendQueue


@given(st.lists(st.binary(max_size=8), min_size=1), st.data())
def test_messages_come_in_order_once_or_not_at_all(sent: list[bytes], data: st.DataObject) -> None:
    sender, receiver = Numbered(), Numbered()
    line = list(enumerate(map(sender.pack, sent)))
    spoilt = data.draw(st.lists(st.sampled_from(line), max_size=2 * len(line)))
    taken = []
    try:
        for _, message in spoilt:
            found = receiver.unpack(message)
            if found:
                taken.append(found[1])
    except Lost:
        pass

    assert taken == sent[: len(taken)]


def test_an_end_is_an_end_whatever_its_number() -> None:
    assert Numbered().unpack(HEADER.pack(77, END) + b"why") == (END, b"why")
    assert Numbered().unpack(HEADER.pack(0, DATA) + b"x") == (DATA, b"x")
    with pytest.raises(Lost):
        Numbered().unpack(b"short")


# --- the way out ---


class Network:
    """What Zenoh is to an outbox: it takes messages, or lets their sender wait until it is open."""

    def __init__(self, *, is_open: bool = True) -> None:
        self.taken: list[bytes] = []
        self.complaints: list[str] = []
        self.open = threading.Event()
        if is_open:
            self.open.set()

    def put(self, message: bytes) -> None:
        self.open.wait()
        self.taken.append(message)

    def outbox(self) -> SendQueue:
        return SendQueue(self.put, self.complaints.append, "test")

    def read(self) -> tuple[bytes, list[str]]:
        """The bytes that came out, and the last words."""
        numbered = Numbered()
        told = [found for found in map(numbered.unpack, self.taken) if found]
        last_words = [why.decode() for kind, why in told if kind == END]
        return b"".join(data for kind, data in told if kind == DATA), last_words


@given(st.lists(st.binary(min_size=1, max_size=3 * MESSAGE // 2), max_size=8))
async def test_what_goes_in_comes_out_in_order_and_then_the_last_word(pieces: list[bytes]) -> None:
    network = Network()
    outbox = network.outbox()
    for piece in pieces:
        outbox.send(piece)

    outbox.end("why")
    outbox.end("another")
    outbox.send(b"too late")
    await outbox.aclose()
    await outbox.aclose()
    assert network.read() == (b"".join(pieces), ["why"])
    assert network.complaints == []


async def test_who_sends_never_waits_and_what_gathers_goes_as_one_message() -> None:
    network = Network(is_open=False)
    outbox = network.outbox()
    for number in range(1000):  # were this to wait for the network, it would do so for ever
        outbox.send(b"%03d" % number)

    network.open.set()
    await outbox.aclose()
    assert network.read() == (b"".join(b"%03d" % number for number in range(1000)), [])
    assert len(network.taken) <= 2


async def test_a_message_has_its_limits() -> None:
    network = Network(is_open=False)
    outbox = network.outbox()
    for _ in range(60):
        outbox.send(bytes(1000))

    network.open.set()
    await outbox.aclose()
    assert max(map(len, network.taken)) < MESSAGE + 1000 + HEADER.size
    assert len(network.read()[0]) == 60_000


async def test_who_does_not_read_is_complained_of_once_and_what_it_was_sent_is_no_other() -> None:
    network = Network(is_open=False)
    outbox = network.outbox()
    for _ in range(2 * MOST // 1000):
        outbox.send(bytes(1000))

    await until(lambda: network.complaints)
    outbox.end(network.complaints[0])
    network.open.set()
    await outbox.aclose()
    data, last_words = network.read()
    assert MOST - 1000 < len(data) <= MOST
    assert last_words == network.complaints
    assert "does not read" in last_words[0]


async def test_one_that_does_not_read_holds_up_nobody_else() -> None:
    frozen, other = Network(is_open=False), Network()
    stuck, free = frozen.outbox(), other.outbox()
    stuck.send(b"x")
    free.send(b"y")
    await until(lambda: other.taken)
    assert not frozen.taken
    await free.aclose()
    frozen.open.set()
    await stuck.aclose()


async def test_a_session_that_is_closed_is_complained_of() -> None:
    def closed(_: bytes) -> None:
        raise zenoh.ZError("session closed at /zenoh/src/session.rs:1")

    complaints: list[str] = []
    outbox = SendQueue(closed, complaints.append, "test")
    outbox.send(b"x")
    await until(lambda: complaints)
    await outbox.aclose()
    assert complaints == ["session closed"]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
async def test_a_bug_in_what_sends_leaves_nobody_waiting() -> None:
    def wrong(_: bytes) -> None:
        raise ZeroDivisionError

    complaints: list[str] = []
    outbox = SendQueue(wrong, complaints.append, "test")
    outbox.send(b"x")
    await until(lambda: complaints)
    await outbox.aclose()
    assert complaints == ["the thread that sends has failed"]


async def test_the_end_waits_only_so_long_for_one_that_does_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zenoh_messages, "LAST_WORDS", 0.05)
    network = Network(is_open=False)
    outbox = network.outbox()
    outbox.send(b"x")
    await outbox.aclose()
    assert not network.taken
    network.open.set()
    async with asyncio.timeout(10):
        while any(thread.name == "dobot_async send queue test" for thread in threading.enumerate()):
            await outbox.aclose()
