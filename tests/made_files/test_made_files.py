"""Every file that is made from declarations is as its declarations make it."""

from __future__ import annotations

from pathlib import Path

import pytest

from made_files import MADE_FILES, TOP


@pytest.mark.parametrize("file", MADE_FILES, ids=lambda path: path.name)
def test_a_made_file_is_what_its_declarations_make(file: Path) -> None:
    old = (TOP / file).read_text("utf-8")
    assert old == MADE_FILES[file](old), "run: python -m tests.made_files"
