"""The files in which ``record`` writes."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from backbone.command_line.recording_work import new_files
from backbone.command_line.unusable_file import FileUnusable


def test_a_path_that_no_message_can_contain_is_refused_and_leaves_no_file(tmp_path: Path) -> None:
    strange = tmp_path / os.fsdecode(b"r\xfcbe.mcap")
    with pytest.raises(FileUnusable, match="no UTF-8"), new_files(strange, 0):
        pass
    assert os.listdir(tmp_path) == []
