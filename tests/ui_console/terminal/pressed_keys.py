"""Size of the terminal in these tests, and what the keys that drive command."""

from __future__ import annotations

from typing import Any

from ui_console.model.arc_abilities import SLOW
from ui_console.model.driving import SPEED, GiveWish, MoveWish

SIZE = (120, 36)


MOST_M_S, MOST_RAD_S = SLOW.forward_m_s, SLOW.turn_rad_s  # the sessions here know no better reach


FORWARD, BACKWARD = MoveWish(SPEED * MOST_M_S, 0.0), MoveWish(-SPEED * MOST_M_S, 0.0)


LEFT, RIGHT = MoveWish(0.0, SPEED * MOST_RAD_S / 2), MoveWish(0.0, -SPEED * MOST_RAD_S / 2)


KEYS: list[tuple[str, list[Any]]] = [
    ("up", [FORWARD]),
    ("w", [FORWARD]),
    ("down", [BACKWARD]),
    ("s", [BACKWARD]),
    ("left", [LEFT]),
    ("a", [LEFT]),
    ("right", [RIGHT]),
    ("d", [RIGHT]),
    ("space", ["stop"]),
    ("escape", ["stop"]),
    ("j", [GiveWish("jump")]),
    ("o", []),
    ("N", [("switch", "scout1")]),
    ("O", []),
    ("r", ["release"]),
    ("t", ["take"]),
    ("m", [("may I", "")]),
    ("g", []),
    ("n", []),
    ("x", ["stop", ("stop robot", "scout1")]),
    ("X", ["stop", "stop all"]),
    ("alt+x", ["stop", ("stop robot", "scout1")]),
    ("shift+x", ["stop", "stop all"]),
    ("alt+shift+x", ["stop", "stop all"]),
    ("c", []),
    ("1", [("switch", "scout1")]),
    ("2", [("switch", "scout2")]),
    ("3", []),
    ("y", [("why", "scout1")]),
    ("i", [("ask", "scout1")]),
    ("k", [("acknowledge", "no_answer:")]),
    ("K", [("acknowledge", "")]),
    ("b", ["views"]),
    ("enter", []),
]
