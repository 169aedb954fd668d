"""Repeated questions: they end after the silence of the receiver, not after a pause of the asking process."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.asking import PAUSE_MOST_S, ask_until_answered
from backbone.component.messages import AskState, ComponentState, LifeState
from backbone.errors import ReplyTimeout

ANSWER = ComponentState("backbone/x", "x", "base", 1, LifeState.READY, 0.0)


class Silence:
    """A bus on which questions time out after these times, and the question after them is answered."""

    def __init__(self, clock: VirtualClock, *took_s: float) -> None:
        self.clock, self.took_s, self.asked = clock, list(took_s), 0

    async def ask(self, *_question: Any, **_within: Any) -> Any:
        self.asked += 1
        if not self.took_s:
            return ANSWER
        await self.clock.sleep_s(self.took_s.pop(0))
        raise ReplyTimeout("no answer")


def asked(bus: Any, clock: VirtualClock, each_s: float, within_s: float) -> Any:
    return ask_until_answered(bus, clock, "backbone/x", AskState(), ComponentState, each_s=each_s, within_s=within_s)


def test_a_pause_of_the_asking_process_is_no_silence_of_the_receiver() -> None:
    async def scene() -> None:
        clock = VirtualClock()
        bus = Silence(clock, 30.0, 6.0)  # it was stopped for so long while it waited a second
        assert await asked(bus, clock, 1.0, 5.0) == ANSWER
        assert bus.asked == 3

    run_virtual(scene())


@given(st.floats(0.05, 3.0), st.floats(0.0, 20.0))
def test_a_silent_receiver_is_asked_for_the_time_stated(each_s: float, within_s: float) -> None:
    async def scene() -> None:
        clock = VirtualClock()
        bus = Silence(clock, *[each_s] * 10_000)
        with pytest.raises(ReplyTimeout):
            await asked(bus, clock, each_s, within_s)
        assert within_s - PAUSE_MOST_S <= clock.now_s() <= within_s + each_s

    run_virtual(scene())


@given(st.lists(st.floats(0.0, 1.0), max_size=4))
def test_an_answer_in_time_is_returned(took_s: list[float]) -> None:
    async def scene() -> None:
        clock = VirtualClock()
        bus = Silence(clock, *took_s)
        assert await asked(bus, clock, 1.0, 10.0) == ANSWER
        assert bus.asked == len(took_s) + 1

    run_virtual(scene())
