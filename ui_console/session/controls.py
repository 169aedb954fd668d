"""The controls of one console: what its operator's hands want, sent to the robot it holds, and what became of that."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any

from backbone.errors import LinkError, Refusal
from backbone.mission_log.operators import OperatorAction
from resource_pool.arc_client import EmergencyStopped
from ui_console.model.driving import Command, DeadMan, Drive, DriveSpan, Halt, Jump
from ui_console.model.events import CommandApplied, LetGoNeeded, LinkTrouble, MomentBegan, failed

if TYPE_CHECKING:
    from resource_pool.arc_client import Applied, ArcClient
    from ui_console.session.observer import Observer


class Controls:
    """Sends commands while a robot is held, and tells each one's fate.

    Args:
        console: Whose controls they are.
    """

    def __init__(self, console: Observer[Any]) -> None:
        self._console = console
        self._dead_man, self._span = DeadMan(), DriveSpan()
        self._pressed = asyncio.Event()
        self._is_held_back = False
        self._arc: ArcClient | None = None
        self._is_on = False

    # ------------------------------------------------------------------ the robot
    def connect(self, arc: ArcClient) -> None:
        """Commands go to this ARC from now on, as long as it is granted."""
        self._arc, self._is_on = arc, True

    def switch_off(self) -> None:
        """Keys mean nothing until ``connect``, also those that are held down; single commands still go."""
        self.require_let_go()
        self._is_on = False

    def disconnect(self) -> None:
        """Nothing is claimed any more: no command goes anywhere."""
        self.switch_off()
        self._arc = None

    def require_let_go(self) -> None:
        """From now on what is held moves nothing until it was let go and pressed anew; wheels that turn stop."""
        self._dead_man.require_let_go()
        self._pressed.set()
        self._console.show(MomentBegan(self._console.clock.now_s()))

    # ------------------------------------------------------------------ the hands
    def hold(self, drive: Drive, lasts_s: float | None = None) -> None:
        """A drive key is down: the command repeats until the hold ends, then the wheels stop.

        Args:
            drive: What the key stands for.
            lasts_s: How long that counts, machine seconds, for what says it again while it is held; None: as for keys.
        """
        self._dead_man.press(drive, asyncio.get_running_loop().time(), lasts_s)
        self._pressed.set()

    def press_jump(self) -> bool:
        """The key for one jump is down; return whether that counts."""
        counts = self._dead_man.press_jump(asyncio.get_running_loop().time())
        self._pressed.set()
        return counts

    def stop(self) -> None:
        """Stop the wheels now; sticks, pads and pages say by this that they were let go."""
        self._dead_man.stop()
        self._pressed.set()

    async def run(self) -> None:
        """Send what is held down while the robot is granted; until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            self._pressed.clear()
            self._tell_held_back(loop.time())
            command = self._dead_man.due(loop.time())
            if command is not None and self._is_on and self._arc is not None and self._arc.granted is not None:
                await self.do(command)
            try:
                async with asyncio.timeout_at(self._next_s()):
                    await self._pressed.wait()
            except TimeoutError:
                continue

    def _next_s(self) -> float | None:
        """Return when something is to be sent or told next, if nothing is pressed; None: not before a press."""
        times = [self._dead_man.next_s, self._dead_man.let_go_s if self._is_held_back else None]
        return min((at_s for at_s in times if at_s is not None), default=None)

    def _tell_held_back(self, loop_s: float) -> None:
        """Let the operator know when a control that is held has to be let go, and when it was."""
        is_held_back = self._dead_man.is_held_back(loop_s)
        if is_held_back is not self._is_held_back:
            self._is_held_back = is_held_back
            self._console.show(LetGoNeeded(self._console.clock.now_s(), is_held_back))

    async def do(self, command: Command) -> bool:
        """Have one command carried out and tell what became of it; return True if it was applied."""
        if self._arc is None:
            return False
        show, now_s = self._console.show, self._console.clock.now_s
        wanted_s = time.perf_counter()
        try:
            match command:
                case Drive(left_rad_s, right_rad_s):
                    applied = await self._arc.drive(left_rad_s, right_rad_s)
                case Halt():
                    applied = await self._arc.halt()
                case Jump():
                    applied = await self._arc.jump()
        except Refusal as refusal:
            if isinstance(refusal, EmergencyStopped):
                self.require_let_go()
            show(failed(now_s(), refusal))
            return False
        except LinkError as error:
            self.require_let_go()  # whoever is cut off for a moment does not see what the robot would do next
            show(LinkTrouble(now_s(), str(error), type(command).__name__.lower()))
            return False
        took_s = time.perf_counter() - wanted_s
        self._tell_applied(command, applied)
        show(CommandApplied(applied.at_s, applied.rc, applied.epoch, applied.command, applied.values, took_s))
        return True

    # ------------------------------------------------------------------ the record
    def tell_drive_ended(self, robot: str, why: str = "") -> None:
        """Keep that the drive that was going on, if any, ended."""
        took_s = self._span.ends(self._console.clock.now_s())
        if took_s is not None:
            detail = f"after {took_s:.1f} s{f', {why}' if why else ''}"
            self._console.acted(OperatorAction.DRIVE_END, robot, detail)

    def _tell_applied(self, command: Command, applied: Applied) -> None:
        if self._span.begins(command, applied.at_s):
            speeds = ", ".join(f"{name.partition('_')[0]} {value:+.1f}" for name, value in applied.values.items())
            self._console.acted(OperatorAction.DRIVE_BEGIN, applied.rc, f"{speeds} rad/s")
        elif isinstance(command, Jump):
            self._console.acted(OperatorAction.JUMP, applied.rc)
        elif isinstance(command, Halt):
            self.tell_drive_ended(applied.rc)
