"""One person at two screens is one person: the robot follows them, and both screens say so."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from console_scenes import ASK, GRANT, SCHEDULE, component, model, rc, request
from fake_resource_pool import FakePlacer
from hypothesis import given
from hypothesis import strategies as st

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import ComponentState
from backbone.nameserver.messages import Components
from backbone.naming import Subsystem
from backbone.rc_manager.messages import AskSchedule, AskWhy
from backbone.scheduling.requests import Holder, RequestState
from backbone.scheduling.views import Schedule, Why
from backbone.wire import Envelope, Message
from resource_pool.arc_client import Suspended
from ui_console.model.console import ConsoleModel
from ui_console.model.events import Heard
from ui_console.session.hand_over import AskHandOver, ClaimOutcome, decide
from ui_console.session.teleoperation import Teleoperation

TIMES = st.floats(0, 100)


@given(TIMES, TIMES)
def test_of_two_claims_of_one_person_the_newer_stands_and_never_both(one_s: float, other_s: float) -> None:
    first = decide(AskHandOver("scout1", "anna", one_s), "anna", "scout1", other_s, by_script=False)
    second = decide(AskHandOver("scout1", "anna", other_s), "anna", "scout1", one_s, by_script=False)
    assert not (first is ClaimOutcome.GIVEN and second is ClaimOutcome.GIVEN)
    if one_s != other_s:
        assert {first, second} == {ClaimOutcome.GIVEN, ClaimOutcome.NEWER}


@pytest.mark.parametrize(
    ("user", "holds", "by_script"),
    [
        ("ben", "scout1", False),
        ("", "scout1", False),
        ("anna", "scout2", False),
        ("anna", "", False),
        ("anna", "scout1", True),
    ],
)
def test_what_another_person_or_a_script_holds_stays_there(user: str, holds: str, by_script: bool) -> None:
    asked = AskHandOver("scout1", "anna", 50.0)
    assert decide(asked, user, holds, 1.0, by_script=by_script) is ClaimOutcome.NOT_YOURS


class RcManager(Component[NoParameters]):
    """Answers with the holder of scout1."""

    accepts = AskSchedule | AskWhy
    holder = ""

    async def answer(self, asked: Envelope[Any]) -> Message:
        if isinstance(asked.body, AskWhy):
            return Why(asked.body.name, "waiting", ["somebody has it"], "3", [], -1.0, "")
        held = [Holder(f"{self.holder}-drive", 1, 0.0, 2.0)] if self.holder else []
        owners = [f"{Subsystem.UI_CONSOLE}/{name}" for name in ("desk", "tablet", "ben")]
        requests = [request(f"{at.partition('/')[2]}-drive", at, RequestState.RUNNING) for at in owners]
        return Schedule(self.clock.now_s(), [rc("scout1", "scout", held)], requests, [])


def launched(subsystem: Subsystem, name: str, parameters: dict[str, Any]) -> Launch:
    return Launch("iros2001", subsystem, name, name, "in this process", "local", "", 0.0, 1.0, parameters)


class Stage:
    """Anna's desk, her tablet, Ben; grants come when the test says so."""

    def __init__(self, placer: FakePlacer) -> None:
        self.placer, self.clock = placer, placer.clock
        bus = placer.network.join(RC_MANAGER, placer.clock)
        self.manager = RcManager(launched(Subsystem.BACKBONE, "rc_manager", {}), bus, placer.clock)
        self.desk, self.tablet = self.console("desk", "anna"), self.console("tablet", "anna")
        self.ben = self.console("ben", "ben")

    def console(self, name: str, user: str) -> Teleoperation:
        launch = launched(Subsystem.UI_CONSOLE, name, {"robot": "scout1", "kind": "drive", "priority": 100})
        bus = self.placer.network.join(launch.address, self.clock)
        shown = ConsoleModel(name, user)
        return Teleoperation(
            launch, bus, self.clock, show=shown.apply, watches=False, keeps_arc=True, takes=False, user=user
        )

    async def takes(self, console: Teleoperation) -> None:
        """Let the console claim; it is granted unless another one holds the robot."""
        await self.clock.sleep_s(1.0)
        console.take()
        await self.placer.wait(lambda: f"{console.name}-drive" in self.placer.arcs)
        if not self.manager.holder:
            await self.placer.arcs[f"{console.name}-drive"].grant()
            self.manager.holder = console.name
        console.schedule_heard()
        await self.clock.sleep_s(1.0)


Scene = Callable[[Stage], Awaitable[None]]


@pytest.fixture
def stage(local_mission: Any, beside: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network:
                placer = FakePlacer(network, VirtualClock(), {})
                try:
                    on = Stage(placer)
                    async with beside(on.manager), beside(on.desk), beside(on.tablet), beside(on.ben):
                        await placer.wait(lambda: all(one.is_ready for one in (on.desk, on.tablet, on.ben)))
                        await scene(on)
                finally:
                    await placer.close()

        run_virtual(main())

    return run


def test_a_robot_follows_its_person_to_another_screen(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        await on.takes(on.desk)
        assert on.desk.is_held
        await on.takes(on.tablet)
        assert not on.desk.is_held
        assert on.placer.arcs["desk-drive"].is_idle
        told = [event.what for event in on.desk.story.of("scout1")]
        assert "was given back by anna: anna goes on at another screen" in told

    stage(scene)


def test_a_claim_that_is_older_than_its_persons_hold_is_given_up_and_takes_no_turns(
    stage: Callable[[Scene], None],
) -> None:
    async def scene(on: Stage) -> None:
        on.manager.holder = "nobody yet"
        await on.takes(on.desk)
        await on.takes(on.tablet)
        await on.placer.arcs["tablet-drive"].grant()
        on.manager.holder = "tablet"
        on.desk.schedule_heard()
        await on.clock.sleep_s(1.0)
        assert on.tablet.is_held
        assert on.desk.given_back
        assert not on.desk.is_held

    stage(scene)


def test_another_persons_robot_stays_with_them(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        await on.takes(on.ben)
        await on.takes(on.tablet)
        assert on.ben.is_held
        assert on.tablet.given_back is None

    stage(scene)


DESK = component("ui_console/console-1", "console", feedback="holds no robot")


def sits(name: str, user: str, feedback: str = "") -> ComponentState:
    return ComponentState(f"ui_console/{name}", "console", "lab", 7, DESK.state, 1.0, feedback, user=user)


def test_a_person_who_is_there_twice_is_told_where() -> None:
    shown = model(
        Heard(1.0, Components([sits("console-1", "anna"), sits("tablet-7", "anna", "drives scout1")], True, 0.0))
    )
    assert shown.own(2.0).other_screens == ["your other screen on lab drives scout1"]
    assert shown.status_line(2.0) == "watching; you hold no robot here; your other screen on lab drives scout1"
    only_looks = model(Heard(1.0, Components([sits("console-1", "anna"), sits("tablet-7", "anna")], True, 0.0)))
    assert only_looks.own(2.0).other_screens == ["your other screen on lab watches"]
    assert model(Heard(1.0, Components([DESK, sits("ben-7", "ben")], True, 0.0))).own(2.0).other_screens == []


def test_people_are_called_by_their_names_in_rows_timeline_and_reasons() -> None:
    holding = Schedule(
        10.0,
        [rc("scout1", "scout", [Holder("console-9-capture", 7, 10.0, 12.0)], ["watch1-capture"])],
        [
            request("console-9-capture", "ui_console/console-9", RequestState.RUNNING, priority="console-9:100"),
            request("watch1-capture", "mission_control/watch1", RequestState.WAITING),
        ],
        [],
    )
    held = component("resource_pool/scout1", "scout", feedback="held by console-9-capture")
    shown = model(Heard(10.0, holding), Heard(10.0, Components([held, sits("console-9", "Ben B.")], True, 0.0)))
    [robot] = shown.robots(11.0)
    assert (robot.holder, robot.priority, robot.feedback) == ("Ben B.", "Ben B.:100", "held by Ben B.")
    assert [row.owner for row in shown.team.requests()] == ["Ben B.", "watch1"]
    assert {one.who for row in shown.team.timeline(11.0).rows for one in row.slices} >= {"Ben B."}
    assert shown.team.person("console-9") == shown.team.person("console-9-capture") == "Ben B."
    shown.apply(ASK)
    shown.apply(GRANT)
    shown.apply(Heard(12.0, Suspended("arc", "slice", "console-9-capture", -1.0)))
    assert shown.own(12.0).taken_because == "it is the turn of Ben B."
    [taken] = shown.alarm_views()
    assert taken.line == "scout1 was taken from anna: it is the turn of Ben B."


def test_what_one_gave_away_is_no_alarm_and_nobody_else_hears_of_ones_own() -> None:
    one = model(Heard(8.0, SCHEDULE), ASK, GRANT)
    two = ConsoleModel("console-2", "ben", one.team)
    one.apply(Heard(12.0, Suspended("arc", "self", "", -1.0)))
    assert one.alarm_views() == []
    one.apply(Heard(13.0, Suspended("arc", "higher", "console-2-capture", -1.0)))
    assert [alarm.subject for alarm in one.alarm_views()] == ["scout1"]
    assert two.alarm_views() == []
