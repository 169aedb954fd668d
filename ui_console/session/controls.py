"""The controls of one console: sends its operator's commands to the held robot, and shows their outcomes."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Awaitable
from typing import TYPE_CHECKING

from backbone.errors import LinkError, Refusal
from backbone.mission_log.operators import OperatorAction
from resource_pool.arc_client import EmergencyStopped
from ui_console.model.applied import command_line, values_line
from ui_console.model.driving import (
    Command,
    DeadMan,
    DriveSpan,
    DriveWish,
    GiveWish,
    HaltWish,
    Motion,
    MoveWish,
    word_of,
)
from ui_console.model.events import AbilitiesKnown, CommandApplied, LetGoNeeded, LinkTrouble, MomentBegan, failed

if TYPE_CHECKING:
    from resource_pool.arc_client import Applied, ArcClient
    from ui_console.model.arc_abilities import ArcAbilities
    from ui_console.session.observer import AnyObserver


LOOK_EVERY_S = 0.1  # chosen: a process that stands still for less than that loses no press


class Controls:
    """Sends commands while a robot is held, and shows the outcome of each."""

    def __init__(self, console: AnyObserver) -> None:
        self._console = console
        self._dead_man, self._span = DeadMan(), DriveSpan()
        self._pressed = asyncio.Event()
        self._is_held_back = False
        self._looks_s = math.inf
        self._arc: ArcClient | None = None
        self._is_on = False
        self.abilities: ArcAbilities | None = None
        """Abilities of the ARC; None: not known."""

    def connect(self, arc: ArcClient) -> None:
        """Send commands to this ARC from now on, as long as it is granted."""
        self._arc, self._is_on = arc, True

    def know(self, abilities: ArcAbilities | None) -> None:
        """Show the abilities of the ARC; None: not known."""
        self.abilities = abilities
        self._console.show(AbilitiesKnown(self._console.clock.now_s(), abilities))

    def switch_off(self) -> None:
        """Ignore keys until ``connect``, including held keys; single commands are still sent."""
        self.require_let_go()
        self._is_on = False

    def disconnect(self) -> None:
        """Send no commands from now on, because the console has no claim any more."""
        self.switch_off()
        self._arc = None

    def require_let_go(self) -> None:
        """Stop the wheels; a held control moves nothing until it was released and pressed again."""
        self._dead_man.require_let_go()
        self._pressed.set()
        self._console.show(MomentBegan(self._console.clock.now_s()))

    def hold(self, drive: Motion, lasts_s: float | None = None) -> bool:
        """Record that a drive key is down: the command repeats until the hold ends, then the wheels stop.

        Return whether that counts: not before a control that is held was let go.

        Args:
            drive: The command of the key.
            lasts_s: How long the press counts, machine seconds, for a control that repeats while held; None: as keys.
        """
        counts = self._dead_man.press(drive, self._press_s(), lasts_s)
        self._pressed.set()
        return counts

    def press_once(self, word: str) -> bool:
        """Record a press of the control for one command; return whether it counts, see ``DeadMan``."""
        if self.abilities is not None and not self.abilities.moves(word):
            return True
        counts = self._dead_man.press_once(self._press_s())
        self._pressed.set()
        return counts

    def stop(self) -> None:
        """Stop the wheels now; sticks, pads and pages report their release by this call."""
        self._dead_man.stop()
        self._pressed.set()

    async def run(self) -> None:
        """Send the commands of held controls while the robot is granted; until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            self._pressed.clear()
            self._show_held_back(self._press_s())
            command = self._dead_man.due(loop.time())
            if command is not None and self._is_on and self._arc is not None and self._arc.granted is not None:
                await self.do(command)
            try:
                async with asyncio.timeout_at(self._next_s()):
                    await self._pressed.wait()
            except TimeoutError:
                continue

    def _next_s(self) -> float | None:
        """Return the time of the next due command or look if no key is pressed; None: not before a press."""
        self._looks_s, let_go_s = math.inf, self._dead_man.let_go_s
        if self._is_held_back and let_go_s is not None:
            self._looks_s = min(asyncio.get_running_loop().time() + LOOK_EVERY_S, let_go_s)
        next_s = self._dead_man.next_s
        soonest_s = self._looks_s if next_s is None else min(next_s, self._looks_s)
        return soonest_s if soonest_s < math.inf else None

    def _press_s(self) -> float:
        """Return the time of a press; if this process comes late to it, it may have stood still beside a held key."""
        now_s = asyncio.get_running_loop().time()
        if now_s > self._looks_s:
            self._dead_man.stood_still(now_s - self._looks_s)
            self._looks_s = now_s
        return now_s

    def _show_held_back(self, loop_s: float) -> None:
        """Show the operator that a held control must be released, and that it was released."""
        is_held_back = self._dead_man.is_held_back(loop_s)
        if is_held_back is not self._is_held_back:
            self._is_held_back = is_held_back
            self._console.show(LetGoNeeded(self._console.clock.now_s(), is_held_back))

    async def do(self, command: Command) -> bool:
        """Send one command and show its outcome; return True if it was applied."""
        if self._arc is None:
            return False
        if self._moves_a_stopped_robot(self._arc, command):
            return False
        sending = self._sending(self._arc, command)
        if sending is None:
            return True
        show, now_s = self._console.show, self._console.clock.now_s
        wanted_s = time.perf_counter()
        try:
            applied = await sending
        except Refusal as refusal:
            if isinstance(refusal, EmergencyStopped):
                self.require_let_go()
            show(failed(now_s(), refusal))
            return False
        except LinkError as error:
            self.require_let_go()  # an operator with a cut link does not see the robot's next motions
            show(LinkTrouble(now_s(), str(error), word_of(command)))
            return False
        took_s = time.perf_counter() - wanted_s
        self._record_applied(command, applied)
        show(CommandApplied(applied.at_s, applied.rc, applied.epoch, applied.command, applied.values, took_s))
        return True

    def _moves_a_stopped_robot(self, arc: ArcClient, command: Command) -> bool:
        """Refuse motion of a robot that this console stopped, because the stop may reach the robot later."""
        robot = arc.granted.robot if arc.granted is not None else ""
        if robot not in self._console.feed.unanswered or not self._moves(command):
            return False
        self.require_let_go()
        stopped = EmergencyStopped(f"{robot} has not confirmed the stop from here yet", rc=robot, is_stopped=True)
        self._console.show(failed(self._console.clock.now_s(), stopped))
        return True

    def _moves(self, command: Command) -> bool:
        match command:
            case GiveWish(word):
                return self.abilities is None or self.abilities.moves(word)
            case HaltWish():
                return False
            case _:
                return True

    def _sending(self, arc: ArcClient, command: Command) -> Awaitable[Applied] | None:
        """Return the coroutine that sends a command; None: the ARC has no command to halt."""
        match command:
            case MoveWish(forward_m_s, turn_rad_s):
                return arc.move(forward_m_s, turn_rad_s)
            case DriveWish(left_rad_s, right_rad_s):
                return arc.drive(left_rad_s, right_rad_s)
            case GiveWish(word, values, role):
                return arc.give(word, values, role)
            case HaltWish() if self.abilities is None or self.abilities.can_halt:
                return arc.halt()
            case HaltWish():
                return None if self.abilities.reach is None else arc.move(0.0)

    def record_drive_end(self, robot: str, why: str = "") -> None:
        """Record the end of the present drive, if there is one."""
        took_s = self._span.ends(self._console.clock.now_s())
        if took_s is not None:
            detail = f"after {took_s:.1f} s{f', {why}' if why else ''}"
            self._console.acted(OperatorAction.DRIVE_END, robot, detail)

    def _record_applied(self, command: Command, applied: Applied) -> None:
        if self._span.begins(command, applied.at_s):
            self._console.acted(OperatorAction.DRIVE_BEGIN, applied.rc, values_line(applied.values))
        elif isinstance(command, GiveWish):
            self._console.acted(OperatorAction.COMMAND, applied.rc, command_line(command.word, applied.values))
        elif isinstance(command, HaltWish):
            self.record_drive_end(applied.rc)
