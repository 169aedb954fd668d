"""Two consoles of equal priority and one robot: who waits asks, who holds decides, silence is a no."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from fake_resource_pool import FakePlacer

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.naming import Subsystem
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import RequestView, Schedule
from backbone.wire import Envelope, Message
from ui_console.model.consent import CONSENT_WITHIN_S, AskConsent, Consent, NotAnOperator
from ui_console.model.console import ConsoleModel
from ui_console.model.driving import DriveWish
from ui_console.session.teleoperation import Teleoperation

CONSENTS = (OperatorAction.ASK_CONSENT, OperatorAction.CONSENT, OperatorAction.DECLINE)


class RcManager(Component[NoParameters]):
    """Knows who holds and who waits for whom; the ARCs of the test are granted by the test."""

    accepts = AskSchedule
    blockers: tuple[str, ...] = ()

    async def answer(self, asked: Envelope[Any]) -> Message:
        return Schedule(self.clock.now_s(), [], [self._request(name) for name in ("anna", "ben", "watch")], [])

    def _request(self, name: str) -> RequestView:
        owner = f"{Subsystem.MISSION_CONTROL if name == 'watch' else Subsystem.UI_CONSOLE}/{name}"
        blockers = [f"{one}-drive" for one in self.blockers] if name == "ben" else []
        state = RequestState.WAITING if blockers else RequestState.RUNNING
        return RequestView(f"{name}-drive", owner, state, ["scout1"], 0.0, -1.0, -1.0, "", blockers, 5.0, "", 1)


class Person:
    """A person at a console, and the content of its screens."""

    def __init__(self, name: str, placer: FakePlacer) -> None:
        self.model = ConsoleModel(name, name)
        launch = launched(Subsystem.UI_CONSOLE, name, {"robot": "scout1", "kind": "drive", "priority": 100})
        bus = placer.network.join(launch.address, placer.clock)
        self.console = Teleoperation(launch, bus, placer.clock, show=self.model.apply, watches=False, keeps_arc=True)


def launched(subsystem: Subsystem, name: str, parameters: dict[str, Any]) -> Launch:
    return Launch("iros2001", subsystem, name, name, "in this process", "local", "", 0.0, 1.0, parameters)


class Stage:
    """Anna holds scout1, Ben waits for it."""

    def __init__(self, placer: FakePlacer) -> None:
        self.placer, self.clock = placer, placer.clock
        self.anna, self.ben = Person("anna", placer), Person("ben", placer)
        self.manager = RcManager(
            launched(Subsystem.BACKBONE, "rc_manager", {}), placer.network.join(RC_MANAGER, placer.clock), placer.clock
        )
        self.manager.blockers = ("anna",)
        self.acts: list[OperatorActed] = []
        placer.bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, lambda heard: self.acts.append(heard.body))

    async def until(self, condition: Callable[[], Any]) -> None:
        await self.placer.wait(condition)

    async def anna_holds(self) -> None:
        await self.until(lambda: len(self.placer.arcs) == 2)
        await self.placer.arcs["anna-drive"].grant()

    async def anna_is_asked(self) -> None:
        await self.until(lambda: self.anna.model.consent(self.clock.now_s()))

    def asked(self) -> str:
        """What Ben's screens show of his question."""
        return self.ben.model.own(self.clock.now_s()).asked

    def consents(self) -> list[tuple[str, OperatorAction]]:
        return [(act.user, act.action) for act in self.acts if act.action in CONSENTS]


Scene = Callable[[Stage], Awaitable[None]]


@pytest.fixture
def stage(local_mission: Any, beside: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network:
                placer = FakePlacer(network, VirtualClock(), {})
                try:
                    on = Stage(placer)
                    async with beside(on.manager), beside(on.anna.console), beside(on.ben.console):
                        await on.anna_holds()
                        await scene(on)
                finally:
                    await placer.close()

        run_virtual(main())

    return run


def test_a_yes_gives_the_robot_back_and_both_see_it(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        on.ben.console.begin_ask_consent("mine is stuck")
        await on.anna_is_asked()
        shown = on.anna.model.own(on.clock.now_s()).consent
        assert shown is not None
        assert (shown.user, shown.robot, shown.why) == ("ben", "scout1", "mine is stuck")
        assert CONSENT_WITHIN_S - 0.5 < shown.left_s <= CONSENT_WITHIN_S
        assert on.asked().startswith("asked anna for scout1")
        on.anna.console.decide(True)
        await on.until(lambda: on.asked() == "anna lets you have scout1")
        arc = on.placer.arcs["anna-drive"]
        assert (arc.granted, arc.is_idle, on.anna.console.is_held) == (False, True, False)
        assert on.anna.model.consent(on.clock.now_s()) is None
        await on.placer.arcs["ben-drive"].grant()
        assert on.asked() == "", "what was asked for is here"
        assert await on.ben.console.do(DriveWish(1.0, 1.0))
        assert on.consents() == [("ben", OperatorAction.ASK_CONSENT), ("anna", OperatorAction.CONSENT)]
        [release] = [act for act in on.acts if act.action is OperatorAction.RELEASE]
        assert (release.user, release.detail) == ("anna", "ben may have it")

    stage(scene)


def test_a_no_is_told_and_changes_nothing(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        on.ben.console.begin_ask_consent()
        await on.anna_is_asked()
        on.anna.console.decide(False, "nearly done")
        await on.until(lambda: on.asked() == "anna keeps scout1: nearly done")
        assert on.anna.console.is_held
        on.anna.console.decide(True)
        assert on.anna.console.is_held, "a question that was answered cannot be answered again"
        assert on.consents() == [("ben", OperatorAction.ASK_CONSENT), ("anna", OperatorAction.DECLINE)]
        told = [event.what for event in on.ben.console.story.of("scout1")]
        assert "anna keeps it from ben: nearly done" in told

    stage(scene)


def test_silence_is_a_no_and_one_can_ask_again(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        for turn in (1, 2):
            began_s = on.clock.now_s()
            on.ben.console.begin_ask_consent()
            on.ben.console.begin_ask_consent()
            await on.anna_is_asked()
            await on.until(lambda: on.asked() == "anna keeps scout1: no answer")
            assert on.clock.now_s() - began_s == pytest.approx(CONSENT_WITHIN_S, abs=0.2)
            assert on.anna.model.consent(on.clock.now_s()) is None
            assert on.consents() == [("ben", OperatorAction.ASK_CONSENT)] * turn
        assert on.anna.console.is_held

    stage(scene)


@pytest.mark.parametrize("is_released", [True, False])
def test_a_robot_given_back_anyway_is_a_yes_and_one_that_is_lost_a_no(
    stage: Callable[[Scene], None], is_released: bool
) -> None:
    async def scene(on: Stage) -> None:
        on.ben.console.begin_ask_consent()
        await on.anna_is_asked()
        if is_released:
            await on.anna.console.give_back()
            await on.until(lambda: on.asked() == "anna lets you have scout1: released")
        else:
            await on.placer.arcs["anna-drive"].suspend("higher", "cleo-drive", deadline_s=0.0)
            await on.until(lambda: on.asked() == "anna keeps scout1: it was lost: higher by cleo-drive")
        assert on.anna.model.consent(on.clock.now_s()) is None

    stage(scene)


def test_a_console_that_ends_while_it_is_asked_stands_in_nobodys_way(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        on.ben.console.begin_ask_consent()
        await on.anna_is_asked()
        on.anna.console.end("anna goes home")
        await on.until(lambda: on.asked().startswith("anna lets you have scout1"))

    stage(scene)


def test_behaviors_cannot_be_asked_and_who_does_not_wait_asks_nobody(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        on.manager.blockers = ("watch",)
        for person, remark in (
            (on.ben, "no operator blocks the claim of ben, but watch"),
            (on.anna, "anna does not wait for a robot"),
        ):
            person.console.begin_ask_consent()
            await on.until(person.model.alarm_views)
            assert remark in person.model.alarm_views()[0].line
        assert on.consents() == []

    stage(scene)


def test_programs_that_ask_for_consent_are_refused(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        question = AskConsent("scout1", "watch", "no reason")
        with pytest.raises(NotAnOperator):
            await on.placer.bus.ask(on.anna.console.address, question, Consent, within_s=1.0)

    stage(scene)


async def question_closes(on: Stage) -> float:
    """Return the seconds until Anna's screens show the question no more."""
    began_s = on.clock.now_s()
    await on.until(lambda: on.anna.model.consent(on.clock.now_s()) is None)
    return on.clock.now_s() - began_s


def test_the_question_of_a_console_that_ended_is_closed_soon(stage: Callable[[Scene], None]) -> None:
    """A yes released the robot for nobody."""

    async def scene(on: Stage) -> None:
        on.ben.console.begin_ask_consent()
        await on.anna_is_asked()
        on.ben.console.end("ben goes home")
        assert await question_closes(on) < CONSENT_WITHIN_S / 4
        on.anna.console.decide(True)
        assert on.anna.console.is_held

    stage(scene)


def test_a_question_is_closed_at_once_where_its_asker_waits_no_longer(stage: Callable[[Scene], None]) -> None:
    async def scene(on: Stage) -> None:
        for _turn in (1, 2):
            on.ben.console.begin_ask_consent()
            await on.anna_is_asked()
            await on.ben.console.give_back("no longer needed")
            assert await question_closes(on) < 0.5
            on.anna.console.decide(True)
            assert on.anna.console.is_held
            on.ben.console.take()
            await on.clock.sleep_s(0.5)
        told = [event.what for event in on.ben.console.story.of("scout1")]
        assert not [what for what in told if what.startswith("anna keeps it")]

    stage(scene)


def test_a_question_is_closed_at_once_where_its_asker_has_another_robot(stage: Callable[[Scene], None]) -> None:
    """As when its claim for any robot got another one."""

    async def scene(on: Stage) -> None:
        on.ben.console.begin_ask_consent()
        await on.anna_is_asked()
        arc = on.placer.arcs["ben-drive"]
        arc.rcs = {**arc.rcs, "scout": "scout2"}
        await arc.grant()
        assert await question_closes(on) < 0.5

    stage(scene)
