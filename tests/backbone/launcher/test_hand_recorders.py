"""A recorder begun by hand that hangs is named until it responds or is gone; one that ends is not."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import Absence
from backbone.keys import Conversation
from backbone.launcher.hand_recorders import (
    LOOK_EACH_S,
    MOST_KNOWN,
    NAMED_FOR_S,
    SILENT_AFTER_S,
    HandRecorders,
    HandRecorderWatch,
)
from backbone.launcher.recorder_beats import BEAT_EACH_S, RecorderBeat
from backbone.naming import claim_address
from backbone.waiting import end_tasks

SOURCE, HOST = "backbone/recorder-7", "lab-pc"
BEAT = RecorderBeat(HOST, 7, "/tmp/night.mcap")  # noqa: S108  no file is written
LAST = RecorderBeat(HOST, 7, "/tmp/night.mcap", is_last=True)  # noqa: S108  no file is written
CLAIM = claim_address(SOURCE, BEAT.incarnation)
LINK_LEASE_S = 2.0


class Watched:
    """A launcher's record of one recorder, in steps of a look."""

    def __init__(self, rate: float = 1.0) -> None:
        self.now_s, self.rate = 0.0, rate
        self.processes = {7}
        self.recorders = HandRecorders(rate, lambda host, pid: host != HOST or pid in self.processes)
        self.logged: list[str] = []
        self.recorders.look(0.0, is_deaf=False)

    def hear(self, beat: RecorderBeat = BEAT, source: str = SOURCE) -> None:
        self.logged += [what for _name, what in self.recorders.beat_came(source, beat, self.now_s)]

    def change_claim(self, *, stands: bool) -> None:
        self.recorders.claim_changed(CLAIM, self.now_s, stands=stands)

    def look(self, for_s: float, *, is_deaf: bool = False) -> None:
        for _ in range(round(for_s / LOOK_EACH_S)):
            self.now_s += LOOK_EACH_S * self.rate
            self.logged += [what for _name, what in self.recorders.look(self.now_s, is_deaf=is_deaf)]

    @property
    def named(self) -> list[str]:
        return [absence.name for absence in self.recorders.absences()]


@pytest.fixture(params=[1.0, 20.0])
def watched(request: pytest.FixtureRequest) -> Iterator[Watched]:
    watched = Watched(request.param)
    watched.hear()
    watched.change_claim(stands=True)
    yield watched
    assert len(watched.logged) == len(set(watched.logged)), "each event is logged once"


@given(pauses_s=st.lists(st.sampled_from([0.5, 1.0, 2.0, 2.5]), max_size=30))
def test_one_whose_beats_come_is_never_named(pauses_s: list[float]) -> None:
    watched = Watched()
    for pause_s in pauses_s:
        watched.hear()
        watched.look(pause_s)
    assert (watched.named, watched.logged) == ([], [])


def test_one_that_hangs_is_named_with_its_process_and_a_remedy(watched: Watched) -> None:
    watched.look(SILENT_AFTER_S + 2 * LOOK_EACH_S)
    [absence] = watched.recorders.absences()
    assert (absence.name, absence.since_s) == ("recorder-7", 0.0)
    assert "kill -CONT 7" in absence.remedy
    assert "recover" in absence.remedy
    assert BEAT.file in absence.doing
    watched.hear()
    assert watched.named == []
    assert watched.logged[1:] == ["responds again"]


def test_one_that_ends_leaves_no_word(watched: Watched) -> None:
    watched.look(BEAT_EACH_S)
    watched.hear(LAST)
    watched.change_claim(stands=False)
    watched.look(100.0)
    assert (watched.named, watched.logged) == ([], [])


def test_a_last_beat_that_comes_after_the_fall_of_the_claim_counts(watched: Watched) -> None:
    watched.look(BEAT_EACH_S)
    watched.change_claim(stands=False)
    assert watched.recorders.look(watched.now_s, is_deaf=False) == []
    watched.hear(LAST)
    watched.look(100.0)
    assert watched.logged == []


def test_one_that_was_killed_is_logged_once_and_not_named(watched: Watched) -> None:
    watched.look(BEAT_EACH_S)
    watched.change_claim(stands=False)
    watched.look(100.0)
    assert watched.named == []
    [line] = watched.logged
    assert "recover" in line


def test_one_whose_link_expires_is_named_until_its_process_is_gone(watched: Watched) -> None:
    watched.look(LINK_LEASE_S)
    watched.change_claim(stands=False)
    watched.look(10 * LOOK_EACH_S)
    assert watched.named == ["recorder-7"]
    watched.processes.clear()
    watched.look(LOOK_EACH_S)
    assert watched.named == []
    assert "recover" in watched.logged[-1]


def test_one_of_another_host_is_named_for_a_time() -> None:
    watched, beat = Watched(), RecorderBeat("far", 7, "x.mcap")
    watched.hear(beat)
    watched.look(LINK_LEASE_S)
    watched.recorders.claim_changed(claim_address(SOURCE, beat.incarnation), watched.now_s, stands=False)
    watched.look(NAMED_FOR_S - 1.0)
    [absence] = watched.recorders.absences()
    assert absence.remedy.startswith(
        "Check the link to far. If it is sound, wake the recorder on far by 'kill -CONT 7'"
    )
    watched.look(2.0)
    assert watched.named == []


def test_one_that_wakes_after_its_link_expired_is_as_before(watched: Watched) -> None:
    watched.look(LINK_LEASE_S)
    watched.change_claim(stands=False)
    watched.look(5.0)
    watched.hear()
    watched.change_claim(stands=True)
    watched.look(SILENT_AFTER_S)
    assert (watched.named, watched.logged[1:]) == ([], ["responds again"])


def test_while_the_hub_is_away_nobody_is_named(watched: Watched) -> None:
    watched.look(20.0, is_deaf=True)
    watched.change_claim(stands=False)
    watched.look(20.0, is_deaf=True)
    watched.look(20.0)
    assert (watched.named, watched.logged) == ([], [])


def test_a_launcher_that_stood_still_accuses_nobody(watched: Watched) -> None:
    watched.now_s += 100.0 * watched.rate
    watched.look(LOOK_EACH_S)
    assert watched.named == []
    watched.hear()
    watched.look(SILENT_AFTER_S)
    assert watched.logged == []


def test_strangers_fill_no_memory_and_name_no_component() -> None:
    watched = Watched()
    watched.hear(source="backbone/rc_manager")
    watched.look(10.0)
    assert watched.named == []
    for pid in range(10 * MOST_KNOWN):
        watched.hear(RecorderBeat("a/b c", pid, "\x00"), f"backbone/recorder-{pid}")
    watched.look(10.0)
    assert len(watched.named) == MOST_KNOWN


def test_the_launcher_hears_recorders_on_the_bus() -> None:
    logged: list[tuple[float, str]] = []

    async def play() -> list[Absence]:
        clock, network = VirtualClock(), LocalNetwork("hand")
        launcher, recorder = network.join("backbone/launcher", clock), network.join(SOURCE, clock)
        watch = HandRecorderWatch(launcher, clock, lambda: False, lambda _name, what: logged.append((now(), what)))
        now = clock.now_s
        watching = asyncio.create_task(watch.run())
        await clock.sleep_s(10.0)
        claim = recorder.declare_alive(CLAIM)
        recorder.publish(SOURCE, Conversation.BEAT, BEAT)
        await clock.sleep_s(10.0)
        hung = watch.absences()
        recorder.publish(SOURCE, Conversation.BEAT, LAST)
        claim.close()
        await clock.sleep_s(10.0)
        assert watch.absences() == []
        await end_tasks(watching)
        return hung

    assert [one.name for one in run_virtual(play())] == ["recorder-7"]
    [(at_s, line)] = logged
    assert 10.0 + SILENT_AFTER_S < at_s <= 10.0 + SILENT_AFTER_S + 2 * LOOK_EACH_S
    assert "does not respond" in line
