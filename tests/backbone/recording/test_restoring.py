"""A mission that is restored at an instant is the one that is read from the begin."""

from __future__ import annotations

from collections import Counter
from typing import Any

from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from small_recordings import CLASSES, SCOUT, Said, recorded

from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.component.messages import (
    AskParameters,
    AskState,
    ComponentState,
    LifeState,
    LogLevel,
    Parameters,
    SetParameter,
    StoryEvent,
)
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.mission_log.log import AskLog, Log
from backbone.nameserver.messages import ListComponents
from backbone.picture.health import HealthWord, MissionHealth
from backbone.recording.presence import Presence
from backbone.recording.reader import Recording
from backbone.recording.recorded_mission import RecordedMission
from backbone.recording.restoring import mission_at
from backbone.recording.writer import NS
from backbone.wire import Message, schema_of
from resource_pool.messages import Frame

LAST_S = 150.0
QUESTIONS = [(SCOUT, AskState()), (SCOUT, AskParameters()), (LAUNCHER, AskLog()), (NAMESERVER, ListComponents())]
kinds = st.sampled_from(["state", "event", "here", "gone", "asked", "picture"])


def messages(at_s: float, kind: str, number: int) -> list[Said]:
    match kind:
        case "state":
            state = ComponentState(SCOUT, "scout", "base", 7, LifeState.READY, 0.5, f"round {number}")
            return [Said(at_s, SCOUT, Conversation.STATUS, state)]
        case "event":
            return [Said(at_s, SCOUT, Conversation.LOG, StoryEvent(at_s, SCOUT, f"{number}", "x", "", LogLevel.INFO))]
        case "picture":
            picture = Frame("grabber", "capture", number, "scout1", number, at_s, 1, 1, memoryview(b"x"))
            return [
                Said(at_s, f"resource_pool/capture{number % 2}", Conversation.FRAMES, picture, "resource_pool/grabber")
            ]
        case "asked":
            asker = f"ui_console/anna-{number}"
            return [
                Said(at_s, SCOUT, Conversation.ASK, AskParameters(), asker),
                Said(at_s + 3.0, SCOUT, Conversation.ASK, Parameters({"speed": number}), SCOUT, f"{asker}#1"),
            ]
    return [Said(at_s, SCOUT, Conversation.ALIVE, Presence(kind == "here"), "")]


def told(mission: RecordedMission) -> list[Message | str]:
    def answer(address: str, question: Message) -> Message | str:
        try:
            return mission.answer(address, question)
        except Refusal as refusal:
            return str(refusal)

    return [*(answer(*question) for question in QUESTIONS), *sorted(map(str, mission.newest()))]


@settings(max_examples=share(40))
@given(
    said=st.lists(st.tuples(st.floats(0.0, LAST_S), kinds), min_size=1, max_size=40),
    looks=st.lists(st.floats(0.0, LAST_S + 1.0), min_size=1, max_size=6),
)
def test_restored_or_read_from_the_begin_a_mission_is_the_same(said: list[tuple[float, str]], looks: list[float]):
    ordered = [one for number, (at_s, kind) in enumerate(sorted(said)) for one in messages(at_s, kind, number)]
    recording = Recording(recorded(ordered))
    for at_s in looks:
        whole = RecordedMission(CLASSES)
        for message in recording.messages():
            if round(message.at_s * NS) < round(at_s * NS):
                whole.take(message)
        restored = mission_at(recording, CLASSES, at_s)
        assert told(restored) == told(whole)
        assert (restored.now_s, {*restored.present}, {*restored.there}) == (
            whole.now_s,
            {*whole.present},
            {*whole.there},
        )


class CountingClasses(dict[str, type[Message]]):
    """Message classes that count by schema how many messages were restored."""

    def __init__(self) -> None:
        super().__init__(CLASSES)
        self.restored = Counter[str]()

    def get(self, schema: str, default: Any = None) -> Any:
        self.restored[schema] += 1
        return super().get(schema, default)


def test_states_and_commands_which_answer_no_question_are_not_restored() -> None:
    asker = "ui_console/anna"
    said = [
        one
        for at_s in range(20)
        for one in (
            Said(at_s, LAUNCHER, Conversation.HEALTH, MissionHealth(HealthWord.OK), LAUNCHER),
            Said(at_s, SCOUT, Conversation.ASK, SetParameter("speed", at_s), asker),
            Said(at_s, SCOUT, Conversation.ASK, Parameters({"speed": at_s}), SCOUT, f"{asker}#{at_s + 1}"),
        )
    ]
    said += messages(20.0, "asked", 7)
    classes = CountingClasses()
    mission = mission_at(Recording(recorded(said)), classes, 30.0)
    assert mission.answer(SCOUT, AskParameters()) == Parameters({"speed": 7})
    assert [one.schema for one in mission.newest()] == [schema_of(MissionHealth)]
    assert classes.restored == {schema_of(AskParameters): 1, schema_of(Parameters): 1}


@given(times=st.lists(st.integers(0, 10**12), min_size=1, max_size=8), data=st.data())
def test_messages_of_the_asked_instant_itself_are_not_known_yet(times: list[int], data: st.DataObject):
    ordered = [each / NS for each in sorted(times)]
    events = [messages(at_s, "event", number) for number, at_s in enumerate(ordered)]
    recording = Recording(recorded([one for said in events for one in said]))
    at_s = data.draw(st.sampled_from(ordered))
    log = mission_at(recording, CLASSES, at_s).answer(LAUNCHER, AskLog())
    assert isinstance(log, Log)
    assert [event.what for event in log.events] == [str(number) for number, one in enumerate(ordered) if one < at_s]
