"""Screen of the terminal console on a recording: the same tables, a time line, and keys for playback."""

from __future__ import annotations

from typing import ClassVar, Protocol

import msgspec
from rich.text import Text
from textual import events
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.screen import Screen
from textual.widgets import Static

from backbone.printable_text import printable
from backbone.recording.markers import Marker, MarkerKind
from backbone.recording.playback import NoSuchTime, Playback
from ui_console.model.profile import Profile
from ui_console.model.time_line import TimeLine, next_speed
from ui_console.model.views import ConsoleView
from ui_console.session.recorded_play import NOT_NOW, STILL_READ
from ui_console.session.verbs import Session
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.dialogs import ChoiceDialog, DialogChoice, LineQuestion, Reading
from ui_console.terminal.keys import STOPS, Hint, help_lines
from ui_console.terminal.recorded_keys import PLAYS, looking_keys, recorded_hints, refused_keys

MARKS = {
    MarkerKind.ALARM: ("!", "bold red"),
    MarkerKind.OPERATOR: ("●", "cyan"),
    MarkerKind.GRANT: ("▲", "green"),
    MarkerKind.REVOKED: ("▽", "yellow"),
}
LEGEND = "▲ a grant  ▽ its end  ! an alarm  ● an action of a person"
TIME_EACH_S = 0.25  # chosen: the position moves one column at a time
HERE = "bold black on white"
PLAY_ON_S = 1.0  # chosen: pressed again while it plays, the key goes to the marker before; seconds of the machine


class RecordingPlayer(Protocol):
    """The interface of a player; see ``RecordedPlay``."""

    playback: Playback
    mission: str
    has_markers: bool

    def play(self, speed: float) -> None:
        """Play."""

    def step(self) -> None:
        """Go on to the next picture, decision or event."""

    def go_to(self, at_s: float) -> None:
        """Show another time."""


class TimeBar(Static):
    """The time line: markers, the present position, and the last marker before it; a click jumps to a time.

    Args:
        line: The time of the recording.
    """

    class Chosen(Message):
        """A time was clicked."""

        def __init__(self, at_s: float) -> None:
            super().__init__()
            self.at_s = at_s

    def __init__(self, line: TimeLine) -> None:
        super().__init__(id="time-bar")
        self._line = line

    def show(self, at_s: float) -> None:
        """Show this time."""
        columns = max(1, self.content_size.width)
        cells = [MARKS[kind] if kind is not None else ("─", "dim") for kind in self._line.marks(columns)]
        here = self._line.column(at_s, columns)
        cells[here] = (cells[here][0].replace("─", "│"), HERE)
        last = self._line.upto(at_s)
        text = Text.assemble(*cells, "\n", _marker_text(last) if last is not None else Text(LEGEND, "dim"))
        text.no_wrap = True
        self.update(text)

    def on_click(self, event: events.Click) -> None:
        """Go to the time under the mouse."""
        at = event.get_content_offset(self)
        if at is not None:
            self.post_message(self.Chosen(self._line.time(at.x, max(1, self.content_size.width))))


def marker_dialog(line: TimeLine, at_s: float) -> ChoiceDialog[float]:
    """Return the dialog that answers with the time of a marker.

    Args:
        line: The time of the recording.
        at_s: The present time; the cursor begins at the last marker before it.
    """
    last = line.upto(at_s)
    begins_at = line.markers.index(last) if last is not None else 0
    return ChoiceDialog("markers (enter goes there)", list(map(_marker_choice, line.markers)), begins_at=begins_at)


def _marker_choice(marker: Marker) -> DialogChoice[float]:
    return DialogChoice(_marker_text(marker), lambda _values: marker.at_s)


class RecordedApp(ConsoleApp, inherit_bindings=False):
    """A recording's screen, and its keys.

    Args:
        session: Shows the recording as a mission.
        play: Plays the recording.
        has_pixels: True if the terminal shows real pixels.
    """

    CSS = ConsoleApp.CSS + "#time-bar { height: 2; padding: 0 1; }"
    BINDINGS: ClassVar[list[BindingType]] = [*PLAYS, *looking_keys(), *refused_keys()]

    def __init__(self, session: Session, play: RecordingPlayer, line: TimeLine, *, has_pixels: bool = False) -> None:
        super().__init__(session, profile=Profile.MONITOR, has_pixels=has_pixels)
        self._play, self._line = play, line
        self._speed = 1.0

    def on_mount(self) -> None:
        """Put the time line below the first lines."""
        self.screen.mount(TimeBar(self._line), after="#say")
        self.set_interval(TIME_EACH_S, self._show_time)

    def redraw(self) -> None:
        """Show the content at the present time."""
        super().redraw()
        self._show_time()

    def _show_time(self) -> None:
        main = self._main()
        for bar in main.query(TimeBar) if main is not None else ():
            bar.show(self._at_s)
        if main is not None and self._view is not None:
            self._show_head(main, self._view)

    def _show_head(self, main: Screen[object], view: ConsoleView) -> None:
        own = msgspec.structs.replace(view.own, status=self._status())
        super()._show_head(main, msgspec.structs.replace(view, own=own))

    def _status(self) -> str:
        playback = self._play.playback
        doing = f"▶ {playback.rate:g} ×" if playback.is_playing else f"‖ {self._speed:g} ×"
        return f"{doing}  {self._at_s:.1f} s of {playback.end_s:.1f} s: recording of {self._play.mission}"

    def _hints(self, view: ConsoleView) -> list[Hint]:  # noqa: ARG002
        return recorded_hints(self._play.playback.is_playing)

    @property
    def _at_s(self) -> float:
        return self._play.playback.now_s()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Enable the keys of this screen that make sense for a recording; no key stops a robot."""
        is_own = action in {"end", "begin", "not_now"}
        return is_own or (action not in STOPS and super().check_action(action, parameters))

    def action_play(self) -> None:
        """Play or pause."""
        if self._play.playback.is_playing:
            self._play.playback.pause()
        else:
            self._play.play(self._speed)
        self.redraw()

    def action_step(self) -> None:
        """Go to the next picture, decision or event, and pause there."""
        self._play.step()
        self.redraw()

    def action_speed(self, steps: int) -> None:
        """Play faster, or slower."""
        self._speed = next_speed(self._speed, steps)
        if self._play.playback.is_playing:
            self._play.play(self._speed)
        self.redraw()

    def action_seek(self, seconds: float) -> None:
        """Go forward or back by this number of seconds."""
        self._go_to(self._at_s + seconds)

    def action_begin(self) -> None:
        """Go to the begin."""
        self._go_to(self._line.begin_s)

    def action_end(self) -> None:
        """Go to the end."""
        self._go_to(self._line.end_s)

    def action_marker(self, steps: int) -> None:
        """Go to the next or previous marker."""
        playback = self._play.playback
        margin_s = PLAY_ON_S * playback.rate if playback.is_playing else 0.0
        found = self._line.after(self._at_s) if steps > 0 else self._line.before(self._at_s - margin_s)
        if found is None:
            self.notify("no further marker" if self._play.has_markers else STILL_READ, severity="warning")
        else:
            self._go_to(found.at_s)

    def action_markers(self) -> None:
        """Choose a marker, and go to its time."""
        if self._line.markers:
            self._open(marker_dialog(self._line, self._at_s), self._go_to)
        else:
            nothing = "nothing is marked: no grant, no alarm, no action of a person"
            self.notify(nothing if self._play.has_markers else STILL_READ, severity="warning")

    def action_go_to(self) -> None:
        """Go to a typed time."""
        remark = f"mission time in seconds, {self._line.begin_s:.1f} to {self._line.end_s:.1f}"
        self._open(LineQuestion("go to which time?", f"{self._at_s:.1f}", remark), self._read_time)

    def on_time_bar_chosen(self, message: TimeBar.Chosen) -> None:
        """Go to the time that was clicked on."""
        self._go_to(message.at_s)

    def action_not_now(self) -> None:
        """Show why commands are not possible."""
        self.notify(NOT_NOW, severity="warning")

    def action_keys(self) -> None:
        """Show the keys and their actions."""
        bindings = [*Binding.make_bindings(PLAYS), *looking_keys(), *refused_keys()]
        self._open(Reading("keys", help_lines(bindings, self.get_key_display)))

    def _read_time(self, text: str) -> None:
        try:
            self._go_to(float(text.strip().removesuffix("s")))
        except (ValueError, NoSuchTime):
            self.notify(f"{printable(text)} is no time: type seconds", severity="warning", markup=False)

    def _go_to(self, at_s: float) -> None:
        self._play.go_to(at_s)
        self._found = None  # the result of a search belongs to the time of the search
        self.redraw()


def _marker_text(marker: Marker) -> Text:
    mark, style = MARKS[marker.kind]
    return Text.assemble((f"{mark} ", style), (f"{marker.at_s:.1f} s  ", "dim"), printable(marker.line))
