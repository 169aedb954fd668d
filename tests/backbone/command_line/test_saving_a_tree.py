"""``tree save`` writes the file that a person means."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from backbone.command_line.tree_orders import write_mission
from backbone.command_line.unusable_file import FileUnusable


def test_a_symbolic_link_stays_one_and_its_file_has_the_tree(tmp_path: Path) -> None:
    there, link = tmp_path / "missions" / "real.xml", tmp_path / "mission.xml"
    there.parent.mkdir()
    there.write_bytes(b"old")
    link.symlink_to(there)
    write_mission(link, b"new")
    assert (link.is_symlink(), there.read_bytes()) == (True, b"new")


def test_what_is_no_file_is_refused_and_stays(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for target in (pipe, tmp_path, Path("/"), Path(".")):
        with pytest.raises(FileUnusable, match=f"{target} cannot be written: it is no regular file"):
            write_mission(target, b"new")
    assert pipe.is_fifo()
