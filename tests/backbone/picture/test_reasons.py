"""``why`` and ``story`` name the components that did not answer, and understand ids of causes."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus, current_cause
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.component.messages import (
    Absence,
    AskStory,
    ComponentState,
    LifeState,
    StandingStop,
    Story,
    StoryEvent,
)
from backbone.component.story import StoryBook, is_about
from backbone.errors import LinkError
from backbone.mission_log.log import AskLog, AskPeople, Log, PeopleKnown
from backbone.nameserver.messages import Components, ListComponents, Resolve, Resolved, UnknownName
from backbone.picture.mission import MissionPicture
from backbone.picture.reasons import AskedName, FoundEvents, Reasons, absences_of_host, reasons_for, story_of
from backbone.scheduling.views import Why

CAUSE = "backbone/rc_manager#112"
SCOUT = ComponentState(
    "resource_pool/scout1",
    "scout",
    "base",
    4711,
    LifeState.READY,
    1.0,
    stop=StandingStop(1, "anna", "child in the room", 2.0),
    absent=[Absence("radio", 3.0, "killed by SIGKILL", "starts again in 0.1 s", "Nothing.")],
)
SILENT = ComponentState("resource_pool/scout2", "scout", "base", 4712, LifeState.READY, 1.0)
CREATOR = ComponentState("backbone/creator-base", "creator", "base", 4713, LifeState.READY, 1.0)
ANNA = ComponentState(
    "ui_console/console-7",
    "console",
    "base",
    4714,
    LifeState.READY,
    1.0,
    "drives scout1, not console-7-drive",
    user="anna",
)
EVENTS = [
    StoryEvent(1.0, SCOUT.address, "connected", "scout1", CAUSE),
    StoryEvent(2.0, SCOUT.address, "disconnected", "scout1", "backbone/rc_manager#113"),
]


def mission(complete: bool = True, unknown: tuple[str, ...] = ()) -> Bus:
    """Return a bus to a mission with a nameserver, a Scout that answers and one that does not."""
    network = LocalNetwork("m")
    states = {state.address.partition("/")[2]: state for state in (SCOUT, SILENT, CREATOR, ANNA)}

    async def names(asked: Any) -> Any:
        match asked.body:
            case ListComponents():
                return Components(list(states.values()), complete, 0.0, list(unknown))
            case Resolve(name=name) if name in states:
                return Resolved(states[name])
            case Resolve(name=name):
                raise UnknownName(f"no component is registered as {name!r}")

    async def tells(asked: Any) -> Story:
        of = asked.body.subject
        return Story([event for event in EVENTS if not of or is_about(event, of)])

    network.join(NAMESERVER, VirtualClock()).serve(NAMESERVER, ListComponents | Resolve, names)
    network.join(SCOUT.address, VirtualClock()).serve(SCOUT.address, AskStory, tells)
    return network.join("ui_console/asker", VirtualClock())


def story(text: str, **listing: Any) -> FoundEvents:
    async def main() -> FoundEvents:
        return await story_of(mission(**listing), text, VirtualClock())

    return run_virtual(main())


def test_a_story_has_the_events_of_components_that_have_ended_and_each_event_once() -> None:
    """An exchange ends with the process that carries it out, and so does the story of that process."""
    ended = StoryEvent(1.5, "mission_control/fast", "x:New warms beside x:Old for anna", "scout1", "")
    other = StoryEvent(1.6, "mission_control/fast", "x:New warms beside x:Old for anna", "scout10", "")

    async def main() -> FoundEvents:
        bus = mission()
        assert isinstance(bus, LocalBus)

        async def logs(asked: Any) -> Log | PeopleKnown:
            if isinstance(asked.body, AskPeople):
                return PeopleKnown({})
            return Log([one for one in (EVENTS[0], ended, other) if asked.body.wants(one)])

        bus.network.join(LAUNCHER, VirtualClock()).serve(LAUNCHER, AskLog | AskPeople, logs)
        return await story_of(bus, "scout1", VirtualClock())

    assert run_virtual(main()).events == [EVENTS[0], ended, EVENTS[1]]


def test_why_a_component_does_not_work_may_be_its_machine() -> None:
    picture, slow = MissionPicture("m"), Absence("far", 3.0, "its link is slow", "goes on", is_running=True)
    picture.take(msgspec.structs.replace(CREATOR, address="backbone/offer-far", host="far", absent=[slow]))
    assert absences_of_host(SCOUT, picture) == []
    [line] = absences_of_host(msgspec.structs.replace(SCOUT, host="far"), picture)
    assert line.startswith("far has not worked")
    assert "its link is slow" in line


def why(text: str) -> Reasons:
    async def main() -> Reasons:
        return await reasons_for(mission(), text, VirtualClock())

    return run_virtual(main())


@pytest.mark.parametrize("text", ["scout1", "resource_pool/scout1", CAUSE])
def test_a_story_names_every_component_that_did_not_tell_its_part(text: str) -> None:
    told = story(text, complete=False, unknown=("mission_control/watch",))
    missing = "\n".join(told.missing)
    assert told.events[0].what == "connected"
    for name in (
        "resource_pool/scout2: ",
        "mission_control/watch: ",
        "radio: it is absent",
        "nameserver has just started",
    ):
        assert name in missing


@pytest.mark.parametrize(
    ("text", "similar"), [("scuot1", " (did you mean 'scout1'?)"), ("scout1", ""), ("anvil", ""), ("", "")]
)
def test_a_story_of_a_misspelt_name_names_a_similar_component(text: str, similar: str) -> None:
    assert story(text).similar == similar


def test_a_cause_has_the_events_that_it_led_to_and_no_others() -> None:
    assert story(CAUSE).events == EVENTS[:1]
    reasons = why(CAUSE)
    assert reasons.name == "rc_manager"
    assert reasons.lines(5.0)[-1] == "  1.000 s  resource_pool/scout1  scout1: connected"


def test_an_address_means_its_component() -> None:
    assert AskedName.of("resource_pool/scout1") == AskedName("scout1")
    assert why("resource_pool/scout1").component == SCOUT


def test_why_shows_a_standing_stop_and_an_absence() -> None:
    assert why("scout1").lines(5.0)[0].startswith("scout1 is STOPPED by anna for 3.0 s: child in the room")
    assert why("scout1").to_json()["stop"]["by"] == "anna"
    reasons = why("radio")
    assert reasons.lines(5.0) == [
        "radio is absent for 2.0 s: killed by SIGKILL; starts again in 0.1 s; Nothing.",
    ]
    assert reasons.to_json()["absent"]["cause"] == "killed by SIGKILL"


def test_while_the_rc_manager_is_silent_no_name_is_called_unknown() -> None:
    with pytest.raises(LinkError):
        why("nobody")


@pytest.mark.parametrize(
    ("state", "at_s", "line"),
    [
        ("waiting", 5.0, "  expected to start in 3.0 s"),
        ("held", 5.0, "  next grant expected in 3.0 s"),
        ("connecting", 9.0, "  expected to start now"),
    ],
)
def test_a_predicted_start_is_told_for_arcs_and_resources(state: str, at_s: float, line: str) -> None:
    """A resource was said to start, and a late one in 0.0 s."""
    known = Why("scout1", state, ["as it is"], "3", [], 8.0, "")
    assert line in Reasons("scout1", known, None, None).lines(at_s)


def test_a_story_book_finds_what_a_message_led_to() -> None:
    book = StoryBook("resource_pool/scout1", VirtualClock())

    async def main() -> None:
        book.note("scout1", "was started")
        current_cause.set(CAUSE)
        book.note("scout1", "connected")

    run_virtual(main())
    assert [event.what for event in book.of(CAUSE)] == ["connected"]
    assert len(book.of("scout1")) == 2


@pytest.mark.parametrize("text", ["rc_manager#112", "backbone/rc_manager#112"])
def test_an_events_cause_may_be_typed_with_or_without_its_subsystem(text: str) -> None:
    assert story(text).events == EVENTS[:1]
    assert "  1.000 s  resource_pool/scout1  scout1: connected" in why(text).lines(5.0)


def test_a_message_that_led_to_nothing_says_so() -> None:
    assert why("scout1#7").lines(5.0)[0].startswith("no component has an event that scout1#7 led to")


def test_an_alarm_means_what_it_is_about() -> None:
    assert why("lost:scout1").component == SCOUT
    assert why("deadline:radio1:scout1").component == SCOUT


def test_a_machine_is_known_with_what_runs_there() -> None:
    here, absent = why("base").lines(5.0)
    assert here == "base is a machine of the mission, with 4 components: creator-base, scout1, scout2, anna"
    assert absent.startswith("creator-base is absent for 0.0 s: no answer")


def test_a_person_is_known_with_every_screen_and_called_by_name() -> None:
    assert why("anna").lines(5.0) == ["anna sits at 1 console", "  on base: drives scout1, not anna"]
    assert why("console-7").lines(5.0) == ["anna is ready on base: drives scout1, not anna"]
