"""Driving by a script: one JSON object per line; its time since the grant says when it takes effect.

``{"at_s": 0.5, "forward_m_s": 0.1, "turn_rad_s": 1}`` moves until the next line, and so does ``{"at_s": 0.7,
"left_rad_s": 4, "right_rad_s": 4}`` by two wheels. ``{"at_s": 1, "halt": true}`` stops, ``{"at_s": 2, "give": "shine",
"values": {"brightness": 0.5}, "role": ""}`` gives any command of the ARC, ``"jump": true`` is short for one.
``{"at_s": 3, "order": "go_to", "x_m": 2, "y_m": 1, "until_done": true}`` gives the robot an order; with ``until_done``
the next line waits until the order is over. ``{"at_s": 3, "release": true}`` gives the robot back; the end of the
script releases too. ``{"stop_robot": "scout2", "reason": "a child"}`` and ``{"stop_all": true}`` are emergency stops;
without ``at_s`` they take effect as soon as they are read from a pipe, even before the grant.

Rules of this file: no bus, no clock, no files. Times are mission seconds since the grant.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import msgspec

from backbone.errors import Refusal
from ui_console.model.driving import (
    REPEAT_EVERY_S,
    DriveWish,
    GiveBack,
    GiveWish,
    HaltWish,
    Motion,
    MoveWish,
    OrderWish,
    StopAll,
    StopRobot,
    Wish,
)
from ui_console.model.orders import Order, OrderKind


class WrongScript(Refusal):
    """A line of the script cannot be carried out; facts: ``line``."""

    code = "script.line"
    remedy = (
        'Write one JSON object a line: {"at_s": 0.5, "forward_m_s": 0.1, "turn_rad_s": 1}, or with "left_rad_s" and '
        '"right_rad_s", or with "halt", "jump", "release" or "stop_all": true, or "give": COMMAND with its "values" '
        'and "role", or "order": KIND with "x_m", "y_m", "target", "robot" and "until_done", or "stop_robot": NAME; '
        "at_s never decreases."
    )


NO_ORDER = [None, None, "", "", False]


class _Line(msgspec.Struct, forbid_unknown_fields=True):
    at_s: float | None = None
    forward_m_s: float | None = None
    turn_rad_s: float | None = None
    left_rad_s: float | None = None
    right_rad_s: float | None = None
    halt: bool = False
    jump: bool = False
    give: str = ""
    values: dict[str, int | float | bool | str] = {}
    role: str = ""
    order: OrderKind | None = None
    x_m: float | None = None
    y_m: float | None = None
    target: str = ""
    robot: str = ""
    until_done: bool = False
    release: bool = False
    stop_robot: str = ""
    stop_all: bool = False
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Step:
    """A line of a script: a command, and the time since the grant at which it takes effect.

    Attributes:
        at_s: Time since the grant.
        at_once: True: read from a pipe, it takes effect immediately.
    """

    at_s: float
    wish: Wish
    at_once: bool = False


class ScriptReader:
    """Reads a script line by line, so that it can also come from a pipe while the robot drives."""

    def __init__(self) -> None:
        self._number, self._last_s, self._released = 0, 0.0, False

    def read(self, text: str) -> Step | None:
        """Return the step of the next line; None for an empty line.

        Raises:
            WrongScript: The line is not valid; the error has its number and fault.
        """
        self._number += 1
        if not text.strip():
            return None
        try:
            line = msgspec.json.decode(text, type=_Line)
        except msgspec.DecodeError as error:
            raise self._wrong(str(error)) from None
        wish, at_s = self._wish(line), self._last_s if line.at_s is None else line.at_s
        if line.at_s is None and not isinstance(wish, StopRobot | StopAll):
            raise self._wrong("at_s is missing")
        if not (math.isfinite(at_s) and at_s >= self._last_s):
            raise self._wrong(f"at_s {at_s:g} comes after {self._last_s:g}")
        if self._released:
            raise self._wrong("nothing can follow a release")
        self._last_s, self._released = at_s, isinstance(wish, GiveBack)
        return Step(at_s, wish, line.at_s is None)

    def _wish(self, line: _Line) -> Wish:
        moves = (line.forward_m_s, line.turn_rad_s) != (None, None)
        drives = (line.left_rad_s, line.right_rad_s) != (None, None)
        wished = [moves, drives, line.halt, line.jump, bool(line.give), line.release, bool(line.stop_robot)]
        if [*wished, line.stop_all, line.order is not None].count(True) != 1:
            can = (
                "forward_m_s and turn_rad_s, both wheel speeds, halt, jump, give, order, release, stop_robot, stop_all"
            )
            raise self._wrong(f"exactly one of: {can}")
        if (line.values or line.role) and not line.give:
            raise self._wrong("values and role belong to a command by give")
        if line.order is not None or [line.x_m, line.y_m, line.target, line.robot, line.until_done] != NO_ORDER:
            return self._order(line)
        if line.stop_robot:
            return StopRobot(line.stop_robot, line.reason)
        if line.stop_all:
            return StopAll(line.reason)
        if line.halt:
            return HaltWish()
        if line.jump or line.give:
            return GiveWish(line.give or "jump", line.values, line.role)
        if line.release:
            return GiveBack()
        return self._motion(line)

    def _order(self, line: _Line) -> OrderWish:
        if line.order is None:
            raise self._wrong("x_m, y_m, target, robot and until_done belong to an order")
        goes, follows = line.order is OrderKind.GO_TO, line.order is OrderKind.FOLLOW
        if (line.x_m is None or line.y_m is None) if goes else (line.x_m, line.y_m) != (None, None):
            raise self._wrong("x_m and y_m belong to go_to, both of them")
        if bool(line.target) is not follows:
            raise self._wrong("a target belongs to follow")
        x_m, y_m = line.x_m or 0.0, line.y_m or 0.0
        self._require_finite(x_m, y_m, "place")
        return OrderWish(Order(line.order, line.robot, x_m, y_m, line.target), line.until_done)

    def _motion(self, line: _Line) -> Motion:
        if (line.forward_m_s, line.turn_rad_s) != (None, None):
            move = MoveWish(line.forward_m_s or 0.0, line.turn_rad_s or 0.0)
            self._require_finite(move.forward_m_s, move.turn_rad_s, "speed")
            return move
        if line.left_rad_s is None or line.right_rad_s is None:
            raise self._wrong("left_rad_s and right_rad_s belong together")
        self._require_finite(line.left_rad_s, line.right_rad_s, "wheel speed")
        return DriveWish(line.left_rad_s, line.right_rad_s)

    def _require_finite(self, one: float, other: float, what: str) -> None:
        if not (math.isfinite(one) and math.isfinite(other)):
            raise self._wrong(f"a {what} is not finite")

    def _wrong(self, what: str) -> WrongScript:
        return WrongScript(f"script line {self._number}: {what}", line=self._number)


def read_script(text: str) -> list[Step]:
    """Return all steps of a script.

    Raises:
        WrongScript: A line is not valid; the first such line is reported.

    Example:
        >>> read_script('{"at_s": 0, "halt": true}')
        [Step(at_s=0.0, wish=HaltWish(), at_once=False)]
    """
    reader = ScriptReader()
    return [step for line in text.splitlines() if (step := reader.read(line)) is not None]


class ScriptPlayer:
    """Turns steps and time into commands.

    Laws: no command is due before its time. A motion is repeated until the next line, because commands expire at the
    robot. ``GiveBack`` comes exactly once and last. After ``require_let_go`` no command that moves the robot is due
    before a halt; in a script, a halt stands for the release of a control. No command is due between an order for which
    the script waits and ``order_over``.

    Args:
        steps: The whole script; None: steps are added later.
        moves: Returns whether the command with this word moves the robot; None: all commands do.
    """

    def __init__(self, steps: list[Step] | None = None, moves: Callable[[str], bool] | None = None) -> None:
        self._moves = moves or (lambda _word: True)
        self._steps = deque(steps or [])
        self._ended = steps is not None
        self._drive: Motion | None = None
        self._next_s = 0.0
        self.must_let_go = False
        self.waits = False
        """True while the script waits for the end of an order."""
        self.is_over = False
        """True when the robot must be or was given back."""
        self.held_back = 0
        """Number of lines skipped because no halt preceded them."""

    def require_let_go(self) -> None:
        """Ignore commands that move the robot until a line halts."""
        self._drive, self.must_let_go = None, True

    def order_over(self) -> None:
        """Continue, because the order for which the script waits is over."""
        self.waits = False

    def add(self, step: Step) -> None:
        """Add a step; a step whose time has passed is due at once."""
        self._steps.append(step)

    def end(self) -> None:
        """Record that no step will follow."""
        self._ended = True

    def due(self, since_grant_s: float) -> list[Wish]:
        """Return the commands to send now, in order; returned commands count as sent.

        Args:
            since_grant_s: Mission seconds since the grant.
        """
        wishes: list[Wish] = []
        while self._steps and self._steps[0].at_s <= since_grant_s and not (self.is_over or self.waits):
            wish = self._steps.popleft().wish
            self.must_let_go = self.must_let_go and not isinstance(wish, HaltWish)
            if self.must_let_go and self._is_motion(wish):
                self.held_back += 1
                continue
            self.is_over = isinstance(wish, GiveBack)
            self.waits = isinstance(wish, OrderWish) and wish.until_done
            if isinstance(wish, Motion | HaltWish | GiveBack | OrderWish):
                self._drive = wish if isinstance(wish, Motion) else None
            self._next_s = since_grant_s + REPEAT_EVERY_S
            wishes.append(wish)
        if self._ended and not self._steps and not (self.is_over or self.waits):
            self.is_over = True
            wishes.append(GiveBack())
        if not wishes and self._drive is not None and since_grant_s >= self._next_s:
            self._next_s = since_grant_s + REPEAT_EVERY_S
            wishes.append(self._drive)
        return wishes

    def _is_motion(self, wish: Wish) -> bool:
        return isinstance(wish, Motion | OrderWish) or (isinstance(wish, GiveWish) and self._moves(wish.word))

    @property
    def next_s(self) -> float | None:
        """Seconds since the grant at which the next command is due; None: not before another step arrives."""
        if self.is_over or self.waits:
            return None
        times = [self._steps[0].at_s] if self._steps else [0.0] if self._ended else []
        if self._drive is not None:
            times.append(self._next_s)
        return min(times, default=None)
