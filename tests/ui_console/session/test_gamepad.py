"""A stick drives only while the dead-man button is held, and a gamepad that is gone stops the wheels."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import run_virtual
from ui_console.model.driving import STICK_LASTS_S, DeadMan, MoveWish
from ui_console.session.gamepad import (
    ABS_X,
    ABS_Y,
    BTN_EAST,
    BTN_NORTH,
    BTN_SELECT,
    BTN_SOUTH,
    BTN_START,
    BTN_TL,
    BTN_TR,
    BTN_WEST,
    BUTTONS,
    CROSS,
    EV_ABS,
    EV_KEY,
    EV_SYN,
    SYN_DROPPED,
    NoGamepad,
    PadWish,
    Stick,
    buttons_help,
    find_gamepad,
    play_gamepad,
)

RANGES = {ABS_X: (-32768, 32767), ABS_Y: (-32768, 32767)}


@dataclass
class Said:
    type: int
    code: int
    value: int


EVENTS = st.one_of(
    st.builds(Said, st.just(EV_KEY), st.sampled_from([BTN_TL, BTN_TR, BTN_SOUTH, 999]), st.integers(0, 2)),
    st.builds(Said, st.just(EV_ABS), st.sampled_from([ABS_X, ABS_Y, 5]), st.integers(-40000, 40000)),
)


@given(st.lists(EVENTS, max_size=40))
def test_without_the_dead_man_button_nothing_drives_and_with_it_no_stick_exceeds_its_end(events: list[Said]) -> None:
    stick, held = Stick(RANGES), {BTN_TL: False, BTN_TR: False}
    for event in events:
        stick.feel(event)
        if event.type == EV_KEY and event.code in held:
            held[event.code] = bool(event.value)
        wanted = stick.wanted()
        assert (wanted is not None) == any(held.values())
        if wanted is not None:
            assert all(-1.0 <= share <= 1.0 for share in wanted)


@pytest.mark.parametrize(
    ("code", "wish"),
    [
        (BTN_SOUTH, PadWish.JUMP),
        (BTN_EAST, PadWish.STOP_ROBOT),
        (BTN_NORTH, PadWish.STOP_ALL),
        (BTN_WEST, PadWish.STOP_ALL),
        (BTN_START, PadWish.TAKE),
        (BTN_SELECT, PadWish.RELEASE),
    ],
)
def test_a_button_asks_once_when_it_is_pressed(code: int, wish: PadWish) -> None:
    stick = Stick(RANGES)
    assert [stick.feel(Said(EV_KEY, code, value)) for value in (1, 2, 0)] == [wish, None, None]


@pytest.mark.parametrize(("pressed", "wish"), CROSS.items())
def test_the_cross_asks_once_when_it_is_pressed(pressed: tuple[int, int], wish: PadWish) -> None:
    stick = Stick(RANGES)
    axis, value = pressed
    assert [stick.feel(Said(EV_ABS, axis, at)) for at in (value, 0)] == [wish, None]


def test_a_stick_that_rests_beside_its_middle_stands_still() -> None:
    stick = Stick(RANGES)
    for event in (Said(EV_KEY, BTN_TL, 1), Said(EV_ABS, ABS_Y, -2000), Said(EV_ABS, ABS_X, 3000)):
        stick.feel(event)
    assert stick.wanted() == (0.0, 0.0)


def test_up_is_forward_and_right_turns_right() -> None:
    stick = Stick(RANGES)
    for event in (Said(EV_KEY, BTN_TR, 1), Said(EV_ABS, ABS_Y, -32768)):
        stick.feel(event)
    assert stick.wanted() == (1.0, 0.0)
    stick.feel(Said(EV_ABS, ABS_X, 32767))
    assert stick.wanted() == (1.0, 1.0)


def test_after_lost_events_the_dead_man_button_must_be_pressed_again() -> None:
    """The kernel drops events that a paused process does not read, and the button's release with them."""
    stick = Stick(RANGES)
    for event in (Said(EV_KEY, BTN_TL, 1), Said(EV_ABS, ABS_Y, -32768), Said(EV_SYN, SYN_DROPPED, 0)):
        stick.feel(event)
    assert stick.wanted() is None
    stick.feel(Said(EV_ABS, ABS_Y, 0))
    assert stick.wanted() is None
    stick.feel(Said(EV_KEY, BTN_TL, 1))
    assert stick.wanted() == (0.0, 0.0)


class PlayedGamepad:
    """Yields the given events, then is unplugged, or hangs."""

    def __init__(self, script: list[tuple[float, Said]], *, unplugged: bool) -> None:
        self.script, self.unplugged = script, unplugged

    async def async_read_loop(self) -> AsyncIterator[Said]:
        for pause_s, event in self.script:
            await asyncio.sleep(pause_s)
            yield event
        if self.unplugged:
            raise OSError(19, "No such device")
        await asyncio.Event().wait()


def play(script: list[tuple[float, Said]], *, unplugged: bool, for_s: float) -> list[Any]:
    said: list[Any] = []

    async def main() -> None:
        device = PlayedGamepad(script, unplugged=unplugged)
        playing = asyncio.create_task(
            play_gamepad(
                device,
                Stick(RANGES),
                hold=lambda *held: said.append(held),
                stop=lambda: said.append("stop"),
                wish=said.append,
            )
        )
        await asyncio.sleep(for_s)
        assert playing.done() is unplugged
        playing.cancel()
        await asyncio.gather(playing, return_exceptions=True)

    run_virtual(main())
    return said


def test_what_is_held_is_said_again_until_it_is_let_go() -> None:
    held = [(0.0, Said(EV_ABS, ABS_Y, -32768)), (0.0, Said(EV_KEY, BTN_TL, 1)), (1.0, Said(EV_KEY, BTN_TL, 0))]
    said = play(held, unplugged=False, for_s=3.0)
    assert said[-1] == "stop"
    assert set(said[:-1]) == {(1.0, 0.0, STICK_LASTS_S)}
    assert 9 <= len(said[:-1]) <= 13


def test_a_shoulder_button_that_is_held_through_a_stop_drives_only_when_it_is_pressed_anew() -> None:
    async def main() -> None:
        loop, hand, driven_s = asyncio.get_running_loop(), DeadMan(), list[float]()
        script = [(0.0, Said(EV_ABS, ABS_Y, -32768)), (0.0, Said(EV_KEY, BTN_TL, 1)), (2.0, Said(EV_KEY, BTN_TL, 0))]
        device = PlayedGamepad([*script, (0.5, Said(EV_KEY, BTN_TL, 1))], unplugged=False)

        def hold(forward: float, right: float, lasts_s: float) -> None:
            if hand.press(MoveWish(forward, right), loop.time(), lasts_s):
                driven_s.append(loop.time())

        playing = asyncio.create_task(
            play_gamepad(device, Stick(RANGES), hold=hold, stop=hand.stop, wish=lambda wish: None)
        )
        await asyncio.sleep(1.0)
        hand.require_let_go()
        await asyncio.sleep(2.0)
        playing.cancel()
        await asyncio.gather(playing, return_exceptions=True)
        assert not [at_s for at_s in driven_s if 1.0 < at_s < 2.5 - 1e-6]
        assert [at_s for at_s in driven_s if at_s >= 2.5 - 1e-6]

    run_virtual(main())


def test_a_gamepad_that_is_gone_while_it_is_held_stops_the_wheels() -> None:
    said = play([(0.0, Said(EV_KEY, BTN_TL, 1)), (0.5, Said(EV_KEY, BTN_SOUTH, 1))], unplugged=True, for_s=3.0)
    assert said[-1] == "stop"
    assert PadWish.JUMP in said


class FoundDevice:
    """evdev's description of a device."""

    def __init__(self, path: str) -> None:
        self.path, self.is_closed = path, False

    def capabilities(self) -> dict[int, list[Any]]:
        if self.path == "unplugged":
            raise OSError(19, "No such device")
        axis = SimpleNamespace(min=0, max=255)
        if self.path == "mouse":
            return {EV_KEY: [272]}
        return {EV_KEY: [BTN_TL, BTN_SOUTH], EV_ABS: [(ABS_X, axis), (ABS_Y, axis)]}

    def close(self) -> None:
        self.is_closed = True


def test_the_first_device_with_a_stick_and_a_shoulder_button_is_the_gamepad(monkeypatch: pytest.MonkeyPatch) -> None:
    """A device that was unplugged since it was listed is left out."""
    evdev = SimpleNamespace(list_devices=lambda: ["mouse", "unplugged", "pad", "other pad"], InputDevice=FoundDevice)
    monkeypatch.setattr("ui_console.session.gamepad.evdev", evdev)
    device, ranges = find_gamepad()
    assert isinstance(device, FoundDevice)
    assert (device.path, ranges) == ("pad", {ABS_X: (0, 255), ABS_Y: (0, 255)})


@pytest.mark.parametrize("installed", [True, False])
def test_without_a_gamepad_or_the_extra_it_is_said_what_to_do(installed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    evdev = SimpleNamespace(list_devices=lambda: ["mouse"], InputDevice=FoundDevice) if installed else None
    monkeypatch.setattr("ui_console.session.gamepad.evdev", evdev)
    with pytest.raises(NoGamepad) as refusal:
        find_gamepad()
    assert "scout-backbone[gamepad]" in refusal.value.remedy


def test_the_help_names_every_button() -> None:
    assert len(buttons_help()) == 1 + len(BUTTONS) + len(CROSS)
