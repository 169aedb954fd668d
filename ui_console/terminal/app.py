"""The console in a terminal: live picture, who holds what and why, keys to drive.

Widgets are thin: what they show is in ``ConsoleModel``, what keys do is in the session.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import Any, ClassVar, Protocol

import msgspec
import numpy as np
from numpy.typing import NDArray
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.events import AppBlur, AppFocus, Key, MouseDown
from textual.screen import Screen
from textual.widgets import Footer, Static

from ui_console.console_model import ConsoleModel
from ui_console.driving import Direction, Drive, drive_towards
from ui_console.gamepad import buttons_help
from ui_console.terminal.dialogs import CSS as DIALOG_CSS
from ui_console.terminal.dialogs import Question, Reading, RobotPicker
from ui_console.terminal.lines import (
    Row,
    alarm_rows,
    component_rows,
    link_rows,
    log_rows,
    parameter_rows,
    request_rows,
    robot_rows,
    status_text,
    timeline_rows,
    tree_rows,
)
from ui_console.terminal.widgets import DrivePad, Panel, Video
from ui_console.views import AlarmView, ConsoleView

REDRAW_EVERY_S = 0.1  # chosen: 10 pictures a second are enough to drive by and leave the CPU to the mission
TABLES_EVERY_S = 0.3  # chosen: people read no faster, and tables cost more than pictures
MONITOR_EVERY_S = 1.0  # measured: 1.6 % of a core, twice a second 2.5 % (bench/console.py)
SPEED_RAD_S, SPEED_STEP_RAD_S, SPEED_MOST_RAD_S = 4.0, 1.0, 15.0  # chosen: a walk, fine steps, a Scout's most
MOST_PICKED_BY_KEY = 9


class Profile(StrEnum):
    """How a console looks."""

    TERMINAL = "terminal"  # picture, tables, keys
    PENDANT = "pendant"  # six keys and the state of one robot; the picture is on a video monitor
    MONITOR = "monitor"  # tables only; drives nothing


class PanelName(StrEnum):
    """The tables, in the order in which tab goes through them."""

    ROBOTS = "robots"
    TREE = "tree"
    SCHEDULE = "schedule"
    TIMELINE = "timeline"
    ALARMS = "alarms"
    LINKS = "links"
    PARAMETERS = "parameters"
    COMPONENTS = "components"
    LOG = "log"


NOTHING = {
    PanelName.ROBOTS: "no robot is known yet",
    PanelName.TREE: "no behavior is known yet",
    PanelName.SCHEDULE: "nobody asks",
    PanelName.TIMELINE: "nothing was held yet",
    PanelName.ALARMS: "none",
    PanelName.LINKS: "nothing is known yet",
    PanelName.PARAMETERS: "i on a row elsewhere asks for its parameters, e here changes one",
    PanelName.COMPONENTS: "nobody is known yet",
    PanelName.LOG: "nothing yet",
}
FIXED = (PanelName.ROBOTS, PanelName.ALARMS)
"""Tables that are always to be seen; the others take turns between them."""

DRIVE_KEYS: list[BindingType] = [
    Binding("up,w", "drive('forward')", "forward"),
    Binding("down,s", "drive('backward')", "backward", show=False),
    Binding("left,a", "drive('left')", "left", show=False),
    Binding("right,d", "drive('right')", "right", show=False),
]
DRIVES = frozenset(
    {
        "drive",
        "stop",
        "jump",
        "faster",
        "release",
        "take",
        "take_or_release",
        "pick",
        "choose_robot",
        "bare",
        "ask_consent",
        "ask_consent_because",
        "decide",
    }
)
"""Actions of those who may drive."""
PENDANT_DOES = frozenset({"drive", "stop", "take_or_release", "quit"})
"""Four keys to drive, one to stop, one to take and release; closing it is no key one drives by."""


class Session(Protocol):
    """What the keys of a console do."""

    model: ConsoleModel

    def picture(self) -> NDArray[np.uint8] | None:
        """Return the newest picture, grey levels, shape (height, width), or None."""

    def now_s(self) -> float:
        """Return the mission time."""

    def hold(self, drive: Drive, lasts_s: float | None = None) -> None:
        """A drive key is down, or for so long what says so again."""

    def stop(self) -> None:
        """Stop the wheels now."""

    def jump(self) -> None:
        """Jump once."""

    def take(self) -> None:
        """Ask for the robot."""

    def release(self) -> None:
        """Give the robot back."""

    def ask_consent(self, why: str = "") -> None:
        """Ask the operator who holds the robot for it."""

    def decide(self, is_given: bool) -> None:
        """Answer the operator who asks for the robot, or to lift a stop."""

    def require_let_go(self) -> None:
        """What is held moves nothing until it was let go and pressed anew."""

    def dismiss_lost(self) -> None:
        """The operator knows that a robot was lost."""

    async def switch(self, robot: str) -> None:
        """Give the robot back and ask for this one."""

    def touch(self) -> None:
        """A key was pressed."""

    def leave(self) -> None:
        """The window is no longer in front."""

    def acknowledge(self, key: str) -> None:
        """One alarm was seen; all, with an empty key."""

    async def stop_robot(self, robot: str) -> bool:
        """Emergency stop; return whether it is certain."""

    async def stop_all(self) -> list[str]:
        """Emergency stop of all; return the robots of which it is not certain."""

    async def lift_stop(self, robot: str, number: int) -> bool:
        """Let the robot move again, if those who stopped it let it; return whether it may.

        Args:
            robot: Which.
            number: Of the stop that was seen on the screen.
        """

    async def why(self, name: str) -> list[str]:
        """Return why it is as it is."""

    async def ask_parameters(self, name: str) -> bool:
        """Have its parameters told; return whether they were."""

    async def set_parameter(self, name: str, parameter: str, value: object) -> bool:
        """Change one; return whether it was."""


class ConsoleApp(App[None]):
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
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (90, "-wide")]  # chosen: two tables beside each other need 45 each
    CSS = (
        DIALOG_CSS
        + """
    #status { height: 1; background: $panel; color: $text; }
    #body { height: 1fr; }
    #video { width: 2fr; height: 1fr; }
    #side { width: 1fr; min-width: 46; }
    .panel { border: round $primary; height: auto; padding: 0 1; }
    #robots { max-height: 12; text-wrap: nowrap; text-overflow: ellipsis; }
    #turn { text-wrap: nowrap; text-overflow: ellipsis; }
    #alarms { max-height: 9; }
    #turn { height: 1fr; }
    .-chosen { border: round $success; }
    #pad { border: round $primary; height: 9; width: 1fr; }
    Screen.-narrow #body { layout: vertical; }
    Screen.-narrow #side { width: 1fr; min-width: 0; height: 2fr; }
    Screen.-narrow #video { width: 1fr; }
    Screen.-narrow #pad { height: 7; }
    Screen.-bare #side { display: none; }
    Screen.-bare Footer { display: none; }
    Screen.-tables #video { display: none; }
    Screen.-tables #pad { display: none; }
    Screen.-tables #side { width: 1fr; }
    Screen.-pendant #turn { display: none; }
    """
    )
    BINDINGS: ClassVar[list[BindingType]] = [
        *DRIVE_KEYS,
        Binding("space,escape", "stop", "stop"),
        Binding("enter", "take_or_release", "take or release"),
        Binding("t", "take", "take"),
        Binding("r", "release", "release"),
        Binding("x", "stop_robot", "STOP ROBOT"),
        Binding("X", "stop_all", "STOP ALL"),
        Binding("c", "lift", "lift stop", show=False),
        Binding("m", "ask_consent", "may I?", show=False),
        Binding("M", "ask_consent_because", "may I, because", show=False),
        Binding("g", "decide(True)", "let them have it", show=False),
        Binding("n", "decide(False)", "keep it", show=False),
        Binding("j", "jump", "jump", show=False),
        Binding("plus,equals_sign", "faster(1)", "faster", show=False),
        Binding("minus", "faster(-1)", "slower", show=False),
        Binding("p", "pick", "pick robot"),
        *(Binding(str(n), f"choose_robot({n})", f"robot {n}", show=False) for n in range(1, MOST_PICKED_BY_KEY + 1)),
        Binding("tab", "panel(1)", "table", priority=True),
        Binding("shift+tab", "panel(-1)", "table before", show=False, priority=True),
        Binding("left_square_bracket,pageup", "row(-1)", "row up", show=False),
        Binding("right_square_bracket,pagedown", "row(1)", "row down", show=False),
        Binding("y", "why", "why"),
        Binding("k", "acknowledge", "seen"),
        Binding("K", "acknowledge_all", "all seen", show=False),
        Binding("i", "ask_parameters", "parameters", show=False),
        Binding("e", "edit", "edit", show=False),
        Binding("v", "bare", "video only", show=False),
        Binding("question_mark,f1", "keys", "keys"),
        Binding("q,ctrl+c", "quit", "quit"),
    ]

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
        self._view: ConsoleView | None = None

    @property
    def drives(self) -> bool:
        """Whether this console may drive."""
        return self.profile is not Profile.MONITOR

    # ------------------------------------------------------------------ what is shown
    def compose(self) -> ComposeResult:
        """Lay out: status above, picture left, tables right, keys below."""
        yield Static(id="status")
        with Horizontal(id="body"):
            yield Video(self._session.picture, has_pixels=self._has_pixels)
            with Vertical(id="side"):
                yield Panel(PanelName.ROBOTS, most_lines=10)
                yield Panel("turn")
                yield Panel(PanelName.ALARMS, most_lines=7, wraps=True)
                yield DrivePad(lambda: self.speed_rad_s)
        yield Footer(compact=True)

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

    def redraw(self) -> None:
        """Show what the model says now."""
        main = self._main()
        if main is None:
            return
        now_s = self._session.now_s()
        view = self._view = self._session.model.view(now_s)
        speed_rad_s = self.speed_rad_s if self.drives else None
        main.query_one("#status", Static).update(status_text(view, speed_rad_s, self._hint(view)), layout=False)
        for name in FIXED:
            self._show(name, main.query_one(f"#{name}", Panel), view)
        turn = main.query_one("#turn", Panel)
        turn.border_title = self._turn
        self._show(self._turn, turn, view)
        self.redraw_video()

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
        """Hide the keys that drive from those who only watch, and all but six from a pendant."""
        if self.profile is Profile.PENDANT:
            return action in PENDANT_DOES
        return action != "take_or_release" and (self.drives or action not in DRIVES)

    def _hint(self, view: ConsoleView) -> str:
        if view.own.away_since_s >= 0:
            return "you are away: press any key"
        consent = view.own.consent
        if consent is not None:
            keys = "enter: let go" if self.profile is Profile.PENDANT else "g: let go, n: keep"
            others = f", {consent.others} more" if consent.others else ""
            return f"{consent.line} [{keys}; {consent.left_s:.0f} s{others}]"
        if view.own.asked:
            return view.own.asked
        unsure = [robot.robot for robot in view.robots if robot.stop is not None and not robot.stop.is_confirmed]
        return f"NOT SURE that {', '.join(unsure)} stopped" if unsure else ""

    def _show(self, name: PanelName, panel: Panel, view: ConsoleView) -> None:
        is_chosen = name is self.chosen
        panel.set_class(is_chosen, "-chosen")
        panel.show_rows(self._rows(name, panel, view), is_chosen=is_chosen, nothing=NOTHING[name])

    def _rows(self, name: PanelName, panel: Panel, view: ConsoleView) -> list[Row]:
        rows: dict[PanelName, Callable[[], list[Row]]] = {
            PanelName.ROBOTS: lambda: robot_rows(view.robots, view.now_s),
            PanelName.TREE: lambda: tree_rows(view.tree, view.now_s),
            PanelName.SCHEDULE: lambda: request_rows(view.requests, view.now_s),
            PanelName.TIMELINE: lambda: timeline_rows(view.timeline, panel.content_size.width),
            PanelName.ALARMS: lambda: alarm_rows(view.alarms, view.now_s),
            PanelName.LINKS: lambda: link_rows(view.links, view.hosts),
            PanelName.PARAMETERS: lambda: parameter_rows(view.parameters),
            PanelName.COMPONENTS: lambda: component_rows(view.components),
            PanelName.LOG: lambda: log_rows(view.log),
        }
        return rows[name]()

    def _panel(self) -> Panel:
        return self.screen_stack[0].query_one(f"#{self.chosen}" if self.chosen in FIXED else "#turn", Panel)

    def _subject(self) -> str:
        row = self._panel().row
        return row.subject if row is not None else ""

    def _robot_meant(self) -> str:
        """Return the robot a stop is for: the one the cursor is on, else the one that is held or wanted."""
        names = [robot.robot for robot in self._view.robots] if self._view is not None else []
        subject = self._subject()
        model = self._session.model
        if model.held is not None and model.robot:
            return model.robot
        return subject if subject in names else model.robot

    # ------------------------------------------------------------------ keys that drive
    def on_key(self, _event: Key) -> None:
        """Take note that somebody is there."""
        self._session.touch()

    def on_mouse_down(self, _event: MouseDown) -> None:
        """Take note that somebody is there."""
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

        def typed(why: str | None) -> None:
            if why is not None:
                self._session.ask_consent(why)

        self.push_screen(Question("may I have it, because", ""), typed)

    def action_decide(self, is_given: bool) -> None:
        """Let the operator who asks have the robot, or keep it."""
        self._session.decide(is_given)

    def on_app_blur(self, _event: AppBlur) -> None:
        """Stop the wheels when the window is left: no key release would be heard there."""
        if self.drives:
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
        self._session.stop()
        self.run_worker(self._stop_robot(robot), exclusive=False)

    def action_stop_all(self) -> None:
        """Stop all robots, whoever holds them."""
        self._session.stop()
        self.run_worker(self._stop_all(), exclusive=False)

    def action_lift(self) -> None:
        """Let the robot move again."""
        robot = self._robot_meant()
        rows = self._view.robots if self._view is not None else []
        for row in rows:
            if row.robot == robot and row.stop is not None:
                self.run_worker(self._session.lift_stop(robot, row.stop.number), exclusive=False)

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
            self.run_worker(self._session.switch(robots[number - 1].robot), group="switch", exclusive=False)

    def action_pick(self) -> None:
        """Pick a robot from the list."""
        if self._view is None:
            return

        def picked(robot: str | None) -> None:
            if robot:
                self.run_worker(self._session.switch(robot), group="switch", exclusive=False)

        self.push_screen(RobotPicker(robot_rows(self._view.robots, self._view.now_s)), picked)

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
        """Say why what the cursor is on is as it is."""
        subject = self._subject()
        if subject:
            self.run_worker(self._why(subject), group="why", exclusive=True)

    async def _why(self, subject: str) -> None:
        self.push_screen(Reading(f"why {subject}?", await self._session.why(subject)))

    def action_acknowledge(self) -> None:
        """The alarm the cursor is on was seen; without one, the first of the list."""
        shown = self._alarms()
        row = self.screen_stack[0].query_one(f"#{PanelName.ALARMS}", Panel).row
        if shown and row is not None:
            self._session.acknowledge(row.key)
            self.redraw()

    def action_acknowledge_all(self) -> None:
        """All alarms were seen."""
        self._session.acknowledge("")
        self.redraw()

    def _alarms(self) -> list[AlarmView]:
        return self._view.alarms if self._view is not None else []

    def action_ask_parameters(self) -> None:
        """Have the component the cursor is on tell its parameters."""
        subject = self._subject()
        if subject:
            self.run_worker(self._ask_parameters(subject), group="parameters", exclusive=True)

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

        def typed(text: str | None) -> None:
            if text is not None:
                self.run_worker(self._set(parameter.component, parameter.name, text), group="parameters")

        self.push_screen(Question(f"{parameter.component}.{parameter.name} =", parameter.value), typed)

    async def _set(self, component: str, parameter: str, text: str) -> None:
        if not await self._session.set_parameter(component, parameter, read_value(text)):
            self.notify(f"{component} did not take {parameter} = {text}: see the alarms", severity="error")
        self.redraw()

    def action_bare(self) -> None:
        """Show the picture alone, or everything again."""
        self.screen.toggle_class("-bare")

    def action_keys(self) -> None:
        """Say what the keys do."""
        shown = [
            f"{', '.join(self.get_key_display(one) for one in bindings)}: {description}"
            for description, bindings in self._keys().items()
        ]
        if self._has_gamepad:
            shown += ["", "gamepad", *buttons_help()]
        self.push_screen(Reading("keys", shown))

    def _keys(self) -> dict[str, list[Binding]]:
        found: dict[str, list[Binding]] = {}
        for binding in self._bindings.key_to_bindings.values():
            for one in binding:
                if self.check_action(one.action.partition("(")[0], ()) and not one.action.startswith("choose_robot"):
                    found.setdefault(one.description, []).append(one)
        return found


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
