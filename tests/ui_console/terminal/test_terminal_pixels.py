"""Real pixels: the escape sequences are complete, and only terminals with the protocol get them."""

from __future__ import annotations

import base64
import re
import unicodedata

import cv2
import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.terminal_theme import DIMMED_MONOKAI
from textual.color import Color
from textual.filter import ANSIToTruecolor

from ui_console.terminal.pixels import (
    CHUNK_BYTES,
    IMAGE,
    MOST_ROWS,
    PLACEHOLDER,
    ROW_MARKS,
    can_show_pixels,
    png,
    row_of_cells,
    send,
)


@settings(max_examples=share(30))
@given(st.integers(0, 2**32 - 1), st.integers(1, 330), st.integers(1, 250))
def test_a_picture_as_png_is_the_same_picture(seed: int, width: int, height: int) -> None:
    picture = np.random.default_rng(seed).integers(0, 256, (height, width)).astype(np.uint8)
    read = cv2.imdecode(np.frombuffer(png(picture), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert np.array_equal(read, picture)


def test_what_is_sent_comes_in_chunks_that_make_up_the_picture_and_takes_no_cell() -> None:
    picture = np.random.default_rng(1).integers(0, 256, (240, 320)).astype(np.uint8)
    segment = send(picture, 80, 30)
    chunks = re.findall(r"\x1b_G([^;]*);([^\x1b]*)\x1b\\", segment.text)
    assert len(chunks) > 5
    assert all(len(payload) <= CHUNK_BYTES for _keys, payload in chunks)
    assert chunks[0][0] == "a=T,U=1,i=42,f=100,c=80,r=30,q=2,m=1"
    assert [keys.partition(",")[0] for keys, _payload in chunks[1:]] == ["m=1"] * (len(chunks) - 2) + ["m=0"]
    assert base64.standard_b64decode("".join(payload for _keys, payload in chunks)) == png(picture)
    assert segment.cell_length == 0


def test_rows_of_placeholders_are_as_wide_as_asked_for_and_say_which_row_they_are() -> None:
    for row in (0, MOST_ROWS - 1):
        segment = row_of_cells(row, 40)
        assert segment.cell_length == 40
        assert segment.text.startswith(PLACEHOLDER + ROW_MARKS[row])
        assert segment.text.count(PLACEHOLDER) == 40
    assert len(set(ROW_MARKS)) == MOST_ROWS
    assert all(unicodedata.combining(mark) == 230 for mark in ROW_MARKS)


def test_the_color_that_names_the_picture_stays_as_it_is_on_the_way_to_the_terminal() -> None:
    on_its_way = ANSIToTruecolor(DIMMED_MONOKAI).apply([row_of_cells(0, 3)], Color(0, 0, 0))
    color = on_its_way[0].style.color if on_its_way[0].style is not None else None
    assert color is not None
    assert color.triplet == (0, 0, IMAGE)


@pytest.mark.parametrize(
    ("environment", "can"),
    [
        ({"TERM": "xterm-kitty"}, True),
        ({"TERM": "xterm-256color", "KITTY_WINDOW_ID": "1"}, True),
        ({"TERM": "xterm-256color", "TERM_PROGRAM": "ghostty"}, True),
        ({"TERM": "xterm-kitty", "TMUX": "default,1,0"}, False),
        ({"TERM": "xterm-kitty", "NO_COLOR": "1"}, False),
        ({"TERM": "xterm-256color"}, False),
        ({}, False),
    ],
)
def test_only_terminals_that_know_the_protocol_are_sent_pixels(environment: dict[str, str], can: bool) -> None:
    assert can_show_pixels(environment) is can


def test_a_picture_in_color_is_packed_as_it_is() -> None:
    picture = np.random.default_rng(1).integers(0, 256, (5, 7, 3)).astype(np.uint8)
    unpacked = cv2.imdecode(np.frombuffer(png(picture), np.uint8), cv2.IMREAD_UNCHANGED)
    assert (unpacked[:, :, ::-1] == picture).all()
