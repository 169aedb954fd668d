"""Messages are lost, late and doubled as their fates say; links keep their order."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.messages import AskStory, Story
from backbone.errors import NoResponder, ReplyTimeout
from backbone.keys import Conversation
from backbone.rc_manager.messages import Beat
from backbone.wire import Envelope
from mission_control.laboratory.simulation.faults import (
    DrawnFates,
    GivenFates,
    KillFault,
    MessageFault,
    Weather,
    draw_moments,
    draw_weather,
)
from mission_control.laboratory.simulation.shape import draw_shape
from mission_control.laboratory.simulation.unreliable_network import UnreliableNetwork

ASKER, SERVER = "resource_pool/asker", "resource_pool/server"
QUESTION, ANSWER = f"{ASKER} > {SERVER} AskStory", f"{SERVER} > {ASKER} answer Story"


class Scene:
    """One who asks and publishes, one who answers and listens."""

    def __init__(self, *faults: MessageFault) -> None:
        clock = VirtualClock()
        self.clock = clock
        self.network = UnreliableNetwork("local", GivenFates(faults), 0.0, 100.0)
        self.asker, self.server = self.network.join(ASKER, clock), self.network.join(SERVER, clock)
        self.answered: list[tuple[float, str]] = []
        self.heard: list[tuple[float, str]] = []
        self.server.serve(SERVER, AskStory, self._answer)
        self.server.subscribe(ASKER, Conversation.BEAT, Beat, self._hear)

    async def _answer(self, asked: Envelope[Any]) -> Story:
        self.answered.append((round(self.clock.now_s(), 3), asked.body.subject))
        return Story([])

    def _hear(self, envelope: Envelope[Any]) -> None:
        self.heard.append((round(self.clock.now_s(), 3), envelope.body.arc))

    async def ask(self, what: str = "x", within_s: float = 1.0) -> Story:
        return await self.asker.ask(SERVER, AskStory(what), Story, within_s=within_s)

    def beat(self, *arcs: str) -> None:
        for arc in arcs:
            self.asker.publish(ASKER, Conversation.BEAT, Beat(arc))

    async def close(self) -> None:
        await self.asker.close()
        await self.server.close()


def play(scene: Coroutine[Any, Any, None]) -> None:
    run_virtual(scene)


def test_a_lost_question_is_never_answered() -> None:
    async def scene() -> None:
        s = Scene(MessageFault(f"{QUESTION} 1", "lost"))
        with pytest.raises(ReplyTimeout):
            await s.ask()
        assert s.answered == []
        await s.ask("again")
        assert s.answered == [(1.0, "again")]
        await s.close()

    play(scene())


def test_of_a_lost_answer_the_question_was_answered() -> None:
    async def scene() -> None:
        s = Scene(MessageFault(f"{ANSWER} 1", "lost"))
        with pytest.raises(ReplyTimeout):
            await s.ask()
        assert s.answered == [(0.0, "x")]
        await s.close()

    play(scene())


def test_a_late_question_is_answered_also_after_it_was_given_up() -> None:
    async def scene() -> None:
        s = Scene(MessageFault(f"{QUESTION} 1", "late", 1.5))
        with pytest.raises(ReplyTimeout):
            await s.ask()
        await s.clock.sleep_until_s(2.0)
        assert s.answered == [(1.5, "x")]
        await s.close()

    play(scene())


def test_a_doubled_question_is_answered_twice_and_heard_once() -> None:
    async def scene() -> None:
        s = Scene(MessageFault(f"{QUESTION} 1", "doubled"))
        await s.ask()
        assert s.answered == [(0.0, "x"), (0.0, "x")]
        await s.close()

    play(scene())


def test_a_question_that_finds_nobody_any_more_ends_without_an_answer() -> None:
    async def scene() -> None:
        s = Scene(MessageFault(f"{QUESTION} 1", "late", 0.5))
        asking = asyncio.create_task(s.ask())
        await s.clock.sleep_s(0.1)
        await s.server.close()
        with pytest.raises(NoResponder):
            await asking
        await s.close()

    play(scene())


def test_what_is_said_after_a_late_message_comes_after_it() -> None:
    async def scene() -> None:
        s = Scene(MessageFault(f"{ASKER} > {SERVER} Beat 2", "late", 0.5))
        s.beat("a", "b", "c")
        await s.clock.sleep_s(1.0)
        assert s.heard == [(0.0, "a"), (0.5, "b"), (0.5, "c")]
        await s.close()

    play(scene())


def test_publications_get_lost_and_come_twice() -> None:
    async def scene() -> None:
        told = f"{ASKER} > {SERVER} Beat"
        s = Scene(MessageFault(f"{told} 1", "lost"), MessageFault(f"{told} 3", "doubled"))
        s.beat("a", "b", "c")
        await s.clock.sleep_s(0.1)
        assert s.heard == [(0.0, "b"), (0.0, "c"), (0.0, "c")]
        assert [fault.effect for fault in s.network.suffered] == ["lost", "doubled"]
        await s.close()

    play(scene())


def test_who_is_cut_off_gets_everything_in_order_when_that_ends() -> None:
    async def scene() -> None:
        s = Scene()
        s.network.cut_off(SERVER, 2.0)
        seen: list[tuple[float, bool]] = []
        s.server.watch_alive(ASKER, lambda _, alive: seen.append((round(s.clock.now_s(), 3), alive)))
        token = s.asker.declare_alive(ASKER)
        s.beat("a", "b")
        with pytest.raises(ReplyTimeout):
            await s.ask()
        token.close()
        await s.clock.sleep_until_s(3.0)
        assert s.heard == [(2.0, "a"), (2.0, "b")]
        assert s.answered == [(2.0, "x")]
        assert seen == [(2.0, True), (2.0, False)]
        await s.close()

    play(scene())


def test_after_its_end_messages_all_arrive() -> None:
    async def scene() -> None:
        s = Scene(MessageFault(f"{ASKER} > {SERVER} Beat 1", "lost"))
        await s.clock.sleep_until_s(100.0)
        s.beat("a")
        await s.clock.sleep_s(0.1)
        assert [arc for _, arc in s.heard] == ["a"]
        await s.close()

    play(scene())


def test_a_messages_fate_hangs_on_itself_alone() -> None:
    names = [f"a > b Beat {number}" for number in range(20_000)]
    drawn = DrawnFates(1, Weather(0.01, 0.02, 0.03))
    fates = {name: drawn.fate(name) for name in names}
    other = DrawnFates(1, Weather(0.01, 0.02, 0.03))
    assert all(other.fate(name) == fates[name] for name in reversed(names))
    effects = [fate.effect for fate in fates.values() if fate is not None]
    assert 140 < effects.count("lost") < 260
    assert 300 < effects.count("late") < 500
    assert 500 < effects.count("doubled") < 700


def test_some_seeds_mean_kills_only_and_some_a_bad_network_only() -> None:
    weathers = [draw_weather(seed) for seed in range(100)]
    assert any(weather.kills and not weather.lost for weather in weathers)
    assert any(weather.lost and not weather.kills for weather in weathers)
    shape = draw_shape(5)
    for fault in draw_moments(shape, Weather(kills=5, hangs=2)):
        assert 1.0 <= fault.at_s <= shape.active_s
        assert isinstance(fault, KillFault) or "/" not in fault.target
