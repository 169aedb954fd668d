"""Drive commands of a person, and the time for which a key press counts.

Rules of this file: no bus, no clock; times are machine seconds, because hands do not follow the mission's clock.

A terminal reports each press of a key and its repeats while the key is held, but never its release. So a command lasts
for a moment after the last press and then ends by itself (dead-man's control).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from ui_console.model.arc_abilities import Reach
from ui_console.model.grip import ControlGrip
from ui_console.model.orders import Order

FIRST_HOLD_S = 0.5  # chosen: bridges the delay of usual keyboards before they repeat; a press moves 0.5 s at most
KEYS_LET_GO_S = 0.7  # chosen: longer than keyboards' delay before they repeat (X: 0.66 s), so the key was released
REPEATED_HOLD_S = (0.15, FIRST_HOLD_S)  # chosen: bounds of the hold once the rhythm of the repeats is known
HOLD_INTERVALS = 3.0  # chosen: two lost repeats are bridged
REPEAT_EVERY_S = 0.1  # chosen: 10 Hz
COMMAND_LASTS_S = 0.5  # as COMMAND_TIMEOUT_S of the resource pool: a robot halts by itself then


@dataclass(frozen=True, slots=True)
class MoveWish:
    """Move at these speeds; sent by stick, pad, keys and page for any body.

    Attributes:
        forward_m_s: Backward is negative.
        turn_rad_s: To the left; to the right is negative.
    """

    forward_m_s: float
    turn_rad_s: float


@dataclass(frozen=True, slots=True)
class DriveWish:
    """Turn the two wheels at these speeds, rad/s, forward is positive; for scripts."""

    left_rad_s: float
    right_rad_s: float


@dataclass(frozen=True, slots=True)
class HaltWish:
    """Stop all motion."""


@dataclass(frozen=True, slots=True)
class GiveWish:
    """Send the command that has this word.

    Attributes:
        word: Word that the ARC declares.
        values: Field → value; fields left out have their defaults.
        role: Role of the RC that obeys it; empty: the only one.
    """

    word: str
    values: Mapping[str, object] = field(default_factory=dict)
    role: str = ""


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


@dataclass(frozen=True, slots=True)
class OrderWish:
    """Order a robot to do a task by itself.

    Attributes:
        order: The order; without a robot it is for the one at the stick.
        until_done: The next line waits until the order is over and the stick has the robot again.
    """

    order: Order
    until_done: bool = False


Motion = MoveWish | DriveWish
Command = Motion | HaltWish | GiveWish
Wish = Command | GiveBack | StopRobot | StopAll | OrderWish

Direction = Literal["forward", "backward", "left", "right"]
DIRECTIONS: dict[Direction, tuple[float, float]] = {
    "forward": (1.0, 0.0),
    "backward": (-1.0, 0.0),
    "left": (0.0, -1.0),
    "right": (0.0, 1.0),
}
"""Direction of a key → forward and right, as of a stick."""

STICK_LASTS_S = 0.3  # chosen: three times the interval at which sticks, pads and pages send
SPEED, SPEED_LEAST, SPEED_MOST = 0.25, 0.05, 1.0  # chosen: shares of the largest speed; a quarter is walking speed
SPEED_STEP = 0.05  # chosen: 19 key presses from the slowest to the fastest


def word_of(command: Command) -> str:
    """Return the word of a command.

    Example:
        >>> word_of(HaltWish()), word_of(GiveWish("jump"))
        ('halt', 'jump')
    """
    match command:
        case MoveWish():
            return "move"
        case DriveWish():
            return "drive"
        case HaltWish():
            return "halt"
        case GiveWish(word=word):
            return word


def faster(speed: float, steps: int) -> float:
    """Return the speed changed by this number of steps, within its bounds.

    Example:
        >>> faster(0.25, 1), faster(0.25, -9)
        (0.3, 0.05)
    """
    return min(max(round(speed + steps * SPEED_STEP, 2), SPEED_LEAST), SPEED_MOST)


def move_by_stick(forward: float, right: float, speed: float, reach: Reach) -> MoveWish:
    """Return the motion for a stick, a drag pad or a direction key.

    Law: the shares of forward speed and of turn rate together are at most the speed, so neither wheel of a robot with
    two wheels turns faster than this share of its most. A turn on the spot uses half of it.

    Args:
        forward: −1 (full backward) to 1 (full forward); larger values are clipped.
        right: −1 (full left) to 1 (full right).
        speed: Share of the reach at full stick.
        reach: Of the body.

    Example:
        >>> move_by_stick(1.0, 0.0, 0.25, Reach(0.4, 6.0))
        MoveWish(forward_m_s=0.1, turn_rad_s=0.0)
        >>> move_by_stick(0.0, -1.0, 0.25, Reach(0.4, 6.0))
        MoveWish(forward_m_s=0.0, turn_rad_s=0.75)
    """
    forward, left = min(max(forward, -1.0), 1.0), min(max(-right, -1.0), 1.0) / 2
    share = speed / max(1.0, abs(forward) + abs(left))
    return MoveWish(share * reach.forward_m_s * forward, share * reach.turn_rad_s * left + 0.0)  # no negative zero


class DriveSpan:
    """Finds begin and end of an operator's drives among the applied commands.

    Laws: begin and end alternate, and a begin comes first; only a motion begins a drive. A drive ends at the latest
    when the robot halts by itself after the last motion.
    """

    def __init__(self) -> None:
        self._began_s: float | None = None
        self._moved_s = 0.0

    def begins(self, command: Command, at_s: float) -> bool:
        """Record an applied command; return True if a drive begins with it."""
        if not isinstance(command, Motion):
            return False
        self._moved_s = at_s
        if self._began_s is not None:
            return False
        self._began_s = at_s
        return True

    def ends(self, at_s: float) -> float | None:
        """End the drive: the wheels stand, or the robot is gone. Return its duration, seconds; None: no drive."""
        began_s, self._began_s = self._began_s, None
        return None if began_s is None else max(0.0, min(at_s, self._moved_s + COMMAND_LASTS_S) - began_s)


class DeadMan:
    """Turns key presses into commands that repeat while a key is held, and one halt after it.

    Laws: a command is due only within the hold of a press; every drive is followed by a halt; after ``require_let_go``
    a held control moves nothing until it was released and pressed again.
    """

    def __init__(self) -> None:
        self._held: Motion | None = None
        self._pressed_s = self._until_s = self._next_s = 0.0
        self._repeats = 0
        self._must_halt = False
        self._keys, self._stick, self._once = ControlGrip(), ControlGrip(), ControlGrip()

    def press(self, drive: Motion, now_s: float, lasts_s: float | None = None) -> bool:
        """Record that a key is down, for the first time or repeated; return whether the press counts.

        Args:
            drive: The command of the key.
            now_s: When.
            lasts_s: Time for which the press counts, for a control that reports repeatedly while held and reports its
                release; None: a key, whose repeat rate is measured.
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

    def press_once(self, now_s: float) -> bool:
        """Record a press of a control for a single command that moves the robot; return whether it counts."""
        return self._once.press(now_s, KEYS_LET_GO_S)

    def stop(self) -> None:
        """Record the release of all controls: a halt is due at once, even if no control was held.

        A stick, pad or page reports its release by this call; keys show theirs by a pause.
        """
        self._held, self._must_halt = None, True
        self._stick.let_go()

    def require_let_go(self) -> None:
        """Ignore presses until the control was released; the present drive ends with a halt."""
        self._must_halt = self._must_halt or self._held is not None
        self._held = None
        for grip in self._grips:
            grip.require_let_go()

    def stood_still(self, for_s: float) -> None:
        """Record that this process read no presses for this time, so it heard no release in it."""
        for grip in self._grips:
            grip.stood_still(for_s)

    def is_held_back(self, now_s: float) -> bool:
        """Return whether a held control must be released before it moves anything."""
        return any(grip.is_held_back(now_s) for grip in self._grips)

    def due(self, now_s: float) -> Motion | HaltWish | None:
        """Return the command to send now, if one is due; the returned command counts as sent."""
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
        """Time at which the next command is due; None: not before a press."""
        if self._must_halt:
            return 0.0
        return None if self._held is None else min(self._next_s, self._until_s)

    @property
    def let_go_s(self) -> float | None:
        """Time at which every held-back control counts as released without further presses; None: none is held back."""
        return max((at_s for grip in self._grips if (at_s := grip.let_go_s) is not None), default=None)

    @property
    def _grips(self) -> tuple[ControlGrip, ControlGrip, ControlGrip]:
        return self._keys, self._stick, self._once
