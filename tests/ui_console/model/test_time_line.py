"""Laws of the line of a recording's time."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from backbone.recording.markers import Marker, MarkerKind
from backbone.recording.playback import FASTEST, SLOWEST
from ui_console.model.time_line import SPEEDS, WEIGHTS, TimeLine, next_speed

TIMES = st.floats(0.0, 100.0)
COLUMNS = st.integers(1, 200)


@st.composite
def lines(draw: st.DrawFn) -> TimeLine:
    begin_s, end_s = sorted((draw(TIMES), draw(TIMES)))
    times = draw(st.lists(st.floats(begin_s, end_s), max_size=20))
    kinds = [draw(st.sampled_from(MarkerKind)) for _ in times]
    markers = [Marker(at_s, kind, "a", "line") for at_s, kind in zip(sorted(times), kinds, strict=True)]
    return TimeLine(begin_s, end_s, markers)


@given(lines(), COLUMNS)
def test_every_marker_is_in_its_column_unless_a_heavier_one_is(line: TimeLine, columns: int) -> None:
    marks = line.marks(columns)
    for marker in line.markers:
        shown = marks[line.column(marker.at_s, columns)]
        assert shown is not None
        assert WEIGHTS[shown] >= WEIGHTS[marker.kind]
    assert sum(mark is not None for mark in marks) <= len(line.markers)


@given(lines(), COLUMNS, st.integers(-5, 300))
def test_every_column_goes_to_a_time_of_the_recording_that_it_shows(line: TimeLine, columns: int, column: int) -> None:
    at_s = line.time(column, columns)
    assert line.begin_s <= at_s <= line.end_s
    if line.end_s - line.begin_s > 1e-6 and 0 <= column < columns:
        assert abs(line.column(at_s, columns) - column) <= 1, "but for rounding"


@given(lines())
def test_from_marker_to_marker_each_time_is_come_by_once_in_both_directions(line: TimeLine) -> None:
    times = sorted({marker.at_s for marker in line.markers})
    on, back = list[float](), list[float]()
    at_s = line.begin_s - 1.0
    while (marker := line.after(at_s)) is not None:
        at_s = marker.at_s
        on.append(at_s)
        assert line.upto(at_s) is not None
    at_s = line.end_s + 1.0
    while (marker := line.before(at_s)) is not None:
        at_s = marker.at_s
        back.append(at_s)
    assert on == times == back[::-1]


@given(st.floats(SLOWEST, FASTEST), st.integers(-12, 12))
def test_every_speed_is_one_that_can_be_played(speed: float, steps: int) -> None:
    assert next_speed(speed, steps) in SPEEDS
    assert (SPEEDS[0], SPEEDS[-1]) == (SLOWEST, FASTEST)
