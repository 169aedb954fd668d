"""A look at a mission reports services that did not answer, and wanted components that are absent."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from rich.console import Console

from backbone.addresses import LAUNCHER, NAMESERVER, PLACER, RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import Absence, AskTime, ComponentState, LifeState, MissionTime, StandingStop
from backbone.creator.messages import ListProcesses, Processes, ProcessState, Spawn
from backbone.errors import LinkError
from backbone.nameserver.messages import Components, Disappeared, ListComponents
from backbone.naming import Subsystem
from backbone.picture.health import HealthWord, MissionHealth
from backbone.picture.look import look
from backbone.picture.mission import MissionPicture, misses
from backbone.picture.screen import live_screen, screen
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.views import RcView, Schedule
from backbone.wire import Message

CREATOR = "backbone/creator-base"


def component(address: str, kind: str = "kind", state: LifeState = LifeState.READY, **more: Any) -> ComponentState:
    return ComponentState(address, kind, "base", 4711, state, 2.0, **more)


def process(name: str, subsystem: Subsystem = Subsystem.RESOURCE_POOL, pid: int = 4711, **more: Any) -> ProcessState:
    return ProcessState(Spawn(subsystem, name, name, "x:Y"), pid, 0, "killed", **more)


def serve(network: LocalNetwork, address: str, answers: dict[type[Message], Message]) -> Any:
    """Answer these questions by a component at this address."""
    accepts: Any = None
    for question in answers:
        accepts = question if accepts is None else accepts | question

    async def answer(asked: Any) -> Message:
        return answers[type(asked.body)]

    bus = network.join(address, VirtualClock())
    bus.serve(address, accepts, answer)
    return bus


LISTED = [component(CREATOR, "creator"), component("resource_pool/scout1", "scout")]
WHOLE = Components(LISTED, True, 0.0)


def core(
    network: LocalNetwork, listing: Components = WHOLE, processes: tuple[ProcessState, ...] = ()
) -> dict[str, Any]:
    """Answer all questions of a look by core services."""
    time = {AskTime: MissionTime(1.0, 1.0)}
    return {
        NAMESERVER: serve(network, NAMESERVER, {ListComponents: listing}),
        RC_MANAGER: serve(network, RC_MANAGER, {AskSchedule: Schedule(1.0, [], [], []), **time}),
        PLACER: serve(network, PLACER, time),
        LAUNCHER: serve(network, LAUNCHER, {ListProcesses: Processes("base", [], [])}),
        CREATOR: serve(network, CREATOR, {ListProcesses: Processes("base", [], list(processes))}),
    }


def looked(listing: Components = WHOLE, processes: tuple[ProcessState, ...] = (), silent: str = "") -> MissionPicture:
    async def main() -> MissionPicture:
        network = LocalNetwork("m")
        answering = core(network, listing, processes)
        if silent:
            await answering[silent].close()
        return await look(network.join("ui_console/looker", VirtualClock()), 10.0)

    return run_virtual(main())


def drawn(shown: object) -> str:
    console = Console(width=200, markup=False)
    with console.capture() as captured:
        console.print(shown)
    return captured.get()


def test_a_mission_whose_services_answer_is_ok() -> None:
    picture = looked()
    assert picture.health.word is HealthWord.OK
    assert picture.problems == ()
    assert picture.to_json()["health"] == "ok"
    assert picture.to_json()["absent"] == []


@pytest.mark.parametrize("silent", [RC_MANAGER, PLACER, LAUNCHER, CREATOR])
def test_a_service_that_does_not_answer_is_absent_and_named_first(silent: str) -> None:
    picture = looked(silent=silent)
    name = silent.partition("/")[2]
    assert picture.health.word is HealthWord.DEGRADED
    assert [absence.name for absence in picture.health.absent] == [name]
    assert picture.to_json()["absent"][0]["vital"]
    assert drawn(screen(picture)).splitlines()[0].endswith("health degraded")
    assert f"{name} is absent for 0.0 s" in drawn(screen(picture)).splitlines()[1]


@pytest.mark.parametrize(
    ("state", "word", "says"),
    [
        (process("scout1", silent_s=1.5), HealthWord.DEGRADED, "it hangs: its event loop did not run for 1.5 s"),
        (process("scout1", pid=0), HealthWord.DEGRADED, "killed; its creator restarts it"),
        (process("placer", Subsystem.BACKBONE), HealthWord.DEGRADED, "its process 4711 is not registered"),
    ],
    ids=["hung", "without a process", "core service that is not registered"],
)
def test_what_creators_say_of_a_component_counts(state: ProcessState, word: HealthWord, says: str) -> None:
    picture = looked(processes=(state,))
    assert picture.health.word is word
    assert says in "\n".join(picture.health.lines(picture.at_s))


def test_many_absences_for_the_same_reason_are_one_line() -> None:
    lost = [Absence(f"scout{number}", 2.0, "was lost", "is being placed again") for number in range(1, 101)]
    placer = Absence("placer", 2.0, "was lost", "is being placed again", is_running=True)
    lines = MissionHealth(HealthWord.DEGRADED, [placer, *lost]).lines(7.5)
    assert lines == [
        "placer has not worked for 5.5 s: was lost; is being placed again",
        "each of 100 components (scout1, scout2, scout3, scout4, scout5, scout6, scout7, scout8 and 92 more) "
        "is absent for 5.5 s: was lost; is being placed again",
    ]
    assert len(MissionHealth(HealthWord.DEGRADED, lost[:8]).lines(7.5)) == 8


def test_many_absences_that_differ_only_in_times_are_one_line() -> None:
    """Twenty radios that fail one after the other filled the screen, and hid what else was wrong."""
    radios = [
        Absence(f"radio{n}", n / 10, f"resource_pool/radio{n} is mute", f"starts again in {n % 3}.5 s")
        for n in range(1, 21)
    ]
    other = Absence("scout1", 2.0, "it is mute", "is being placed again")
    lines = MissionHealth(HealthWord.DEGRADED, [*radios, other]).lines(7.5)
    assert lines == [
        "each of 20 components (radio1, radio2, radio3, radio4, radio5, radio6, radio7, radio8 and 12 more) "
        "is absent for 5.5 to 7.4 s: resource_pool/NAME is mute; starts again in 0.5 to 2.5 s",
        "scout1 is absent for 5.5 s: it is mute; is being placed again",
    ]


def test_a_component_that_failed_is_absent_until_it_is_registered_again() -> None:
    failed = component("resource_pool/scout1", state=LifeState.FAILED, feedback="RuntimeError: no device")
    (absence,) = misses([failed], [], 10.0)
    assert (absence.name, absence.since_s, absence.cause) == ("scout1", 2.0, "RuntimeError: no device")
    assert misses([component("resource_pool/scout1")], [process("scout1")], 10.0) == []


def test_an_absence_keeps_its_beginning_from_look_to_look() -> None:
    async def main() -> MissionPicture:
        network = LocalNetwork("m")
        answering = core(network)
        await answering[RC_MANAGER].close()
        bus = network.join("ui_console/looker", VirtualClock())
        first = await look(bus, 10.0)
        return await look(bus, 30.0, before=first)

    picture = run_virtual(main())
    assert picture.health.absent[0].since_s == 10.0
    assert picture.health.word is HealthWord.FAILED


def test_without_a_nameserver_the_last_picture_is_kept_and_marked_as_old() -> None:
    async def main() -> tuple[MissionPicture, MissionPicture]:
        network = LocalNetwork("m")
        answering = core(network)
        bus = network.join("ui_console/looker", VirtualClock())
        first = await look(bus, 10.0)
        await answering[NAMESERVER].close()
        return await look(bus, 12.0, before=first), await look(bus, 13.0, before=await look(bus, 12.0, before=first))

    second, third = run_virtual(main())
    assert list(third.components) == [CREATOR, "resource_pool/scout1"]
    assert (second.stale_since_s, third.stale_since_s, third.at_s) == (10.0, 10.0, 13.0)
    assert third.health.absent[0].since_s == 12.0
    shown = drawn(live_screen(third, [], 40))
    assert "OLD PICTURE, of 10.0 s" in shown
    assert "nameserver is absent for 1.0 s: no answer" in shown
    assert "scout1" in shown


def test_without_a_nameserver_there_is_no_first_picture() -> None:
    async def main() -> None:
        with pytest.raises(LinkError):
            await look(LocalNetwork("m").join("ui_console/looker", VirtualClock()), 1.0)

    run_virtual(main())


@pytest.mark.parametrize(
    ("listing", "processes", "says"),
    [
        (Components(LISTED, False, 9.5), (), "the list may be incomplete"),
        (
            Components(LISTED, False, 9.5, [f"resource_pool/arc{n:03}" for n in range(307)]),
            (),
            "the list is incomplete: no word yet from 307 components (arc000, arc001",
        ),
        (
            Components(LISTED, True, 9.5, ["resource_pool/scout2"]),
            (),
            "the list is incomplete: no word yet from 1 component (scout2)",
        ),
        (
            Components(LISTED, False, 9.5),
            (process("scout1"), process("scout3")),
            "the list is incomplete: running and not registered yet: 1 component (scout3)",
        ),
        (
            Components(LISTED, True, 9.5),
            tuple(process(f"scout{number}") for number in range(2, 309)),
            "the list is incomplete: running and not registered yet: 307 components (scout2, scout3",
        ),
        (
            Components(LISTED, True, 9.5),
            (process("scout1"), *(ProcessState(process(f"arc{n}").spawn, 0, 0, "") for n in range(6))),
            "the list is incomplete: still being started: 6 components (arc0, arc1, arc2, arc3, arc4, arc5)",
        ),
    ],
    ids=["hub began a moment ago", "many unknown", "one that hangs", "do not come back", "come back too late", "start"],
)
def test_a_list_that_is_not_whole_says_so(listing: Components, processes: tuple[ProcessState, ...], says: str) -> None:
    picture = looked(listing, processes)
    assert says in "\n".join(picture.problems)
    assert says in drawn(screen(picture))
    assert says in picture.to_json()["problems"][0]


STOPPED = component("resource_pool/scout1", "scout", stop=StandingStop(3, "anna", "child in the room", 4.0))


@pytest.mark.parametrize("draw", [screen, lambda picture: live_screen(picture, [], 30)], ids=["whole", "live"])
def test_a_standing_emergency_stop_is_shown_with_who_set_it_when_and_why(draw: Callable[..., Any]) -> None:
    picture = looked(Components([*LISTED[:1], STOPPED], True, 0.0))
    assert "scout1 is STOPPED by anna for 6.0 s: child in the room" in drawn(draw(picture))
    (stop,) = picture.to_json()["stops"]
    assert (stop["name"], stop["by"], stop["reason"], stop["since_s"]) == ("scout1", "anna", "child in the room", 4.0)
    assert looked().to_json()["stops"] == []


def test_many_stops_are_one_line_in_the_order_of_counting() -> None:
    """After a stop of all sixty robots, status began with sixty lines, of scout1, scout10, scout11 …"""
    robots = [
        component(f"resource_pool/scout{n}", "scout", stop=StandingStop(3, "anna", "", 4.0 + n / 10))
        for n in (10, 2, 1, *range(11, 21))
    ]
    picture = looked(Components(robots, True, 0.0))
    assert picture.stop_lines() == [
        "each of 13 components (scout1, scout2, scout10, scout11, scout12, scout13, scout14, scout15 and 5 more) "
        "is STOPPED by anna for 4.0 to 5.9 s; lift the stop at a console when it may move"
    ]
    assert len(looked(Components(robots[:8], True, 0.0)).stop_lines()) == 8


def test_components_and_resources_are_in_the_order_of_counting() -> None:
    names = ["scout1", "scout10", "scout2"]
    picture = looked(Components([component(f"resource_pool/{name}", "scout") for name in names], True, 0.0))
    picture.schedule = Schedule(1.0, [RcView(name, "scout", "up", False, 1.0, [], 0, []) for name in names], [], [])
    for part in (*drawn(screen(picture)).split("resources"), drawn(live_screen(picture, [], 40))):
        assert [*dict.fromkeys(re.findall(r"\bscout\d+\b", part))] == ["scout1", "scout2", "scout10"]


@pytest.mark.parametrize(
    "text", ["\x1b]0;owned\x07\x1b[2J", "down\rup", "\u202edne", "[/red] [link=file:///]", "x" * 1_000_000, "a\nb"]
)
def test_what_a_component_says_commands_no_terminal(text: str) -> None:
    hostile = component(f"resource_pool/a{text[:30]}", feedback=text, absent=[Absence(text, 1.0, text, "tries again")])
    picture = looked(Components([hostile], True, 0.0))
    for shown in (drawn(screen(picture)), drawn(live_screen(picture, [], 30))):
        plain = shown.replace("\n", "")
        assert plain.isprintable()
        assert len(shown) < 100_000
    assert "[/red]" not in text or "[/red]" in drawn(screen(picture))


def test_it_is_the_same_picture_whether_all_is_asked_for_or_each_thing_is_heard() -> None:
    asked, heard = MissionPicture("m"), MissionPicture("m")
    early, ready = (component("resource_pool/scout1", state=state) for state in (LifeState.CONNECTING, LifeState.READY))
    gone = component("resource_pool/scout2")
    asked.take(Components([ready], True, 0.0))
    for said in (gone, ready, early, Disappeared(gone.address), component(gone.address, state=LifeState.STOPPED)):
        heard.take(said)
    assert asked.components == heard.components == {ready.address: ready}


def test_a_list_that_is_not_complete_proves_no_absence() -> None:
    picture = MissionPicture("m")
    picture.take(component("resource_pool/scout1"))
    picture.take(Components([component("resource_pool/scout2")], False, 0.0))
    assert sorted(picture.components) == ["resource_pool/scout1", "resource_pool/scout2"]
