"""Drive commands of a person, and for how long a pressed key counts.

Rules of this file: no bus, no clock; times are seconds of the machine, for hands do not speed up
with the mission's clock.

A terminal reports each press of a key and its repeats while the key is held, never its release. So a command lasts for
a moment after the last press and ends by itself (dead-man).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ui_console.model.grip import Grip

FIRST_HOLD_S = 0.5  # chosen: bridges the pause of usual keyboards before they repeat; a press moves 0.5 s at most
KEYS_LET_GO_S = 0.7  # chosen: a longer pause than keyboards make before they repeat (X: 0.66 s), so a hand let go
REPEATED_HOLD_S = (0.15, FIRST_HOLD_S)  # chosen: bounds of the hold once the rhythm of the repeats is known
HOLD_INTERVALS = 3.0  # chosen: two lost repeats are bridged
REPEAT_EVERY_S = 0.1  # chosen: 10 Hz; commands end by themselves after 0.5 s at the robot


@dataclass(frozen=True, slots=True)
class DriveWish:
    """Turn the wheels at these speeds, rad/s, forward is positive."""

    left_rad_s: float
    right_rad_s: float


@dataclass(frozen=True, slots=True)
class HaltWish:
    """Stop the wheels."""


@dataclass(frozen=True, slots=True)
class JumpWish:
    """Jump once."""


@dataclass(frozen=True, slots=True)
class GiveBack:
    """Release the robot."""


@dataclass(frozen=True, slots=True)
class StopRobot:
    """Emergency stop of one robot, regardless of its holder."""

    robot: str
    reason: str = ""


@dataclass(frozen=True, slots=True)
class StopAll:
    """Emergency stop of all robots."""

    reason: str = ""


Command = DriveWish | HaltWish | JumpWish
COMMAND_WORDS: dict[type[Command], str] = {DriveWish: "drive", HaltWish: "halt", JumpWish: "jump"}
Wish = Command | GiveBack | StopRobot | StopAll

Direction = Literal["forward", "backward", "left", "right"]

STICK_LASTS_S = 0.3  # chosen: three times the interval at which sticks, pads and pages send their wish


def drive_by_stick(forward: float, right: float, speed_rad_s: float) -> DriveWish:
    """Return the wheel speeds for a stick or a drag pad.

    Args:
        forward: −1 (full backward) to 1 (full forward); beyond is clipped.
        right: −1 (full left) to 1 (full right).
        speed_rad_s: Of the wheels at full forward.

    Example:
        >>> drive_by_stick(1.0, 0.0, 4.0)
        DriveWish(left_rad_s=4.0, right_rad_s=4.0)
        >>> drive_by_stick(0.0, 1.0, 4.0)
        DriveWish(left_rad_s=2.0, right_rad_s=-2.0)
    """
    forward, right = min(max(forward, -1.0), 1.0), min(max(right, -1.0), 1.0)
    left_share, right_share = forward + right / 2, forward - right / 2
    most = max(1.0, abs(left_share), abs(right_share))
    return DriveWish(speed_rad_s * left_share / most, speed_rad_s * right_share / most)


def drive_towards(direction: Direction, speed_rad_s: float) -> DriveWish:
    """Return the wheel speeds for a direction key; turns are on the spot, at half the speed.

    Example:
        >>> drive_towards("left", 4.0)
        DriveWish(left_rad_s=-2.0, right_rad_s=2.0)
    """
    turn = speed_rad_s / 2
    match direction:
        case "forward":
            return DriveWish(speed_rad_s, speed_rad_s)
        case "backward":
            return DriveWish(-speed_rad_s, -speed_rad_s)
        case "left":
            return DriveWish(-turn, turn)
        case "right":
            return DriveWish(turn, -turn)


class DriveSpan:
    """Finds where one drive of an operator begins and ends among the commands that were applied.

    Laws: begin and end take turns, a begin first; only a drive begins one.
    """

    def __init__(self) -> None:
        self._began_s: float | None = None

    def begins(self, command: Command, at_s: float) -> bool:
        """Take in an applied command; return True if a drive begins with it."""
        if self._began_s is not None or not isinstance(command, DriveWish):
            return False
        self._began_s = at_s
        return True

    def ends(self, at_s: float) -> float | None:
        """End the drive: the wheels stand, or the robot is gone. Return its duration, seconds; None: there was none."""
        began_s, self._began_s = self._began_s, None
        return None if began_s is None else max(0.0, at_s - began_s)


class DeadMan:
    """Turns key presses into commands that repeat while a key is held, and one halt after it.

    Laws: a command is due only within the hold of a press; every drive is followed by a halt; from ``require_let_go``
    on a control that is held moves nothing until it was let go and pressed anew.
    """

    def __init__(self) -> None:
        self._held: DriveWish | None = None
        self._pressed_s = self._until_s = self._next_s = 0.0
        self._repeats = 0
        self._must_halt = False
        self._keys, self._stick, self._jump = Grip(), Grip(), Grip()

    # ------------------------------------------------------------------ controls
    def press(self, drive: DriveWish, now_s: float, lasts_s: float | None = None) -> bool:
        """Take in that a key is down, for the first time or again; return whether that counts.

        Args:
            drive: The command of the key.
            now_s: When.
            lasts_s: How long the press counts, for a control that reports repeatedly while it is held and reports its
                release; None: for a key, whose repeat rate is measured.
        """
        grip, silence_s = (self._keys, KEYS_LET_GO_S) if lasts_s is None else (self._stick, lasts_s)
        if not grip.press(now_s, silence_s):
            return False
        if lasts_s is not None:
            if self._held is None or now_s >= self._until_s:
                self._next_s = now_s
            self._repeats, hold_s = 0, lasts_s
        elif drive == self._held and now_s < self._until_s:
            self._repeats += 1
            least, most = REPEATED_HOLD_S
            rhythm_s = HOLD_INTERVALS * (now_s - self._pressed_s)
            hold_s = min(max(rhythm_s, least), most) if self._repeats >= 2 else FIRST_HOLD_S
        else:
            self._repeats, hold_s, self._next_s = 0, FIRST_HOLD_S, now_s
        self._held, self._pressed_s, self._until_s = drive, now_s, now_s + hold_s
        self._must_halt = False  # the new press replaces the halt, and ends with one
        return True

    def press_jump(self, now_s: float) -> bool:
        """Take in that the key for one jump is down, for the first time or again; return whether that counts."""
        return self._jump.press(now_s, KEYS_LET_GO_S)

    def stop(self) -> None:
        """Take in that all controls are released: a halt is due at once, also if none was held.

        A stick, pad or page reports its release by this call; keys show theirs by a pause.
        """
        self._held, self._must_halt = None, True
        self._stick.let_go()

    def require_let_go(self) -> None:
        """Ignore presses until the control was let go; the present drive ends with a halt."""
        self._must_halt = self._must_halt or self._held is not None
        self._held = None
        for grip in self._grips:
            grip.require_let_go()

    def is_held_back(self, now_s: float) -> bool:
        """Return whether a control is held that has to be let go before it moves anything."""
        return any(grip.is_held_back(now_s) for grip in self._grips)

    # ------------------------------------------------------------------ commands to send
    def due(self, now_s: float) -> DriveWish | HaltWish | None:
        """Return the command to send now, if one is due; asking counts as sending."""
        if self._held is not None and now_s >= self._until_s:
            self._held, self._must_halt = None, True
        if self._held is None:
            must_halt, self._must_halt = self._must_halt, False
            return HaltWish() if must_halt else None
        if now_s < self._next_s:
            return None
        self._next_s = now_s + REPEAT_EVERY_S
        return self._held

    @property
    def next_s(self) -> float | None:
        """When the next command is due; None: not before a press."""
        if self._must_halt:
            return 0.0
        return None if self._held is None else min(self._next_s, self._until_s)

    @property
    def let_go_s(self) -> float | None:
        """When every control that is held back counts as let go if it stays silent; None: none is held back."""
        return max((at_s for grip in self._grips if (at_s := grip.let_go_s) is not None), default=None)

    @property
    def _grips(self) -> tuple[Grip, Grip, Grip]:
        return self._keys, self._stick, self._jump
