"""Lossless delivery over a network that loses, doubles and reorders, and over one that carries nothing for a while."""

import math
import random

from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.lossless import (
    AGAIN_MOST_S,
    AGAIN_S,
    MOST_STREAMS_HEARD,
    MOST_UNDER_WAY_BYTES,
    LosslessHearing,
    LosslessSending,
    Parcel,
)

STREAM, KEY = b"stream-1", "scout/m/x/y/frames"
STEP_S = 0.005


class LossyLink:
    """A sender and a listener with a network between them that loses a share of what it carries."""

    def __init__(self, loss: float, seed: int, most_bytes: int = 10**9) -> None:
        self.sending, self.hearing = LosslessSending(most_bytes), LosslessHearing()
        self._loss, self._random = loss, random.Random(seed)
        self._on_the_way: list[tuple[float, Parcel | int]] = []
        self.now_s = 0.0
        self.heard: list[bytes] = []
        self.sent_bytes = 0

    def _carry(self, what: Parcel | int) -> None:
        for _copy in range(self._random.choice((1, 1, 1, 2))):
            if self._random.random() >= self._loss:
                self._on_the_way.append((self.now_s + self._random.random() * 4 * STEP_S, what))

    def step(self) -> None:
        self.now_s += STEP_S
        for parcel in self.sending.due(self.now_s):
            self.sent_bytes += len(parcel.raw)
            self._carry(parcel)
        arrived = [what for at_s, what in self._on_the_way if at_s <= self.now_s]
        self._on_the_way = [one for one in self._on_the_way if one[0] > self.now_s]
        for what in arrived:
            match what:
                case Parcel(number, lost, _key, raw):
                    is_new, acknowledged = self.hearing.take(STREAM, number, lost)
                    if is_new:
                        self.heard.append(raw)
                    self._carry(acknowledged)
                case int(number):
                    self.sending.acknowledge(number, self.now_s)


messages = st.lists(st.integers(0, 3 * MOST_UNDER_WAY_BYTES // 2).map(bytes), max_size=30)


@given(messages, st.floats(0.0, 0.6), st.integers(0, 2**32), st.data())
def test_every_message_arrives_once_and_in_order_however_lossy_the_network_is(
    given_messages: list[bytes], loss: float, seed: int, data: st.DataObject
) -> None:
    link = LossyLink(loss, seed)
    for message in given_messages:
        assert link.sending.add(KEY, message)
        for _ in range(data.draw(st.integers(0, 3))):
            link.step()
    for _ in range(100_000):
        if not link.sending.waiting:
            break
        link.step()
    assert list(map(len, link.heard)) == list(map(len, given_messages))
    assert link.hearing.lost == 0
    link.now_s += 10 * AGAIN_MOST_S
    assert not list(link.sending.due(link.now_s)), "an idle stream says nothing"


@given(messages, st.integers(0, 1_000_000))
def test_what_waits_has_a_bound_and_what_is_lost_is_counted_at_the_listener(lost_from: list[bytes], most: int) -> None:
    link = LossyLink(0.0, 0, most)
    taken = [message for message in lost_from if link.sending.add(KEY, message)]
    assert sum(map(len, taken)) <= max(most, len(taken[0]) if taken else 0)
    link.sending.add(KEY, b"last") or taken  # one more, so that the count travels with the messages after it
    while link.sending.waiting:
        link.step()
    assert link.heard[: len(taken)] == taken
    assert link.hearing.lost <= link.sending.lost
    assert link.sending.add(KEY, b"after")
    while link.sending.waiting:
        link.step()
    assert link.hearing.lost == link.sending.lost


def test_a_listener_that_hangs_costs_the_network_a_window_again_and_again_but_ever_more_rarely() -> None:
    link = LossyLink(1.0, 0)
    for _ in range(100):
        link.sending.add(KEY, bytes(MOST_UNDER_WAY_BYTES // 4))
    while link.now_s < 100.0:
        link.step()
    assert link.sent_bytes <= (100.0 / AGAIN_MOST_S + 4) * MOST_UNDER_WAY_BYTES


def test_numbers_that_were_never_sent_are_not_acknowledged() -> None:
    sending = LosslessSending()
    sending.add(KEY, b"one")
    assert [parcel.number for parcel in sending.due(0.0)] == [1]
    for nonsense in (2, 2**64 - 1, -1):
        sending.acknowledge(nonsense, 0.1)
    assert sending.waiting == 1
    sending.acknowledge(1, 0.1)
    assert sending.waiting == 0
    assert sending.again_s == math.inf


def test_a_gap_is_answered_at_once_but_only_once() -> None:
    sending = LosslessSending()
    for text in (b"one", b"two", b"three"):
        sending.add(KEY, text)
    assert len(list(sending.due(0.0))) == 3
    sending.acknowledge(0, 0.001)  # the second came before the first
    assert [parcel.raw for parcel in sending.due(0.001)] == [b"one", b"two", b"three"]
    sending.acknowledge(0, 0.002)  # the third did, too
    assert not list(sending.due(0.002))
    assert sending.again_s == 0.001 + AGAIN_S


def test_strangers_streams_are_forgotten_and_their_losses_are_not() -> None:
    hearing = LosslessHearing()
    for number in range(MOST_STREAMS_HEARD + 5):
        hearing.take(number.to_bytes(8), 7, 1)
    assert hearing.lost == MOST_STREAMS_HEARD + 5
    hearing.take(b"stranger", 1, 2**64 - 1)
    assert hearing.lost == MOST_STREAMS_HEARD + 5
