"""Laws of asking for consent: each question has one answer, a yes is for one, and silence is a no."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ui_console.model.consent import (
    CONSENT_WITHIN_S,
    MOST_OPEN,
    AskConsent,
    AskedAlready,
    ConsentDesk,
    Sought,
    TooManyAsk,
    Topic,
)

ASK = AskConsent("scout1", "ben", "my robot is stuck")


def seek(desk: ConsentDesk, asker: str, asked: AskConsent, now_s: float) -> Sought:
    return desk.open_question(Sought(asker, asked.user, asked.robot, asked.why, now_s + CONSENT_WITHIN_S))


steps = st.lists(
    st.one_of(
        st.tuples(st.just("seek"), st.integers(0, 3)),
        st.tuples(st.just("decide"), st.booleans()),
        st.tuples(st.just("decide_late"), st.integers(0, 3)),
        st.tuples(st.just("wait"), st.floats(0, 10)),
        st.tuples(st.just("ended"), st.booleans()),
        st.tuples(st.just("withdrawn"), st.integers(0, 3)),
    ),
    max_size=30,
)


@given(steps)
def test_each_question_gets_exactly_one_answer_and_none_stays_open_longer_than_promised(
    played: list[tuple[str, float]],
) -> None:
    desk, now_s = ConsentDesk("anna"), 0.0
    asked: list[object] = []
    settled: list[object] = []
    for what, with_what in played:
        match what:
            case "seek":
                asker = f"ui_console/{with_what}"
                if asker in {one.asker for one in desk.open}:
                    with pytest.raises(AskedAlready):
                        seek(desk, asker, ASK, now_s)
                else:
                    asked.append(seek(desk, asker, ASK, now_s))
            case "decide":
                first = desk.open[0] if desk.open else None
                answers = desk.decide(bool(with_what))
                assert [answer.sought for answer in answers if answer.consent.is_given] == (
                    [first] if with_what and first else []
                )
                settled += [answer.sought for answer in answers]
            case "decide_late":
                is_over = all(one.number != with_what for one in desk.open[:1])
                answers = desk.decide(True, number=int(with_what))
                assert (answers == []) is is_over, "only the first question is answered by its number"
                settled += [answer.sought for answer in answers]
            case "wait":
                now_s += with_what
                late = desk.expire(now_s)
                assert not any(answer.consent.is_given for answer in late)
                settled += [answer.sought for answer in late]
                assert all(one.until_s > now_s for one in desk.open)
            case "withdrawn":
                asker = f"ui_console/{with_what}"
                over = desk.withdrawn(asker, ASK.user, Topic.TAKE)
                assert not any(answer.consent.is_given for answer in over)
                settled += [answer.sought for answer in over]
                assert asker not in {one.asker for one in desk.open}
            case "ended":
                settled += [answer.sought for answer in desk.ended(bool(with_what), "released")]
                assert not desk.open
    assert sorted(map(id, asked)) == sorted(map(id, [*settled, *desk.open]))


def test_a_yes_is_for_the_first_and_the_others_hear_for_whom() -> None:
    desk = ConsentDesk("anna")
    for name in ("ben", "cleo", "dan"):
        seek(desk, f"ui_console/{name}", AskConsent("scout1", name, ""), 1.0)
    [no] = desk.decide(False, "nearly done")
    assert (no.sought.user, no.consent.is_given, no.consent.reason) == ("ben", False, "nearly done")
    yes, other = desk.decide(True)
    assert (yes.sought.user, yes.consent.is_given, yes.consent.user) == ("cleo", True, "anna")
    assert (other.sought.user, other.consent.is_given, other.consent.reason) == ("dan", False, "cleo may have it")
    assert desk.decide(True) == []


def test_an_answer_to_a_question_that_is_over_answers_no_other() -> None:
    desk = ConsentDesk("anna")
    to_ben = seek(desk, "ui_console/ben", ASK, 1.0).number
    desk.expire(1.0 + CONSENT_WITHIN_S)
    to_cleo = seek(desk, "ui_console/cleo", AskConsent("scout1", "cleo", ""), 10.0).number
    assert desk.decide(True, number=to_ben) == []
    [yes] = desk.decide(True, number=to_cleo)
    assert yes.sought.user == "cleo"


def test_silence_is_a_no_after_some_seconds() -> None:
    desk = ConsentDesk("anna")
    seek(desk, "ui_console/ben", ASK, 1.0)
    assert desk.expire(1.0 + CONSENT_WITHIN_S - 0.1) == []
    [late] = desk.expire(1.0 + CONSENT_WITHIN_S)
    assert (late.consent.is_given, late.consent.reason) == (False, "no answer")


def test_a_console_is_asked_by_so_many_and_no_more() -> None:
    desk = ConsentDesk("anna")
    for number in range(MOST_OPEN):
        seek(desk, f"ui_console/{number}", ASK, 1.0)
    with pytest.raises(TooManyAsk):
        seek(desk, "ui_console/one-more", ASK, 1.0)
