"""A console says which robot it lost, when it hears nothing any more, and what has to be let go first."""

from __future__ import annotations

import pytest
from console_scenes import ASK, GRANT, SCHEDULE, STOP, held_model, model
from screen_text import screen_text
from written_session import WrittenSession

from resource_pool.arc_client import Stopper, StopState, Suspended
from ui_console.model.consent import Consent, Settled, Sought, Topic
from ui_console.model.events import GivenBack, Granted, Heard, HoldConfirmed, LetGoNeeded, LinkHeard, MomentBegan
from ui_console.model.profile import Profile
from ui_console.model.views import AlarmKind, LostView
from ui_console.session.feed import LINK_FRESH_S
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.display import LINK_LOOK_S
from ui_console.terminal.head import head

AWAY = GivenBack(20.0, "anna is away", True, wanted=False)


def test_a_robot_given_back_unasked_is_said_to_be_lost_with_when_and_why_and_can_be_taken_again() -> None:
    shown = model(Heard(8.0, SCHEDULE), ASK, GRANT, AWAY)
    assert shown.own(21.0).lost == LostView("scout1", "anna is away", 20.0, may_retake=True)
    assert shown.own(90.0).lost is not None, "until somebody has seen it"
    shown.dismiss_lost()
    assert shown.own(90.0).lost is None


def test_taking_a_robot_again_ends_the_word_that_it_was_lost() -> None:
    shown = model(Heard(8.0, SCHEDULE), ASK, GRANT, AWAY, ASK)
    assert shown.own(21.0).lost is None


def test_a_robot_given_back_on_purpose_is_not_lost() -> None:
    assert model(ASK, GRANT, GivenBack(20.0, "released", True)).own(21.0).lost is None


@pytest.mark.parametrize(
    ("reason", "why"),
    [("lease", "the RC manager was silent for too long"), ("rc", "scout1 does not answer")],
)
def test_a_robot_lost_without_a_decision_is_said_to_be_lost_while_the_console_asks_for_it_again(
    reason: str, why: str
) -> None:
    shown = model(Heard(8.0, SCHEDULE), ASK, GRANT, Heard(12.0, Suspended("arc", reason, "scout1", -1.0)))
    lost = shown.own(12.0).lost
    assert lost is not None
    assert (lost.robot, lost.at_s, lost.may_retake, lost.why) == ("scout1", 12.0, False, why)
    shown.apply(Granted(14.0, "scout1", GRANT.rcs, {"scout1": 8}, 20.0, 9.95, True))
    assert shown.own(14.0).lost is None
    shown.look(14.1)
    [told] = [alarm for alarm in shown.alarm_views() if alarm.kind is AlarmKind.TAKEN]
    assert told.line == f"scout1 was lost and is yours again: {why}"


def test_whose_turn_is_over_has_lost_nothing() -> None:
    assert model(ASK, GRANT, Heard(12.0, Suspended("arc", "slice", "console-2", -1.0))).own(12.0).lost is None


WITHIN_S = 1.0
DRAWN_S = 0.1  # of a busy machine's screen


def test_what_is_not_heard_counts_as_old_early_enough_to_be_drawn_within_a_second() -> None:
    assert LINK_FRESH_S + LINK_LOOK_S + DRAWN_S <= WITHIN_S


@pytest.mark.parametrize("profile", list(Profile))
async def test_a_screen_says_at_the_next_look_that_its_link_is_down(profile: Profile) -> None:
    session = WrittenSession(shown=held_model())
    async with ConsoleApp(session, profile=profile).run_test(size=(80, 24)) as pilot:
        assert "NO LINK" not in screen_text(pilot.app)
        session.model.apply(LinkHeard(12.0, False))
        await pilot.pause(2 * LINK_LOOK_S)
        assert "NO LINK" in screen_text(pilot.app)


@pytest.mark.parametrize("word", [LinkHeard(12.5, False), None])
def test_what_is_shown_is_never_older_than_a_second_without_saying_so(word: LinkHeard | None) -> None:
    """The link says that it is down, or says nothing any more."""
    shown = held_model()
    shown.apply(LinkHeard(12.0, True, 0.002, until_s=13.0))
    assert shown.own(13.0).is_held
    assert shown.own(13.0).link_down_s < 0
    if word is not None:
        shown.apply(word)
    shown.look(13.1)
    own = shown.own(13.1)
    assert (own.link_down_s, own.is_held) == (12.0, False)
    assert "NO LINK" in own.status
    assert "you hold" not in own.status
    assert not any(robot.is_mine for robot in shown.robots(13.1))
    assert [alarm.kind for alarm in shown.team.alarms.views() if alarm.is_active] == [AlarmKind.LINK]
    shown.apply(LinkHeard(14.0, True, 0.002, until_s=15.0))
    shown.look(14.0)
    assert shown.own(14.0).link_down_s < 0
    assert shown.own(14.0).is_held
    assert not [alarm for alarm in shown.team.alarms.views() if alarm.is_active]


@pytest.mark.parametrize("cut", [LinkHeard(12.5, False), None])
def test_after_a_cut_the_first_line_says_what_it_does_not_know_until_the_arc_confirms_the_hold(
    cut: LinkHeard | None,
) -> None:
    shown = held_model()
    shown.apply(LinkHeard(12.0, True, 0.002, until_s=13.0))
    assert shown.status_line(12.1).startswith("you hold scout1")
    if cut is not None:
        shown.apply(cut)
    for at_s in (14.0, 14.3):
        shown.apply(LinkHeard(at_s, True, 0.002, until_s=at_s + 0.8))
        assert shown.status_line(at_s) == "the link is back; not yet known whether you still hold scout1"
        assert "green" not in str(head(shown.view(at_s), 160, Profile.TERMINAL, 0.25).status.spans)
    shown.apply(HoldConfirmed(14.5))
    assert shown.status_line(14.5).startswith("you hold scout1")
    assert "green" in str(head(shown.view(14.5), 160, Profile.TERMINAL, 0.25).status.spans)


def test_what_has_to_be_let_go_is_said_only_while_a_robot_is_held() -> None:
    shown = held_model()
    shown.apply(LetGoNeeded(12.0, True))
    assert shown.own(12.0).must_let_go
    shown.apply(LetGoNeeded(12.5, False))
    assert not shown.own(12.5).must_let_go
    shown.apply(LetGoNeeded(13.0, True))
    shown.apply(GivenBack(14.0, "released", True))
    assert not shown.own(14.0).must_let_go


def test_each_moment_has_a_number_of_its_own_that_no_later_grant_has_again() -> None:
    shown = held_model()
    seen = [shown.own(11.0).moment]
    for event in (MomentBegan(12.0), GivenBack(13.0, "released", True), MomentBegan(14.0)):
        shown.apply(event)
        seen.append(shown.own(14.0).moment)
    assert seen == [seen[0], seen[0] + 1, seen[0] + 1, seen[0] + 2]


def test_each_robots_row_says_whose_stop_it_is_since_when_and_what_lifting_it_takes() -> None:
    both = StopState(
        "scout2", True, 3, "ben", "", 11.5, console="ui_console/ben", also=[Stopper("cleo", "ui_console/c")]
    )
    rows = model(Heard(8.0, SCHEDULE), Heard(11.0, STOP), Heard(11.5, both)).robots(12.0)
    mine, theirs = rows[0].stop, rows[1].stop
    assert mine is not None
    assert theirs is not None
    assert (mine.by_user, mine.age_s, mine.is_mine, mine.lift_line) == ("anna", 1.0, True, "hold to lift")
    assert (theirs.by_user, theirs.also, theirs.is_mine) == ("ben", ["cleo"], False)
    assert theirs.lift_line == "asks ben and cleo first"


def test_the_alarm_of_a_stop_goes_when_the_stop_is_lifted() -> None:
    shown = model(Heard(11.0, STOP), Heard(12.0, StopState("scout1", False, 1, "ben", "", 12.0)))
    assert shown.team.alarms.views() == []


def test_a_question_whether_to_lift_a_stop_and_one_for_the_robot_are_told_apart() -> None:
    shown = held_model()
    lift = Sought("ui_console/ben", "ben", "scout1", "", 20.0, Topic.LIFT)
    take = Sought("ui_console/ben", "ben", "scout1", "mine is stuck", 20.0)
    shown.apply(lift)
    shown.apply(take)
    asked = shown.own(12.0).consent
    assert asked is not None
    assert (asked.topic, asked.others) == ("lift", 1)
    assert asked.line == "ben asks whether scout1, which you stopped, may move again"
    shown.apply(Settled(lift, Consent(True, "anna", "")))
    asked = shown.own(13.0).consent
    assert asked is not None
    assert (asked.topic, asked.line) == ("take", "ben asks for scout1: mine is stuck")
