"""The places where a stop can be given: every screen, dialog and focus of every console, and the way to each.

Rule of this file: data only. ``tests/ui_console/test_stops_table.py`` compares it with the consoles' own lists, so
that a new table, dialog or control without a place fails that test.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

ROBOT = "scout3"
"""The robot of the console that is tried."""
OTHERS = ("scout1", "scout2")
OPERATOR = "tina"  # at the terminal
OWN_STOP = "stopped by the operator"
"""Robots that other operators drive meanwhile."""


class Link(StrEnum):
    """State of the console's link, and of its robot, while the stop is given."""

    UP = "up"  # connected; the console drives the robot if it can
    OTHER = "other holds"  # connected; another operator drives the robot
    CUT = "cut"  # no byte passes between the console and the mission
    FROZEN = "frozen"  # the console's process, or the browser's of its page, is stopped


class Gesture(StrEnum):
    """Manner of the stop."""

    ONE = "one"
    ALL = "all"
    RED_ONE = "red button of the robot"
    RED_MINE = "red button of the hand"
    RED_ALL = "red button of all"
    PAD_ONE = "gamepad, one"
    PAD_ALL = "gamepad, all"

    @property
    def is_for_all(self) -> bool:
        """Whether it stops all robots."""
        return self in (Gesture.ALL, Gesture.RED_ALL, Gesture.PAD_ALL)


@dataclass(frozen=True)
class Place:
    """A screen, dialog or focus.

    Attributes:
        name: Name in the table.
        of: Its part of the code: a table's name, the method that opens a dialog, an id or a class of the page.
        open: Keys of a terminal, or a script of the page, that open it.
        shows: Pattern on the terminal, or condition of the page, once it is open; empty: no wait.
        close: Keys or script that lead back.
        needs: Required state: "stopped" (another operator has stopped another robot), OWN_STOP (this one has), "asked"
            (another operator asks), "held" (the console holds ``ROBOT``: no such cell while another operator does).
        meant: The robot that a stop of one robot concerns here while another operator holds ``ROBOT``.
    """

    name: str
    of: str
    open: str = ""
    shows: str = ""
    close: str = ""
    needs: str = ""
    meant: str = ROBOT


def _table(number: int, name: str) -> Place:
    return Place(name, f"panel:{name}", "Tab " * number, close="BTab " * number)


TABLES = ("robots", "tree", "schedule", "timeline", "alarms", "links", "parameters", "components", "log")
PANELS = tuple(_table(number, name) for number, name in enumerate(TABLES))
READING = (
    Place("dialog of keys", "action_keys", "?", "these keys|EMERGENCY STOP of all", "Escape"),
    Place("dialog of reasons", "_why", "y", r"why scout\d\?", "Escape"),
)
LOOKING = (
    Place("dialog of views", "_look", "b", "what the behaviors see", "Escape"),
    Place("view of a behavior", "_look", "b Enter", "escape leaves", "Escape"),
    Place("list of the bus's keys", "action_heard", "B", "what is said", "Escape"),
)
LIFTING = (
    Place("dialog to lift", "action_lift", "c", "lift the stop of", "Escape", "stopped", OTHERS[1]),
    Place("dialog to lift one's own", "action_lift_own", "C", "lift your 1 stop", "Escape", OWN_STOP, OTHERS[1]),
)
WRITING = (
    Place("field of the log's search", "action_search", "/", "search the log", "Escape"),
    Place("field of a parameter", "action_edit", "i e", "x and X stop robots here too", "Escape" + " BTab" * 6),
)
DRIVING = (
    Place("picture alone", "action_bare", "v", close="v"),
    Place("dialog of commands", "action_command", "o", "which command", "Escape", needs="held"),
    Place("dialog of orders", "action_order", "O", "to do by itself", "Escape"),
    Place("field of an order", "action_order", "O Enter", "go to a place", "Escape"),
    Place("dialog of robots", "action_pick", "p Up", "which robot", "Escape", meant=OTHERS[1]),
    Place("field of a reason", "action_ask_consent_because", "M", "may I have it", "Escape"),
)
TERMINAL = (*PANELS, *DRIVING, *READING, *LOOKING, *WRITING, *LIFTING)
MONITOR = (*PANELS, *READING, *LOOKING, *WRITING, *LIFTING)
PENDANT = (Place("the screen", "screen"), READING[0], *LIFTING)
HEADLESS = (Place("no screen", "headless"),)
SCRIPT = (Place("a drive runs", "drive"), Place("nothing is due", "pause"))


def _focus(selector: str, reveal: str = "") -> Place:
    script = f"{reveal}document.querySelector('{selector}')?.focus()"
    return Place(f"focus on {selector}", selector, script, close="document.activeElement.blur()")


def _answer(selector: str) -> Place:
    """Return an answer to a question; the page enables it when a person could have read the question."""
    focused = f"(document.querySelector('{selector}:enabled')?.focus(), document.activeElement.matches('{selector}'))"
    return replace(_focus(selector), shows=focused, needs="asked")


def _revealed(area: str, selector: str, more: str = "") -> Place:
    area = f"document.getElementById('{area}')"
    shown = _focus(selector, f"{area}.hidden = false; {more}")
    return Place(shown.name, shown.of, shown.open, close=f"{shown.close}; {area}.hidden = true")


def _tab(name: str) -> Place:
    return Place(f"table of {name}", f"tab:{name}", f"document.getElementById('tab-{name}').click()")


def _card(part: str, robot: str, needs: str = "") -> Place:
    selector = f".robot[data-robot={robot}] {CARD[part]}"
    script = f"document.querySelector('{selector}').focus()"
    return Place(f"card of {robot}, {part}", part, script, "", "document.activeElement.blur()", needs, robot)


def _log_field(selector: str) -> Place:
    selector = f"#log-search {selector}" if selector[0] == "[" else selector
    reveal = "document.getElementById('tab-log').click(); "
    return replace(_focus(selector, reveal), close="document.getElementById('tab-alarms').click()")


NAMED = ("text", "robot", "person", "level", "since", "until")
LOG_FIELDS = (*(f"[name={name}]" for name in NAMED), "[type=submit]", "[type=reset]", "#log-export")
CARD = {
    "take": ".row button:nth-child(1)",
    "stop_robot": ".row button:nth-child(2)",
    "why": ".row button:nth-child(3)",
    "enlarge": ".enlarge",
    "lift": ".lift",
}
CONTROLS = (
    "theme",
    "stop-all",
    "pad",
    "stop-mine",
    "halt",
    "take",
    "may-i",
    "release",
    "speed",
    "panel",
    "news",
    "more",
)
SEEN = "document.getElementById('seen-panel').open = true; "
BUS = "document.getElementById('bus-panel').open = true; "
BUS_VIEW = f"{BUS}document.getElementById('bus-view').hidden = false; "
MAP = ("go", "watch", "return", "end", "follow", "target")
CLOSE = "document.getElementById('reading').close()"
PAGE = (
    Place("nothing has the focus", "body"),
    *map(_tab, TABLES),
    *(_focus(f"#{control}") for control in CONTROLS),
    *(_focus(f"#map-{control}") for control in MAP),
    *(_focus(f"#seen-{control}", SEEN) for control in ("behavior", "view")),
    *(_focus(f"#bus-{control}", BUS) for control in ("words", "order", "keys")),
    *(_focus(f"#bus-{control}", BUS_VIEW) for control in ("back", "fields")),
    *(_revealed("login", selector) for selector in ("#login-token", "#login-user", "#login [type=submit]")),
    *(_revealed("lost", selector) for selector in ("#retake", "#dismiss")),
    _revealed("kinds", "#kind"),
    _revealed("kinds", "#take-so", "document.getElementById('take-so').disabled = false; "),
    *map(_answer, ("#consent-yes", "#consent-no")),
    *map(_log_field, LOG_FIELDS),
    *(_card(part, ROBOT) for part in ("take", "stop_robot", "why")),
    *(_card(part, OTHERS[0]) for part in ("take", "stop_robot", "why", "enlarge")),
    _card("lift", OTHERS[1], "stopped"),
    Place(
        "dialog of reasons",
        "#reading",
        f"document.querySelector('.robot[data-robot={ROBOT}] {CARD['why']}').click()",
        "document.getElementById('reading').open",
        CLOSE,
    ),
    Place(
        "field of a parameter",
        "input",
        "document.getElementById('tab-components').click();"
        f"document.querySelector('[data-key=\"parameters:{ROBOT}\"]').click()",
        "(document.querySelector('#panel input') ?? document.body).focus() || document.activeElement.matches('input')",
        "document.activeElement.blur(); document.getElementById('tab-alarms').click()",
    ),
    Place("command's button", "#commands", "document.querySelector('#commands button')?.focus()"),
    Place("alarm's buttons", "#alarm-bar", "document.querySelector('#alarm-bar button')?.focus()"),
)

KEYS = (Gesture.ONE, Gesture.ALL)
RED = (Gesture.RED_ONE, Gesture.RED_MINE, Gesture.RED_ALL)
PAD = (Gesture.PAD_ONE, Gesture.PAD_ALL)


@dataclass(frozen=True)
class Kind:
    """A kind of console.

    Attributes:
        gestures: The manners of stop that it has.
        drives: Whether it holds a robot.
        size: Columns and lines of a terminal; (0, 0) for a console without a terminal.
    """

    places: tuple[Place, ...]
    gestures: tuple[Gesture, ...]
    drives: bool = True
    size: tuple[int, int] = (0, 0)
    words: tuple[str, ...] = ()


ATTACH = ("attach", ROBOT)
KINDS = {
    "terminal": Kind(TERMINAL, KEYS, size=(120, 40), words=ATTACH),
    "terminal 80x24": Kind(TERMINAL, KEYS, size=(80, 24), words=ATTACH),
    "pendant": Kind(PENDANT, KEYS, size=(80, 24), words=(*ATTACH, "--profile", "pendant")),
    "monitor": Kind(MONITOR, KEYS, drives=False, size=(80, 24), words=("monitor",)),
    "gamepad": Kind(TERMINAL, PAD, size=(120, 40), words=(*ATTACH, "--gamepad")),
    "headless": Kind(HEADLESS, PAD, words=(*ATTACH, "--profile", "headless")),
    "page desktop": Kind(PAGE, (*KEYS, *RED, *PAD)),
    "page tablet": Kind(PAGE, (*KEYS, *RED)),
    "page phone": Kind(PAGE, (*KEYS, *RED)),
    "script": Kind(SCRIPT, KEYS, words=(*ATTACH, "--json")),
}


@dataclass(frozen=True)
class Cell:
    """A cell of the table."""

    console: str
    place: Place
    gesture: Gesture
    link: Link


def cells(console: str) -> list[Cell]:
    """Return all cells of a console, in the best order of trials."""
    kind = KINDS[console]
    return [
        Cell(console, place, gesture, link)
        for link in Link
        for place in kind.places
        for gesture in kind.gestures
        if not (link is not Link.UP and gesture is Gesture.RED_MINE)  # this button is shown only to hands that drive
        and not (link is Link.UP and not kind.drives)
        and not (console == "script" and link is Link.OTHER and place.of == "drive")
        and not (link is Link.OTHER and place.needs == "held")
    ]
