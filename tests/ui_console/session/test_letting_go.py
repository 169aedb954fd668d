"""After a stop, a grant or a loss a control that is still held moves nothing until it was let go and pressed anew."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from fake_resource_pool import FakePlacer
from held_robot import FORWARD, REPEAT_S, HeldRobot
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import VirtualClock, VirtualLoop
from resource_pool.arc_client import EmergencyStopped
from resource_pool.commands import Halt as ArcHalt
from resource_pool.messages import GiveCommand
from ui_console.model.driving import KEYS_LET_GO_S, STICK_LASTS_S, DeadMan, GiveWish, HaltWish, MoveWish
from ui_console.session.controls import LOOK_EVERY_S


@given(
    st.lists(
        st.tuples(st.sampled_from(["key", "stick", "let go", "require"]), st.floats(0.01, 0.8)),
        max_size=40,
    )
)
def test_a_press_counts_only_if_its_control_was_let_go_since_that_was_required(played: list[tuple[str, float]]) -> None:
    hand, now_s = DeadMan(), 0.0
    silence_s = {"key": KEYS_LET_GO_S, "stick": STICK_LASTS_S}
    until_s = dict.fromkeys(silence_s, -1.0)
    is_clean = dict.fromkeys(silence_s, True)  # let go since it was required last
    for what, pause_s in played:
        now_s += pause_s
        for control, end_s in until_s.items():
            is_clean[control] = is_clean[control] or now_s >= end_s
        match what:
            case "require":
                hand.require_let_go()
                is_clean = {control: now_s >= until_s[control] for control in until_s}
            case "let go":
                hand.stop()
                is_clean["stick"] = True
            case control:
                counts = hand.press(FORWARD, now_s, STICK_LASTS_S if control == "stick" else None)
                assert counts is is_clean[control]
                until_s[control] = now_s + silence_s[control]
        if not any(is_clean[control] and now_s < end_s for control, end_s in until_s.items()):
            assert not isinstance(hand.due(now_s), MoveWish)


def test_what_is_held_when_letting_go_is_required_halts_at_once() -> None:
    hand = DeadMan()
    hand.press(FORWARD, 0.0)
    assert hand.due(0.0) == FORWARD
    hand.require_let_go()
    assert hand.due(0.0) == HaltWish()
    assert hand.due(0.1) is None


def test_a_key_that_repeats_is_held_back_until_it_pauses() -> None:
    hand = DeadMan()
    hand.press(FORWARD, 0.0)
    hand.require_let_go()
    for repeat in range(1, 100):
        assert not hand.press(FORWARD, repeat * REPEAT_S)
        assert hand.is_held_back(repeat * REPEAT_S)
    last_s = 99 * REPEAT_S
    assert not hand.is_held_back(last_s + KEYS_LET_GO_S)
    assert hand.press(FORWARD, last_s + KEYS_LET_GO_S)
    assert hand.due(last_s + KEYS_LET_GO_S) == FORWARD


def test_a_key_whose_repeats_begin_as_late_as_on_x_was_not_let_go() -> None:
    """X11 waits 0.66 s before a key repeats, others half a second: that is no pause of a hand."""
    hand = DeadMan()
    hand.press(FORWARD, 0.0)
    hand.require_let_go()
    assert not hand.press(FORWARD, 0.66)


def test_a_stick_says_that_it_was_let_go_and_a_stop_key_does_not_say_it_for_keys() -> None:
    hand = DeadMan()
    hand.press(FORWARD, 0.0)
    hand.press(FORWARD, 0.0, STICK_LASTS_S)
    hand.require_let_go()
    assert not hand.press(FORWARD, 0.1, STICK_LASTS_S)
    hand.stop()
    assert not hand.press(FORWARD, 0.15)
    assert hand.press(FORWARD, 0.15, STICK_LASTS_S)


def test_a_jump_key_that_is_held_jumps_no_more_until_it_was_let_go() -> None:
    hand = DeadMan()
    assert [hand.press_once(n * REPEAT_S) for n in range(3)] == [True] * 3
    hand.require_let_go()
    assert not hand.press_once(3 * REPEAT_S)
    assert hand.press_once(3 * REPEAT_S + KEYS_LET_GO_S)


Scene = Callable[[HeldRobot], Awaitable[None]]


class StallingLoop(VirtualLoop):
    """The loop of a process that may stand still."""

    stood_s = 0.0

    def time(self) -> float:
        return super().time() + self.stood_s


def stand_still(for_s: float) -> None:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, StallingLoop)
    loop.stood_s += for_s


@pytest.fixture
def stage(local_mission: Any, beside: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network:
                placer = FakePlacer(network, VirtualClock(), {})
                on = HeldRobot(placer)
                try:
                    async with beside(on.console):
                        await on.held()
                        await scene(on)
                finally:
                    await on.rc.close()
                    await placer.close()

        with asyncio.Runner(loop_factory=StallingLoop) as runner:
            runner.run(main())

    return run


HANDS = [pytest.param(None, id="key"), pytest.param(STICK_LASTS_S, id="stick")]


@pytest.mark.parametrize("lasts_s", HANDS)
def test_after_a_lift_a_held_control_moves_nothing_until_it_is_pressed_anew(
    stage: Callable[[Scene], None], lasts_s: float | None
) -> None:
    async def scene(on: HeldRobot) -> None:
        await on.hold_key(1.0, lasts_s)
        assert on.drives()
        on.stop()
        await on.hold_key(1.0, lasts_s)
        on.arc.commands.clear()
        on.lift()
        await on.hold_key(2.0, lasts_s)
        assert not on.drives()
        assert on.model.own(on.clock.now_s()).must_let_go
        await on.clock.sleep_s(KEYS_LET_GO_S + 0.05)
        assert not on.model.own(on.clock.now_s()).must_let_go
        await on.hold_key(0.5, lasts_s)
        assert on.drives()
        assert {drive.after_stop for drive in on.drives()} == {on.latch.state.number}

    stage(scene)


@pytest.mark.parametrize("for_s", [0.2, 1.0, 60.0])
@pytest.mark.parametrize("lasts_s", HANDS)
def test_a_control_held_while_the_console_stands_still_was_not_let_go(
    stage: Callable[[Scene], None], lasts_s: float | None, for_s: float
) -> None:
    async def scene(on: HeldRobot) -> None:
        await on.hold_key(1.0, lasts_s)
        on.console.require_let_go()
        await on.hold_key(0.5, lasts_s)
        on.arc.commands.clear()
        for _time in range(3):
            stand_still(for_s)
            await on.hold_key(0.5, lasts_s)
        assert not on.drives()
        await on.clock.sleep_s(KEYS_LET_GO_S + LOOK_EVERY_S)
        await on.hold_key(0.5, lasts_s)
        assert on.drives()

    stage(scene)


@pytest.mark.parametrize("lasts_s", HANDS)
def test_a_stop_and_lift_nobody_told_of_are_learned_from_the_refusal_and_need_a_fresh_press_too(
    stage: Callable[[Scene], None], lasts_s: float | None
) -> None:
    async def scene(on: HeldRobot) -> None:
        await on.hold_key(1.0, lasts_s)
        on.arc.refusal = EmergencyStopped("scout1 was stopped", rc="scout1", number=4, is_stopped=True)
        await on.hold_key(0.3, lasts_s)
        on.arc.refusal = None
        on.arc.commands.clear()
        await on.hold_key(1.0, lasts_s)
        assert not on.drives()

    stage(scene)


@pytest.mark.parametrize("lasts_s", HANDS)
@pytest.mark.parametrize("change", ["loss and grant", "own stop", "dialog", "window left"])
def test_a_control_held_through_a_change_moves_nothing_until_it_is_pressed_anew(
    stage: Callable[[Scene], None], lasts_s: float | None, change: str
) -> None:
    async def scene(on: HeldRobot) -> None:
        await on.hold_key(1.0, lasts_s)
        match change:
            case "loss and grant":
                await on.arc.suspend("higher", "console-9", deadline_s=0.0)
                await on.hold_key(0.5, lasts_s)
                await on.arc.grant()
            case "own stop":
                assert await on.console.stop_robot("scout1")
                on.lift()
            case "dialog":
                on.console.require_let_go()
            case "window left":
                on.console.leave()
        on.arc.commands.clear()
        await on.hold_key(1.0, lasts_s)
        assert not on.drives()
        await on.clock.sleep_s(KEYS_LET_GO_S + 0.05)
        await on.hold_key(0.3, lasts_s)
        assert on.drives()

    stage(scene)


def test_stopping_twice_with_a_stick_held_does_not_count_as_letting_it_go(stage: Callable[[Scene], None]) -> None:
    async def scene(on: HeldRobot) -> None:
        await on.hold_key(0.5, STICK_LASTS_S)
        for _press in range(2):
            on.console.stop()  # screens stop the wheels by it as well
            await on.console.stop_robot("scout1")
            await on.hold_key(0.2, STICK_LASTS_S)
        on.arc.commands.clear()
        on.lift()
        await on.hold_key(1.0, STICK_LASTS_S)
        assert not on.drives()

    stage(scene)


def test_a_jump_key_held_through_a_stop_does_not_jump_after_the_lift(stage: Callable[[Scene], None]) -> None:
    async def scene(on: HeldRobot) -> None:
        for repeat in range(40):
            if repeat == 10:
                on.stop()
            if repeat == 20:
                on.arc.commands.clear()
                on.lift()
            on.console.give(GiveWish("jump"))
            await on.clock.sleep_s(REPEAT_S)
        assert not [command for _at_s, _epoch, command in on.arc.commands if isinstance(command, GiveCommand)]
        await on.clock.sleep_s(KEYS_LET_GO_S + 0.05)
        on.console.give(GiveWish("jump"))
        await on.clock.sleep_s(0.1)
        assert [type(command) for _at_s, _epoch, command in on.arc.commands][-1] is GiveCommand

    stage(scene)


def test_a_robot_that_was_stopped_and_freed_before_it_is_granted_is_driven_by_the_first_press(
    stage: Callable[[Scene], None],
) -> None:
    """An operator who takes the robot knows of the stop from the beginning, so that no second press is needed."""

    async def scene(on: HeldRobot) -> None:
        await on.console.give_back()
        on.latch.stop("ben", "", on.clock.now_s())
        on.latch.lift(on.latch.state.number, "ben", on.clock.now_s())
        on.console.take()
        await on.held()
        await on.hold_key(0.3)
        assert {drive.after_stop for drive in on.drives()} == {on.latch.state.number}
        assert on.drives()

    stage(scene)


def test_a_robot_that_does_not_answer_its_stop_gets_no_motion_from_the_console_that_stopped_it(
    stage: Callable[[Scene], None],
) -> None:
    """The stop was lost on a cut link and sent again half a second after it; the motion came before the stop."""

    async def scene(on: HeldRobot) -> None:
        away = on.placer.network.servers.pop("resource_pool/scout1")
        assert not await on.console.stop_robot("scout1", "a child")
        on.arc.commands.clear()
        await on.clock.sleep_s(KEYS_LET_GO_S + REPEAT_S)
        await on.hold_key(1.0)
        assert not await on.console.do(GiveWish("jump"))
        assert {type(command) for _at_s, _epoch, command in on.arc.commands} <= {ArcHalt}
        assert await on.console.do(HaltWish())
        on.placer.network.servers["resource_pool/scout1"] = away
        await on.clock.sleep_s(3.0)
        assert on.latch.state.is_stopped
        on.lift()
        await on.clock.sleep_s(KEYS_LET_GO_S + REPEAT_S)
        await on.hold_key(1.0)
        assert on.drives()

    stage(scene)


def test_a_second_stop_that_is_given_up_ends_no_repetition_of_the_first(stage: Callable[[Scene], None]) -> None:
    async def scene(on: HeldRobot) -> None:
        away = on.placer.network.servers.pop("resource_pool/scout1")
        assert not await on.console.stop_robot("scout1", "a child")
        second = asyncio.create_task(on.console.feed.stop_robots(["scout1"], "a child"))
        await on.clock.sleep_s(0.1)  # it is under way
        assert not second.done()
        second.cancel()
        with pytest.raises(asyncio.CancelledError):
            await second
        assert "scout1" in on.console.feed.unanswered
        on.placer.network.servers["resource_pool/scout1"] = away
        await on.clock.sleep_s(3.0)
        assert on.latch.state.is_stopped
        assert "scout1" not in on.console.feed.unanswered

    stage(scene)
