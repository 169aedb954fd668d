"""The schedule of a recording: decided anew it is the same, and gives the reasons that were given live."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Callable, Coroutine
from functools import cache
from random import Random
from typing import Any

import msgspec
import pytest
from examples import share, some

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import UnknownName
from backbone.rc_manager.messages import AskWhy, Decided, TraceLine
from backbone.recording.decisions import NoSuchRule, NotRecorded, decided_anew, schedule_at
from backbone.recording.hearing import to_overhear
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import Recorded, Recording
from backbone.recording.reasons import reasons_at
from backbone.recording.revival import message_as_sent, revived
from backbone.recording.writer import RecordingWriter
from backbone.scheduling.events import RcKnown, Woken
from backbone.scheduling.explain.answers import Answers
from backbone.scheduling.fairness import Turns
from backbone.scheduling.own_planner import WrongPlanner
from backbone.scheduling.views import Schedule, Why
from backbone.wire import WIRE_VERSION, Envelope, write
from mission_control.laboratory.simulation import mission_run
from mission_control.laboratory.simulation.mission_run import MissionRun, run_mission
from mission_control.laboratory.simulation.shape import draw_shape
from mission_control.laboratory.simulation.unreliable_network import UnreliableNetwork

CLASSES = message_classes()
MOST_BYTES = 2**30
SEEDS = range(6, 6 + max(3, share(20)))  # in the first three every other rule differs somewhere
ASKED_SEEDS, ASKED = range(4), 50

Beside = Callable[[LocalNetwork], Coroutine[Any, Any, None]]
RecordMission = Callable[..., Recording]


async def nothing(_network: LocalNetwork) -> None:
    """Do nothing beside the mission."""


@pytest.fixture(scope="module")
def recorded() -> RecordMission:
    """Return what plays the chaotic mission of a seed, with something beside it, and returns the recording of it."""
    return cache(play)


def play(
    seed: int, leave_out: Callable[[str, bytes], bool] = lambda _key, _raw: False, beside: Beside = nothing
) -> Recording:
    file = io.BytesIO()
    writer = RecordingWriter(file, CLASSES, {})
    networks: list[LocalNetwork] = []

    class OverheardNetwork(UnreliableNetwork):
        def __init__(self, *args: Any) -> None:
            super().__init__(*args)
            networks.append(self)
            self._recorder = self.join("backbone/recorder", VirtualClock())
            for conversation in to_overhear(()):
                self._recorder.overhear(conversation, self._heard, MOST_BYTES)

        def _heard(self, key: str, raw: bytes) -> None:
            if not leave_out(key, raw):
                writer.write(key, raw, 0.0)

    async def both(mission: Coroutine[Any, Any, MissionRun]) -> MissionRun:
        task = asyncio.create_task(beside(networks[0]), name="beside the mission")
        try:
            return await mission
        finally:
            task.cancel()
            await asyncio.wait({task})
            if not task.cancelled():
                task.result()

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(mission_run, "UnreliableNetwork", OverheardNetwork)
        patched.setattr(mission_run, "run_virtual", lambda mission: run_virtual(both(mission)))
        run_mission(seed, chaos=True)
    writer.finish()
    return Recording(file)


@pytest.mark.parametrize("seed", SEEDS)
def test_decided_anew_all_decisions_are_as_recorded(recorded: RecordMission, seed: int):
    found = decided_anew(recorded(seed))
    assert found.difference is None
    assert found.decisions > 10
    assert found.missing == 0


def test_the_first_decision_of_another_scheduler_is_named(recorded: RecordMission, monkeypatch: pytest.MonkeyPatch):
    recordings = [recorded(seed) for seed in SEEDS]
    monkeypatch.setattr(Turns, "seniority", lambda _self, arc, _now_s: (False, 0.0, -arc.stamp[0], -arc.stamp[1]))
    found = [decided_anew(recording) for recording in recordings]
    named = [one.difference for one in found if one.difference is not None]
    assert named
    assert all(one.recorded != one.decided for one in named)


def test_with_other_rules_the_first_decision_that_differs_has_both_reasons(recorded: RecordMission):
    found = [decided_anew(recorded(seed), policy="strict").difference for seed in SEEDS]
    named = [one for one in found if one is not None]
    assert named
    lines = [line for one in named for line in (*one.recorded, *one.decided)]
    assert any(line.cause for line in lines)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_recorded_rules_given_as_other_rules_make_no_difference(recorded: RecordMission, seed: int):
    shape = draw_shape(seed)
    found = decided_anew(recorded(seed), policy=shape.policy, grace_s=shape.grace_s)
    assert found.difference is None
    assert found.decisions > 10


def test_what_other_rules_decide_of_themselves_between_recorded_events_is_a_difference(recorded: RecordMission):
    """An ARC rises by waiting alone: nothing happened then that the recording could have."""
    found = [decided_anew(recorded(seed), aging_s=1.0).difference for seed in SEEDS]
    named = [one for one in found if one is not None and isinstance(one.event, Woken)]
    assert named
    for one in named:
        assert one.recorded == ()
        assert one.decided


def test_a_rule_that_is_none_is_refused(recorded: RecordMission):
    recording = recorded(1)
    for wrong in ({"polciy": "strict"}, {"policy": "lenient"}, {"aging_s": "soon"}, {"grace_s": -1}):
        with pytest.raises(NoSuchRule):
            decided_anew(recording, **wrong)
    with pytest.raises(WrongPlanner):
        decided_anew(recording, planner="os:path")


def test_what_is_missing_is_counted_and_no_difference(recorded: RecordMission):
    drawn = Random(1)

    def lost(key: str, _raw: bytes) -> bool:
        return f"/{RC_MANAGER}/" in key and drawn.random() < 0.05

    found = [decided_anew(recorded(seed, lost)) for seed in (1, 2, 3)]
    assert all(one.difference is None for one in found)
    assert sum(one.missing for one in found) > 0


def late_for_restarts(recording: Recording, lost: int, short: int = 1_000_000) -> Recording:
    """Return the recording of a recorder that overheard each restarted RC manager only after so many messages.

    Args:
        short: Number of messages after which the first RC manager fell.
    """
    file, newest, lives = io.BytesIO(), 0, 1
    writer = RecordingWriter(file, CLASSES, {})
    for one in recording.messages(source=RC_MANAGER):
        said = message_as_sent(CLASSES, one)
        assert said is not None
        lives += one.sequence < newest
        newest = one.sequence
        if one.sequence <= short if lives == 1 else one.sequence > lost:
            writer.write(one.key, write(Envelope(WIRE_VERSION, one.source, one.sequence, one.at_s, "", said)), one.at_s)
    writer.finish()
    return Recording(file)


@pytest.mark.parametrize(("lost", "short"), [(5, 1_000_000), (20, 30), (20, 60)])
def test_decisions_of_a_restarted_rc_manager_are_not_those_of_the_former(
    recorded: RecordMission, lost: int, short: int
):
    found = [decided_anew(late_for_restarts(recorded(seed), lost, short)) for seed in SEEDS]
    assert [one.difference for one in found if one.difference is not None] == []
    assert sum(one.missing for one in found) > 0
    assert all(one.decisions > 0 for one in found)


def without_later_lines(recording: Recording) -> Recording:
    """Return the recording without the lines that stand behind another message of the same decision."""
    file, former = io.BytesIO(), ""
    writer = RecordingWriter(file, CLASSES, {})
    for one in sorted(recording.messages(source=RC_MANAGER), key=lambda one: (one.at_s, one.sequence)):
        said = message_as_sent(CLASSES, one)
        assert said is not None
        if isinstance(said, TraceLine) and former not in ("TraceLine", "Decided"):
            continue
        former = type(said).__name__
        writer.write(one.key, write(Envelope(WIRE_VERSION, one.source, one.sequence, one.at_s, "", said)), one.at_s)
    writer.finish()
    return Recording(file)


def test_a_line_that_is_missing_behind_another_message_is_no_difference(recorded: RecordMission):
    """Leases are renewed between the lines of a decision, which counted as whole although a later line was missing."""
    found = [decided_anew(without_later_lines(recorded(seed))) for seed in SEEDS]
    assert [one.difference for one in found if one.difference is not None] == []
    assert sum(one.missing for one in found) > 0


def test_the_schedule_of_a_former_life_is_not_that_of_the_restarted_rc_manager(recorded: RecordMission):
    late = late_for_restarts(recorded(1), 5)
    number, restarted_s = 0, 0.0
    for one in late.messages(source=RC_MANAGER):
        restarted_s = restarted_s or (one.at_s if one.sequence < number else 0.0)
        number = one.sequence
    assert schedule_at(late, restarted_s - 0.01)
    with pytest.raises(NotRecorded, match="decisions are missing"):
        schedule_at(late, restarted_s + 1.0)


def test_aging_before_the_slowest_resource_is_handed_over_is_refused_as_in_a_mission_file(recorded: RecordMission):
    file = io.BytesIO()
    writer = RecordingWriter(file, CLASSES, {})
    for one in recorded(1).messages(source=RC_MANAGER):
        said = message_as_sent(CLASSES, one)
        assert said is not None
        if isinstance(said, Decided) and isinstance(said.event, RcKnown):
            slow = msgspec.structs.replace(said.event, connect_s=2.0, disconnect_s=1.0)
            said = msgspec.structs.replace(said, event=slow)
        raw = write(Envelope(WIRE_VERSION, one.source, one.sequence, one.at_s, one.cause, said))
        writer.write(one.key, raw, one.at_s)
    writer.finish()
    with pytest.raises(NoSuchRule, match=r"aging_s is 2, and \w+ needs 3 s to disconnect and connect"):
        decided_anew(Recording(file), aging_s=2.0)
    assert decided_anew(Recording(file), aging_s=3.0).unread == 0


@pytest.mark.parametrize("body", [["of another release"], None])
@pytest.mark.parametrize("schema", ["TraceLine/2", "TraceLine/9", "Decided/1", "Decided/9"])
def test_a_message_of_another_form_is_counted_and_no_difference(
    recorded: RecordMission, schema: str, body: list[str] | None
):
    file, number = io.BytesIO(), 0
    writer = RecordingWriter(file, CLASSES, {})
    for one in recorded(1).messages():
        said = message_as_sent(CLASSES, one)
        assert said is not None
        raw = write(Envelope(WIRE_VERSION, one.source, one.sequence, one.at_s, one.cause, said))
        if one.schema.partition("/")[0] == schema.partition("/")[0]:
            number += 1
            if number % 7 == 0:
                raw = msgspec.msgpack.encode([WIRE_VERSION, one.source, one.sequence, one.at_s, "", [schema, body]])
        writer.write(one.key, raw, one.at_s)
    writer.finish()
    found = decided_anew(Recording(file))
    assert (found.difference, found.unread) == (None, number // 7)
    assert found.missing > 0
    assert found.decisions > 0


@pytest.mark.parametrize(("seed", "most"), some([(2, 37), *((1, most) for most in range(100, 110))]))
def test_a_decision_at_whose_lines_the_recording_ends_is_not_missing(recorded: RecordMission, seed: int, most: int):
    heard = list[str]()

    def after_the_end(key: str, _raw: bytes) -> bool:
        heard.extend([key] if f"/{RC_MANAGER}/" in key else [])
        return len(heard) > most

    found = decided_anew(recorded(seed, after_the_end))
    assert (found.difference, found.missing) == (None, 0)


def test_the_schedule_of_each_instant_is_the_one_that_was_published_then(recorded: RecordMission):
    recording = recorded(4)
    published = [one for one in recording.messages((f"{RC_MANAGER}/schedule",)) if one.schema == "Schedule/1"]
    assert len(published) > 10
    for message in Random(4).sample(published, 10):
        assert schedule_then(recording, message) == revived(Schedule, message.body)


def schedule_then(recording: Recording, message: Recorded) -> Schedule:
    manager = schedule_at(recording, message.at_s)
    return Answers(manager).schedule(message.body["at_s"])


@pytest.mark.thorough
@pytest.mark.parametrize("seed", ASKED_SEEDS)
def test_reasons_of_random_instants_are_those_that_were_given_then(recorded: RecordMission, seed: int):
    """Two hundred questions in all, while ARCs ask and give back, and RCs and the RC manager itself die and return."""
    drawn, shape, given = Random(seed), draw_shape(seed), list[Why]()
    names = [name for owner in shape.owners for name in (owner.arc, owner.name)]
    names += [resource.name for resource in shape.resources]

    async def ask(network: LocalNetwork) -> None:
        clock = VirtualClock()
        bus = network.join("ui_console/asker", clock)
        while True:
            await clock.sleep_s(drawn.uniform(0.0, 2 * (shape.active_s + shape.calm_s) / (3 * ASKED)))
            try:
                given.append(await bus.ask(RC_MANAGER, AskWhy(drawn.choice(names)), Why, within_s=0.5))
            except (LinkError, Refusal):  # it is dead or cut off, or has no request of that name
                continue

    recording = recorded(seed, beside=ask)
    assert len(given) >= ASKED
    assert len({why.state for why in given}) > 2
    for why in drawn.sample(given, ASKED):
        assert reasons_at(recording, why.name, why.at_s).why == why


def test_without_a_snapshot_there_is_no_schedule(recorded: RecordMission):
    recording = recorded(1, lambda key, _raw: key.endswith(f"/{Conversation.DECISIONS}"))
    with pytest.raises(NotRecorded):
        schedule_at(recording, 10.0)
    with pytest.raises(NotRecorded):
        reasons_at(recording, "nobody", 10.0)
    with pytest.raises(NotRecorded):
        decided_anew(recording)


def test_the_remedy_for_an_unknown_name_needs_no_mission(recorded: RecordMission):
    with pytest.raises(UnknownName) as refused:
        reasons_at(recorded(1), "nobody", 10.0)
    assert "recording keys" in refused.value.remedy
