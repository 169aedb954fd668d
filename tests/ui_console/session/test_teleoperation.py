"""A person at the console: takes a robot, drives it, gives it back, turns to another."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from driven_console import console, grant_at_once
from fake_resource_pool import FakePlacer

from backbone.component.messages import StoryEvent
from backbone.errors import NoResponder
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from resource_pool.arc_client import Suspended
from resource_pool.commands import Halt as ArcHalt
from resource_pool.commands import Move as ArcMove
from ui_console.model.console import ConsoleModel
from ui_console.model.driving import GiveWish, MoveWish
from ui_console.model.events import (
    Asked,
    Attention,
    CommandApplied,
    ConsoleEvent,
    GivenBack,
    Granted,
    LinkHeard,
    said,
)
from ui_console.session.teleoperation import Teleoperation

FORWARD = MoveWish(0.1, 0.0)


def test_a_console_claims_with_its_own_priority_beside_the_mission(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        async with beside(console(placer, lambda event: None)):
            await placer.wait(lambda: placer.arcs)
            asked = placer.arcs["console-7-video_drive"].parameters
            assert asked["path"] == [["console-7", 100]]
            assert (asked["console"], asked["wish"]) == (True, {"robot": "scout1"})

    placer_world(scene)


def test_a_held_key_drives_and_a_released_one_stops_the_wheels(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        async with beside(console(placer, lambda event: None)) as driven:
            await placer.wait(lambda: placer.arcs)
            [arc] = placer.arcs.values()
            await arc.grant()
            assert arc.commands == []
            for _repeat in range(20):
                driven.hold(FORWARD)
                await placer.clock.sleep_s(0.05)
            await placer.clock.sleep_s(2.0)
            kinds = [type(command) for _at_s, _epoch, command in arc.commands]
            assert kinds == [ArcMove] * (len(kinds) - 1) + [ArcHalt]
            assert 9 <= len(kinds) <= 14

    placer_world(scene)


def test_keys_pressed_while_somebody_else_has_the_robot_do_nothing_later_either(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        events: list[ConsoleEvent] = []
        async with beside(console(placer, events.append)) as driven:
            await placer.wait(lambda: placer.arcs)
            [arc] = placer.arcs.values()
            driven.hold(FORWARD)
            await placer.clock.sleep_s(0.2)
            await arc.grant()
            driven.hold(FORWARD)
            await arc.suspend("higher", "console-9", deadline_s=0.0)
            await arc.grant()
            await placer.clock.sleep_s(1.0)
            assert {epoch for _at_s, epoch, command in arc.commands if isinstance(command, ArcMove)} <= {1}
            words = [type(said(event)) for event in events if isinstance(said(event), Granted | Suspended)]
            assert words == [Granted, Suspended, Granted]

    placer_world(scene)


def test_released_with_one_call_the_robot_is_free_and_can_be_taken_again(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        events: list[ConsoleEvent] = []
        async with beside(console(placer, events.append)) as driven:
            for _turn in range(3):
                await placer.wait(lambda: placer.arcs)
                [arc] = placer.arcs.values()
                await arc.grant()
                await driven.give_back()
                assert arc.released == "released"
                assert not placer.arcs
                assert events[-1] == GivenBack(placer.clock.now_s(), "released", True)
                driven.take()

    placer_world(scene)


def test_taken_again_while_it_is_being_given_back_the_robot_is_asked_for_afterwards(
    placer_world: Any, beside: Any
) -> None:
    async def scene(placer: FakePlacer) -> None:
        events: list[ConsoleEvent] = []
        placer.on_arc = grant_at_once
        async with beside(console(placer, events.append)) as driven:
            await placer.wait(lambda: driven.is_held)
            driven.begin_release()
            await asyncio.sleep(0)
            driven.take()
            await driven.wait_granted()
            assert driven.is_held
            own = [type(event) for event in events if isinstance(event, Asked | Granted | GivenBack)]
            assert own == [Asked, Granted, GivenBack, Asked, Granted]

    placer_world(scene)


def test_ended_in_any_way_it_gives_the_robot_back(placer_world: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once

        async def leave(driven: Teleoperation) -> None:
            await driven.wait_granted()

        await console(placer, lambda event: None, work=leave).run()
        assert placer.ended == ["console-7-video_drive"]

    placer_world(scene)


def test_pictures_arrive_with_their_age(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        seen: list[Any] = []
        async with beside(console(placer, lambda event: None, see=seen.append)):
            await placer.wait(lambda: placer.arcs)
            [arc] = placer.arcs.values()
            await arc.grant()
            arc.publish(b"\0" * 4, 2, 2, 5)
            await placer.wait(lambda: seen)
            assert seen[0].number == 5

    placer_world(scene)


def test_a_command_without_an_answer_is_told_as_such(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        events: list[ConsoleEvent] = []
        async with beside(console(placer, events.append)) as driven:
            await placer.wait(lambda: placer.arcs)
            await placer.arcs["console-7-video_drive"].grant()
            await placer.kill("console-7-video_drive")
            assert await driven.do(FORWARD) is False
            assert not any(isinstance(event, CommandApplied) for event in events)
            with pytest.raises(NoResponder):
                await driven.bus.ask("resource_pool/console-7-video_drive", ArcHalt(), ArcHalt, within_s=0.1)

    placer_world(scene)


def test_switching_gives_the_first_robot_back_before_the_other_is_asked_for(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        events: list[ConsoleEvent] = []
        placer.on_arc = grant_at_once
        async with beside(console(placer, events.append)) as driven:
            await placer.wait(lambda: driven.is_held)
            [first] = placer.arcs.values()
            await driven.switch("scout2")
            assert first.released == "console-7 takes scout2"
            await placer.wait(lambda: driven.is_held)
            [second] = placer.arcs.values()
            assert second.parameters["wish"] == {"robot": "scout2"}
            await driven.switch("scout2")
            assert list(placer.arcs.values()) == [second]
        kinds = [type(event) for event in events if isinstance(event, Granted | GivenBack)]
        assert kinds == [Granted, GivenBack, Granted, GivenBack]

    placer_world(scene)


def test_another_kind_for_the_same_robot_is_claimed_anew_and_stays_with_it(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        async with beside(console(placer, lambda event: None)) as driven:
            await placer.wait(lambda: driven.is_held)
            [first] = placer.arcs.values()
            robot = first.parameters["wish"]["robot"]
            await driven.switch(robot, "lit_drive")
            assert first.released == f"console-7 takes {robot}"
            await placer.wait(lambda: driven.is_held)
            for kind in ("lit_drive", ""):
                await driven.switch(robot, kind)
                assert list(placer.arcs) == ["console-7-lit_drive"]
            await driven.give_back()
            driven.take()
            await placer.wait(lambda: driven.is_held)
            assert list(placer.arcs) == ["console-7-lit_drive"]

    placer_world(scene)


def test_of_several_robots_asked_for_in_a_row_the_last_is_taken(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        async with beside(console(placer, lambda event: None)) as driven:
            await placer.wait(lambda: driven.is_held)
            await asyncio.gather(*(driven.switch(robot) for robot in ("scout2", "scout3", "scout1", "scout3")))
            await placer.wait(lambda: driven.is_held)
            [arc] = placer.arcs.values()
            assert arc.parameters["wish"] == {"robot": "scout3"}

    placer_world(scene)


def test_a_robot_whose_operator_touched_nothing_for_long_is_given_back_and_can_be_taken_again(
    placer_world: Any, beside: Any
) -> None:
    async def scene(placer: FakePlacer) -> None:
        events: list[ConsoleEvent] = []
        placer.on_arc = grant_at_once
        driven = console(placer, events.append, away_after_s=20.0)
        async with beside(driven):
            await placer.wait(lambda: driven.is_held)
            for _key in range(5):
                await placer.clock.sleep_s(15.0)
                driven.hold(FORWARD)
            assert driven.is_held
            await placer.clock.sleep_s(21.0)
            assert not placer.arcs
            attention = [event.is_there for event in events if isinstance(event, Attention)]
            assert attention == [False]
            driven.touch()
            driven.take()
            await placer.wait(lambda: driven.is_held)
            await placer.clock.sleep_s(21.0)
            assert not placer.arcs

    placer_world(scene)


@pytest.mark.parametrize("robot", ["", "scout2"])
def test_an_operator_who_was_away_takes_a_robot_and_touches_nothing_more_loses_it_again(
    robot: str, placer_world: Any, beside: Any
) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        driven = console(placer, lambda event: None, away_after_s=20.0)
        async with beside(driven):
            await placer.wait(lambda: driven.is_held)
            await placer.clock.sleep_s(21.0)
            assert not placer.arcs
            if robot:
                await driven.switch(robot)
            else:
                driven.take()
            await placer.wait(lambda: driven.is_held)
            await placer.clock.sleep_s(21.0)
            assert not placer.arcs

    placer_world(scene)


def test_a_hold_that_says_how_long_it_counts_ends_then_and_not_later(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        async with beside(console(placer, lambda event: None)) as driven:
            await placer.wait(lambda: driven.is_held)
            [arc] = placer.arcs.values()
            for _message in range(10):
                driven.hold(FORWARD, 0.3)
                await placer.clock.sleep_s(0.1)
            silent_s = placer.clock.now_s() - 0.1
            await placer.clock.sleep_s(2.0)
            halts = [at_s for at_s, _epoch, command in arc.commands if isinstance(command, ArcHalt)]
            assert len(halts) == 1
            assert 0.25 <= halts[0] - silent_s <= 0.35

    placer_world(scene)


def test_each_thing_a_driver_does_is_one_event_with_the_name(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        heard: list[OperatorActed] = []
        placer.on_arc = grant_at_once
        placer.bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, lambda said: heard.append(said.body))
        async with beside(console(placer, lambda event: None, user="anna")) as driven:
            await placer.wait(lambda: driven.is_held)
            for _repeat in range(10):
                driven.hold(FORWARD)
                await placer.clock.sleep_s(0.05)
            await placer.clock.sleep_s(1.0)
            driven.give(GiveWish("jump"))
            await placer.clock.sleep_s(0.1)
            driven.stop()
            driven.hold(FORWARD)
            await placer.clock.sleep_s(0.1)
            [arc] = placer.arcs.values()
            await arc.suspend("higher", "console-9", deadline_s=0.0)
            await arc.grant()
            await driven.do(FORWARD)
            await driven.give_back()
            await placer.clock.sleep_s(0.1)
        await placer.clock.sleep_s(0.1)
        assert {act.user for act in heard} == {"anna"}
        assert [(act.action, act.subject) for act in heard] == [
            (OperatorAction.ATTACH, "console-7"),
            (OperatorAction.TAKE, "scout1"),
            (OperatorAction.DRIVE_BEGIN, "scout1"),
            (OperatorAction.DRIVE_END, "scout1"),
            (OperatorAction.COMMAND, "scout1"),
            (OperatorAction.DRIVE_BEGIN, "scout1"),
            (OperatorAction.DRIVE_END, "scout1"),
            (OperatorAction.DRIVE_BEGIN, "scout1"),
            (OperatorAction.DRIVE_END, "scout1"),
            (OperatorAction.RELEASE, "scout1"),
            (OperatorAction.DETACH, "console-7"),
        ]
        ends = [act.detail for act in heard if act.action is OperatorAction.DRIVE_END]
        assert ends[1].endswith("higher by console-9")
        assert ends[2].endswith("released")
        assert "scout1 was given back by anna: released" in [f"{act.subject} {act.sentence}" for act in heard]

    placer_world(scene)


def test_that_the_robot_is_there_is_told_to_the_mission_with_the_users_name(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        heard: list[tuple[str, str]] = []
        placer.on_arc = grant_at_once
        placer.bus.subscribe(
            "*/*", Conversation.LOG, StoryEvent, lambda said: heard.append((said.body.subject, said.body.what))
        )
        async with beside(console(placer, lambda event: None, user="anna")) as driven:
            await placer.wait(lambda: driven.is_held)
            await driven.give_back()
            await placer.clock.sleep_s(0.1)
        assert heard == [("scout1", "was taken over by anna")]

    placer_world(scene)


@pytest.mark.parametrize("is_lost", [False, True])
def test_the_next_heartbeat_of_the_arc_after_a_cut_shows_whether_the_robot_is_still_held(
    is_lost: bool, placer_world: Any, beside: Any
) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        shown = ConsoleModel("console-7", "anna")
        async with beside(console(placer, shown.apply)) as driven:
            await placer.wait(lambda: driven.is_held)
            [arc] = placer.arcs.values()
            for is_up in (False, True):
                await placer.clock.sleep_s(1.0)
                shown.apply(LinkHeard(placer.clock.now_s(), is_up))
            arc.granted = not is_lost
            await placer.clock.sleep_s(0.2)
            assert "not yet known whether you still hold scout1" in shown.status_line(placer.clock.now_s())
            await arc.beat()
            line = shown.status_line(placer.clock.now_s())
            assert line.startswith("waiting for scout1" if is_lost else "you hold scout1")

    placer_world(scene)
