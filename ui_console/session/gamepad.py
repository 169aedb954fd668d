"""Driving by a gamepad: the stick counts only while the dead-man button is held.

``Stick`` is pure: events of the device go in, positions of the stick come out. ``play_gamepad`` is the loop around it.
The device is read through evdev, which is an extra (``pip install 'scout-backbone[gamepad]'``, Linux only).

A gamepad reports the release of a button. A gamepad that is held still reports nothing, so its last position counts
until the system reports that the gamepad is gone; the drive command is repeated every ``SAY_EVERY_S`` meanwhile.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable, Mapping
from enum import StrEnum
from typing import Protocol

from backbone.bus.interface import Clock
from backbone.errors import Refusal
from backbone.waiting import end_tasks, set_within
from ui_console.model.driving import STICK_LASTS_S

try:
    import evdev
except ImportError:  # an extra; few machines have it
    evdev = None

log = logging.getLogger(__name__)

EV_SYN, EV_KEY, EV_ABS = 0, 1, 3  # Linux, input-event-codes.h
SYN_DROPPED = 3
ABS_X, ABS_Y, ABS_HAT0X, ABS_HAT0Y = 0, 1, 16, 17
BTN_SOUTH, BTN_EAST, BTN_NORTH, BTN_WEST, BTN_TL, BTN_TR, BTN_SELECT, BTN_START = 304, 305, 307, 308, 310, 311, 314, 315
DEAD_MAN = frozenset({BTN_TL, BTN_TR})
STILL_ZONE = 0.12  # chosen: released sticks rest within a tenth of their middle
SAY_EVERY_S = 0.1  # chosen: a third of ``STICK_LASTS_S``; machine seconds
FIND_EVERY_S = 1.0  # chosen: finds a gamepad soon after it was switched on again


class PadWish(StrEnum):
    """Action of a button."""

    JUMP = "jump"
    TAKE = "take"
    RELEASE = "release"
    STOP_ROBOT = "stop_robot"
    STOP_ALL = "stop_all"
    NEXT_ROBOT = "next_robot"
    WATCH = "watch by itself"
    RETURN = "return by itself"


BUTTONS = {
    BTN_SOUTH: PadWish.JUMP,
    BTN_START: PadWish.TAKE,
    BTN_SELECT: PadWish.RELEASE,
    BTN_EAST: PadWish.STOP_ROBOT,
    BTN_NORTH: PadWish.STOP_ALL,  # both, because drivers do not agree which of them is the X and which the upper one
    BTN_WEST: PadWish.STOP_ALL,
}
CROSS = {
    (ABS_HAT0X, 1): PadWish.NEXT_ROBOT,
    (ABS_HAT0Y, -1): PadWish.WATCH,
    (ABS_HAT0Y, 1): PadWish.RETURN,
}
"""Axis of the cross and its value when it is pressed → action."""


class NoGamepad(Refusal):
    """No gamepad can be read on this machine."""

    code = "console.no_gamepad"
    remedy = "Plug one in, see that you may read /dev/input, and install it: pip install 'scout-backbone[gamepad]'."


class GamepadEvent(Protocol):
    """One event of the device."""

    type: int
    code: int
    value: int


class Gamepad(Protocol):
    """The used part of evdev's ``InputDevice``."""

    def async_read_loop(self) -> AsyncIterator[GamepadEvent]:
        """Yield its events; raise ``OSError`` when it is gone."""


FoundGamepad = tuple[Gamepad, Mapping[int, tuple[int, int]]]
"""An open gamepad, and the least and largest value of each axis of its stick."""


class Stick:
    """Turns events of the device into positions of the stick.

    Law: without the dead-man button the robot does not drive, in any position of the stick. If the kernel lost events,
    because this process did not read for a while, the button's release may be among them: it must be pressed again.

    Args:
        ranges: Axis → least and largest value.
    """

    def __init__(self, ranges: Mapping[int, tuple[int, int]]) -> None:
        self._ranges = ranges
        self._at = {ABS_X: 0.0, ABS_Y: 0.0}
        self._held: set[int] = set()

    def feel(self, event: GamepadEvent) -> PadWish | None:
        """Process an event; return the action of a button, or of the cross, that was just pressed."""
        if event.type == EV_ABS and (event.code, event.value) in CROSS:
            return CROSS[event.code, event.value]
        if event.type == EV_ABS and event.code in self._at and event.code in self._ranges:
            least, most = self._ranges[event.code]
            share = 2 * (event.value - least) / max(1, most - least) - 1
            self._at[event.code] = 0.0 if abs(share) < STILL_ZONE else min(max(share, -1.0), 1.0)
        elif event.type == EV_SYN and event.code == SYN_DROPPED:
            self._held.clear()
        elif event.type == EV_KEY and event.code in DEAD_MAN:
            if event.value:
                self._held.add(event.code)
            else:
                self._held.discard(event.code)
        elif event.type == EV_KEY and event.value == 1:
            return BUTTONS.get(event.code)
        return None

    def wanted(self) -> tuple[float, float] | None:
        """Return the present forward and right, each −1 to 1; None: the dead-man button is not held."""
        return (-self._at[ABS_Y], self._at[ABS_X]) if self._held else None


def find_gamepad() -> FoundGamepad:
    """Return the first gamepad of this machine.

    Raises:
        NoGamepad: There is no gamepad, or none can be read.
    """
    if evdev is None:
        raise NoGamepad("evdev is not installed")
    for path in evdev.list_devices():
        try:
            device = evdev.InputDevice(path)
            can = device.capabilities()
        except OSError:  # it was unplugged since it was listed
            continue
        axes = {code: (info.min, info.max) for code, info in can.get(EV_ABS, [])}
        if {ABS_X, ABS_Y} <= axes.keys() and DEAD_MAN & set(can.get(EV_KEY, [])):
            return device, axes
        device.close()
    raise NoGamepad("no device under /dev/input has a stick and a shoulder button")


async def wait_gamepad(clock: Clock, find: Callable[[], FoundGamepad]) -> FoundGamepad:
    """Wait until a gamepad is there, and return it; ``find`` is called in a thread."""
    while True:
        try:
            return await asyncio.to_thread(find)
        except NoGamepad:
            await clock.sleep_s(FIND_EVERY_S)


async def play_gamepad(
    device: Gamepad,
    stick: Stick,
    *,
    hold: Callable[[float, float, float], None],
    stop: Callable[[], None],
    wish: Callable[[PadWish], None],
) -> None:
    """Drive by the device until the device is gone or the task is cancelled; then stop the wheels.

    Args:
        stick: A new stick.
        hold: Called repeatedly while the dead-man button is held: forward, right, and the time a call counts.
        stop: Called when the button is released.
        wish: Called for each pressed button.
    """
    changed = asyncio.Event()

    async def feel() -> None:
        async for event in device.async_read_loop():
            asked = stick.feel(event)
            if asked is not None:
                wish(asked)
            changed.set()

    feeling = asyncio.create_task(feel(), name="gamepad")
    feeling.add_done_callback(lambda _feeling: changed.set())
    was_held = False
    try:
        while not feeling.done():
            drive = stick.wanted()
            if drive is not None:
                hold(*drive, STICK_LASTS_S)
            elif was_held:
                stop()
            was_held = drive is not None
            if await set_within(changed, SAY_EVERY_S if was_held else None):
                changed.clear()
        if (error := feeling.exception()) is not None:
            if not isinstance(error, OSError):
                raise error
            log.warning("the gamepad is gone: %s", error)
    finally:
        await end_tasks(feeling)
        if was_held:
            stop()


def buttons_help() -> list[str]:
    """Return the actions of the gamepad's buttons, for people."""
    names: dict[int, str] = {BTN_SOUTH: "A", BTN_EAST: "B", BTN_NORTH: "X", BTN_WEST: "Y"}
    names |= {BTN_SELECT: "select", BTN_START: "start"}
    return [
        "shoulder button held: the left stick drives",
        *(f"{names[code]}: {wish}" for code, wish in BUTTONS.items()),
        *(f"cross {way}: {wish}" for way, wish in zip(("right", "up", "down"), CROSS.values(), strict=True)),
    ]
