"""What a terminal sends becomes keys, reports and pasted text; nothing costs the emergency stop a tenth of a second."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from textual.events import AppFocus, CursorPosition, Key, MouseDown, MouseMove, MouseUp, Paste
from textual.message import Message

from ui_console.terminal.key_gate import KEYS_PER_S, MOST_AT_ONCE, MOVES_PER_S, KeyGate
from ui_console.terminal.key_stream import MOST_KEPT, KeyStream

SENT = st.text(alphabet="\x1b[]OPM?<;:0129$~^_\\xXwqäu\x07 ", max_size=60)
ANSWERS = [
    "\x1b]11;rgb:1e1e/1e1e/1e1e\x1b\\",
    "\x1b]11;rgb:1e1e/1e1e/1e1e\x07",
    "\x1bP>|xterm(370)\x1b\\",
    "\x1b_Gi=31;OK\x1b\\",
    "\x1b[?62;22c",
    "\x1b[8;24;80t",
]
"""Background color, name, picture, abilities and size: an earlier program asked for them on a slow link."""
CUT = [
    "\x1b[200~",
    "\x1b[200~text",
    "\x1b]11;rgb",
    "\x1bP>|",
    "\x1b_G",
    "\x1b[",
    "\x1b[<0;1",
    "\x1b[120;",
    "\x1b[M",
    "\x1bO",
]


@pytest.fixture(autouse=True)
def _time_is_virtual() -> None:
    """Keep the time of the machine: nothing here waits, and no loop runs."""


def keys(events: list[Message]) -> list[str]:
    return [event.key for event in events if isinstance(event, Key)]


@given(st.lists(SENT, max_size=5))
def test_a_stop_that_arrives_alone_is_a_key_at_once_whatever_came_before(sent: list[str]) -> None:
    stream = KeyStream()
    for text in sent:
        list(stream.typed(text))
    assert keys(list(stream.typed("X")))[-1] in {"X", "alt+shift+x"}


@given(st.lists(SENT, max_size=5))
def test_a_key_after_a_pause_is_a_key_whatever_came_before(sent: list[str]) -> None:
    stream = KeyStream()
    for text in sent:
        list(stream.typed(text))
    list(stream.pause())
    assert keys(list(stream.typed("w"))) == ["w"]


@given(SENT, st.integers(0, 60))
def test_no_matter_where_a_read_ends_the_same_is_understood(sent: str, at: int) -> None:
    once, twice = KeyStream(), KeyStream()
    first, second = sent[:at], sent[at:]
    if second in {"x" * len(second), "X" * len(second)}:
        return  # a stop that arrives alone is a key
    whole = [*once.typed(sent), *once.pause()]
    assert keys([*twice.typed(first), *twice.typed(second), *twice.pause()]) == keys(whole)


@pytest.mark.parametrize("answer", ANSWERS)
def test_an_answer_of_the_terminal_is_no_key(answer: str) -> None:
    assert keys(list(KeyStream().typed(answer + "w"))) == ["w"]


@pytest.mark.parametrize("cut", CUT)
@pytest.mark.parametrize("stop", ["X", "XX", "\x1b[120;2;88u"])
def test_a_stop_follows_a_cut_sequence_at_once(cut: str, stop: str) -> None:
    stream = KeyStream()
    assert not keys(list(stream.typed(cut)))
    assert set(keys(list(stream.typed(stop)))) == {"X"}
    assert keys(list(stream.typed("w"))) == ["w"]


def test_a_paste_is_text_and_no_key_wherever_it_is_cut() -> None:
    stream = KeyStream()
    pieces = ["\x1b[20", "0~may", " I, w", "hen\x1b[2", "01~w"]
    events: list[Message] = []
    for piece in pieces:
        events += [*stream.typed(piece), *stream.pause()] if piece == " I, w" else stream.typed(piece)
    assert [event.text for event in events if isinstance(event, Paste)] == ["may I, when"]
    assert keys(events) == ["w"]


def test_of_a_huge_paste_a_line_is_kept() -> None:
    pasted = [*KeyStream().typed("\x1b[200~" + "y" * 100_000 + "\x1b[201~")]
    assert [len(event.text) for event in pasted if isinstance(event, Paste)] == [MOST_KEPT]


def test_reports_are_understood_beside_keys() -> None:
    events = [*KeyStream().typed("a\x1b[I\x1b[<0;5;7M\x1b[M !!\x1b[3;4R\x1b[[A\x1b[1;5x\x1bOx")]
    assert keys(events) == ["a", "f1", "ctrl+8", "8"]
    assert [type(event) for event in events if not isinstance(event, Key)] == [AppFocus, MouseDown, CursorPosition]


def test_a_hand_is_admitted_and_a_flood_is_not_but_its_stops_are() -> None:
    gate = KeyGate()
    gate.begin(0.0)
    admitted = gate.admitted([*[Key("w", "w")] * 1000, *[Key("X", "X")] * 3], 0.1)
    assert keys(admitted) == [*["w"] * MOST_AT_ONCE, "X"]
    assert gate.has_dropped
    for number in range(1, 100):
        assert keys(gate.admitted([Key("w", "w")], 0.1 + number / 30)) == ["w"]
        assert not gate.has_dropped


@given(st.lists(st.tuples(st.floats(0.0, 0.4), st.integers(0, 200)), max_size=20))
def test_no_more_keys_are_admitted_than_a_hand_types(reads: list[tuple[float, int]]) -> None:
    gate, now_s, typed = KeyGate(), 0.0, 0
    gate.begin(now_s)
    for after_s, count in reads:
        now_s += after_s
        admitted = keys(gate.admitted([*[Key("w", "w")] * count, Key("X", "X")], now_s))
        assert admitted[-1] == "X"
        typed += len(admitted) - 1
    assert typed <= MOST_AT_ONCE + now_s * KEYS_PER_S + 1


def test_of_a_flood_of_moves_the_last_one_arrives_and_no_more_than_a_hand_makes() -> None:
    gate, stream, moves = KeyGate(), KeyStream(), []
    gate.begin(0.0)
    for number in range(1000):
        read = stream.typed(f"\x1b[<35;{number + 1};5M")
        moves += gate.admitted(read, number / 1000)
    moves += gate.admitted([], 1.1)
    assert MOVES_PER_S / 2 < len(moves) <= MOVES_PER_S + 2
    assert isinstance(moves[-1], MouseMove)
    assert moves[-1].x == 999


def test_a_release_of_the_mouse_is_always_admitted_after_its_moves() -> None:
    gate, stream = KeyGate(), KeyStream()
    gate.begin(0.0)
    typed = "\x1b[<0;5;5M" + "\x1b[<32;6;5M" * 500 + "\x1b[<0;7;5m"
    assert [type(event) for event in gate.admitted(stream.typed(typed), 0.1)] == [MouseDown, MouseUp]
    assert not gate.admitted([], 0.2)
