"""The picture of an experiment names its lines beside them, and says how often and from which seed it was tried."""

from __future__ import annotations

import io
import itertools
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from mission_control.laboratory.experiments.conditions import ALWAYS, PAPERS, QUARTER, Condition
from mission_control.laboratory.experiments.plot import (
    COLORS,
    LEAST_GAP,
    MARKERS,
    THE_PAPERS,
    NoPlotting,
    UnknownFormat,
    apart,
    plot,
    require_format,
    require_plotting,
    series,
)
from mission_control.laboratory.experiments.screen import table
from mission_control.laboratory.experiments.surveillance import ConditionRow, SurveillanceOutcome


def row(condition: Condition, detected: int = 40, trials: int = 50, predicted: float = 0.8) -> ConditionRow:
    return ConditionRow(condition, trials, detected, predicted, 0, 0, [], 0, 0, 1.0, "")


OUTCOME = SurveillanceOutcome(7, [row(condition) for condition in (*PAPERS, *QUARTER, *ALWAYS)], 1.0)


def luminance(color: str) -> float:
    """Return the relative luminance by WCAG 2.1."""
    parts = [int(color[place : place + 2], 16) / 255 for place in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@given(st.lists(st.floats(0, 100), max_size=10))
def test_names_never_cover_each_other_and_keep_the_order_of_their_lines(heights: list[float]) -> None:
    placed = apart(heights)
    inside = sorted(placed)
    assert all(high - low >= LEAST_GAP - 1e-6 for low, high in itertools.pairwise(inside))
    for one, other in ((a, b) for a in range(len(heights)) for b in range(len(heights))):
        if heights[one] < heights[other]:
            assert placed[one] < placed[other]


@given(st.lists(st.integers(0, 20), max_size=6, unique=True))
def test_names_that_have_room_stay_beside_their_lines(steps: list[int]) -> None:
    heights = [LEAST_GAP * step for step in steps]
    assert apart(heights) == pytest.approx(heights)


def test_each_policy_and_way_of_driving_is_a_line_with_its_intervals_and_the_papers_are_one() -> None:
    shown = series(OUTCOME.rows)
    assert next(iter(shown)) == "paper, pioneer 0.5 m/s"
    assert list(shown)[-2:] == [f"{THE_PAPERS}, pioneer", f"{THE_PAPERS}, person"]
    assert len(shown) == 7
    for points in shown.values():
        assert [point.extra for point in points] == sorted(point.extra for point in points)
        assert all(point.low <= point.rate <= point.high for point in points)


def test_lines_differ_in_color_shape_and_brightness_from_paper() -> None:
    assert len(set(COLORS)) == len(COLORS) == len(MARKERS) == len(set(MARKERS))
    assert all((1.05 / (luminance(color) + 0.05)) > 2.0 for color in COLORS)


def test_the_picture_says_how_often_from_which_seed_and_what_each_line_is(tmp_path: Path) -> None:
    file = tmp_path / "rates.svg"
    try:
        require_plotting()
    except NoPlotting:
        pytest.skip("matplotlib is not installed")
    plot(OUTCOME, file, "Surveillance")
    drawn = file.read_text()
    for text in ("Surveillance", "50 trials of each condition, seed 7", "95 %", "predicted", *series(OUTCOME.rows)):
        assert text in drawn


def test_the_table_says_how_often_from_which_seed_and_explains_its_mark() -> None:
    console = Console(width=200, file=io.StringIO())
    with console.capture() as captured:
        console.print(table(SurveillanceOutcome(3, [row(Condition(), 20, 50, 0.8)], 1.0), "Surveillance"))
    drawn = captured.get()
    assert "Surveillance: 50 trials of each condition, seed 3" in drawn
    assert "s.e. !" in drawn
    assert "beyond 3 (marked !)" in drawn


@pytest.mark.parametrize("name", ["rates.gif", "rates.pgf", "rates.txt", "rates"])
def test_only_the_two_formats_of_the_remedy_are_accepted(name: str) -> None:
    pytest.importorskip("matplotlib")
    with pytest.raises(UnknownFormat, match=r"\.png or \.svg"):
        require_format(Path(name))
    require_format(Path("rates.PNG"))
    require_format(Path("rates.svg"))
