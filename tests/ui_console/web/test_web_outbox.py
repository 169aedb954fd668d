"""What waits for a browser never piles up."""

from __future__ import annotations

import json
from typing import Any

from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from ui_console.web.outbox import ANSWERS_KEPT, DRAWN_WITHIN_S, PICTURES_UNDERWAY, Outbox

ROBOTS = ("scout1", "scout2", "scout3")


def all_of(outbox: Outbox, now_s: float = 0.0) -> list[str | bytes]:
    found: list[str | bytes] = []
    while (message := outbox.next(now_s)) is not None:
        found.append(message)
    return found


def watching(*robots: str) -> Outbox:
    outbox = Outbox()
    outbox.watch(frozenset(robots))
    return outbox


def test_of_a_section_only_the_newest_is_sent_and_only_if_it_is_new() -> None:
    outbox = Outbox()
    for now in (b"1", b"2", b"3"):
        outbox.put_section("own", now)
    outbox.put_section("log", b"[]")
    [sent] = all_of(outbox)
    assert json.loads(sent) == {"view": {"own": 3, "log": []}}
    outbox.put_section("own", b"3")
    assert all_of(outbox) == []


def test_a_picture_that_was_not_sent_gives_way_to_the_next() -> None:
    outbox = watching("scout1")
    for number in range(5):
        outbox.put_picture("scout1", number, 0.1 * number, b"%d" % number)
    assert all_of(outbox) == [b"4"]
    assert outbox.skipped == 4


def test_pictures_wait_until_those_before_them_are_drawn() -> None:
    outbox = watching("scout1")
    sent = []
    for number in range(6):
        outbox.put_picture("scout1", number, 10.0 + number, b"%d" % number)
        sent += all_of(outbox, 0.1 * number)
    assert sent == [b"0", b"1"]
    assert outbox.drawn("scout1", 0) == 10.0
    assert all_of(outbox, 0.7) == [b"5"]
    assert outbox.drawn("scout1", 0) is None


def test_a_picture_that_is_never_drawn_holds_up_the_next_for_a_while_only() -> None:
    outbox = watching("scout1")
    for number in range(PICTURES_UNDERWAY + 1):
        outbox.put_picture("scout1", number, 0.0, b"%d" % number)
        outbox.next(1.0)
    assert outbox.next(1.1) is None
    assert outbox.next_s() == 1.0 + DRAWN_WITHIN_S
    assert outbox.next(1.0 + DRAWN_WITHIN_S) == b"2"


def test_what_is_not_watched_is_not_sent() -> None:
    outbox = watching("scout1")
    outbox.put_picture("scout2", 1, 0.0, b"2")
    assert all_of(outbox) == []
    outbox.put_picture("scout1", 1, 0.0, b"1")
    outbox.watch(frozenset({"scout2"}))
    assert all_of(outbox) == []
    assert outbox.watched == {"scout2"}


def test_robots_take_turns_when_one_sends_more_than_fits() -> None:
    outbox = watching(*ROBOTS)
    order = []
    for round_ in range(9):
        for robot in ROBOTS:
            outbox.put_picture(robot, round_, 0.0, robot.encode())
        sent = outbox.next(0.1 * round_)
        assert isinstance(sent, bytes)
        order.append(sent.decode())
        outbox.drawn(sent.decode(), round_)
    assert sorted(order) == sorted(3 * ROBOTS)


def test_answers_are_told_in_order_before_all_else_and_are_not_kept_without_end() -> None:
    outbox = watching("scout1")
    outbox.put_section("own", b"1")
    for number in range(ANSWERS_KEPT + 2):
        outbox.put_answer(b"%d" % number)
    sent = all_of(outbox)
    assert sent[:-1] == [str(number) for number in range(2, ANSWERS_KEPT + 2)]


actions = st.lists(
    st.one_of(
        st.tuples(st.just("picture"), st.sampled_from(ROBOTS)),
        st.tuples(st.just("send"), st.just("")),
        st.tuples(st.just("drawn"), st.sampled_from(ROBOTS)),
        st.tuples(st.just("section"), st.sampled_from(["own", "log"])),
    ),
    max_size=80,
)


@settings(max_examples=share(150))
@given(actions)
def test_pictures_underway_are_bounded_and_never_go_back_in_time(acts: list[tuple[str, str]]) -> None:
    outbox = watching(*ROBOTS)
    newest: dict[str, int] = {}
    underway: dict[str, list[int]] = {robot: [] for robot in ROBOTS}
    for step, (act, name) in enumerate(acts):
        now_s = 0.001 * step
        match act:
            case "picture":
                newest[name] = step
                outbox.put_picture(name, step, now_s, f"{name} {step}".encode())
            case "section":
                outbox.put_section(name, str(step).encode())
            case "drawn":
                if underway[name]:
                    assert outbox.drawn(name, underway[name].pop(0)) is not None
            case _:
                sent: Any = outbox.next(now_s)
                if isinstance(sent, bytes):
                    robot, number = sent.decode().split()
                    assert int(number) == newest[robot], "the newest, and nothing else"
                    underway[robot].append(int(number))
        assert all(len(numbers) <= PICTURES_UNDERWAY for numbers in underway.values())
