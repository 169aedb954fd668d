"""The health watch is silent while nothing happens, and misses nothing all the same."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from itertools import pairwise

import pytest
from msgspec.structs import replace

from backbone.addresses import LAUNCHER, NAMESERVER, PLACER, RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import Absence, AskTime, ComponentState, LifeState, MissionTime
from backbone.creator.messages import ListProcesses, Processes
from backbone.keys import Conversation
from backbone.launcher.health_watch import REST_S, HealthWatch
from backbone.nameserver.messages import Components, Disappeared, ListComponents
from backbone.picture.health import LOOK_EVERY_S, SAY_EVERY_S, SILENT_AFTER_S, HealthWord, MissionHealth
from backbone.picture.look import LOOK_TIME_S
from backbone.waiting import end_tasks
from backbone.wire import Envelope, Message

CREATOR = "backbone/creator-base"
LOST = Absence("scout1", 0.0, "killed by SIGKILL", "restarts in 0.1 s")


class Services:
    """Core services that answer and count questions, and what the launcher says of them."""

    def __init__(self) -> None:
        self.clock, network = VirtualClock(), LocalNetwork("quiet")
        self.asked = Counter[str]()
        self.hung: set[str] = set()
        self.state = ComponentState(CREATOR, "creator", "base", 7, LifeState.READY, 0.0)
        self.others: list[ComponentState] = []
        self.voices = {at: network.join(at, self.clock) for at in (NAMESERVER, RC_MANAGER, PLACER, LAUNCHER, CREATOR)}
        for at, voice in self.voices.items():
            voice.serve(at, ListComponents | AskTime | ListProcesses, self.answer)
        self.said: list[tuple[float, MissionHealth]] = []
        self.own: list[Absence] = []
        self.voices[CREATOR].subscribe(LAUNCHER, Conversation.HEALTH, MissionHealth, self._hear)
        self.watch = HealthWatch(self.voices[LAUNCHER], self.clock, lambda: None, lambda: self.own)

    def _hear(self, envelope: Envelope[MissionHealth]) -> None:
        self.said.append((self.clock.now_s(), envelope.body))

    async def answer(self, asked: Envelope[Message]) -> Message:
        kind = type(asked.body).__name__
        self.asked[kind] += 1
        if kind in self.hung:
            await asyncio.Event().wait()
        match asked.body:
            case ListComponents():
                return Components([self.state, *self.others], True, 0.0)
            case AskTime():
                return MissionTime(self.clock.now_s(), 1.0, 0.0)
            case _:
                return Processes("base", [], [])

    def miss(self, *absent: Absence) -> None:
        """Have the creator miss these from now on."""
        self.state = ComponentState(CREATOR, "creator", "base", 7, LifeState.READY, 0.0, "", "", list(absent))
        self.voices[CREATOR].publish(CREATOR, Conversation.STATUS, self.state)

    async def until_said(self, word: HealthWord) -> float:
        """Return how long it took until this word was said."""
        began_s = self.clock.now_s()
        async with asyncio.timeout(30.0):
            while self.said[-1][1].word is not word:
                await self.clock.sleep_s(0.01)
        return self.clock.now_s() - began_s


@asynccontextmanager
async def watched() -> AsyncIterator[Services]:
    services = Services()
    watching = asyncio.create_task(services.watch.run(), name="watch")
    await services.clock.sleep_s(5.0)
    yield services
    await end_tasks(watching)
    for voice in services.voices.values():
        await voice.close()


def test_a_healthy_mission_is_seldom_asked_and_its_health_is_heard_in_time() -> None:
    async def main() -> None:
        async with watched() as services:
            services.asked.clear()
            began_s = services.clock.now_s()
            await services.clock.sleep_s(20.0)
            assert services.asked["ListComponents"] <= 20.0 / REST_S + 1
            times_s = [at_s for at_s, _ in services.said if at_s > began_s]
            assert len(times_s) <= 20.0 / SAY_EVERY_S + 1
            pauses_s = [later - sooner for sooner, later in pairwise(times_s)]
            assert max(pauses_s) < SILENT_AFTER_S
            assert {health.word for _, health in services.said} == {HealthWord.OK}

    run_virtual(main())


def test_the_health_is_heard_every_second_also_when_it_was_said_in_between() -> None:
    async def main() -> None:
        async with watched() as services:
            began_s = services.clock.now_s()
            for pause_s in (7.3, 0.7, 6.1, 0.45, 8.6, 6.9):  # nothing is published, so rounds find the changes
                services.state = replace(services.state, absent=[] if services.state.absent else [LOST])
                await services.clock.sleep_s(pause_s)
            assert {health.word for _, health in services.said} == {HealthWord.OK, HealthWord.DEGRADED}
            times_s = [at_s for at_s, _ in services.said if at_s > began_s]
            assert max(later - sooner for sooner, later in pairwise(times_s)) < 1.01 * SAY_EVERY_S

    run_virtual(main())


def test_a_launcher_that_has_started_all_does_not_say_starting_because_of_an_old_list() -> None:
    async def main() -> None:
        async with watched() as services:
            services.said.clear()
            services.state = ComponentState(LAUNCHER, "launcher", "base", 7, LifeState.CONNECTING, 0.0)
            await services.clock.sleep_s(20.0)
            assert {health.word for _, health in services.said} == {HealthWord.OK}

    run_virtual(main())


def test_an_absence_that_an_owner_reports_is_said_at_once_and_so_is_its_end() -> None:
    async def main() -> None:
        async with watched() as services:
            for pause_s in (0.0, 0.3, 1.0, 1.7):
                await services.clock.sleep_s(pause_s)
                services.miss(LOST)
                assert await services.until_said(HealthWord.DEGRADED) < 2 * LOOK_EVERY_S
                services.miss()
                assert await services.until_said(HealthWord.OK) < 2 * LOOK_EVERY_S

    run_virtual(main())


@pytest.mark.parametrize(("components", "rounds"), [(90, 40), (400, 10), (10_000, 4)])
def test_while_something_is_absent_a_large_mission_is_asked_less_often_and_news_is_said_at_once(
    components: int, rounds: int
) -> None:
    async def main() -> None:
        async with watched() as services:
            ready = ComponentState("mission_control/one", "wait", "base", 7, LifeState.READY, 0.0)
            services.others = [replace(ready, address=f"mission_control/one{number}") for number in range(components)]
            services.miss(LOST)
            assert await services.until_said(HealthWord.DEGRADED) < 2 * LOOK_EVERY_S
            services.asked.clear()
            await services.clock.sleep_s(20.0)
            assert services.asked["ListComponents"] == pytest.approx(rounds, abs=2)
            services.miss()
            assert await services.until_said(HealthWord.OK) < 2 * LOOK_EVERY_S

    run_virtual(main())


def test_what_the_launcher_itself_misses_is_said_at_once() -> None:
    async def main() -> None:
        async with watched() as services:
            services.own = [LOST]
            services.watch.notice()
            assert await services.until_said(HealthWord.DEGRADED) < 0.1
            services.own = []
            services.watch.notice()
            assert await services.until_said(HealthWord.OK) < LOOK_EVERY_S

    run_virtual(main())


def test_a_service_that_lives_and_does_not_answer_is_missed_within_a_rest() -> None:
    async def main() -> None:
        async with watched() as services:
            services.hung = {"AskTime"}
            assert await services.until_said(HealthWord.DEGRADED) <= REST_S + LOOK_TIME_S + LOOK_EVERY_S
            services.hung = set()
            assert await services.until_said(HealthWord.OK) < LOOK_TIME_S + 2 * LOOK_EVERY_S

    run_virtual(main())


def test_news_of_feedback_alone_makes_no_round_and_a_component_that_left_makes_one() -> None:
    async def main() -> None:
        async with watched() as services:
            services.asked.clear()
            for number in range(50):
                state = ComponentState(CREATOR, "creator", "base", 7, LifeState.READY, 0.0, f"{number} components")
                services.voices[CREATOR].publish(CREATOR, Conversation.STATUS, state)
                await services.clock.sleep_s(0.02)
            assert services.asked["ListComponents"] <= 1
            services.asked.clear()
            services.voices[NAMESERVER].publish(NAMESERVER, Conversation.EVENTS, Disappeared("mission_control/watch"))
            await services.clock.sleep_s(LOOK_EVERY_S)
            assert services.asked["ListComponents"] >= 1

    run_virtual(main())


def test_owners_reports_are_collected_while_a_round_waits_for_a_creator_that_is_cut_off() -> None:
    async def main() -> None:
        async with watched() as services:
            services.hung = {"ListProcesses"}
            await services.clock.sleep_s(2 * REST_S)
            services.miss(LOST)
            await services.clock.sleep_s(2 * LOOK_EVERY_S + LOOK_TIME_S)
            assert "scout1" in {absence.name for absence in services.said[-1][1].absent}

    run_virtual(main())
