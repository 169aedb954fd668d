"""A file in which no recording can begin is refused before anything starts, in one sentence with one remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from backbone.launcher.mission_recorder import RecorderFailed, require_new, require_writable

UNUSABLE = {
    "/proc/night.mcap": "cannot be written: ",
    f"{'n' * 300}.mcap": "cannot be written: File name too long",
    f"{'n' * 5000}/night.mcap": "there is no folder ",
    "nights/night.mcap": "there is no folder ",
    "night.mcap/night.mcap": "there is no folder ",
    ".": " is no regular file",
    "/": " is no regular file",
    "/dev/null": " is no regular file",
}


@pytest.mark.parametrize(("name", "why"), UNUSABLE.items(), ids=lambda text: text[:20])
def test_one_that_cannot_be_made(name: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("night.mcap").touch()
    with pytest.raises(RecorderFailed, match=why):
        require_writable(Path(name))
    with pytest.raises(RecorderFailed):
        require_new(Path(name))
    assert [one.name for one in tmp_path.iterdir()] == ["night.mcap"]


def test_one_that_exists_is_no_new_one_but_begins_a_series(tmp_path: Path) -> None:
    path = tmp_path / "night.mcap"
    path.touch()
    with pytest.raises(RecorderFailed, match="exists"):
        require_new(path)
    require_writable(path)
    assert list(tmp_path.iterdir()) == [path]
