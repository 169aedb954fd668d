"""Screen of the terminal console: live picture, holders with reasons, and the relevant keys.

Widgets contain no logic: ``ConsoleModel`` has their content, ``keys`` has the keys.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, ClassVar, TypeVar

import msgspec
from rich.text import Text
from textual import work
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.events import CursorPosition, Resize, Unmount
from textual.screen import Screen
from textual.widgets import Static

from ui_console.model.answering import AWAKE_EVERY_S, AnswerGrip
from ui_console.model.driving import SPEED
from ui_console.model.profile import Profile
from ui_console.model.views import ConsoleView
from ui_console.session.verbs import Session
from ui_console.terminal.dialogs import CSS as DIALOG_CSS
from ui_console.terminal.dialogs import Dialog, LiftQuestion
from ui_console.terminal.driver import KeysDropped
from ui_console.terminal.ending import EndingApp
from ui_console.terminal.head import head
from ui_console.terminal.keys import KEYS, Hint, has, hints, robot_meant
from ui_console.terminal.lines import Row, table_rows
from ui_console.terminal.log_search import FOUND_SHOWN, LogResult
from ui_console.terminal.tables import FIXED, NOTHING, PanelName
from ui_console.terminal.widgets import DrivePad, KeyLine, Panel, Video

REDRAW_EVERY_S = 0.1  # chosen: 10 pictures a second are enough for driving, and leave the CPU to the mission
TABLES_EVERY_S = 0.3  # chosen: people read no faster, and tables cost more than pictures
MONITOR_EVERY_S = 1.0  # measured: 1.6 % of a core, twice a second 2.5 % (bench/console.py)
LINK_LOOK_S = 0.1  # chosen: with ``LINK_FRESH_S`` less than the second after which an old view must be marked
NO_PICTURES = "no pictures: this kind of ARC has no camera or no framegrabber"
UNANSWERED = "the pad let go: the terminal did not answer for a second. Press anew, and keep the mouse moving."
NARROW_COLUMNS = 70  # chosen: below, picture and tables side by side are both too small


A = TypeVar("A")


class ConsoleDisplay(EndingApp):
    """One console's screen, without the actions of its keys.

    Args:
        session: Carries out the keys' actions.
        profile: Its appearance.
        has_pixels: True if the terminal shows real pixels.
        is_bare: True to begin with the picture alone, for a head-mounted display.
        has_gamepad: True if the session also drives by a gamepad.
    """

    TITLE = "scout-console"
    ENABLE_COMMAND_PALETTE = False
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (NARROW_COLUMNS, "-small"), (100, "-wide")]  # chosen: see the CSS
    VERTICAL_BREAKPOINTS = [(0, "-low"), (30, "-high")]  # chosen: a pad with more lines would take lines of the picture
    CSS = (
        DIALOG_CSS
        + """
    #status { height: 1; background: $panel; color: $text; }
    #say { height: auto; max-height: 4; background: $panel; color: $text; padding: 0 1; }
    #keys { height: auto; background: $panel; color: $text; }
    #body { height: 1fr; }
    #left { width: 2fr; }
    #video { width: 1fr; height: 1fr; }
    #pad { border: round $primary; height: 9; width: 1fr; }
    #side { width: 1fr; min-width: 46; }
    .panel { border: round $primary; height: auto; padding: 0 1; text-wrap: nowrap; text-overflow: ellipsis; }
    #robots { max-height: 12; }
    #alarms { max-height: 9; }
    #turn { height: 1fr; }
    .-chosen { border: round $success; }
    /* 80 x 24: a picture of 46 x 17 cells, and 32 columns of text beside it */
    Screen.-small #left { width: 46; }
    Screen.-small #side { min-width: 0; }
    Screen.-small .panel { padding: 0; }
    Screen.-low #pad { height: 5; }
    Screen.-low #robots { max-height: 8; }
    Screen.-low #alarms { max-height: 7; }
    Screen.-narrow #body { layout: vertical; }
    Screen.-narrow #left { width: 1fr; height: 1fr; }
    Screen.-narrow #side { width: 1fr; min-width: 0; height: 1fr; }
    Screen.-narrow #pad { height: 5; }
    Screen.-bare #side, Screen.-bare #pad, Screen.-bare #keys { display: none; }
    Screen.-bare #left { width: 1fr; }
    Screen.-tables #left { display: none; }
    Screen.-tables #side { width: 1fr; height: 1fr; }
    Screen.-pendant #turn { display: none; }
    Screen.-unlinked #body, Screen.-unlinked #keys { opacity: 45%; }
    """
    )
    BINDINGS: ClassVar[list[BindingType]] = [*KEYS]

    def __init__(
        self,
        session: Session,
        *,
        profile: Profile = Profile.TERMINAL,
        has_pixels: bool = False,
        is_bare: bool = False,
        has_gamepad: bool = False,
    ) -> None:
        super().__init__()
        self._session, self.profile, self._has_pixels, self._begins_bare = session, profile, has_pixels, is_bare
        self._has_gamepad = has_gamepad
        self.speed = SPEED
        self.chosen = PanelName.ROBOTS
        self._turn = PanelName.SCHEDULE
        self._found: LogResult | None = None
        self._view: ConsoleView | None = None
        self._stops: set[asyncio.Task[None]] = set()
        self._answering = AnswerGrip()
        self._read_s = 0.0  # when the newest key was read

    @property
    def drives(self) -> bool:
        """Whether this console may drive."""
        return self.profile is not Profile.MONITOR

    def compose(self) -> ComposeResult:
        """Lay out: first lines, picture and drag pad left, tables right, keys below."""
        yield Static(id="status")
        yield Static(id="say")
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield Video(self._session.picture, has_pixels=self._has_pixels)
                yield DrivePad()
            with Vertical(id="side"):
                yield Panel(PanelName.ROBOTS)
                yield Panel("turn")
                yield Panel(PanelName.ALARMS)
        yield KeyLine(id="keys")

    def on_mount(self) -> None:
        """Begin to redraw."""
        self.screen.set_class(self.profile is not Profile.TERMINAL, "-tables")
        self.screen.set_class(self.profile is Profile.PENDANT, "-pendant")
        self.screen.set_class(self._begins_bare, "-bare")
        if self.profile is Profile.MONITOR:
            self.chosen, self._turn = PanelName.TIMELINE, PanelName.TIMELINE
        self.redraw()
        every_s = MONITOR_EVERY_S if self.profile is Profile.MONITOR else TABLES_EVERY_S
        self.set_interval(every_s, self.redraw)
        if self.profile is Profile.TERMINAL:
            self.set_interval(REDRAW_EVERY_S, self.redraw_video)
        self.set_interval(LINK_LOOK_S, self.redraw_if_cut)
        self.set_interval(AWAKE_EVERY_S, lambda: self._answering.look(asyncio.get_running_loop().time()))

    def on_resize(self, _event: Resize) -> None:
        """Adapt the layout to the new size."""
        self.call_after_refresh(self.redraw)

    def on_cursor_position(self, _event: CursorPosition) -> None:
        """Tell the drag pad that the terminal answers."""
        main = self._main()
        if main is not None:
            main.query_one(DrivePad).answered()

    def on_keys_dropped(self, message: KeysDropped) -> None:
        """Say why the keys had no effect; one that is still held answers no question."""
        super().on_keys_dropped(message)
        self._answering.press(message.time, asyncio.get_running_loop().time())

    def on_drive_pad_unanswered(self, _message: DrivePad.Unanswered) -> None:
        """Show why the pad let go."""
        self.notify(UNANSWERED, severity="warning")

    async def on_unmount(self, _event: Unmount) -> None:
        """Notify the session that the screen ended, as soon as no emergency stop is under way."""
        if self._stops:
            await asyncio.wait(self._stops)
        self._session.closed()

    def _carried_out(self, stop: Coroutine[Any, Any, None]) -> Callable[[], Awaitable[None]]:
        """Begin an emergency stop that the end of the screen does not cancel; the result waits for it."""
        task = asyncio.create_task(stop, name="emergency stop")
        self._stops.add(task)
        task.add_done_callback(self._stops.discard)
        return lambda: asyncio.shield(task)

    def redraw(self) -> None:
        """Show the model's present content."""
        main = self._main()
        if main is None:
            return
        view = self._view = self._session.model.view(self._session.now_s())
        consent, loop = view.own.consent, asyncio.get_running_loop()
        self._answering.show(consent.number if consent is not None else 0, loop.time())
        main.set_class(view.own.link_down_s >= 0, "-unlinked")
        self._show_head(main, view)
        main.query_one(DrivePad).disabled = self._session.model.reach is None
        for name in FIXED:
            self._show(name, main.query_one(f"#{name}", Panel), view)
        turn = main.query_one("#turn", Panel)
        found = self._found if self._turn is PanelName.LOG else None
        turn.border_title = Text(found.title if found is not None else self._turn)
        self._show(self._turn, turn, view)
        main.query_one(KeyLine).show(self._hints(view), rows=1 if self.size.width >= NARROW_COLUMNS else 2)
        if isinstance(self.screen, LiftQuestion):
            subject = self.screen.subject
            self.screen.look(next((robot.stop for robot in view.robots if robot.robot == subject), None))
        self.redraw_video()

    def redraw_if_cut(self) -> None:
        """Show at once that the link is down or up again, so that no old view appears fresh."""
        shown = self._view is not None and self._view.own.link_down_s >= 0
        if (self._session.model.team.links.down_s(self._session.now_s()) >= 0) is not shown:
            self.redraw()

    def redraw_video(self) -> None:
        """Show the newest picture, or the reason why there is no usable one."""
        main = self._main()
        if self._view is None or self.profile is not Profile.TERMINAL or main is None:
            return
        own = self._view.own
        stale = [video for video in self._view.videos if video.robot == own.robot and video.is_stale]
        remark = f"picture is {stale[0].age_s:.0f} s old" if stale else ""
        if own.is_asked and not own.is_held:
            remark = own.status
        elif (abilities := self._view.abilities) is not None and not abilities.gives_pictures:
            remark = NO_PICTURES
        main.query_one(Video).look(remark)

    def _open(self, dialog: Dialog[A], answered: Callable[[A], object] | None = None, *, stale: str = "") -> None:
        """Open a dialog; a key held at its opening or closing does not drive until it was released.

        Args:
            answered: Called with its answer.
            stale: Message to show instead of the answer if the robot was stopped, freed, granted or lost meanwhile.
        """

        def closed(answer: A | None) -> None:
            has_changed = self._session.model.moment != opened_at
            self._session.require_let_go()
            if answered is None or answer is None:
                return
            if stale and has_changed:
                self.notify(stale, severity="warning")
            else:
                answered(answer)

        self._session.require_let_go()
        opened_at = self._session.model.moment
        self.push_screen(dialog, closed)

    @work
    async def _begin(self, act: Callable[[], Awaitable[object]]) -> None:
        """Run this in a task, so that keys continue to work."""
        await act()

    def _main(self) -> Screen[object] | None:
        """Return the screen behind all dialogs; None while it is being closed."""
        screens = self.screen_stack if self.is_running else []
        return screens[0] if screens and screens[0].query("#status") else None

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002
        """Hide the keys that this profile does not have."""
        return has(self.profile, action)

    def _hints(self, view: ConsoleView) -> list[Hint]:
        return hints(view, self.profile, self._robot_meant())

    def _show_head(self, main: Screen[object], view: ConsoleView) -> None:
        first = head(view, self.size.width, self.profile, self.speed)
        main.query_one("#status", Static).update(first.status, layout=False)
        say = main.query_one("#say", Static)
        say.display = bool(first.says)
        say.update(Text("\n").join(first.says))

    def _show(self, name: PanelName, panel: Panel, view: ConsoleView) -> None:
        is_chosen = name is self.chosen
        panel.set_class(is_chosen, "-chosen")
        if name is PanelName.LOG and self._found is not None:
            found = self._found
            log = self._session.model.team.log(FOUND_SHOWN, found.asked, found.log.events)
            view = msgspec.structs.replace(view, log=log)
        rows = table_rows(name, view, panel.content_size.width)
        panel.show_rows(rows, is_chosen=is_chosen, nothing=NOTHING[name])

    def _panel(self) -> Panel:
        return self.screen_stack[0].query_one(f"#{self.chosen}" if self.chosen in FIXED else "#turn", Panel)

    def _subject(self) -> str:
        return _subject_of(self._panel().row)

    def _robots_at_hand(self) -> dict[str, str]:
        """Return the robots that a key may mean, see ``robot_meant``."""
        names = [robot.robot for robot in self._view.robots] if self._view is not None else []
        model, panel = self._session.model, self._panel()
        dialog = self.screen.subject if isinstance(self.screen, Dialog) else ""
        robots = self.screen_stack[0].query_one(f"#{PanelName.ROBOTS}", Panel)
        placed = (dialog, _subject_of(panel.placed), _subject_of(robots.placed))
        shown = _subject_of(panel.row)
        return {
            "held": model.mine,
            "placed": next((robot for robot in placed if robot in names), ""),
            "wanted": model.robot,
            "shown": shown if shown in names else names[0] if len(names) == 1 else "",
        }

    def _robot_meant(self) -> str:
        return robot_meant(**self._robots_at_hand())


def _subject_of(row: Row | None) -> str:
    return row.subject if row is not None else ""
