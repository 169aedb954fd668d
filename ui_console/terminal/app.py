"""Actions of the terminal console's keys; the session carries out those that concern the robot."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from functools import partial

import msgspec
from textual import work
from textual.events import AppBlur, AppFocus, Key, MouseDown
from textual.widgets import Input

from backbone.errors import LinkError, Refusal
from backbone.launcher.endings import ExitCode
from backbone.naming import component_of
from ui_console.model.arc_abilities import ArcAbilities
from ui_console.model.driving import DIRECTIONS, STICK_LASTS_S, Direction, faster
from ui_console.model.key_table import KeyRow
from ui_console.model.profile import Profile
from ui_console.model.views import AlarmView
from ui_console.session.gamepad import buttons_help
from ui_console.terminal.dialogs import (
    LiftQuestion,
    LineQuestion,
    OwnLiftQuestion,
    Reading,
    RobotPicker,
    command_dialog,
)
from ui_console.terminal.display import ConsoleDisplay
from ui_console.terminal.key_dialogs import KeyDialog, KeyPicker
from ui_console.terminal.keys import keys_help, own_stops, stop_meant
from ui_console.terminal.lines import robot_rows
from ui_console.terminal.log_search import SEARCH_HELP, LogResult, read_search
from ui_console.terminal.order_dialog import order_dialog
from ui_console.terminal.tables import FIXED, PanelName
from ui_console.terminal.view_dialogs import ViewDialog, views_dialog
from ui_console.terminal.widgets import DrivePad, Panel


class ConsoleApp(ConsoleDisplay):
    """One console's screen, and its keys."""

    def on_key(self, event: Key) -> None:
        """Record that the operator is there; Textual calls this right before the action of the key."""
        self._read_s = event.time
        self._session.touch()

    def on_mouse_down(self, _event: MouseDown) -> None:
        """Record that the operator is there."""
        self._session.touch()

    def on_input_changed(self, _event: Input.Changed) -> None:
        """Record that the operator is there, because a field does not pass its keys on."""
        self._session.touch()

    def action_drive(self, direction: Direction) -> None:
        """Drive while the key is held; the session ends it when no repeat comes."""
        self._session.steer(*DIRECTIONS[direction], self.speed)

    def on_drive_pad_dragged(self, message: DrivePad.Dragged) -> None:
        """Drive by the pad, and ask whether the terminal is still there."""
        self._session.steer(message.forward, message.right, self.speed, STICK_LASTS_S)
        self.ask_terminal()

    def on_drive_pad_released(self, _message: DrivePad.Released) -> None:
        """Stop the wheels now."""
        self._session.stop()

    def action_stop(self) -> None:
        """Stop the wheels now; if the robot carries out an order, the order ends."""
        self._session.halt()

    def action_jump(self) -> None:
        """Jump once, if the robot can."""
        if self._abilities is not None and not self._abilities.takes("jump"):
            self.notify("this robot cannot jump; o lists its commands", severity="warning")
            return
        self._session.jump()

    def action_command(self) -> None:
        """Choose one of the robot's other commands, and send it."""
        if self._session.model.held is None:
            self.notify("you hold no robot: take one first", severity="warning")
        elif self._abilities is None or not self._abilities.commands:
            what = "has no other commands" if self._abilities is not None else "has not told its commands yet"
            self.notify(f"{self._session.model.robot or 'the ARC'} {what}", severity="warning")
        else:
            stale = "not given: the robot was stopped, freed, granted or lost meanwhile. Press o again."
            dialog = command_dialog(self._session.model.robot, self._abilities.commands)
            self._open(dialog, self._session.give, stale=stale)

    def action_order(self) -> None:
        """Choose an order for this robot, or for all robots that the operator holds."""
        robot, others = self._session.model.robot, self._session.robots_held()
        if not robot:
            self.notify("which robot? take one first", severity="warning")
            return
        stale = "not ordered: the robot was stopped, freed, granted or lost meanwhile. Press O again."
        self._open(order_dialog(robot, others), self._session.order_group, stale=stale)

    @property
    def _abilities(self) -> ArcAbilities | None:
        return self._session.model.abilities

    def action_faster(self, steps: int) -> None:
        """Change the speed of the drive keys."""
        self.speed = faster(self.speed, steps)
        self.redraw()

    def action_release(self) -> None:
        """Release the robot and continue to watch."""
        self._session.release()

    def action_take(self) -> None:
        """Ask for the robot again."""
        self._session.take()

    def action_take_or_release(self) -> None:
        """Claim or release the robot; the pendant has one key for both."""
        if self._session.model.asked is None:
            self._session.take()
        else:
            self._session.release()

    def action_ask_consent(self) -> None:
        """Ask the operator who holds the robot for which this operator waits."""
        self._session.ask_consent()

    def action_ask_consent_because(self) -> None:
        """Ask the same, with a reason."""
        self._open(LineQuestion("may I have it, because"), self._session.ask_consent)

    def action_decide(self, is_given: bool) -> None:
        """Answer the question on the screen, if there is one; a later question is answered by a later press."""
        if number := self._answering.press(self._read_s, asyncio.get_running_loop().time()):
            self._session.decide(is_given, number)

    def on_app_blur(self, _event: AppBlur) -> None:
        """Stop the wheels when the window loses the focus, because it gets no key events after that."""
        if self.drives:
            self.screen_stack[0].query_one(DrivePad).let_go()
            self._session.leave()

    def on_app_focus(self, _event: AppFocus) -> None:
        """Record that the operator is there again."""
        if self.drives:
            self._session.touch()

    def action_stop_robot(self) -> None:
        """Stop this robot, regardless of its holder."""
        robot = self._robot_meant()
        if not robot:
            self.notify("which robot? move to its row first, or stop all with X", severity="warning")
            return
        self._session.touch()
        self._session.stop()
        self._begin(self._carried_out(self._stop_robot(robot)))

    def action_stop_all(self) -> None:
        """Stop all robots, regardless of their holders."""
        self._session.touch()
        self._session.stop()
        self._begin(self._carried_out(self._stop_all()))

    def action_lift(self) -> None:
        """Show the stop with its authors and reason, and lift it if a different key confirms."""
        robots = {robot.robot: robot for robot in self._view.robots} if self._view is not None else {}
        stopped = [name for name, robot in robots.items() if robot.stop is not None]
        meant = stop_meant(stopped, **self._robots_at_hand())
        stop = robots[meant].stop if meant else None
        if stop is None:
            told = "which one? move to the row of a stopped robot first" if stopped else "no robot is stopped"
            self.notify(told, severity="warning")
            return
        self._open(LiftQuestion(meant, stop), lambda number: self._begin(partial(self._lift, {meant: number})))

    def action_lift_own(self) -> None:
        """Show the robots that this operator alone has stopped, and lift these stops if a different key confirms."""
        own = own_stops(self._view.robots) if self._view is not None else {}
        if own:
            self._open(OwnLiftQuestion(own), lambda stops: self._begin(partial(self._lift, stops)))
        else:
            self.notify("you alone have stopped no robot", severity="warning")

    async def _lift(self, stops: Mapping[str, int]) -> None:
        lifted = await asyncio.gather(*(self._session.lift_stop(*stop) for stop in stops.items()))
        if stay := [robot for robot, is_lifted in zip(stops, lifted, strict=True) if not is_lifted]:
            verb = "stays" if len(stay) == 1 else "stay"
            self.notify(f"{', '.join(stay)} {verb} stopped: see the alarms", severity="warning")
        self.redraw()

    async def _stop_robot(self, robot: str) -> None:
        if not await self._session.stop_robot(robot):
            self.notify(f"{robot} did not confirm the stop; until it answers, it is sent again", severity="error")
        self.redraw()

    async def _stop_all(self) -> None:
        unsure = await self._session.stop_all()
        if unsure:
            self.notify(f"not confirmed: {', '.join(unsure)}", severity="error")
        self.redraw()

    def action_choose_robot(self, number: int) -> None:
        """Take the robot of this number in place of the one held."""
        robots = self._view.robots if self._view is not None else []
        if number <= len(robots):
            self._begin(partial(self._session.switch, robots[number - 1].robot))

    def action_next_robot(self) -> None:
        """Go to the next robot; the order of the present robot continues."""
        self._begin(self._session.next_robot)

    def action_pick(self) -> None:
        """Pick a robot from the list."""
        if self._view is None:
            return
        robot = self._session.model.robot
        self._open(
            RobotPicker(robot_rows(self._view.robots, self._view.now_s, robot), robot),
            lambda chosen: self._begin(partial(self._session.switch, chosen)),
        )

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
        """Show the explanation of the row under the cursor; for an alarm, also its place."""
        row = self._panel().row
        if row is not None and row.subject:
            where = next((alarm.where for alarm in self._alarms() if alarm.key == row.key), "")
            self._why(row.subject, [f"where: {where}"] if where else [])
        else:
            self.notify(f"{self.chosen} has no row to explain", severity="warning")

    @work(group="why", exclusive=True)
    async def _why(self, subject: str, first: list[str]) -> None:
        self._open(Reading(f"why {subject}?", [*first, *await self._session.why(subject)]))

    def action_acknowledge(self) -> None:
        """Acknowledge the loss of a robot, else the alarm under the cursor, or the first of the list."""
        if self._knew_of_lost():
            return
        shown = self._alarms()
        row = self.screen_stack[0].query_one(f"#{PanelName.ALARMS}", Panel).row
        if shown and row is not None:
            self._session.acknowledge(row.key)
            self.redraw()

    def action_acknowledge_all(self) -> None:
        """Acknowledge all alarms, and the loss of a robot."""
        self._knew_of_lost()
        self._session.acknowledge("")
        self.redraw()

    def _knew_of_lost(self) -> bool:
        """Acknowledge the loss of a robot; return whether one was lost."""
        is_lost = self._view is not None and self._view.own.lost is not None
        if is_lost:
            self._session.dismiss_lost()
            self.redraw()
        return is_lost

    def _alarms(self) -> list[AlarmView]:
        return self._view.alarms if self._view is not None else []

    def action_ask_parameters(self) -> None:
        """Ask the component under the cursor for its parameters."""
        subject = self._subject()
        if subject:
            self._ask_parameters(subject)

    @work(group="parameters", exclusive=True)
    async def _ask_parameters(self, name: str) -> None:
        if await self._session.ask_parameters(name):
            self.chosen = self._turn = PanelName.PARAMETERS
        self.redraw()

    def action_edit(self) -> None:
        """Change the parameter under the cursor."""
        row = self._panel().row
        if self.chosen is not PanelName.PARAMETERS or row is None or self._view is None:
            return
        found = [one for one in self._view.parameters if f"parameter:{one.component}.{one.name}" == row.key]
        if not found:
            return
        parameter = found[0]

        self._open(
            LineQuestion(f"{parameter.component}.{parameter.name} =", parameter.value),
            lambda text: self._begin(partial(self._set, parameter.component, parameter.name, text)),
        )

    async def _set(self, component: str, parameter: str, text: str) -> None:
        if not await self._session.set_parameter(component, parameter, read_value(text)):
            self.notify(f"{component} did not take {parameter} = {text}: see the alarms", severity="error")
        self.redraw()

    def action_search(self) -> None:
        """Show the events of the mission's log that match a search, and matching events from now on."""
        before = self._found.line if self._found is not None else ""
        self._open(LineQuestion("search the log", before, SEARCH_HELP), self._search)

    @work(group="search", exclusive=True)
    async def _search(self, line: str) -> None:
        question = read_search(line)
        try:
            found = LogResult(" ".join(line.split()), *await self._session.search_log(question)) if question else None
        except Refusal as refusal:
            self.notify(f"{refusal.detail}. {refusal.remedy}", severity="warning", markup=False)
            return
        self._found = found
        self.chosen = self._turn = PanelName.LOG
        self.redraw()

    def action_look(self) -> None:
        """Choose a debug view of a behavior, and watch it live."""
        self._look()

    @work(group="look", exclusive=True)
    async def _look(self) -> None:
        try:
            views = await self._session.debug_views()
        except LinkError as error:
            self.notify(str(error), severity="warning", markup=False)
            return
        if not views:
            self.notify("no behavior shows anything yet", severity="warning")
            return
        self._open(views_dialog(views), lambda chosen: self._open(self._view_dialog(*chosen)))

    def _view_dialog(self, behavior: str, view: str) -> ViewDialog:
        keep_looking = partial(self._session.keep_looking, behavior, view)
        return ViewDialog(f"{component_of(behavior)}: {view}", keep_looking, has_pixels=self._has_free_pixels)

    def action_heard(self) -> None:
        """List the keys on the bus, and show the messages of the chosen key."""
        self._open(KeyPicker(self._session.keep_listing), lambda row: self._open(self._key_dialog(row)))

    def _key_dialog(self, row: KeyRow) -> KeyDialog:
        return KeyDialog(row, self._session.keep_hearing, self._session.now_s, has_pixels=self._has_free_pixels)

    @property
    def _has_free_pixels(self) -> bool:
        """True if a dialog may show real pixels, of which the terminal keeps one picture."""
        return self._has_pixels and self.profile is Profile.MONITOR

    def action_bare(self) -> None:
        """Show the picture alone, or everything again."""
        self.screen.toggle_class("-bare")

    def action_keys(self) -> None:
        """Show the keys and their actions."""
        shown = keys_help(self.profile, self.get_key_display)
        if self._has_gamepad:
            shown += ["", "gamepad", *buttons_help()]
        self._open(Reading("keys", shown))

    def action_interrupt(self) -> None:
        """Leave with the exit code of Ctrl-C."""
        self.exit(return_code=ExitCode.INTERRUPTED)


def read_value(text: str) -> object:
    """Return the typed value, decoded as JSON if it is JSON, else as text.

    Example:
        >>> read_value("0.5"), read_value("true"), read_value("scout1")
        (0.5, True, 'scout1')
    """
    try:
        return msgspec.json.decode(text)
    except msgspec.DecodeError:
        return text
