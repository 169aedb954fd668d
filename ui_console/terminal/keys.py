"""Keys of the terminal console: their actions, the profiles that have them, and the keys in the last line.

Rules of this file: no screen; a view and a width go in, texts come out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from rich.style import Style
from rich.text import Text
from textual.binding import Binding

from ui_console.model.profile import Profile
from ui_console.model.views import ConsoleView, RobotView

MOST_PICKED_BY_KEY = 9
STOP_KEYS = frozenset({"x", "X"})
"""Keys of the emergency stop: no dialog and no field uses them for another purpose."""
ARRIVES_AS = frozenset({"alt+x", "alt+shift+x", "shift+x", "alt+q"})
"""The same keys a tenth of a second after escape, and from terminals that report modifiers."""

DRIVE_KEYS = [
    Binding("up,w", "drive('forward')", "drive forward while held"),
    Binding("down,s", "drive('backward')", "drive backward while held"),
    Binding("left,a", "drive('left')", "turn left on the spot while held"),
    Binding("right,d", "drive('right')", "turn right on the spot while held"),
]
KEYS = [
    Binding("x,alt+x", "stop_robot", "EMERGENCY STOP of your robot, or of the row's", priority=True),
    Binding("X,shift+x,alt+shift+x", "stop_all", "EMERGENCY STOP of all robots", priority=True),
    Binding("c", "lift", "lift a stop: says whose it is, and asks again"),
    Binding("C", "lift_own", "lift all stops that you alone set: says how many, and asks again"),
    *DRIVE_KEYS,
    Binding("space,escape", "stop", "stop the wheels now"),
    Binding("enter", "take_or_release", "take the robot, or give it back"),
    Binding("t", "take", "take the robot"),
    Binding("r", "release", "give the robot back and go on watching"),
    Binding("p", "pick", "pick a robot from a list, and take it"),
    *(Binding(str(n), f"choose_robot({n})", "take the robot of this number") for n in range(1, MOST_PICKED_BY_KEY + 1)),
    Binding("N", "next_robot", "go to the next robot; the order of this one goes on"),
    Binding("O", "order", "tell this robot, or all you hold, to do something by itself, from a list"),
    Binding("m", "ask_consent", "ask the operator who holds the robot for it"),
    Binding("M", "ask_consent_because", "the same, with a reason you type"),
    Binding("g", "decide(True)", "say yes to the operator who asks for the robot, or to lift your stop"),
    Binding("n", "decide(False)", "say no"),
    Binding("o", "command", "give another command of the robot, from a list"),
    Binding("j", "jump", "jump, if the robot can"),
    Binding("plus,equals_sign", "faster(1)", "faster"),
    Binding("minus", "faster(-1)", "slower"),
    Binding("tab", "panel(1)", "next table", priority=True),
    Binding("shift+tab", "panel(-1)", "table before", priority=True),
    Binding("left_square_bracket,pageup", "row(-1)", "cursor up"),
    Binding("right_square_bracket,pagedown", "row(1)", "cursor down"),
    Binding("y", "why", "why is this row as it is"),
    Binding("k", "acknowledge", "a lost robot, or the alarm under the cursor, was seen"),
    Binding("K", "acknowledge_all", "all alarms were seen"),
    Binding("i", "ask_parameters", "show the row's parameters"),
    Binding("e", "edit", "change the parameter under the cursor"),
    Binding(
        "slash",
        "search",
        "search the mission's log: words, a robot, a person, a level, a time",
    ),
    Binding("b", "look", "what the behaviors see: choose a view, and look at it live"),
    Binding("B", "heard", "what is said: list all keys with their rates, choose one, and see its messages"),
    Binding("v", "bare", "picture alone, and back"),
    Binding("question_mark,f1", "keys", "these keys"),
    Binding("q,alt+q", "quit", "give the robot back and leave"),
    Binding("ctrl+q", "quit", "give the robot back and leave", priority=True),
    Binding("ctrl+c", "interrupt", "the same from any dialog; exit code 130", priority=True),
]

DRIVES = frozenset(
    {
        "drive",
        "stop",
        "jump",
        "command",
        "faster",
        "release",
        "take",
        "take_or_release",
        "pick",
        "choose_robot",
        "next_robot",
        "order",
        "bare",
        "ask_consent",
        "ask_consent_because",
    }
)
"""Actions of consoles that may drive."""
STOPS = frozenset({"stop_robot", "stop_all", "lift", "lift_own", "decide"})
"""Actions of every console: stop, lift, and answer another operator who wants to lift."""
PENDANT_DOES = STOPS | {"drive", "stop", "take_or_release", "keys", "quit", "interrupt"}
"""Four keys to drive, one to stop the wheels, one to take and release, and the keys of the emergency stop."""


def has(profile: Profile, action: str) -> bool:
    """Return whether a console of this profile has this action."""
    if profile is Profile.PENDANT:
        return action in PENDANT_DOES
    return action != "take_or_release" and (profile is not Profile.MONITOR or action not in DRIVES)


def keys_help(profile: Profile, name_of: Callable[[Binding], str]) -> list[str]:
    """Return the action of each key of this profile, a line each, the keys of the emergency stop first.

    Args:
        name_of: Returns the name of a key for people.
    """
    return help_lines([one for one in Binding.make_bindings(KEYS) if has(profile, action_of(one))], name_of)


def help_lines(bindings: Iterable[Binding], name_of: Callable[[Binding], str]) -> list[str]:
    """Return the action of each key, a line for each action."""
    keys: dict[str, list[str]] = {}
    for binding in Binding.make_bindings(bindings):
        if binding.key not in ARRIVES_AS:
            keys.setdefault(binding.description, []).append(name_of(binding))
    return [f"{_span(names):<14} {description}" for description, names in keys.items()]


def action_of(binding: Binding) -> str:
    """Return the action of a key without its arguments."""
    return binding.action.partition("(")[0]


def robot_meant(*, held: str, placed: str, wanted: str, shown: str) -> str:
    """Return the robot that a stop concerns, the operator's own first; empty: ambiguous.

    Args:
        held: The held robot.
        placed: The robot in the row to which the operator moved the cursor.
        wanted: The robot that this console requests.
        shown: The robot under a cursor that the operator did not move.
    """
    return held or placed or wanted or shown


def stop_meant(stopped: Sequence[str], *, held: str, placed: str, wanted: str, shown: str) -> str:
    """Return the stopped robot that a lift concerns, the row's first; empty: none of these is stopped."""
    meant = next((robot for robot in (placed, held, wanted, shown) if robot in stopped), "")
    return meant or (stopped[0] if len(stopped) == 1 else "")


def own_stops(robots: Iterable[RobotView]) -> dict[str, int]:
    """Return the robots that this operator alone has stopped, each with the number of its stop."""
    return {one.robot: one.stop.number for one in robots if one.stop is not None and one.stop.is_mine}


@dataclass(frozen=True)
class Hint:
    """A key that the last line names.

    Attributes:
        key: Its name, for people.
        words: Its action now, for people.
        action: Action of a click on it; empty: none.
        weight: If there is not enough room, hints of more weight stay.
        style: Of the key.
    """

    key: str
    words: str
    action: str
    weight: int
    style: str = "bold"


STOP_STYLE = "bold white on red"


def hints(view: ConsoleView, profile: Profile, meant: str) -> list[Hint]:
    """Return the relevant keys, in the order on the screen.

    Args:
        view: Content of the console.
        profile: Its look.
        meant: The robot that a stop concerns.
    """
    found = [Hint("x", f"STOP {meant or 'ROBOT'}", "stop_robot", 9, STOP_STYLE)]
    found.append(Hint("X", "STOP ALL", "stop_all", 9, STOP_STYLE))
    if any(robot.stop is not None for robot in view.robots):
        found.append(Hint("c", "lift a stop", "lift", 8))
    if len(own := own_stops(view.robots)) > 1:
        found.append(Hint("C", f"lift your {len(own)}", "lift_own", 7))
    if view.own.consent is not None:
        found += [Hint("g", "yes", "decide(True)", 8), Hint("n", "no", "decide(False)", 8)]
    if profile is not Profile.MONITOR:
        found += _hands(view, profile)
    if profile is not Profile.PENDANT:
        found += [Hint("tab", "table", "panel(1)", 4), Hint("y", "why", "why", 4)]
        if view.own.lost is not None or any(not alarm.acknowledged_by for alarm in view.alarms):
            found.append(Hint("k", "seen", "acknowledge", 3))
    return [*found, Hint("?", "keys", "keys", 7), Hint("q", "quit", "quit", 7)]


def _hands(view: ConsoleView, profile: Profile) -> Iterator[Hint]:
    own, can, is_pendant = view.own, view.abilities, profile is Profile.PENDANT
    drives = own.is_held and (can is None or can.reach is not None)
    if drives:
        yield Hint("←↑↓→", "drive", "", 5)
    if own.is_held and (can is None or can.can_halt):
        yield Hint("space", "halt", "stop", 6)
    if is_pendant:
        yield Hint("enter", "give back" if own.is_asked else "take", "take_or_release", 6)
        return
    if own.is_asked:
        if not own.is_held:
            yield Hint("m", "may I?", "ask_consent", 6)
        yield Hint("r", "give back" if own.is_held else "ask no more", "release", 6)
    else:
        if any(order.robot == own.robot and not order.state.is_final for order in own.orders):
            yield Hint("space", "end order", "stop", 6)
            yield Hint("r", "give back", "release", 6)
        yield Hint("t", "take it again" if own.lost is not None else "take", "take", 6)
    if own.is_held or own.orders:
        yield Hint("O", "order", "order", 3)
    if own.orders:
        yield Hint("N", "next robot", "next_robot", 3)
    yield Hint("p", "pick robot", "pick", 3)
    if drives:
        yield Hint("+ -", "speed", "", 2)
    if own.is_held:
        if can is None or can.takes("jump"):
            yield Hint("j", "jump", "jump", 1)
        if can is not None and can.commands:
            yield Hint("o", "command", "command", 1 if drives else 5)


def key_lines(found: Sequence[Hint], columns: int, rows: int) -> Text:
    """Return the keys of the largest weight that fit; no key is cut."""
    shown = list(found)
    while shown and len(lines := _packed(shown, columns)) > rows:
        shown.remove(min(reversed(shown), key=lambda hint: hint.weight))
    return Text("\n").join(lines) if shown else Text()


def _packed(shown: Sequence[Hint], columns: int) -> list[Text]:
    lines: list[Text] = []
    for hint in shown:
        on = Style(meta={"@click": f"app.{hint.action}"}) if hint.action else Style.null()
        text = Text.assemble((f" {hint.key} ", Style.parse(hint.style) + on), (f"{hint.words} ", on))
        if lines and lines[-1].cell_len + text.cell_len <= columns:
            lines[-1].append_text(text)
        else:
            lines.append(text)
    return lines


def _span(names: Sequence[str]) -> str:
    """Return the names of keys; of a long row, only the first and last name."""
    return f"{names[0]} … {names[-1]}" if len(names) > 4 else ", ".join(names)
