"""Keys of the terminal console on a recording: for playback, for viewing, and keys that would command.

Rules of this file: no screen.
"""

from __future__ import annotations

from dataclasses import replace

from textual.binding import Binding

from ui_console.terminal.keys import KEYS, Hint, action_of

SEEK_S, SEEK_FAR_S = 5.0, 60.0  # chosen: a small step back, and a large one for recordings of an hour

PLAYS = [
    Binding("space", "play", "play, or stand still", priority=True),
    Binding("full_stop", "step", "to the next picture, decision or event, and stand still there", priority=True),
    Binding("plus,equals_sign", "speed(1)", "play faster", priority=True),
    Binding("minus", "speed(-1)", "play slower", priority=True),
    Binding("less_than_sign,left", f"seek({-SEEK_S})", f"{SEEK_S:.0f} s back", priority=True),
    Binding("greater_than_sign,right", f"seek({SEEK_S})", f"{SEEK_S:.0f} s on", priority=True),
    Binding("comma,shift+left", f"seek({-SEEK_FAR_S})", f"{SEEK_FAR_S:.0f} s back"),
    Binding("semicolon,shift+right", f"seek({SEEK_FAR_S})", f"{SEEK_FAR_S:.0f} s on"),
    Binding("home", "begin", "to the begin"),
    Binding("end", "end", "to the end"),
    Binding("n", "marker(1)", "to the next marker: a grant, its end, an alarm, an action of a person", priority=True),
    Binding("N", "marker(-1)", "to the marker before", priority=True),
    Binding("m", "markers", "list the markers, and go to one"),
    Binding("g", "go_to", "go to a time that you type"),
]
LOOKS = frozenset(
    {
        "panel",
        "row",
        "why",
        "acknowledge",
        "acknowledge_all",
        "ask_parameters",
        "search",
        "look",
        "heard",
        "keys",
        "quit",
        "interrupt",
    }
)
"""Actions of a console that command nothing."""
LEAVES = {"quit": "leave", "interrupt": "leave from any dialog; exit code 130"}
SILENT = frozenset({"bare", "take_or_release"})
"""Actions that a watching console does not have anyway."""


def looking_keys() -> list[Binding]:
    """Return the keys for viewing, without those for playback; there is no robot to release."""
    return [
        replace(one, description=LEAVES.get(action_of(one), one.description))
        for one in Binding.make_bindings(KEYS)
        if action_of(one) in LOOKS and one.key not in _playing()
    ]


def refused_keys() -> list[Binding]:
    """Return the keys that would command a mission; on a recording they show why that is not possible."""
    return [
        Binding(one.key, "not_now", "commands nothing here", priority=one.priority)
        for one in Binding.make_bindings(KEYS)
        if action_of(one) not in LOOKS | SILENT and one.key not in _playing() | {"escape"}
    ]


def recorded_hints(is_playing: bool) -> list[Hint]:
    """Return the keys in the last line."""
    return [
        Hint("space", "stand still" if is_playing else "play", "play", 9),
        Hint(".", "step", "step", 6),
        Hint("+ -", "speed", "", 5),
        Hint("← →", f"{SEEK_S:.0f} s", "", 5),
        Hint("n N", "marker", "marker(1)", 6),
        Hint("m", "markers", "markers", 4),
        Hint("g", "go to", "go_to", 4),
        Hint("tab", "table", "panel(1)", 4),
        Hint("y", "why", "why", 6),
        Hint("B", "what is said", "heard", 3),
        Hint("?", "keys", "keys", 7),
        Hint("q", "quit", "quit", 7),
    ]


def _playing() -> frozenset[str]:
    return frozenset(one.key for one in Binding.make_bindings(PLAYS))
