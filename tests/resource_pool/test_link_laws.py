"""Laws of the two-way link, without loop and bus: who is asked, what is lost, what is published, what is an alarm."""

from __future__ import annotations

import itertools

from hypothesis import given
from hypothesis import strategies as st

from resource_pool.drivers.reply_turns import ReplyTurn, ReplyTurns
from resource_pool.link_watch import LOST_IN_A_ROW, LinkNews, LinkWatch
from resource_pool.readings_book import EVERY_S, RECHARGED_SHARE, BatteryWatch, Charge, ReadingsBook

ROBOTS = st.integers(1, 3)
PAUSES = st.sampled_from([0.0, 0.05, 0.1, 0.45, 0.5, 0.7, 3.0])
SHARES = st.floats(0, 1)


steps = st.lists(st.tuples(st.sampled_from(["packet", "reply"]), ROBOTS, PAUSES), max_size=60)


def played(history: list[tuple[str, int, float]]) -> list[tuple[float, int, str, ReplyTurn]]:
    """Return what happened: time, robot, step, and for a packet its turn."""
    turns, now_s, found = ReplyTurns(0.5), 0.0, []
    for what, robot, pause_s in history:
        now_s += pause_s
        turn = turns.take(robot, now_s) if what == "packet" else ReplyTurn()
        if what == "reply":
            turns.heard(robot)
        found.append((now_s, robot, what, turn))
    return found


@given(steps)
def test_a_robot_is_asked_by_the_first_packet_that_is_due_and_by_no_other(
    history: list[tuple[str, int, float]],
) -> None:
    asked_s: dict[int, float] = {}
    for now_s, robot, what, turn in played(history):
        is_due = what == "packet" and now_s >= asked_s.get(robot, -1.0) + 0.5 - 1e-6
        assert turn.asks == is_due
        if is_due:
            asked_s[robot] = now_s


@given(steps)
def test_a_reply_is_lost_if_none_came_between_two_packets_that_ask(history: list[tuple[str, int, float]]) -> None:
    owed: dict[int, bool] = {}
    for _, robot, what, turn in played(history):
        assert turn.is_lost == (turn.asks and owed.get(robot, False))
        if turn.asks or what == "reply":
            owed[robot] = turn.asks


@given(steps, ROBOTS)
def test_one_robots_turns_do_not_depend_on_the_others(history: list[tuple[str, int, float]], robot: int) -> None:
    turns, now_s, alone = ReplyTurns(0.5), 0.0, []
    for what, who, pause_s in history:
        now_s += pause_s
        if who == robot:
            if what == "reply":
                turns.heard(robot)
            alone.append(turns.take(robot, now_s) if what == "packet" else ReplyTurn())
    assert alone == [turn for _, who, _, turn in played(history) if who == robot]


@given(st.lists(st.tuples(ROBOTS, st.booleans()), max_size=80))
def test_silence_and_its_end_are_news_once_each_and_every_reply_is_counted(replies: list[tuple[int, bool]]) -> None:
    links = LinkWatch()
    assert [links.add(robot, f"scout{robot}") for robot in (1, 2, 3, 1)] == [True, True, True, False]
    news = [(robot, links.heard(robot) if came else links.lost(robot)) for robot, came in replies]
    for robot in (1, 2, 3):
        came = [one for who, one in replies if who == robot]
        runs = [(is_reply, len(list(run))) for is_reply, run in itertools.groupby(came)]
        silences = sum(not is_reply and length >= LOST_IN_A_ROW for is_reply, length in runs)
        own = [one for who, one in news if who == robot and one is not LinkNews.NONE]
        assert own[::2] == [LinkNews.SILENT] * silences
        assert own[1::2] == [LinkNews.ANSWERS] * len(own[1::2])
        ends_silent = bool(runs) and not runs[-1][0] and runs[-1][1] >= LOST_IN_A_ROW
        assert len(own) == 2 * silences - ends_silent
        assert links.counts()[f"replies_lost_scout{robot}"] == came.count(False)
    counts = links.counts()
    assert (counts["replies"], counts["replies_lost"]) == (
        sum(came for _, came in replies),
        sum(not came for _, came in replies),
    )


def test_the_news_comes_with_the_third_lost_reply() -> None:
    links = LinkWatch()
    links.add(1, "scout1")
    assert [links.lost(1) for _ in range(4)] == [LinkNews.NONE, LinkNews.NONE, LinkNews.SILENT, LinkNews.NONE]
    assert [links.heard(1) for _ in range(2)] == [LinkNews.ANSWERS, LinkNews.NONE]


@given(st.lists(st.tuples(PAUSES, st.integers(0, 2)), max_size=40))
def test_readings_are_published_when_they_change_not_too_often_and_the_newest_at_last(
    puts: list[tuple[float, int]],
) -> None:
    book, now_s, published = ReadingsBook(), 0.0, []

    def publish_until(end_s: float) -> None:
        nonlocal now_s
        while (due_s := book.due_s) is not None and due_s <= end_s:
            now_s = max(now_s, due_s)
            published.append((now_s, dict(book.values)))
            book.published(now_s)
        now_s = end_s

    for pause_s, value in puts:
        publish_until(now_s + pause_s)
        book.put({"value": float(value)}, now_s)
    publish_until(now_s + EVERY_S)
    for (before_s, before), (after_s, after) in itertools.pairwise(published):
        assert after_s - before_s >= EVERY_S - 1e-9
        assert before != after
    assert [values for _, values in published][-1:] == [{"value": float(value)} for _, value in puts][-1:]
    assert book.due_s is None


@given(st.floats(0, 0.9), st.lists(SHARES, max_size=60))
def test_a_low_battery_is_one_alarm_until_it_is_charged_again(alarm_share: float, charges: list[float]) -> None:
    battery = BatteryWatch(alarm_share)
    news = [(share, battery.see(share)) for share in charges]
    told = [charge for _, charge in news if charge is not Charge.AS_BEFORE]
    assert told[::2] == [Charge.LOW] * len(told[::2])
    assert told[1::2] == [Charge.CHARGED_AGAIN] * len(told[1::2])
    is_low = False
    for share, charge in news:
        if charge is Charge.AS_BEFORE:
            assert share < alarm_share + RECHARGED_SHARE if is_low else share >= alarm_share
        elif charge is Charge.LOW:
            assert share < alarm_share
            is_low = True
        else:
            assert share >= alarm_share + RECHARGED_SHARE
            is_low = False


@given(st.lists(st.floats(0.2 - 0.01, 0.2 + RECHARGED_SHARE - 0.01), max_size=40))
def test_a_charge_that_wavers_about_the_limit_is_one_alarm_at_most(charges: list[float]) -> None:
    battery = BatteryWatch(0.2)
    assert [battery.see(share) for share in charges].count(Charge.LOW) <= 1
