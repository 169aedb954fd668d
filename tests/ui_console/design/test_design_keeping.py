"""The draft file: unsaved changes survive, belong to one designer, and let no other change wait."""

from __future__ import annotations

import asyncio
import base64
import json
import threading
from pathlib import Path

import pytest
from design_stage import WITHIN_S, serving
from design_tutorial import tutorial_draft

from backbone.atomic_file import replace_file
from ui_console.design import keeping
from ui_console.design.draft import Draft
from ui_console.design.effects import set_value
from ui_console.design.file import FileChanged, save
from ui_console.design.keeping import DraftFile, DraftNotKept, DraftUnreadable, path_of_draft


def test_what_was_not_saved_is_there_again_with_what_the_file_held(tmp_path: Path) -> None:
    file = str(tmp_path / "guard.xml")
    draft = save(tutorial_draft(file), Path(file)).do(set_value((), "priority", "11"))
    DraftFile(file).keep(draft)
    resumed = DraftFile(file).resume()
    assert resumed is not None
    assert (resumed.text, resumed.saved, resumed.source) == (draft.text, draft.saved, file)
    assert not resumed.past
    save(resumed, Path(file))
    assert resumed.text == Path(file).read_bytes()


def test_a_file_that_changed_while_the_server_was_away_is_not_overwritten_unasked(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    draft = save(tutorial_draft(str(file)), file).do(set_value((), "priority", "11"))
    DraftFile(str(file)).keep(draft)
    file.write_bytes(file.read_bytes() + b"<!-- theirs -->")
    resumed = DraftFile(str(file)).resume()
    assert resumed is not None
    with pytest.raises(FileChanged):
        save(resumed, file)


def test_the_draft_file_goes_when_there_is_nothing_to_lose(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    kept, draft = DraftFile(str(file)), tutorial_draft(str(file))
    kept.keep(draft)
    assert [one.name for one in tmp_path.iterdir()] == [".guard.xml.draft"]
    kept.keep(draft.do(set_value((), "priority", "12")))
    kept.keep(save(draft, file))
    assert [one.name for one in tmp_path.iterdir()] == ["guard.xml"]
    kept.keep(save(draft, file))
    assert DraftFile(str(file)).resume() is None


def test_another_designers_draft_is_left_alone(tmp_path: Path) -> None:
    file = str(tmp_path / "guard.xml")
    one, other = DraftFile(file), DraftFile(file)
    one.keep(Draft.new(file))
    with pytest.raises(DraftNotKept, match="another designer's"):
        other.keep(tutorial_draft(file))
    one.keep(tutorial_draft(file))


def test_a_folder_that_is_gone_is_told(tmp_path: Path) -> None:
    with pytest.raises(DraftNotKept, match="No such file"):
        DraftFile(str(tmp_path / "gone" / "guard.xml")).keep(Draft.new("guard.xml"))


class SlowDisk:
    """A disk that takes its time to write.

    Attributes:
        asked: Set when it is to write.
        may_write: Until it is set, nothing is written.
    """

    def __init__(self) -> None:
        self.asked, self.may_write = threading.Event(), threading.Event()

    def replace_file(self, target: Path, content: bytes) -> None:
        self.asked.set()
        assert self.may_write.wait(4 * WITHIN_S)
        replace_file(target, content)


@pytest.fixture
def slow_disk(monkeypatch: pytest.MonkeyPatch) -> SlowDisk:
    disk = SlowDisk()
    monkeypatch.setattr(keeping, "replace_file", disk.replace_file)
    return disk


async def test_no_change_waits_until_an_earlier_one_is_on_the_disk(file: Path, slow_disk: SlowDisk) -> None:
    async with serving(file) as served, served.page() as anna:
        try:
            await anna.change(do="set", path=[], name="priority", value="11")
            assert await asyncio.to_thread(slow_disk.asked.wait, WITHIN_S)
            await anna.change(do="undo")
            await anna.change(do="redo")
        finally:
            slow_disk.may_write.set()
    resumed = DraftFile(str(file)).resume()
    assert resumed is not None
    assert resumed.mission.text("priority") == "11"


async def test_a_save_waits_for_the_disk_and_leaves_no_draft_file(file: Path, slow_disk: SlowDisk) -> None:
    async with serving(file) as served, served.page() as anna:
        await anna.change(do="set", path=[], name="priority", value="11")
        assert await asyncio.to_thread(slow_disk.asked.wait, WITHIN_S)
        saving = asyncio.create_task(anna.change(do="save", name="night.xml"))
        await anna.wait(lambda: not anna.view["status"]["is_changed"], "saved")
        slow_disk.may_write.set()
        await saving
        assert sorted(one.name for one in file.parent.iterdir()) == ["guard.xml", "night.xml"]


def encoded(text: bytes) -> str:
    return base64.b64encode(text).decode()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00\xff",
        b"[" * 100_000,
        json.dumps({"format": 1, "text": encoded(b"<mission"), "saved": None}).encode(),
        json.dumps({"format": 2, "text": encoded(b"<mission/>"), "saved": None}).encode(),
        json.dumps({"format": 1, "text": "no base64!", "saved": None}).encode(),
        json.dumps({"format": 1, "text": encoded(b"<mission/>"), "saved": None, "more": 1}).encode(),
    ],
)
def test_what_is_no_draft_is_refused_with_a_remedy(tmp_path: Path, content: bytes) -> None:
    file = str(tmp_path / "guard.xml")
    path_of_draft(file).write_bytes(content)
    with pytest.raises(DraftUnreadable) as refusal:
        DraftFile(file).resume()
    assert "Remove it" in refusal.value.remedy
