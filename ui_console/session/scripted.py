"""Driving without a screen: a script goes in, JSON lines come out."""

from __future__ import annotations

import asyncio
import contextlib
import os
import selectors
import threading
from collections.abc import Callable

from backbone.addresses import RC_MANAGER
from backbone.errors import LinkError, Refusal
from backbone.launcher.endings import ExitCode
from backbone.picture.words import UNDECIDED
from backbone.rc_manager.messages import AskWhy, StaleEpoch
from backbone.scheduling.views import Why
from backbone.waiting import set_within
from resource_pool.arc_client import EmergencyStopped, StopState, Suspended, SwappedOut
from ui_console.model import events
from ui_console.model.driving import Command, GiveBack, GiveWish, HaltWish, Motion, OrderWish, StopAll, StopRobot
from ui_console.model.orders import OrderState
from ui_console.model.script import ScriptPlayer, ScriptReader, Step, WrongScript
from ui_console.session.feed import REPLY_TIME_S
from ui_console.session.teleoperation import Teleoperation

INSTANT_S = 1e-9  # chosen: far above the rounding of mission times
READ_BYTES = 65536
TOLD_AFTER_S = 1.0  # chosen: a grant for which no other ARC has to end its slice is there by then
_FOR_SCREENS_ONLY = (
    events.Asked,
    events.AbilitiesKnown,
    events.HoldConfirmed,
    events.MomentBegan,
    events.PictureSeen,
    events.TurnedTo,
)


class ScriptDriver:
    """Plays one script on one console.

    Args:
        write: Called with each line of JSON, without its end; must write it at once.
        steps: The whole script; None: steps arrive by ``feed``.
        within_s: Longest wait for the grant, mission seconds; 0: no limit.
    """

    def __init__(
        self, write: Callable[[bytes], None], steps: list[Step] | None = None, *, within_s: float = 0.0
    ) -> None:
        self._write, self._within_s = write, within_s
        self._player = ScriptPlayer(steps, self._moves)
        self._reader = ScriptReader()
        self._news = asyncio.Event()
        self._granted = self._failed = False
        self._wrong: WrongScript | None = None
        self._console: Teleoperation | None = None
        self._stops: list[StopRobot | StopAll] = []
        self._stopping: set[asyncio.Task[None]] = set()
        self._stopped = self._is_unanswered = self._order_is_over = False
        self._awaited = 0

    def show(self, event: events.ConsoleEvent) -> None:
        """Write the event if it is one for scripts; unanswered commands make one line until an answer arrives."""
        if isinstance(event, _FOR_SCREENS_ONLY) or self._is_repeated(event):
            return
        said = events.said(event)
        if isinstance(said, Suspended) and said.reason in UNDECIDED:
            self._player.require_let_go()
        if isinstance(said, StopState) and (said.is_stopped or self._stopped):
            self._stopped = said.is_stopped
            self._player.require_let_go()
        if isinstance(event, events.CommandRefused) and event.code == EmergencyStopped.code:
            self._player.require_let_go()
        if isinstance(event, events.CommandRefused) and event.code not in (SwappedOut.code, StaleEpoch.code):
            self._failed = True
        self._follow_order(event)
        self._write(events.event_json(event))

    def _follow_order(self, event: events.ConsoleEvent) -> None:
        """Follow the order for which the script waits: the script continues when the stick has the robot again."""
        if isinstance(event, events.OrderChanged):
            self._failed = self._failed or event.given.state is OrderState.FAILED
            is_awaited = event.given.number == self._awaited
            self._order_is_over = self._order_is_over or (is_awaited and event.given.state.is_final)
        is_held = self._console is not None and self._console.is_held
        is_refused = isinstance(event, events.CommandRefused) and event.ends_claim
        if self._order_is_over and (is_held or is_refused):
            self._order_is_over = False
            self._player.order_over()
            self._news.set()

    @property
    def must_halt(self) -> bool:
        """Whether commands that move the robot are ignored until a line halts."""
        return self._player.must_let_go

    def _moves(self, word: str) -> bool:
        """Return whether a command moves the robot; True while that is not known."""
        abilities = self._console.arc_abilities if self._console is not None else None
        return abilities is None or abilities.moves(word)

    def _is_repeated(self, event: events.ConsoleEvent) -> bool:
        """Track missing answers; return True for a missing answer that follows another one."""
        if isinstance(event, events.LinkTrouble) and event.command:
            was_unanswered, self._is_unanswered = self._is_unanswered, True
            return was_unanswered
        if isinstance(events.said(event), events.CommandApplied | events.Granted | Suspended):
            self._is_unanswered = False
        return False

    def feed(self, line: str | None) -> None:
        """Read the next line of the script; None: its end. A wrong line ends the script."""
        if self._wrong is None:
            try:
                step = None if line is None else self._reader.read(line)
            except WrongScript as wrong:
                self._wrong, step, line = wrong, None, None
            if step is not None and step.at_once and isinstance(step.wish, StopRobot | StopAll):
                self._stops.append(step.wish)
                self._begin_stops()
            elif step is not None:
                self._player.add(step)
            if line is None:
                self._player.end()
            self._news.set()

    def cut(self, error: OSError) -> None:
        """End the script, because its further lines cannot be read: no line could halt the robot any more."""
        if self._wrong is None:
            detail = f"the script cannot be read to its end: {error.strerror or error}"
            self._wrong = WrongScript(detail, remedy="Keep its pipe or terminal readable, or give it as a file.")
            self._player.end()
            self._news.set()

    async def drive(self, console: Teleoperation) -> None:
        """Wait for the grant, play the script to its end, give the robot back; then no stop is under way."""
        self._console = console
        self._begin_stops()
        await self._play_when_granted(console)
        while self._stopping:
            await asyncio.wait(self._stopping)

    async def _play_when_granted(self, console: Teleoperation) -> None:
        telling = console.start_task(self._tell_why_it_waits(console), "why")
        try:
            async with asyncio.timeout(self._within_s / console.clock.rate if self._within_s else None):
                await console.wait_granted()
        except TimeoutError:
            self._failed = True
            detail = f"not granted within {self._within_s:g} s"
            remedy = "Ask 'scout-backbone why' for the reason, use a higher --priority, or wait longer."
            now_s = console.clock.now_s()
            self._write(events.event_json(events.CommandRefused(now_s, "console.not_granted", detail, remedy)))
            await console.give_back("not granted in time")
            return
        except Refusal:
            return
        finally:
            telling.cancel()
        self._granted = True
        await self._play(console, console.clock.now_s())

    def exit_code(self, console: Teleoperation) -> int:
        """Return the command's exit code: 0 only if the robot was granted and given back cleanly."""
        if self._wrong is not None:
            return ExitCode.USAGE
        if console.refusal is not None or self._failed or self._player.held_back:
            return ExitCode.REFUSED
        return ExitCode.DONE if self._granted and console.given_back else ExitCode.NO_BACKBONE

    async def _tell_why_it_waits(self, console: Teleoperation) -> None:
        """Write why the claim waits, once, unless it is granted soon."""
        await console.clock.sleep_s(TOLD_AFTER_S)
        try:
            why = await console.bus.ask(
                RC_MANAGER, AskWhy(console.parameters.arc(console.bus)), Why, within_s=REPLY_TIME_S
            )
        except (LinkError, Refusal):  # no request is there yet, or its reasons cannot be asked for
            return
        self._write(events.event_json(events.Heard(console.clock.now_s(), why)))

    async def _play(self, console: Teleoperation, granted_s: float) -> None:
        clock = console.clock
        while True:
            self._news.clear()
            since_s, next_s = clock.now_s() - granted_s, self._player.next_s
            if next_s is not None and abs(since_s - next_s) < INSTANT_S:
                since_s = next_s  # the step is due now, regardless of rounding
            for wish in self._player.due(since_s):
                if isinstance(wish, Command):
                    console.interrupt()
                match wish:
                    case GiveBack():
                        if self._wrong is not None:
                            self._write(events.event_json(events.failed(clock.now_s(), self._wrong)))
                        await console.give_back("the script is over")
                        return
                    case StopRobot() | StopAll():
                        await self._stop(console, wish)
                    case OrderWish(order, until_done):
                        [number] = console.order_group([order])
                        self._awaited = number if until_done else 0
                    case GiveWish():
                        await console.do(wish)
                    case HaltWish() if console.is_held:
                        await console.do(wish)
                    case _ if isinstance(wish, Motion) and console.is_held:
                        await console.do(wish)
            await self._wait_news(console, granted_s)

    def _begin_stops(self) -> None:
        """Carry out the immediate emergency stops, if the console is ready."""
        if self._console is None or not self._console.is_ready:
            return
        stops, self._stops = self._stops, []
        for stop in stops:
            task = self._console.start_task(self._stop(self._console, stop), "stop")
            self._stopping.add(task)
            task.add_done_callback(self._stopping.discard)

    async def _stop(self, console: Teleoperation, stop: StopRobot | StopAll) -> None:
        """Stop one robot or all; if a robot does not confirm its stop, the script shows that and fails."""
        if isinstance(stop, StopRobot):
            is_sure = await console.stop_robot(stop.robot, stop.reason)
        else:
            is_sure = not await console.stop_all(stop.reason)
        self._failed = self._failed or not is_sure

    async def _wait_news(self, console: Teleoperation, granted_s: float) -> None:
        """Wait until the next step is due or another one has arrived."""
        next_s = self._player.next_s
        wait_s = None
        if next_s is not None:
            wait_s = max(0.0, granted_s + next_s - console.clock.now_s()) / console.clock.rate
        await set_within(self._news, wait_s)


def feed_from(descriptor: int, feed: Callable[[str | None], None], cut: Callable[[OSError], None]) -> None:
    """Call ``feed`` in this event loop with each line read from a file descriptor, then with None.

    The reading thread ends with the process, so an open pipe delays nothing.

    Args:
        descriptor: Of a pipe, a terminal or a file; it may be non-blocking.
        feed: Called with each line, then with None.
        cut: Called instead of the last call of ``feed`` if the system refuses to read on.
    """
    loop = asyncio.get_running_loop()

    def hand_over(act: Callable[..., None], *said: object) -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed: the script is over
            loop.call_soon_threadsafe(act, *said)

    def read() -> None:
        rest = b""
        while chunk := _read_when_ready(descriptor):
            *lines, rest = (rest + chunk).split(b"\n")
            for line in lines:
                hand_over(feed, line.decode(errors="replace"))
        if rest:
            hand_over(feed, rest.decode(errors="replace"))
        hand_over(feed, None)

    def read_or_cut() -> None:
        try:
            read()
        except OSError as error:
            hand_over(cut, error)

    threading.Thread(target=read_or_cut, name="script", daemon=True).start()


def _read_when_ready(descriptor: int) -> bytes:
    """Wait for bytes, and return them; empty at the end."""
    while True:
        try:
            return os.read(descriptor, READ_BYTES)
        except BlockingIOError:  # another program that has this pipe or terminal open made it non-blocking
            with selectors.DefaultSelector() as selector:
                selector.register(descriptor, selectors.EVENT_READ)
                selector.select()
