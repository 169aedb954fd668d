"""A decision process can say "not now" to the end of its slice, with an estimate, up to its maximum run time."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import pytest
from pool_on_local_network import Owner, Pool, a_pool

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.rc_manager.messages import Done, SetPriority, TraceLine
from backbone.wire import Envelope
from resource_pool.arc_client import ArcClient, SliceEnds

ROBOTS = ["scout1", "scout2", "radio"]
ASKED_BEFORE_S = 0.2


class Hesitant(Owner):
    """Answers as the test says when its slice is about to end."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.answers: Iterator[float] = iter(())
        self.asked: list[tuple[float, SliceEnds]] = []
        self.hangs_when_asked = False

    def know(self, arc: str) -> ArcClient:
        self.arcs[arc] = ArcClient(self.bus, arc, self, lambda: next(self.answers, 0.0))
        return self.arcs[arc]

    async def answer(self, asked: Envelope[Any]) -> Any:
        if isinstance(asked.body, SliceEnds):
            self.asked.append((self.clock.now_s(), asked.body))
            if self.hangs_when_asked:
                await self.clock.sleep_s(60.0)
        return await super().answer(asked)


class Play:
    """A pool with a hesitant owner that runs first, an equal that waits for the same robot, and what was traced."""

    def __init__(self, pool: Pool, hesitant: Hesitant, other: Owner) -> None:
        self.pool, self.hesitant, self.other = pool, hesitant, other
        self.lines: list[dict[str, Any]] = []
        pool.ear.subscribe(RC_MANAGER, Conversation.EVENTS, TraceLine, lambda said: self.lines.append(said.body.line))

    def times(self, event: str) -> list[float]:
        return [line["t"] for line in self.lines if line["ev"] == event and line.get("arc") == "hesitant-drive"]

    async def slice_s(self) -> float:
        """Return how long the first slice lasted, when it is over."""
        await self.pool.clock.sleep_s(12.0)
        return self.times("revoke")[0] - self.times("grant")[0]


@pytest.fixture
def play(local_mission: Any) -> Callable[..., None]:
    def run(scene: Callable[[Play], Awaitable[None]], *answers: float, **claim: Any) -> None:
        async def main() -> None:
            async with a_pool(local_mission, ROBOTS) as pool:
                hesitant = await pool.start(Hesitant, "hesitant", None, Subsystem.MISSION_CONTROL)
                hesitant.answers = iter(answers)
                other = await pool.owner("other")
                made = Play(pool, hesitant, other)
                given = {"maximum_runtime_s": 8.0, "may_say_not_now": True} | claim
                await pool.arc(hesitant, "drive", "scout1", **given)
                await pool.arc(other, "drive", "scout1")
                await scene(made)

        run_virtual(main())

    return run


def test_who_needs_a_second_more_gets_it_and_then_the_other_has_its_turn(play: Any) -> None:
    async def scene(now: Play) -> None:
        assert await now.slice_s() == pytest.approx(6.0, abs=0.05)
        assert now.other.heard()[0] == "Resumed"
        grant_s = now.times("grant")[0]
        asked_after_s = [at_s - grant_s for at_s, _ in now.hesitant.asked[:2]]
        assert asked_after_s == pytest.approx([5.0 - ASKED_BEFORE_S, 6.0 - ASKED_BEFORE_S], abs=0.05)
        assert now.hesitant.asked[0][1].most_s - grant_s == pytest.approx(8.0, abs=0.05)

    play(scene, 1.0)


@pytest.mark.parametrize("wanted_s", [1.0, 2.9, 100.0, math.inf, 1e-9])
def test_nobody_gets_more_than_its_maximum_run_time(play: Any, wanted_s: float) -> None:
    async def scene(now: Play) -> None:
        assert await now.slice_s() == pytest.approx(8.0, abs=0.05)
        assert len(now.hesitant.asked) <= (8.0 - 5.0) / ASKED_BEFORE_S + 1

    play(scene, *[wanted_s] * 100)


@pytest.mark.parametrize("answer", [0.0, -1.0, math.nan])
def test_who_needs_nothing_more_loses_no_time_and_is_asked_once(play: Any, answer: float) -> None:
    async def scene(now: Play) -> None:
        assert await now.slice_s() == pytest.approx(5.0, abs=0.05)
        assert [at_s for at_s, _ in now.hesitant.asked if at_s < now.times("revoke")[0]] == [now.hesitant.asked[0][0]]
        assert not now.times("extend")

    play(scene, answer, 1.0)


def test_who_has_no_time_to_spare_is_not_asked(play: Any) -> None:
    async def scene(now: Play) -> None:
        assert await now.slice_s() == pytest.approx(5.0, abs=0.05)
        assert now.hesitant.asked == []

    play(scene, 1.0, maximum_runtime_s=5.0)


def test_who_did_not_say_that_it_may_refuse_is_not_asked(play: Any) -> None:
    async def scene(now: Play) -> None:
        assert await now.slice_s() == pytest.approx(5.0, abs=0.05)
        assert now.hesitant.asked == []

    play(scene, 1.0, may_say_not_now=False)


def test_who_does_not_answer_in_time_has_said_nothing(play: Any) -> None:
    async def scene(now: Play) -> None:
        now.hesitant.hangs_when_asked = True
        assert await now.slice_s() == pytest.approx(5.0, abs=0.05)

    play(scene, 1.0)


def test_a_higher_one_overrides_all_the_same(play: Any) -> None:
    async def scene(now: Play) -> None:
        await now.pool.clock.sleep_s(6.0)
        await now.pool.ear.ask(RC_MANAGER, SetPriority("other", 9), Done, within_s=1)
        await now.pool.clock.sleep_s(0.3)
        [revoked_s] = now.times("revoke")
        assert revoked_s - now.times("grant")[0] == pytest.approx(6.0, abs=0.1)
        assert now.other.heard() == ["Resumed"]

    play(scene, 3.0)


def test_who_asked_for_more_time_itself_is_asked_before_that_ends(play: Any) -> None:
    async def scene(now: Play) -> None:
        arc = now.hesitant.arcs["hesitant-drive"]
        granted = await arc.wait_granted()
        await arc.want_longer(granted.until_s + 2.0)
        assert await now.slice_s() == pytest.approx(7.5, abs=0.1)
        assert now.hesitant.asked[0][0] == pytest.approx(granted.until_s + 2.0 - ASKED_BEFORE_S, abs=0.05)

    play(scene, 0.5)


def test_a_slice_that_was_made_longer_is_followed_by_one_of_the_usual_length(play: Any) -> None:
    async def scene(now: Play) -> None:
        await now.pool.clock.sleep_s(25.0)
        grants, revokes = now.times("grant"), now.times("revoke")
        lengths = [end_s - begin_s for begin_s, end_s in zip(grants, revokes, strict=False)]
        assert lengths[:2] == pytest.approx([6.5, 5.0], abs=0.05)

    play(scene, 1.5)


def test_who_always_hesitates_gets_longer_turns_but_not_more_of_them(play: Any) -> None:
    async def scene(now: Play) -> None:
        await now.pool.clock.sleep_s(40.0)
        turns = [name for name in ("hesitant", "other") for line in now.lines if _grants(line, f"{name}-drive")]
        assert abs(turns.count("hesitant") - turns.count("other")) <= 1

    play(scene, *[1.0] * 20)


def _grants(line: dict[str, Any], arc: str) -> bool:
    return line["ev"] == "grant" and line["arc"] == arc
