"""Pictures become cells: mean greys, whole rows, equal neighbors together."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ui_console.terminal.video import GREYS, fit, row_segments, shrink


@given(st.integers(1, 400), st.integers(1, 300), st.integers(1, 130), st.integers(1, 40), st.integers(0, 255))
def test_an_even_picture_is_one_run_of_its_grey_in_every_row(
    width: int, height: int, columns: int, rows: int, grey: int
) -> None:
    steps = shrink(np.full((height, width), grey, np.uint8), columns, rows)
    assert steps.shape == (2 * rows, columns)
    assert set(steps.ravel().tolist()) == {grey * GREYS // 256}
    for row in range(rows):
        [segment] = row_segments(steps, row)
        assert segment.cell_length == columns


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(1, 20))
def test_every_row_is_as_wide_as_asked_for(seed: int, columns: int, rows: int) -> None:
    picture = np.random.default_rng(seed).integers(0, 256, (48, 64)).astype(np.uint8)
    steps = shrink(picture, columns, rows)
    assert [sum(s.cell_length for s in row_segments(steps, row)) for row in range(rows)] == [columns] * rows


def test_what_is_bright_above_and_dark_below_is_so_in_the_cell() -> None:
    steps = shrink(np.array([[255], [0]], np.uint8), 1, 1)
    [segment] = row_segments(steps, 0)
    assert segment.style is not None
    assert segment.style.color is not None
    assert segment.style.bgcolor is not None
    assert (segment.style.color.number, segment.style.bgcolor.number) == (255, 232)


@given(st.integers(1, 1000), st.integers(1, 1000), st.integers(1, 300), st.integers(1, 100))
def test_a_picture_fits_into_its_room(width: int, height: int, columns: int, rows: int) -> None:
    fitted_columns, fitted_rows = fit(width, height, columns, rows)
    assert 1 <= fitted_columns <= columns
    assert 1 <= fitted_rows <= rows


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(1, 20))
def test_a_picture_in_color_fills_every_row_and_without_hue_is_drawn_as_the_grey_one(
    seed: int, columns: int, rows: int
) -> None:
    grey = np.random.default_rng(seed).integers(0, 256, (48, 64)).astype(np.uint8)
    steps, colored = shrink(grey, columns, rows), shrink(np.repeat(grey[:, :, np.newaxis], 3, axis=2), columns, rows)
    assert colored.shape == (2 * rows, columns, 3)
    assert [row_segments(colored, row) for row in range(rows)] == [row_segments(steps, row) for row in range(rows)]


def test_colors_are_those_of_the_terminals_cube() -> None:
    steps = shrink(np.array([[[255, 0, 0]], [[0, 255, 0]]], np.uint8), 1, 1)
    [segment] = row_segments(steps, 0)
    assert segment.style is not None
    assert segment.style.color is not None
    assert segment.style.bgcolor is not None
    assert (segment.style.color.number, segment.style.bgcolor.number) == (196, 46)
