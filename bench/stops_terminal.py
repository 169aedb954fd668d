"""Consoles in a terminal, and scripts on a pipe, for the table of stops."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import time
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

import psutil
from measuring import BIN
from stops_link import Relay
from stops_pad import Pad
from stops_places import KINDS, OPERATOR, OWN_STOP, ROBOT, Gesture, Place
from stops_world import TURN, NotSeen, until

from ui_console.model.driving import KEYS_LET_GO_S

REPEAT_EVERY_S = 0.05  # chosen: about as fast as keyboards repeat
LET_GO_S = KEYS_LET_GO_S + 0.1  # a little more, because the terminal needs a moment to pass keys on
ESCAPE_S = 0.15  # chosen: a terminal distinguishes escape from the begin of another key by a pause
MOST_ESCAPES = 5
SHOWN_S = 0.5  # chosen: the effect of a key is drawn by then
SHOWN_WITHIN_S = 30.0
FRAMES = re.compile(r"[\u2500-\u259f].*")
CANNOT = r"NO LINK|CANNOT STOP|MAY NOT ARRIVE|no_answer"
"""Warnings of consoles that are cut off."""


class TriedConsole(ABC):
    """A console and its simulated hands."""

    def __init__(self, name: str, relay: Relay) -> None:
        self.name, self.kind, self.relay = name, KINDS[name], relay
        self._holding: asyncio.Task[None] | None = None
        self._let_go_s = 0.0
        self._frozen: list[int] = []

    async def drive(self) -> None:
        """Hold the driving keys down until ``let_go``; begin only after earlier keys count as released."""
        if self._holding is None:
            await asyncio.sleep(self._let_go_s + LET_GO_S - time.monotonic())
            self._holding = asyncio.create_task(self._hold(), name="a hand")

    async def let_go(self) -> None:
        """Release all keys."""
        holding, self._holding = self._holding, None
        if holding is not None:
            holding.cancel()
            await asyncio.wait({holding})
            await self._release()
            self._let_go_s = time.monotonic()

    async def aim(self, gestures: Sequence[Gesture]) -> None:  # noqa: B027  keys are found without looking
        """Prepare to give these stops while the console is frozen. Call it before freezing."""

    @abstractmethod
    async def take(self) -> None:
        """Go to the first screen and request the robot, if the console has not requested it."""

    @abstractmethod
    async def go(self, place: Place) -> None:
        """Open a place."""

    async def shows_meant(self, robot: str) -> None:  # noqa: B027  only a cursor in a terminal makes it another one
        """Return when the console shows that a stop of one robot concerns this robot."""

    @abstractmethod
    async def leave(self, place: Place) -> None:
        """Close the place."""

    @abstractmethod
    async def give(self, gesture: Gesture) -> float:
        """Give the stop; return its time, monotonic clock of this machine."""

    @abstractmethod
    async def says(self) -> str:
        """Return the console's text about its own state."""

    async def freeze(self) -> None:
        """Stop its processes."""
        self._frozen = await self._pids()
        for pid in self._frozen:
            os.kill(pid, signal.SIGSTOP)

    async def thaw(self) -> None:
        """Continue its processes."""
        for pid in self._frozen:
            os.kill(pid, signal.SIGCONT)

    @abstractmethod
    async def _pids(self) -> list[int]:
        """Return the processes whose stop freezes the console."""

    @abstractmethod
    async def _hold(self) -> None:
        """Hold the driving keys until cancelled."""

    async def _release(self) -> None:  # noqa: B027  keys are released by not being pressed any more
        """Release the keys that ``_hold`` held."""


class Terminal(TriedConsole):
    """A console in tmux."""

    def __init__(self, name: str, relay: Relay, folder: Path) -> None:
        super().__init__(name, relay)
        self._socket, self._pad, self._pid = folder / "tmux", Pad(folder), 0

    @property
    def _has_gamepad(self) -> bool:
        return "--gamepad" in self.kind.words

    @asynccontextmanager
    async def present(self, environment: dict[str, str], mission: str) -> AsyncIterator[Terminal]:
        """Run the console until the block ends."""
        program = self._pad.program() if self._has_gamepad else [str(BIN / "scout-console")]
        words = " ".join([*program, *self.kind.words, "--user", OPERATOR, "--mission", mission])
        columns, lines = self.kind.size
        size = ["-x", str(columns), "-y", str(lines)]
        given = [f"-e{name}={value}" for name, value in environment.items()]
        await self._tmux("new-session", "-d", *size, *given, f"{words}; cat")
        try:
            await self._shows(r"you hold|watching|waiting")
            shell = psutil.Process(int(await self._tmux("display-message", "-p", "#{pane_pid}")))
            [console] = shell.children()  # tmux continues its own child if that is stopped, but not the console
            self._pid = console.pid
            if self.name == "monitor":
                await self._press("BTab " * 3)  # the cursor begins at the timeline
                await self._shows(ROBOT)
                await self._press("] ]")  # and moves to the robot that is meant
                await self._shows(f"STOP {ROBOT}")
            yield self
        finally:
            await self.let_go()
            await self._tmux("kill-server")

    async def take(self) -> None:
        """See ``TriedConsole``."""
        if self.kind.drives and re.search(r"watching|hold no robot", await self._screen()):
            await self._press("Enter" if self.name == "pendant" else "t")

    async def go(self, place: Place) -> None:
        """See ``TriedConsole``."""
        if place.open and not place.of.startswith(("panel:", "action_bare")):
            await self._hold_no_key()
        if place.needs in ("stopped", OWN_STOP):
            await self._shows(f"STOPPED: {place.meant}(?!,)")
        for key in place.open.split():
            await self._press(key)
            if key == "i":
                await self._shows("─ parameters")
        if place.shows:
            await self._shows(place.shows)

    async def shows_meant(self, robot: str) -> None:
        """See ``TriedConsole``."""
        await self._shows(f"STOP {robot}")

    async def leave(self, place: Place) -> None:
        """See ``TriedConsole``."""
        await self._hold_no_key()
        for key in place.close.split():
            await self._press(key)
            await asyncio.sleep(ESCAPE_S if key == "Escape" else 0.0)
            if key == "Escape":
                await self._closed(place)

    async def give(self, gesture: Gesture) -> float:
        """See ``TriedConsole``."""
        at_s = time.monotonic()
        match gesture:
            case Gesture.ONE:
                await self._press("x")
            case Gesture.ALL:
                await self._press("X")
            case Gesture.PAD_ONE | Gesture.PAD_ALL:
                self._pad.stop(gesture)
            case _:
                raise ValueError(f"a terminal has no {gesture}")
        return at_s

    async def says(self) -> str:
        """See ``TriedConsole``."""
        lines = (await self._screen()).splitlines()
        return " / ".join(FRAMES.sub("", line).strip() for line in lines[:2])

    async def _pids(self) -> list[int]:
        return [self._pid]

    async def _hold_no_key(self) -> None:
        if not self._has_gamepad:
            await self.let_go()

    async def _hold(self) -> None:
        if self._has_gamepad:
            self._pad.turn()
            await asyncio.Event().wait()
        while True:
            await self._press("d")
            await asyncio.sleep(REPEAT_EVERY_S)

    async def _release(self) -> None:
        if self._has_gamepad:
            self._pad.let_go()

    async def _press(self, keys: str) -> None:
        if keys.split():
            await self._tmux("send-keys", *keys.split())

    async def _screen(self) -> str:
        return await self._tmux("capture-pane", "-p")

    async def _shows(self, pattern: str) -> None:
        async def is_shown() -> bool:
            return re.search(pattern, await self._screen()) is not None

        try:
            await until(is_shown, f"{pattern!r} on the screen", SHOWN_WITHIN_S)
        except NotSeen as error:
            raise NotSeen(f"{error}\n{await self._screen()}") from None

    async def _closed(self, place: Place) -> None:
        """Press escape again if a busy console took it for the begin of another key."""
        for _ in range(MOST_ESCAPES):
            if re.search(place.shows, await self._screen()) is None:
                return
            await asyncio.sleep(SHOWN_S)
            if re.search(place.shows, await self._screen()) is not None:
                await self._press("Escape")

    async def _tmux(self, *words: str) -> str:
        command = ["tmux", "-S", str(self._socket), "-f", "/dev/null", *words]
        environment = {**os.environ, "TERM": "xterm-256color"}
        pipe = asyncio.subprocess.PIPE
        done = await asyncio.create_subprocess_exec(*command, env=environment, stdout=pipe, stderr=pipe)
        return (await done.communicate())[0].decode()


class OfLines(TriedConsole):
    """A console whose output is lines of text."""

    def __init__(self, name: str, relay: Relay) -> None:
        super().__init__(name, relay)
        self._heard: list[str] = []
        self._process: asyncio.subprocess.Process | None = None
        self._reading: asyncio.Task[None] | None = None

    async def _begin(self, words: list[str], environment: dict[str, str]) -> None:
        """Run its program, with this environment besides our own."""
        pipe = asyncio.subprocess.PIPE
        self._process = await asyncio.create_subprocess_exec(
            *words, env={**os.environ, **environment}, stdin=pipe, stdout=pipe
        )
        self._reading = asyncio.create_task(self._read(self._process), name="the console's lines")

    async def _end(self) -> None:
        """Kill its program, if it runs."""
        process, self._process = self._process, None
        if process is None or self._reading is None:
            return
        if process.returncode is None:
            process.kill()
        await process.wait()
        await self._reading

    async def _pids(self) -> list[int]:
        assert self._process is not None
        return [self._process.pid]

    async def _read(self, process: asyncio.subprocess.Process) -> None:
        assert process.stdout is not None
        async for line in process.stdout:
            self._heard.append(line.decode().rstrip())


class Script(OfLines):
    """A console that reads lines from a pipe."""

    _command: tuple[list[str], dict[str, str]] = ([], {})

    @asynccontextmanager
    async def present(self, environment: dict[str, str], mission: str) -> AsyncIterator[Script]:
        """Run the console until the block ends."""
        words = [str(BIN / "scout-console"), *self.kind.words, "--user", "sam", "--mission", mission]
        self._command = words, environment
        try:
            yield self
        finally:
            await self.let_go()
            await self._end()

    async def take(self) -> None:
        """See ``TriedConsole``."""
        if self._process is None or self._process.returncode is not None:
            await self._end()
            await self._begin(*self._command)

    async def go(self, place: Place) -> None:
        """See ``TriedConsole``."""
        if place.of == "pause":
            await self.let_go()

    async def leave(self, place: Place) -> None:  # noqa: ARG002  a script has no screen
        """See ``TriedConsole``."""
        await self.let_go()

    async def give(self, gesture: Gesture) -> float:
        """See ``TriedConsole``."""
        self._heard.clear()
        at_s = time.monotonic()
        await self._write({"stop_all": True} if gesture is Gesture.ALL else {"stop_robot": ROBOT})
        return at_s

    async def says(self) -> str:
        """See ``TriedConsole``."""
        told = [json.loads(line) for line in self._heard]
        return "; ".join(
            " ".join(str(one[key]) for key in ("event", "code", "detail") if key in one) for one in told[-3:]
        )

    async def _hold(self) -> None:
        await self._write({"at_s": 0, "halt": True})
        await self._write({"at_s": 0, "left_rad_s": TURN.left_rad_s, "right_rad_s": TURN.right_rad_s})
        await asyncio.Event().wait()

    async def _release(self) -> None:
        await self._write({"at_s": 0, "halt": True})

    async def _write(self, line: dict[str, object]) -> None:
        process = self._process
        if process is not None and process.returncode is None and process.stdin is not None:
            process.stdin.write(json.dumps(line).encode() + b"\n")
            await process.stdin.drain()
