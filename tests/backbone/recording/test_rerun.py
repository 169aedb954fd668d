"""A component that is run on a recording says what the recorded one said, unless it is another one."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import pytest
from recorded_missions import CLASSES, record_mission
from small_recordings import SCOUT, Said, recorded

from backbone.component.class_path import load_class
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import AskState, ComponentState, LifeState, StoryEvent
from backbone.errors import NoResponder
from backbone.keys import Conversation
from backbone.mission.reader import read_mission
from backbone.naming import Subsystem
from backbone.recording.comparison import KeyComparison, compared
from backbone.recording.reader import Recorded, Recording
from backbone.recording.rerun import NoSuchComponent, RealComponent, classes_of, launch_of, run_again
from backbone.recording.revival import with_names
from backbone.wire import schema_of

MISSION_XML = Path(__file__).parents[3] / "mission.xml"
LASTED_S = 19.0  # chosen: shorter than COMPARE_EVERY_S, when both children are asked for at one instant, in any order
FINDINGS = "mission_control/watch-scout2/events MotionSeen/1"
WATCHERS, ARC = ("watch-scout1", "watch-scout2"), "watch-scout1-capture"
Same = Callable[[str], dict[str, KeyComparison]]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Yield a recording of a mission on virtual time."""
    path = tmp_path_factory.mktemp("rerun") / "it.mcap"
    record_mission(path, read_mission(MISSION_XML), LASTED_S)
    with path.open("rb") as file:
        yield Recording(file)


def rerun_of(recording: Recording, *names: str, **parameters: Any) -> dict[str, KeyComparison]:
    """Return what the components said on the recording beside what the recorded ones said, by schema."""
    components = []
    for name in names:
        launch = launch_of(recording, CLASSES, name)
        launch = msgspec.structs.replace(launch, parameters={**launch.parameters, **parameters})
        components.append(RealComponent(launch, load_class(launch.class_path)))
    rerun = run_again(recording, CLASSES, components)
    assert rerun.fell == {}
    addresses = {launch.address for launch, _kind in components}
    found = compared((one for one in recording.messages() if one.source in addresses), rerun.said)
    return {f"{key} {schema}": one for (key, _source, schema), one in found.items()}


@pytest.fixture(scope="module")
def same(recording: Recording) -> Same:
    """Return what runs a component again as it was; each is run once."""
    return cache(lambda name: rerun_of(recording, name))


@pytest.mark.parametrize("name", [*WATCHERS, ARC])
def test_the_same_component_says_the_same(same: Same, name: str):
    found = same(name)
    assert {key for key, one in found.items() if not one.is_same} == set()
    assert sum(one.first for one in found.values()) > 50


def test_components_that_run_again_together_say_the_same(recording: Recording):
    """What children and parent say to each other is from this run, not from the recording."""
    found = rerun_of(recording, "surveillance", *WATCHERS)
    assert {key for key, one in found.items() if not one.is_same} == set()
    assert sum(one.first for key, one in found.items() if "ChildReport" in key) > 2


def test_there_is_something_to_find(same: Same):
    assert same("watch-scout2")[FINDINGS].first > 1


def test_another_parameter_is_named_at_the_first_finding_that_differs(recording: Recording):
    of_findings = rerun_of(recording, "watch-scout2", frames_wanted=3)[
        "mission_control/watch-scout2/events MotionSeen/1"
    ]
    assert of_findings.difference is not None
    assert of_findings.difference.number == 0
    assert of_findings.difference.second_s > of_findings.difference.first_s


def test_another_class_may_take_its_place(recording: Recording):
    launch = msgspec.structs.replace(launch_of(recording, CLASSES, "watch-scout1"), parameters={"seconds": 5.0})
    rerun = run_again(recording, CLASSES, [RealComponent(launch, load_class("mission_control.behaviors.wait:Wait"))])
    found = compared(recording.messages(source=launch.address), rerun.said)
    assert not all(one.is_same for one in found.values())


def test_a_component_that_falls_is_told(recording: Recording):
    class Broken(load_class("mission_control.behaviors.wait:Wait")):  # type: ignore[misc]
        async def connect(self) -> None:
            raise ZeroDivisionError

    launch = msgspec.structs.replace(launch_of(recording, CLASSES, "watch-scout1"), parameters={"seconds": 5.0})
    [(name, bug)] = run_again(recording, CLASSES, [RealComponent(launch, Broken)]).fell.items()
    assert name == "watch-scout1"
    assert isinstance(bug, ZeroDivisionError)


def test_a_question_that_nobody_answered_gets_no_answer_again_and_is_said_once() -> None:
    class Asker(Component[NoParameters]):
        async def connect(self) -> None:
            for _ in range(2):
                try:
                    await self.bus.ask(SCOUT, AskState(), ComponentState, within_s=1.0)
                    self.publish_event(self.name, "got an answer")
                except NoResponder:
                    self.publish_event(self.name, "found nobody")

    launch = Launch("local", Subsystem.MISSION_CONTROL, "asker", "asker", "x:Y", "base", "", 0.0, 1.0, {})
    state, asker = ComponentState(SCOUT, "scout", "base", 7, LifeState.READY, 0.5, ""), launch.address
    asked = [
        Said(1.0, asker, Conversation.LOG, StoryEvent(1.0, asker, "begins", "asker", ""), asker),
        Said(1.1, SCOUT, Conversation.ASK, AskState(), asker),
        Said(1.2, SCOUT, Conversation.ASK, AskState(), asker),
        Said(1.2, SCOUT, Conversation.ASK, state, SCOUT, f"{asker}#3"),
    ]
    said = run_again(Recording(recorded(asked)), CLASSES, [RealComponent(launch, Asker)]).said
    assert sum(one.schema == schema_of(AskState) for one in said) == 2
    events = [one.body["what"] for one in said if one.schema == schema_of(StoryEvent)]
    assert [what for what in events if "answer" in what or "nobody" in what] == ["found nobody", "got an answer"]


def test_of_nobody_there_is_no_launch(recording: Recording):
    with pytest.raises(NoSuchComponent, match="watch-scout1"):
        launch_of(recording, CLASSES, "watch-scot1")


def test_who_is_there_and_cannot_be_launched_is_not_meant_to_be_itself() -> None:
    state = ComponentState(SCOUT, "scout", "base", 7, LifeState.READY, 0.5, "")
    without_parameters = Recording(recorded([Said(1.0, SCOUT, Conversation.STATUS, state)]))
    with pytest.raises(NoSuchComponent) as refused:
        launch_of(without_parameters, CLASSES, "scout1")
    assert refused.value.detail == "the recording has no parameters of 'scout1'"


def test_the_messages_of_a_units_modules_and_of_its_exchanges_are_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own_modules.py").write_text(
        "from backbone.wire import Message\nclass OwnDepth(Message, frozen=True):\n    depth_m: float\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    parameters = {"modules": [{"name": "depth", "class_path": "own_modules:Depth"}]}
    unit = "mission_control.modules.unit_component:UnitComponent"
    launch = Launch("local", Subsystem.MISSION_CONTROL, "u", "execution_unit", unit, "local", "", 0.0, 1.0, parameters)
    classes = classes_of(launch)
    assert {"OwnDepth/1", "SwapModule/1"} <= classes.keys()
    nameless = Recorded("scout/m/u", "u", "OwnDepth/1", 1.0, 1.0, 1.0, 1, "", ["OwnDepth/1", 0.5])
    assert with_names(classes, nameless).body == {"depth_m": 0.5}
    assert with_names({}, nameless) is nameless
