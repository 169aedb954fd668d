"""An owner's wish on the local bus: what it says of a component that is away, comes back, or only seems to be away."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from backbone.addresses import PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus, Subscription
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import AskState, ComponentState, LifeState
from backbone.component.peer_monitor import GONE_AFTER_S
from backbone.placer.messages import AskPlacement, NotPlaced, Placement, Start, Started
from backbone.placer.wishes import COMPARE_EVERY_S, PAUSE_MOST_S, SLOW_START_S, Wish, keep_placed
from backbone.wire import Envelope, Message

ADDRESS = "resource_pool/grabber"
SETTLED_S = 0.3  # chosen: some events of the bus later


def serve_placer(bus: Bus) -> Subscription:
    """Let it believe that its creator restarts all missing components."""

    async def answer(asked: Envelope[Start | AskPlacement]) -> Message:
        if isinstance(asked.body, Start):
            return Started("grabber", "here", 1, [])
        return Placement("grabber", "framegrabber", "here", "backbone/launcher", 0.0, [])

    bus.serve(PLACER, Start | AskPlacement, answer)
    return bus.declare_alive(PLACER)


def serve_silent_placer(bus: Bus) -> None:
    """Let it start nothing and answer nothing."""

    async def never(_asked: Envelope[Start]) -> Message:
        await asyncio.Event().wait()
        raise AssertionError("waits for ever")

    bus.serve(PLACER, Start, never)


def serve_component(bus: Bus) -> None:
    async def answer(_asked: Envelope[AskState]) -> Message:
        return ComponentState(ADDRESS, "framegrabber", "here", 1, LifeState.READY, 0.0)

    bus.serve(ADDRESS, AskState, answer)


def run_kept(trial: Callable[[VirtualClock, Wish, Bus, Bus], Awaitable[None]]) -> None:
    """Run the trial with a wish, the placer's bus and the component's bus, while an owner keeps the wish."""

    async def main() -> None:
        clock, network, wish = VirtualClock(), LocalNetwork(), Wish("grabber", order_id="7")
        placer, owner, component = (network.join(at, clock) for at in (PLACER, "backbone/launcher", ADDRESS))
        keeping = asyncio.create_task(
            keep_placed(owner, clock, wish, lambda: Start("framegrabber", "grabber"), ADDRESS)
        )
        await trial(clock, wish, placer, component)
        keeping.cancel()
        await asyncio.wait({keeping})
        for bus in (placer, owner, component):
            await bus.close()

    run_virtual(main())


@pytest.mark.parametrize("away_s", [0.5, GONE_AFTER_S + 0.5, GONE_AFTER_S + PAUSE_MOST_S + 0.5, 30.0])
def test_what_is_back_is_no_longer_missed_however_long_it_was_away(away_s: float) -> None:
    async def trial(clock: VirtualClock, wish: Wish, placer: Bus, component: Bus) -> None:
        serve_placer(placer)
        life = component.declare_alive(ADDRESS)
        await clock.sleep_s(2.0)
        assert wish.absence() is None
        life.close()
        await clock.sleep_s(away_s)
        assert (wish.absence() is not None) is (away_s > GONE_AFTER_S)
        component.declare_alive(ADDRESS)
        await clock.sleep_s(SETTLED_S)
        assert wish.absence() is None

    run_kept(trial)


@pytest.mark.parametrize("is_placer_away", [False, True])
@pytest.mark.parametrize("is_token_lost", [False, True])
def test_what_is_back_is_no_longer_missed_though_tokens_are_lost(is_token_lost: bool, is_placer_away: bool) -> None:
    async def trial(clock: VirtualClock, wish: Wish, placer: Bus, component: Bus) -> None:
        lives = [component.declare_alive(ADDRESS), serve_placer(placer)]
        await clock.sleep_s(2.0)
        for life in lives if is_placer_away else lives[:1]:
            life.close()
        await clock.sleep_s(GONE_AFTER_S + SETTLED_S)
        assert wish.absence() is not None
        serve_component(component)
        if not is_token_lost:
            component.declare_alive(ADDRESS)
        await clock.sleep_s(PAUSE_MOST_S + GONE_AFTER_S + SETTLED_S)
        for _ in range(60):
            assert wish.absence() is None
            await clock.sleep_s(0.5)

    run_kept(trial)


def test_what_is_ready_is_not_missed_though_the_answer_to_its_start_is_lost() -> None:
    async def trial(clock: VirtualClock, wish: Wish, placer: Bus, component: Bus) -> None:
        serve_silent_placer(placer)
        await clock.sleep_s(SLOW_START_S + SETTLED_S)
        assert wish.absence() is not None
        serve_component(component)
        await clock.sleep_s(SLOW_START_S + SETTLED_S)
        assert wish.absence() is None

    run_kept(trial)


def test_all_orders_of_a_wish_have_one_id() -> None:
    """A placer that died together with the creator knows no id, and a behavior's memory is of one order."""

    async def trial(clock: VirtualClock, wish: Wish, placer: Bus, component: Bus) -> None:
        ids: list[str] = []

        async def lose(asked: Envelope[Start | AskPlacement]) -> Message:
            if isinstance(asked.body, Start):
                ids.append(asked.body.order_id)
                return Started("grabber", "here", 1, [])
            raise NotPlaced("grabber was not placed")

        placer.serve(PLACER, Start | AskPlacement, lose)
        placer.declare_alive(PLACER)
        component.declare_alive(ADDRESS)
        await clock.sleep_s(3 * COMPARE_EVERY_S)
        assert len(ids) > 1
        assert set(ids) == {"7"}

    run_kept(trial)


def test_an_absence_names_the_fault_in_one_line_without_the_end_of_the_log() -> None:
    """Health showed a traceback with its line ends as characters."""
    wish = Wish("watcher")
    told = 'watcher: exit code 1: KeyError: 3 (own.py, line 4)\nTraceback (most recent call last):\n  File "own.py"'
    wish.not_started(f"it was refused: {told}", 1.0)
    absence = wish.absence()
    assert absence is not None
    assert absence.cause == "it was refused: watcher: exit code 1: KeyError: 3 (own.py, line 4)"
