"""Supervision: single decisions."""

from __future__ import annotations

import copy
import signal

import pytest

from backbone.creator.decisions import (
    AskToStop,
    ForkComponent,
    ReportEnded,
    ReportFell,
    ReportLeft,
    ReportReady,
    ReportSilent,
    ReportStartFailed,
    SendSignal,
    SupervisionWakesAt,
    describe,
)
from backbone.creator.messages import START_MOST_S, AlreadyHere, EndedBy, RestartPolicy
from backbone.creator.supervision import FIRST_STARTS, LATE_MOST_S, LEAVE_S, TERM_S, Supervision


def running(policy: RestartPolicy | None = None, *, asked_by_signal: bool = False) -> Supervision:
    """Return a supervision under which ``scout1`` is ready, pid 7."""
    supervision = Supervision()
    supervision.start_ordered("scout1", policy or RestartPolicy(), 5.0, 0.0, asked_by_signal=asked_by_signal)
    supervision.forked("scout1", 7, 0.0)
    assert ReportReady("scout1", 7) in supervision.ready("scout1")
    return supervision


def test_ending_escalates_from_asking_to_sigterm_to_sigkill() -> None:
    supervision = running()
    assert supervision.end_ordered("scout1", 1.5, 0.5, 10.0) == [AskToStop("scout1", 1.5), SupervisionWakesAt(11.5)]
    assert supervision.woken(11.5) == [SendSignal("scout1", 7, signal.SIGTERM), SupervisionWakesAt(12.0)]
    assert supervision.woken(12.0) == [SendSignal("scout1", 7, signal.SIGKILL)]
    assert supervision.exited(7, -9, 12.1) == [ReportEnded("scout1", EndedBy.SIGKILL, -9)]


def test_who_cannot_be_asked_gets_sigterm_unless_it_is_about_to_leave() -> None:
    supervision = running()
    supervision.end_ordered("scout1", 1.5, 0.5, 10.0)
    assert supervision.ask_failed("scout1", 10.0) == [SupervisionWakesAt(10.0 + LEAVE_S)]
    assert supervision.woken(10.0 + LEAVE_S)[0] == SendSignal("scout1", 7, signal.SIGTERM)
    assert supervision.exited(7, 0, 10.2) == [ReportEnded("scout1", EndedBy.SIGTERM, 0)]


def test_time_in_which_a_process_could_not_run_is_added_to_its_times_to_end() -> None:
    """On a full machine, the ends of 24 robots took longer than their times, and many were killed while they ended."""
    supervision = running()
    supervision.end_ordered("scout1", 1.5, 0.5, 10.0)
    assert supervision.observed("scout1", 0.2, 10.25, 0.25) == [SupervisionWakesAt(11.75)]
    supervision.ask_failed("scout1", 10.5)
    assert supervision.observed("scout1", 0.2, 10.75, 0.25) == [SupervisionWakesAt(10.75 + LEAVE_S)]
    assert supervision.woken(10.5 + LEAVE_S) == [SupervisionWakesAt(10.75 + LEAVE_S)]
    supervision.woken(10.75 + LEAVE_S)
    assert supervision.observed("scout1", 0.2, 11.5, 0.25) == [SupervisionWakesAt(11.5 + LEAVE_S)]


def test_a_process_that_can_never_run_is_killed_after_a_bounded_time() -> None:
    """Else a mission waits for minutes for a process that computes with a low share of a full machine."""
    supervision, now_s, sent = running(), 10.0, list[SendSignal]()
    supervision.end_ordered("scout1", 1.5, 0.5, now_s)
    while len(sent) < 2 and now_s < 100.0:
        now_s += 0.25
        supervision.observed("scout1", 0.0, now_s, 0.25)
        sent += [one for one in supervision.woken(now_s) if isinstance(one, SendSignal)]
    assert [one.number for one in sent] == [signal.SIGTERM, signal.SIGKILL]
    assert now_s == 10.0 + 1.5 + 0.5 + LATE_MOST_S


def test_a_process_that_could_run_gets_no_more_time_to_end() -> None:
    supervision = running()
    supervision.end_ordered("scout1", 1.5, 0.5, 10.0)
    assert supervision.observed("scout1", 0.2, 10.25, 0.0) == []
    assert supervision.woken(11.5)[0] == SendSignal("scout1", 7, signal.SIGTERM)


def test_who_was_about_to_leave_when_asked_ended_by_itself() -> None:
    supervision = running()
    supervision.end_ordered("scout1", 1.5, 0.5, 10.0)
    supervision.ask_failed("scout1", 10.0)
    assert supervision.exited(7, 0, 10.01) == [ReportEnded("scout1", EndedBy.ITSELF, 0)]


def test_a_hub_is_asked_by_signal() -> None:
    supervision = running(asked_by_signal=True)
    assert supervision.end_ordered("scout1", 1.5, 0.5, 10.0)[0] == SendSignal("scout1", 7, signal.SIGTERM)
    assert supervision.exited(7, 0, 10.2) == [ReportEnded("scout1", EndedBy.ASKING, 0)]


def test_a_second_order_to_end_can_only_hurry() -> None:
    supervision = running()
    supervision.end_ordered("scout1", 1.5, 0.5, 10.0)
    assert supervision.end_ordered("scout1", 9.0, 9.0, 10.5) == [SupervisionWakesAt(11.5)]
    assert supervision.end_ordered("scout1", 0.1, 0.1, 10.5) == [SupervisionWakesAt(10.6)]


def test_what_is_not_ready_is_asked_by_signal_and_has_as_long_as_others_to_end() -> None:
    """On a busy machine a start ends half a second after the signal, and that is in good order."""
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    supervision.forked("scout1", 7, 0.0)
    term = SendSignal("scout1", 7, signal.SIGTERM)
    assert supervision.end_ordered("scout1", 1.5, 0.5, 1.0) == [term, SupervisionWakesAt(2.5)]
    late = copy.deepcopy(supervision)
    assert supervision.exited(7, 0, 2.4) == [
        ReportStartFailed("scout1", "exit code 0"),
        ReportEnded("scout1", EndedBy.ASKING, 0),
    ]
    assert late.woken(2.5) == [term, SupervisionWakesAt(3.0)]
    assert late.woken(3.0)[0] == SendSignal("scout1", 7, signal.SIGKILL)


def test_back_off_doubles_up_to_its_most_and_from_the_limit_on_pauses_are_long() -> None:
    policy = RestartPolicy(back_off_s=0.1, back_off_most_s=0.3, limit=3, window_s=60.0)
    supervision, now_s, pauses = running(policy), 1.0, []
    for pid in range(7, 11):
        told = supervision.exited(pid, 1, now_s)
        fell = next(each for each in told if isinstance(each, ReportFell))
        pauses.append(fell.restart_in_s)
        assert fell.failing == (len(pauses) > policy.limit)
        if not fell.failing:
            now_s += fell.restart_in_s
            assert supervision.woken(now_s)[0] == ForkComponent("scout1")
            supervision.forked("scout1", pid + 1, now_s)
            supervision.ready("scout1")
    assert pauses == [0.1, 0.2, 0.3, policy.failing_pause_s]
    assert supervision.end_ordered("scout1", 1.0, 1.0, now_s) == [ReportEnded("scout1", EndedBy.ITSELF, 1)]


def test_restarts_before_the_window_count_no_longer() -> None:
    policy = RestartPolicy(back_off_s=0.1, limit=1, window_s=10.0)
    supervision = running(policy)
    supervision.exited(7, 1, 1.0)
    supervision.woken(1.1)
    supervision.forked("scout1", 8, 1.1)
    assert ReportFell("scout1", "exit code 1", 0.1) in supervision.exited(8, 1, 11.2)


def test_a_component_without_restart_that_ends_in_good_order_is_left_to_its_owner() -> None:
    supervision = running(RestartPolicy(restart=False))
    assert supervision.exited(7, 0, 1.0) == [ReportLeft("scout1")]
    assert supervision.find("scout1") is None


@pytest.mark.parametrize("returncode", [0, 1, -9, -15])
def test_what_is_wanted_is_restarted_however_it_ended(returncode: int) -> None:
    supervision = running(RestartPolicy(back_off_s=0.1))
    told = supervision.exited(7, returncode, 1.0)
    assert told == [ReportFell("scout1", describe(returncode), 0.1), SupervisionWakesAt(1.1)]
    assert [(each.name, each.since_s) for each in supervision.absences(1.0)] == [("scout1", 1.0)]
    supervision.woken(1.1)
    supervision.forked("scout1", 8, 1.1)
    assert supervision.absences(1.2)
    supervision.ready("scout1")
    assert supervision.absences(1.3) == []


def test_a_first_start_that_a_signal_ended_is_begun_again() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(back_off_s=0.1), 5.0, 0.0)
    supervision.forked("scout1", 7, 0.0)
    assert supervision.exited(7, -15, 1.0) == [ReportFell("scout1", "killed by SIGTERM", 0.1), SupervisionWakesAt(1.1)]
    assert supervision.woken(1.1)[0] == ForkComponent("scout1")
    supervision.forked("scout1", 8, 1.1)
    assert supervision.ready("scout1") == [ReportReady("scout1", 8)]


@pytest.mark.parametrize("is_shared", [False, True])
def test_a_silent_process_is_shown_then_killed_then_restarted(is_shared: bool) -> None:
    supervision = running(RestartPolicy(back_off_s=0.1, hung_after_s=3.0))
    assert supervision.observed("scout1", 0.5, 9.5) == []
    assert supervision.observed("scout1", 0.8, 9.8) == [ReportSilent("scout1", 0.8)]
    assert supervision.absences(10.0)[0].since_s == pytest.approx(9.0)
    assert supervision.observed("scout1", 2.9, 11.9) == []
    assert supervision.observed("scout1", 3.0, 12.0) == [SendSignal("scout1", 7, signal.SIGKILL)]
    told = "hung: no sign of life for 3.0 s: pan.py, line 7, in update"
    place = "pan.py, line 7, in update"
    fell, *_ = (
        supervision.left("scout1", -9, "its process pool: killed by SIGKILL", 12.1, place)
        if is_shared
        else supervision.exited(7, -9, 12.1, place)
    )
    assert fell == ReportFell("scout1", told, 0.1)


def test_a_beat_of_a_ready_process_searches_no_deadline() -> None:
    """With hundreds of components the search at each beat took a sixth of a creator's time."""
    supervision = running()
    supervision.start_ordered("scout2", RestartPolicy(), 5.0, 1.0)
    assert supervision.observed("scout1", 0.0, 2.0) == []
    assert isinstance(supervision.observed("scout1", 3.0, 3.0)[-1], SupervisionWakesAt)


def test_a_process_that_was_only_paused_for_a_moment_stays() -> None:
    supervision = running()
    supervision.observed("scout1", 2.5, 9.5)
    assert supervision.observed("scout1", 0.0, 9.8) == [ReportSilent("scout1", 0.0)]
    assert supervision.absences(9.8) == []


def test_a_start_that_shows_signs_of_life_is_not_late() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    supervision.forked("scout1", 7, 0.0)
    assert supervision.observed("scout1", 0.0, 4.9) == [SupervisionWakesAt(9.9)]
    assert supervision.observed("scout1", 0.0, 60.0) == [SupervisionWakesAt(65.0)]
    assert supervision.observed("scout1", 1.0, START_MOST_S) == [SupervisionWakesAt(START_MOST_S)]


def test_the_restart_of_a_service_reports_its_pause() -> None:
    supervision = running(RestartPolicy(back_off_s=0.1))
    assert supervision.exited(7, 0, 1.0) == [ReportFell("scout1", "exit code 0", 0.1), SupervisionWakesAt(1.1)]


def test_a_first_start_that_fails_is_not_repeated() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    supervision.forked("scout1", 7, 0.0)
    assert supervision.exited(7, 1, 1.0) == [ReportStartFailed("scout1", "exit code 1")]
    assert supervision.find("scout1") is None


def test_who_is_not_ready_in_time_is_ended_before_the_start_is_answered() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    supervision.forked("scout1", 7, 0.0)
    assert supervision.woken(5.0) == [SendSignal("scout1", 7, signal.SIGTERM), SupervisionWakesAt(5.0 + TERM_S)]
    assert supervision.ready("scout1") == []
    assert supervision.exited(7, 0, 5.1) == [
        ReportStartFailed("scout1", "was not ready and showed no sign of life for 5 s")
    ]


def test_a_zygote_that_hangs_holds_no_order_up() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    late_s = START_MOST_S
    failed = ReportStartFailed("scout1", "was not ready and showed no sign of life for 5 s")
    assert supervision.woken(late_s) == [failed]
    assert supervision.forked("scout1", 7, late_s + 1.0)[0] == SendSignal("scout1", 7, signal.SIGTERM)
    assert supervision.exited(7, 0, late_s + 1.1) == []
    assert supervision.find("scout1") is None


def test_a_token_that_rises_before_the_pid_is_known_counts() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    supervision.ready("scout1")
    assert supervision.forked("scout1", 7, 0.0) == [ReportReady("scout1", 7)]


def test_tokens_say_nothing_about_those_that_are_ready() -> None:
    assert running().ready("scout1") == []


def test_a_name_that_is_left_to_its_owner_may_be_ordered_anew() -> None:
    supervision = running(RestartPolicy(restart=False))
    supervision.exited(7, 1, 1.0)
    assert supervision.start_ordered("scout1", RestartPolicy(), 5.0, 2.0)[0] == ForkComponent("scout1")


def test_a_name_in_use_is_refused_with_its_pid() -> None:
    with pytest.raises(AlreadyHere, match="ready, pid 7"):
        running().start_ordered("scout1", RestartPolicy(), 5.0, 1.0)


def test_signals_without_a_name_are_described_by_number() -> None:
    assert describe(-99) == "killed by signal 99"


@pytest.mark.parametrize("returncode", [0, -9, -15])
def test_a_start_that_is_ended_from_outside_is_begun_again_also_without_restart(returncode: int) -> None:
    """Its owner still waits for the answer; a refusal would mean that the component cannot run."""
    supervision = Supervision()
    supervision.start_ordered("arc", RestartPolicy(restart=False), 20.0, 1.0)
    supervision.forked("arc", 7, 1.1)
    (fell, _) = supervision.exited(7, returncode, 1.2)
    assert isinstance(fell, ReportFell)
    assert fell.restart_in_s >= 0
    assert ForkComponent("arc") in supervision.woken(1.2 + fell.restart_in_s)


@pytest.mark.parametrize("returncode", [0, -signal.SIGSEGV])
def test_a_first_start_that_crashes_again_and_again_has_failed(returncode: int) -> None:
    supervision, now_s = Supervision(), 0.0
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, now_s)
    for pid in range(1, FIRST_STARTS):
        supervision.forked("scout1", pid, now_s)
        assert isinstance(supervision.exited(pid, returncode, now_s)[0], ReportFell)
        now_s += 10.0
        assert ForkComponent("scout1") in supervision.woken(now_s)
    supervision.forked("scout1", FIRST_STARTS, now_s)
    assert supervision.exited(FIRST_STARTS, returncode, now_s) == [ReportStartFailed("scout1", describe(returncode))]
    assert supervision.find("scout1") is None
