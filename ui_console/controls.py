"""The controls of one console: what its operator's hands want, sent to the robot it holds, and what became of that."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any

from backbone.errors import LinkError, Refusal, code_of
from backbone.operators import OperatorAction
from ui_console.console_events import CommandApplied, CommandRefused, LinkTrouble
from ui_console.driving import Command, DeadMan, Drive, DriveSpan, Halt, Jump

if TYPE_CHECKING:
    from resource_pool.arc_client import Applied, ArcClient
    from ui_console.observer import Observer


class Controls:
    """Sends commands while a robot is held, and tells each one's fate.

    Args:
        console: Whose controls they are.
    """

    def __init__(self, console: Observer[Any]) -> None:
        self._console = console
        self._dead_man, self._span = DeadMan(), DriveSpan()
        self._pressed = asyncio.Event()
        self._arc: ArcClient | None = None
        self._is_on = False

    # ------------------------------------------------------------------ the robot
    def connect(self, arc: ArcClient) -> None:
        """Commands go to this ARC from now on, as long as it is granted."""
        self._arc, self._is_on = arc, True

    def switch_off(self) -> None:
        """Keys mean nothing until ``connect``, also those that are held down; single commands still go."""
        self.release()
        self._is_on = False

    def disconnect(self) -> None:
        """Nothing is claimed any more: no command goes anywhere."""
        self.switch_off()
        self._arc = None

    def release(self) -> None:
        """Forget what is held down; whoever takes the robot away has stopped it."""
        self._dead_man = DeadMan()

    # ------------------------------------------------------------------ the hands
    def hold(self, drive: Drive, lasts_s: float | None = None) -> None:
        """A drive key is down: the command repeats until the hold ends, then the wheels stop.

        Args:
            drive: What the key stands for.
            lasts_s: How long that counts, machine seconds, for what says it again while it is held; None: as for keys.
        """
        self._dead_man.press(drive, asyncio.get_running_loop().time(), lasts_s)
        self._pressed.set()

    def stop(self) -> None:
        """Stop the wheels now."""
        self._dead_man.stop()
        self._pressed.set()

    async def run(self) -> None:
        """Send what is held down while the robot is granted; until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            self._pressed.clear()
            command = self._dead_man.due(loop.time())
            if command is not None and self._is_on and self._arc is not None and self._arc.granted is not None:
                await self.do(command)
            try:
                async with asyncio.timeout_at(self._dead_man.next_s):
                    await self._pressed.wait()
            except TimeoutError:
                continue

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
            show(CommandRefused(now_s(), code_of(refusal), refusal.detail, refusal.remedy))
            return False
        except LinkError as error:
            show(LinkTrouble(now_s(), str(error)))
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
