"""Laws of the list of keys, of plots, and of the view of one key."""

from __future__ import annotations

import base64
import json

import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from ui_console.model.key_table import MOST_KEYS, PART_S, PARTS, KeyTable
from ui_console.model.key_view import MOST_SERIES, KeyView
from ui_console.model.message_views import (
    LONGEST_TEXT,
    MOST_ROWS,
    VIEWS,
    FieldRow,
    Fields,
    MessageView,
    field_rows,
    installed_views,
)
from ui_console.model.series import PARTS as SERIES_PARTS
from ui_console.model.series import SPAN_S, Series

KEY, SOURCE, SCHEMA = "scout/night/resource_pool/scout1/readings", "resource_pool/scout1", "Readings/1"
TIMES = st.floats(0.0, 1000.0)
NUMBERS = st.floats(-1e6, 1e6)
SAMPLES = st.lists(st.tuples(TIMES, NUMBERS), min_size=1, max_size=60).map(sorted)
LEAVES = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5)
BODIES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=20) | st.dictionaries(st.text(max_size=3), inner, max_size=5)
)


@settings(max_examples=share(100))
@given(st.floats(1.0, 200.0), st.floats(1.0, 30.0), st.integers(1, 5000))
def test_what_is_said_steadily_has_its_rate_and_size(rate_hz: float, lasts_s: float, size_bytes: int) -> None:
    table = KeyTable(0.0)
    for number in range(1, int(lasts_s * rate_hz) + 1):
        table.add(KEY, SOURCE, SCHEMA, size_bytes, number / rate_hz)
    (row,) = table.rows(lasts_s)
    span_s = min(lasts_s, (PARTS - 1) * PART_S)
    assert row.messages_per_s == pytest.approx(rate_hz, abs=2.0 / span_s)
    assert row.bytes_per_s == pytest.approx(row.messages_per_s * size_bytes)
    assert row.mean_bytes == size_bytes
    assert row.id == ("resource_pool/scout1/readings", SOURCE, SCHEMA)


def test_a_key_that_falls_silent_stays_in_the_list_without_a_rate() -> None:
    table = KeyTable(0.0)
    table.add(KEY, SOURCE, SCHEMA, 10, 1.0)
    (row,) = table.rows(1.0 + PARTS * PART_S + PART_S)
    assert (row.messages_per_s, row.bytes_per_s, row.mean_bytes, row.heard_s) == (0.0, 0.0, 10.0, 1.0)


def test_a_mission_ten_times_as_fast_says_ten_times_as_much_in_a_second_of_the_machine() -> None:
    table = KeyTable(0.0)
    for number in range(40):
        table.add(KEY, SOURCE, SCHEMA, 10, number / 10)
    assert table.rows(4.0, 10.0)[0].messages_per_s == pytest.approx(10 * table.rows(4.0)[0].messages_per_s)


def test_a_flood_of_keys_pushes_out_those_that_were_silent_longest() -> None:
    table = KeyTable(0.0, [("scout/night/never", "", "")])
    for number in range(MOST_KEYS + 10):
        table.add(f"scout/night/a/b{number}/log", SOURCE, SCHEMA, 10, float(number))
    keys = {row.key for row in table.rows(1e4)}
    assert len(keys) == MOST_KEYS
    assert "never" not in keys
    assert f"a/b{MOST_KEYS + 9}/log" in keys


@settings(max_examples=share(100))
@given(SAMPLES, st.integers(1, 300))
def test_a_plot_has_the_least_and_most_number_of_the_span_at_any_width(
    samples: list[tuple[float, float]], count: int
) -> None:
    series = Series()
    for at_s, number in samples:
        series.add(at_s, number)
    now_s, part_s = samples[-1][0], SPAN_S / SERIES_PARTS
    kept = [number for at_s, number in samples if at_s // part_s > now_s // part_s - SERIES_PARTS]
    extent = series.extent(now_s)
    assert extent == (min(kept), max(kept))
    columns = [one for one in series.columns(now_s, count) if one is not None]
    assert (min(one.least for one in columns), max(one.most for one in columns)) == extent
    assert len(series) <= SERIES_PARTS


@given(SAMPLES, st.integers(1, 100), st.floats(0.0, 2 * SPAN_S))
def test_a_number_holds_until_the_next_one_comes(
    samples: list[tuple[float, float]], count: int, later_s: float
) -> None:
    series = Series()
    for at_s, number in samples:
        series.add(at_s, number)
    now_s = samples[-1][0] + later_s
    columns = series.columns(now_s, count)
    first = next((at for at, one in enumerate(columns) if one is not None), count)
    levels = series.levels(now_s, count)
    assert len(levels) == count - first
    assert all(one is None or level == one.most for one, level in zip(columns[first:], levels, strict=True))


def test_what_is_no_number_and_what_is_too_old_is_not_plotted() -> None:
    series = Series()
    for at_s, number in ((100.0, 1.0), (100.0, float("nan")), (101.0, float("inf")), (100.0 - 2 * SPAN_S, 5.0)):
        series.add(at_s, number)
    assert series.extent(101.0) == (1.0, 1.0)


@given(BODIES)
def test_any_message_is_shown_in_rows_of_printable_text(body: object) -> None:
    rows = field_rows(body)
    assert len(rows) <= MOST_ROWS
    assert all((row.name + row.text).isprintable() and len(row.text) <= LONGEST_TEXT + 30 for row in rows)


def plotted(view: KeyView) -> list[str]:
    """Return the numbers of the newest message that have a plot."""
    return [row.name for row in view.rows if row.number is not None and view.series(row.name) is not None]


@given(st.lists(st.dictionaries(st.text(max_size=3), BODIES, max_size=5) | BODIES, max_size=10))
def test_a_view_of_a_key_takes_any_message_and_stays_small(bodies: list[object]) -> None:
    view = KeyView("Frame/1", VIEWS)
    for number, body in enumerate(bodies):
        view.take(body, float(number), number)
        assert all(view.series(name) is not None for name in plotted(view))
    assert view.messages == len(bodies)


def test_a_key_whose_names_change_with_each_message_keeps_a_bounded_number_of_plots() -> None:
    view = KeyView("Odd/1", {})
    for number in range(2 * MOST_SERIES):
        view.take({f"n{number}": number}, float(number), number)
    assert sum(view.series(f"n{number}") is not None for number in range(2 * MOST_SERIES)) == MOST_SERIES
    assert plotted(view) == [f"n{2 * MOST_SERIES - 1}"]


@pytest.mark.parametrize(("pixels", "is_color"), [(bytes(6), False), (bytes(18), True)])
def test_a_picture_is_shown_as_one_and_its_other_fields_as_rows(pixels: bytes, is_color: bool) -> None:
    view = KeyView("Frame/1", installed_views())
    body = {"robot": "scout1", "width_px": 3, "height_px": 2, "pixels": base64.b64encode(pixels).decode()}
    view.take(body, 1.0, 1)
    assert view.picture is not None
    assert (view.picture.is_color, view.picture.pixels) == (is_color, pixels)
    assert [row.name for row in view.rows] == ["robot", "width_px", "height_px"]
    view.take({**body, "height_px": 5}, 2.0, 2)
    assert view.picture is None


class Halved(MessageView):
    def rows(self, fields: Fields) -> list[FieldRow]:
        half = float(json.dumps(fields["whole"])) / 2
        return [FieldRow("half", f"{half:g} of it", half)]


def test_a_view_of_a_package_shows_the_messages_of_its_schema_and_plots_what_it_makes_of_them() -> None:
    view = KeyView("Whole/1", {"Whole/1": Halved})
    view.take({"whole": 3}, 1.0, 1)
    assert (view.rows, plotted(view), view.trouble) == ([FieldRow("half", "1.5 of it", 1.5)], ["half"], "")


def test_a_message_that_its_view_cannot_show_is_shown_as_a_table_and_says_so() -> None:
    view = KeyView("Whole/1", {"Whole/1": Halved})
    view.take({"part": 3}, 1.0, 1)
    assert view.rows == [FieldRow("part", "3", 3.0)]
    assert "Halved cannot show it" in view.trouble
