"""What a browser may say, judged without a socket."""

from __future__ import annotations

import json
from typing import Any

import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from ui_console.web.login import (
    BURST,
    FAULTS_FORGIVEN,
    LOGIN_WITHIN_S,
    MAX_MESSAGE_BYTES,
    RATE_HZ,
    Authenticator,
    BeatRequest,
    ClientSession,
    ProtocolViolation,
    TokenRights,
    ViolationKind,
    Welcome,
    WrongOperator,
    new_rights,
    new_token,
    read_operator,
)
from ui_console.web.protocol import (
    Intent,
    LiftRequest,
    ReleaseRequest,
    SetRequest,
    Steer,
    StopWheels,
    Watch,
    understand,
)

TOKEN = "the-right-one"  # noqa: S105  opens nothing


def session(granted: TokenRights | None = None, now_s: float = 0.0) -> ClientSession[Intent]:
    return ClientSession(Authenticator({TOKEN: granted or TokenRights("", 100)}), understand, now_s)


def hello(**more: Any) -> bytes:
    return json.dumps({"do": "hello", "token": TOKEN, **more}).encode()


def welcomed() -> ClientSession[Intent]:
    one = session()
    assert isinstance(one.heard(hello(user="anna"), 0.0), Welcome)
    return one


anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=12), inner, max_size=4),
    max_leaves=12,
)
words = st.sampled_from(["hello", "drive", "stop", "take", "watch", "drawn", "set", "why", "here", "stop_all", "dance"])
messages = st.one_of(
    st.binary(max_size=200),
    st.text(max_size=200),
    anything.map(json.dumps),
    st.builds(
        lambda word, rest: json.dumps({"do": word, **rest}), words, st.dictionaries(st.text(max_size=9), anything)
    ),
)


@settings(max_examples=share(60))
@given(st.lists(messages, max_size=12))
def test_nobody_gets_in_without_the_token_whatever_is_said(said: list[str | bytes]) -> None:
    one = session()
    for number, data in enumerate(said):
        outcome = one.heard(data, 0.1 * number)
        assert outcome is None or isinstance(outcome, ProtocolViolation)
        assert one.is_out, "the first wrong word is the last"
    assert one.welcome is None


@settings(max_examples=share(60))
@given(st.lists(messages, max_size=12))
def test_whatever_a_visitor_says_means_something_typed_or_is_an_offence(said: list[str | bytes]) -> None:
    one = welcomed()
    was_out = False
    for number, data in enumerate(said):
        outcome = one.heard(data, 1.0 + number)
        if was_out:
            assert outcome is None
        elif isinstance(outcome, Steer):
            assert -1 <= outcome.forward <= 1
            assert -1 <= outcome.right <= 1
        was_out = was_out or (isinstance(outcome, ProtocolViolation) and outcome.is_fatal)
        assert one.is_out is was_out


@given(st.text(max_size=100))
def test_only_the_right_token_opens(token: str) -> None:
    found = Authenticator({TOKEN: TokenRights("", 7)}).rights_of(token)
    assert (found == TokenRights("", 7)) is (token == TOKEN)
    assert token == TOKEN or found is None


@given(st.integers(-1000, 1000) | st.none(), st.integers(0, 500))
def test_nobody_gets_more_priority_than_the_token_is_good_for(asked: int | None, most: int) -> None:
    outcome = session(TokenRights("", most)).heard(hello(priority=asked), 0.0)
    assert isinstance(outcome, Welcome)
    assert 0 <= outcome.priority <= most
    if asked is None or asked >= most:
        assert outcome.priority == most


def test_a_token_made_for_somebody_has_that_name() -> None:
    assert session(TokenRights("anna", 5)).heard(hello(user="eve"), 0.0) == Welcome("anna", 5)
    assert session().heard(hello(user="  a\n b "), 0.0) == Welcome("a b", 100)
    assert session().heard(hello(), 0.0) == Welcome("unnamed", 100)


def test_people_at_two_pages_without_a_name_are_two_people() -> None:
    for page, user in (("7f01a-2", "unnamed 7f01"), ("8e-3", "unnamed 8e-3"), (" \n", "unnamed")):
        assert session().heard(hello(page=page), 0.0) == Welcome(user, 100, page)


def test_who_shows_no_token_in_time_is_late() -> None:
    one = session(now_s=3.0)
    assert one.must_log_in_by_s == 3.0 + LOGIN_WITHIN_S
    assert one.late().kind is ViolationKind.LATE
    assert one.heard(hello(), 9.0) is None
    assert welcomed().must_log_in_by_s is None


def test_a_message_that_is_too_long_ends_it_before_it_is_read() -> None:
    one = welcomed()
    outcome = one.heard(b'{"do":"why","name":"' + b"a" * MAX_MESSAGE_BYTES + b'"}', 1.0)
    assert isinstance(outcome, ProtocolViolation)
    assert (outcome.kind, outcome.is_fatal) == (ViolationKind.OVERSIZED, True)
    assert one.heard(b'{"do":"stop"}', 2.0) is None


def test_a_few_meaningless_messages_are_forgiven() -> None:
    one = welcomed()
    for _ in range(FAULTS_FORGIVEN):
        outcome = one.heard(b"{", 1.0)
        assert isinstance(outcome, ProtocolViolation)
        assert not outcome.is_fatal
        assert one.heard(b'{"do":"stop"}', 1.0) == StopWheels()
    outcome = one.heard(b"{", 1.0)
    assert isinstance(outcome, ProtocolViolation)
    assert outcome.is_fatal


@pytest.mark.parametrize(
    "said",
    [
        b'{"do":"drive","moment":0,"forward":2,"right":0,"speed":0.5}',
        b'{"do":"drive","moment":0,"forward":NaN,"right":0,"speed":0.5}',
        b'{"do":"drive","moment":0,"forward":1e999,"right":0,"speed":0.5}',
        b'{"do":"drive","moment":0,"forward":1,"right":0,"speed":-1}',
        b'{"do":"drive","moment":0,"forward":1,"right":0,"speed":4}',
        b'{"do":"drive","moment":0,"forward":1,"right":0,"speed":0.5,"more":1}',
        b'{"do":"drive","forward":1,"right":0,"speed":0.5}',
        b'{"do":"give","word":"jump","values":{},"role":""}',
        b'{"do":"give","moment":0,"word":"shine","values":{"brightness":[1]},"role":""}',
        b'{"do":"give","moment":0,"word":"shine","values":{"brightness":NaN},"role":""}',
        b'{"do":"take","robot":"' + b"x" * 64 + b'"}',
        b'{"do":"watch","robots":[' + b",".join([b'"a"'] * 17) + b"]}",
        b'{"do":"drawn","robot":"scout1","number":-1}',
        b'{"do":"beat","number":-1}',
        b'{"do":"lift","robot":"scout1"}',
        b'{"do":"hello","token":"the-right-one"}',
        b"[" * 2000,
        b"\xff\xfe",
        b"",
    ],
)
def test_what_is_out_of_range_means_nothing(said: bytes) -> None:
    outcome = welcomed().heard(said, 1.0)
    assert isinstance(outcome, ProtocolViolation)
    assert outcome.kind is ViolationKind.MALFORMED


def test_words_become_intents() -> None:
    one = welcomed()
    assert one.heard(b'{"do":"beat","number":7}', 1.0) == BeatRequest(7)
    assert one.heard(b'{"do":"lift","robot":"scout1","number":3}', 1.0) == LiftRequest("scout1", 3)
    said = b'{"do":"drive","moment":3,"forward":0.5,"right":-1,"speed":0.5}'
    assert one.heard(said, 1.0) == Steer(3, 0.5, -1.0, 0.5)
    assert one.heard('{"do":"release"}', 1.0) == ReleaseRequest()
    assert one.heard(b'{"do":"watch","robots":["scout1"]}', 1.0) == Watch(["scout1"])
    setting = one.heard(b'{"do":"set","name":"watch-scout1","parameter":"pause_s","value":[1,"a"]}', 1.0)
    assert setting == SetRequest("watch-scout1", "pause_s", [1, "a"])


@settings(max_examples=share(50))
@given(st.floats(1.2, 20.0), st.floats(0.0, 1e6))
def test_who_floods_is_out_soon(times_too_many: float, begins_s: float) -> None:
    one = session(now_s=begins_s)
    one.heard(hello(), begins_s)
    step_s = 1.0 / (RATE_HZ * times_too_many)
    most = int(BURST / (1.0 - 1.0 / times_too_many)) + 3
    outcomes = [one.heard(b'{"do":"stop"}', begins_s + number * step_s) for number in range(most)]
    faults = [outcome.kind for outcome in outcomes if isinstance(outcome, ProtocolViolation)]
    assert faults == [ViolationKind.FLOOD]
    assert one.is_out


def test_who_keeps_to_the_rate_is_heard_for_ever() -> None:
    one = welcomed()
    for number in range(3000):
        assert one.heard(b'{"do":"stop"}', number / (RATE_HZ * 0.99)) == StopWheels()


def test_tokens_are_one_for_all_or_one_for_each() -> None:
    [(token, granted)] = new_rights([], 50).items()
    assert (granted, len(token) >= 32) == (TokenRights("", 50), True)
    assert sorted(new_rights([("anna", 1), ("ben", 2)], 50).values(), key=lambda one: one.user) == [
        TokenRights("anna", 1),
        TokenRights("ben", 2),
    ]
    assert len({new_token() for _ in range(100)}) == 100


def test_two_operators_of_one_name_are_refused() -> None:
    with pytest.raises(WrongOperator, match="anna is there twice"):
        new_rights([("anna", 1), ("ben", 2), ("anna", 3)], 50)


@pytest.mark.parametrize(
    "text", ["anna", "=3", "anna=", "anna=-1", "anna=x", "a" * 64 + "=1", " =1", "anna =1", "\x1b[2Ja=1"]
)
def test_an_operator_is_a_name_and_a_priority(text: str) -> None:
    with pytest.raises(WrongOperator, match="anna=120"):
        read_operator(text)
    assert read_operator("anna=120") == ("anna", 120)
