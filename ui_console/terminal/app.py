"""The console in a terminal: live picture, who holds what and why, keys to drive.

Widgets are thin: what they show is in ``ConsoleModel``, what keys do is in the session, which keys there are in
``keys``.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any, ClassVar, TypeVar

import msgspec
from rich.text import Text
from textual import work
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.events import AppBlur, AppFocus, Key, MouseDown, Resize, Unmount
from textual.screen import Screen
from textual.widgets import Input, Static

from backbone.cli import ExitCode
from ui_console.console_model import LOG_SHOWN
from ui_console.driving import Direction, drive_towards
from ui_console.gamepad import buttons_help
from ui_console.profile import Profile
from ui_console.terminal.dialogs import CSS as DIALOG_CSS
from ui_console.terminal.dialogs import Dialog, LiftQuestion, Question, Reading, RobotPicker
from ui_console.terminal.ending import EndingApp
from ui_console.terminal.head import head
from ui_console.terminal.keys import KEYS, has, hints, keys_help, robot_meant, stop_meant
from ui_console.terminal.lines import Row, robot_rows
from ui_console.terminal.log_search import SEARCH_HELP, WrongSearch, read_search
from ui_console.terminal.tables import FIXED, NOTHING, PanelName, table_rows
from ui_console.terminal.verbs import Session
from ui_console.terminal.widgets import DrivePad, KeyLine, Panel, Video
from ui_console.views import AlarmView, ConsoleView

REDRAW_EVERY_S = 0.1  # chosen: 10 pictures a second are enough to drive by and leave the CPU to the mission
TABLES_EVERY_S = 0.3  # chosen: people read no faster, and tables cost more than pictures
MONITOR_EVERY_S = 1.0  # measured: 1.6 % of a core, twice a second 2.5 % (bench/console.py)
SPEED_RAD_S, SPEED_STEP_RAD_S, SPEED_MOST_RAD_S = 4.0, 1.0, 15.0  # chosen: a walk, fine steps, a Scout's most
NARROW_COLUMNS = 70  # chosen: below, picture and tables beside each other are both too small
A = TypeVar("A")


class ConsoleApp(EndingApp):
    """One console's screen.

    Args:
        session: What keys do.
        profile: How it looks.
        has_pixels: True if the terminal shows real pixels.
        is_bare: True to begin with the picture alone, for a head-mounted display.
        has_gamepad: True if the session also drives by one.
    """

    TITLE = "scout-console"
    ENABLE_COMMAND_PALETTE = False
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (NARROW_COLUMNS, "-small"), (100, "-wide")]  # chosen: see the CSS
    VERTICAL_BREAKPOINTS = [(0, "-low"), (30, "-high")]  # chosen: a pad of more lines would take the picture's
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
        self.speed_rad_s = SPEED_RAD_S
        self.chosen = PanelName.ROBOTS
        self._turn = PanelName.SCHEDULE
        self._search = ""
        self._view: ConsoleView | None = None

    @property
    def drives(self) -> bool:
        """Whether this console may drive."""
        return self.profile is not Profile.MONITOR

    # ------------------------------------------------------------------ what is shown
    def compose(self) -> ComposeResult:
        """Lay out: first lines, picture and drag pad left, tables right, keys below."""
        yield Static(id="status")
        yield Static(id="say")
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield Video(self._session.picture, has_pixels=self._has_pixels)
                yield DrivePad(lambda: self.speed_rad_s)
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
        if self.profile is Profile.MONITOR:
            self.set_interval(TABLES_EVERY_S, self.redraw_if_cut)

    def on_resize(self, _event: Resize) -> None:
        """Show as much as fits now."""
        self.call_after_refresh(self.redraw)

    def on_unmount(self, _event: Unmount) -> None:
        """Let the session know before anything else is done about what ended the screen."""
        self._session.closed()

    def redraw(self) -> None:
        """Show what the model says now."""
        main = self._main()
        if main is None:
            return
        view = self._view = self._session.model.view(self._session.now_s())
        main.set_class(view.own.link_down_s >= 0, "-unlinked")
        self._show_head(main, view)
        for name in FIXED:
            self._show(name, main.query_one(f"#{name}", Panel), view)
        turn = main.query_one("#turn", Panel)
        is_searched = self._turn is PanelName.LOG and bool(self._search)
        turn.border_title = Text(f"log: {self._search}" if is_searched else self._turn)
        self._show(self._turn, turn, view)
        keys = hints(view, self.profile, self._robot_meant())
        main.query_one(KeyLine).show(keys, rows=1 if self.size.width >= NARROW_COLUMNS else 2)
        if isinstance(self.screen, LiftQuestion):
            subject = self.screen.subject
            self.screen.look(next((robot.stop for robot in view.robots if robot.robot == subject), None))
        self.redraw_video()

    def redraw_if_cut(self) -> None:
        """Show at once that the link is down, or up again: nothing looks fresh that is not."""
        shown = self._view is not None and self._view.own.link_down_s >= 0
        if (self._session.model.team.link_down_s(self._session.now_s()) >= 0) is not shown:
            self.redraw()

    def redraw_video(self) -> None:
        """Show the newest picture, or why there is none to drive by."""
        main = self._main()
        if self._view is None or self.profile is not Profile.TERMINAL or main is None:
            return
        own = self._view.own
        stale = [video for video in self._view.videos if video.robot == own.robot and video.is_stale]
        remark = f"picture is {stale[0].age_s:.0f} s old" if stale else ""
        if own.is_asked and not own.is_held:
            remark = own.status
        main.query_one(Video).look(remark)

    def _main(self) -> Screen[Any] | None:
        """Return the screen behind all dialogs; None while it is just being taken down."""
        screens = self.screen_stack if self.is_running else []
        return screens[0] if screens and screens[0].query("#status") else None

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002
        """Hide the keys that this profile does not have."""
        return has(self.profile, action)

    def _show_head(self, main: Screen[Any], view: ConsoleView) -> None:
        first = head(view, self.size.width, self.profile, self.speed_rad_s)
        main.query_one("#status", Static).update(first.status, layout=False)
        say = main.query_one("#say", Static)
        say.display = bool(first.says)
        say.update(Text("\n").join(first.says))

    def _show(self, name: PanelName, panel: Panel, view: ConsoleView) -> None:
        is_chosen = name is self.chosen
        panel.set_class(is_chosen, "-chosen")
        if name is PanelName.LOG and self._search:
            found = self._session.model.team.log(LOG_SHOWN, read_search(self._search))
            view = msgspec.structs.replace(view, log=found)
        rows = table_rows(name, view, panel.content_size.width)
        panel.show_rows(rows, is_chosen=is_chosen, nothing=NOTHING[name])

    # ------------------------------------------------------------------ what is meant
    def _panel(self) -> Panel:
        return self.screen_stack[0].query_one(f"#{self.chosen}" if self.chosen in FIXED else "#turn", Panel)

    def _subject(self) -> str:
        return _subject_of(self._panel().row)

    def _robots_at_hand(self) -> dict[str, str]:
        """Return the robots that a key may mean, see ``robot_meant``."""
        names = [robot.robot for robot in self._view.robots] if self._view is not None else []
        model, panel = self._session.model, self._panel()
        dialog = self.screen.subject if isinstance(self.screen, Dialog) else ""
        placed, shown = dialog or _subject_of(panel.placed), _subject_of(panel.row)
        return {
            "held": model.robot if model.held is not None else "",
            "placed": placed if placed in names else "",
            "wanted": model.robot,
            "shown": shown if shown in names else names[0] if len(names) == 1 else "",
        }

    def _robot_meant(self) -> str:
        return robot_meant(**self._robots_at_hand())

    def _open(self, dialog: Dialog[A], answered: Callable[[A], object] | None = None) -> None:
        """Open a dialog; what is held down then, or when it closes, drives no more until it was let go."""

        def closed(answer: A | None) -> None:
            self._session.require_let_go()
            if answered is not None and answer is not None:
                answered(answer)

        self._session.require_let_go()
        self.push_screen(dialog, closed)

    @work
    async def _begin(self, act: Callable[[], Awaitable[object]]) -> None:
        """Do this while keys are heard."""
        await act()

    # ------------------------------------------------------------------ keys that drive
    def on_key(self, _event: Key) -> None:
        """Take note that somebody is there."""
        self._session.touch()

    def on_mouse_down(self, _event: MouseDown) -> None:
        """Take note that somebody is there."""
        self._session.touch()

    def on_input_changed(self, _event: Input.Changed) -> None:
        """Take note that somebody is there: a field keeps the keys to itself."""
        self._session.touch()

    def action_drive(self, direction: Direction) -> None:
        """Drive while the key is held; the session ends it when no repeat comes."""
        self._session.hold(drive_towards(direction, self.speed_rad_s))

    def on_drive_pad_held(self, message: DrivePad.Held) -> None:
        """Drive as the pad says."""
        self._session.hold(message.drive, message.lasts_s)

    def on_drive_pad_let_go(self, _message: DrivePad.LetGo) -> None:
        """Stop the wheels now."""
        self._session.stop()

    def action_stop(self) -> None:
        """Stop the wheels now."""
        self._session.stop()

    def action_jump(self) -> None:
        """Jump once."""
        self._session.jump()

    def action_faster(self, steps: int) -> None:
        """Change the speed of the drive keys."""
        wanted = self.speed_rad_s + steps * SPEED_STEP_RAD_S
        self.speed_rad_s = min(max(wanted, SPEED_STEP_RAD_S), SPEED_MOST_RAD_S)
        self.redraw()

    def action_release(self) -> None:
        """Give the robot back and go on watching."""
        self._session.release()

    def action_take(self) -> None:
        """Ask for the robot again."""
        self._session.take()

    def action_take_or_release(self) -> None:
        """Ask for the robot, or give it back: the pendant's key for both."""
        if self._session.model.asked is None:
            self._session.take()
        else:
            self._session.release()

    def action_ask_consent(self) -> None:
        """Ask the operator who holds what this one waits for."""
        self._session.ask_consent()

    def action_ask_consent_because(self) -> None:
        """The same, with a sentence that says why."""
        self._open(Question("may I have it, because"), self._session.ask_consent)

    def action_decide(self, is_given: bool) -> None:
        """Let the operator who asks have the robot, or keep it."""
        self._session.decide(is_given)

    def on_app_blur(self, _event: AppBlur) -> None:
        """Stop the wheels when the window is left: no key release would be heard there."""
        if self.drives:
            self.screen_stack[0].query_one(DrivePad).let_go()
            self._session.leave()

    def on_app_focus(self, _event: AppFocus) -> None:
        """Take note that somebody is there again."""
        if self.drives:
            self._session.touch()

    # ------------------------------------------------------------------ emergency stop
    def action_stop_robot(self) -> None:
        """Stop this robot, whoever holds it."""
        robot = self._robot_meant()
        if not robot:
            self.notify("which robot? move to its row first, or stop all with X", severity="warning")
            return
        self._session.touch()
        self._session.stop()
        self._begin(partial(self._stop_robot, robot))

    def action_stop_all(self) -> None:
        """Stop all robots, whoever holds them."""
        self._session.touch()
        self._session.stop()
        self._begin(self._stop_all)

    def action_lift(self) -> None:
        """Show whose stop is meant and why it was set, and lift it if another key says so."""
        robots = {robot.robot: robot for robot in self._view.robots} if self._view is not None else {}
        stopped = [name for name, robot in robots.items() if robot.stop is not None]
        meant = stop_meant(stopped, **self._robots_at_hand())
        stop = robots[meant].stop if meant else None
        if stop is None:
            told = "which one? move to the row of a stopped robot first" if stopped else "no robot is stopped"
            self.notify(told, severity="warning")
            return
        self._open(LiftQuestion(meant, stop), lambda number: self._begin(partial(self._lift, meant, number)))

    async def _lift(self, robot: str, number: int) -> None:
        if not await self._session.lift_stop(robot, number):
            self.notify(f"{robot} stays stopped: see the alarms", severity="warning")
        self.redraw()

    async def _stop_robot(self, robot: str) -> None:
        if not await self._session.stop_robot(robot):
            self.notify(f"{robot} did not confirm the stop", severity="error")
        self.redraw()

    async def _stop_all(self) -> None:
        unsure = await self._session.stop_all()
        if unsure:
            self.notify(f"not confirmed: {', '.join(unsure)}", severity="error")
        self.redraw()

    # ------------------------------------------------------------------ which robot
    def action_choose_robot(self, number: int) -> None:
        """Take the robot of this number in place of the one that is held."""
        robots = self._view.robots if self._view is not None else []
        if number <= len(robots):
            self._begin(partial(self._session.switch, robots[number - 1].robot))

    def action_pick(self) -> None:
        """Pick a robot from the list."""
        if self._view is None:
            return
        self._open(
            RobotPicker(robot_rows(self._view.robots, self._view.now_s)),
            lambda robot: self._begin(partial(self._session.switch, robot)),
        )

    # ------------------------------------------------------------------ tables
    def action_panel(self, steps: int) -> None:
        """Go to the next table."""
        names = list(PanelName)
        self.chosen = names[(names.index(self.chosen) + steps) % len(names)]
        if self.chosen not in FIXED:
            self._turn = self.chosen
        self.redraw()

    def action_row(self, steps: int) -> None:
        """Move the cursor in the chosen table."""
        self._panel().move(steps)

    def action_why(self) -> None:
        """Say why what the cursor is on is as it is; of an alarm, also where to look."""
        row = self._panel().row
        if row is not None and row.subject:
            where = next((alarm.where for alarm in self._alarms() if alarm.key == row.key), "")
            self._why(row.subject, [f"where: {where}"] if where else [])

    @work(group="why", exclusive=True)
    async def _why(self, subject: str, first: list[str]) -> None:
        self._open(Reading(f"why {subject}?", [*first, *await self._session.why(subject)]))

    def action_acknowledge(self) -> None:
        """A robot that was lost is known to be; else the alarm the cursor is on was seen, or the first of the list."""
        if self._knew_of_lost():
            return
        shown = self._alarms()
        row = self.screen_stack[0].query_one(f"#{PanelName.ALARMS}", Panel).row
        if shown and row is not None:
            self._session.acknowledge(row.key)
            self.redraw()

    def action_acknowledge_all(self) -> None:
        """All alarms were seen, and that a robot was lost."""
        self._knew_of_lost()
        self._session.acknowledge("")
        self.redraw()

    def _knew_of_lost(self) -> bool:
        """Note that the operator knows of a robot that was lost; return whether one was."""
        is_lost = self._view is not None and self._view.own.lost is not None
        if is_lost:
            self._session.dismiss_lost()
            self.redraw()
        return is_lost

    def _alarms(self) -> list[AlarmView]:
        return self._view.alarms if self._view is not None else []

    def action_ask_parameters(self) -> None:
        """Have the component the cursor is on tell its parameters."""
        subject = self._subject()
        if subject:
            self._ask_parameters(subject)

    @work(group="parameters", exclusive=True)
    async def _ask_parameters(self, name: str) -> None:
        if await self._session.ask_parameters(name):
            self.chosen = self._turn = PanelName.PARAMETERS
        self.redraw()

    def action_edit(self) -> None:
        """Change the parameter the cursor is on."""
        row = self._panel().row
        if self.chosen is not PanelName.PARAMETERS or row is None or self._view is None:
            return
        found = [one for one in self._view.parameters if f"parameter:{one.component}.{one.name}" == row.key]
        if not found:
            return
        parameter = found[0]

        self._open(
            Question(f"{parameter.component}.{parameter.name} =", parameter.value),
            lambda text: self._begin(partial(self._set, parameter.component, parameter.name, text)),
        )

    async def _set(self, component: str, parameter: str, text: str) -> None:
        if not await self._session.set_parameter(component, parameter, read_value(text)):
            self.notify(f"{component} did not take {parameter} = {text}: see the alarms", severity="error")
        self.redraw()

    def action_search(self) -> None:
        """Show only what fits in the log."""
        self._open(Question("search the log", self._search, SEARCH_HELP), self._searched)

    def _searched(self, line: str) -> None:
        try:
            read_search(line)
        except WrongSearch as wrong:
            self.notify(str(wrong), severity="warning", markup=False)
            return
        self._search = " ".join(line.split())
        self.chosen = self._turn = PanelName.LOG
        self.redraw()

    def action_bare(self) -> None:
        """Show the picture alone, or everything again."""
        self.screen.toggle_class("-bare")

    def action_keys(self) -> None:
        """Say what the keys do."""
        shown = keys_help(self.profile, self.get_key_display)
        if self._has_gamepad:
            shown += ["", "gamepad", *buttons_help()]
        self._open(Reading("keys", shown))

    def action_interrupt(self) -> None:
        """Leave as Ctrl-C leaves any program."""
        self.exit(return_code=ExitCode.INTERRUPTED)


def _subject_of(row: Row | None) -> str:
    return row.subject if row is not None else ""


def read_value(text: str) -> object:
    """Return what was typed as JSON, or as the text it is.

    Example:
        >>> read_value("0.5"), read_value("true"), read_value("scout1")
        (0.5, True, 'scout1')
    """
    try:
        return msgspec.json.decode(text)
    except msgspec.DecodeError:
        return text
