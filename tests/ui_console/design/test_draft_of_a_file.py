"""A draft of a file: opened, saved to the byte, and looked at with any fault."""

from __future__ import annotations

from pathlib import Path

import pytest
from examples import share
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shipped_drafts import SHIPPED

from backbone.mission.edit import outline
from backbone.mission.reader import MissionInvalid
from ui_console.design.commands import TextState
from ui_console.design.draft import Draft
from ui_console.design.effects import set_value
from ui_console.design.file import FileChanged, NotSaved, save
from ui_console.design.views import element_view, problems_view, tree_view


def test_an_opened_file_is_saved_to_the_byte(tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    file.write_bytes(SHIPPED[0].read_bytes())
    file.chmod(0o640)
    draft = Draft.opened(str(file))
    assert not draft.is_changed
    changed = draft.do(set_value((), "priority", "11"))
    assert changed.is_changed
    kept = save(changed, file)
    assert not kept.is_changed
    assert file.read_bytes() == SHIPPED[0].read_bytes().replace(b'priority="10"', b'priority="11"')
    assert file.stat().st_mode & 0o777 == 0o640
    assert [one.name for one in tmp_path.iterdir()] == ["mission.xml"]


def test_somebody_elses_change_is_not_overwritten_unasked(tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    draft = save(Draft.new(str(file)), file)
    file.write_bytes(draft.text + b"<!-- theirs -->")
    with pytest.raises(FileChanged, match="holds something else"):
        save(draft.do(set_value((), "priority", "11")), file)
    assert file.read_bytes().endswith(b"<!-- theirs -->")
    assert save(draft, file, overwrite=True).text == file.read_bytes()


def test_what_a_killed_save_left_is_gone_when_the_file_is_opened_again(tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    save(Draft.new(str(file)), file)
    (tmp_path / ".mission.xml.saving").write_bytes(b"half a mission")
    Draft.opened(str(file))
    assert [one.name for one in tmp_path.iterdir()] == ["mission.xml"]


def test_a_folder_that_is_not_there_refuses_and_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(NotSaved, match="No such file"):
        save(Draft.new("a.xml"), tmp_path / "no" / "a.xml")
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_xml_is_told_as_check_tells_it(tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    file.write_text("<mission")
    with pytest.raises(MissionInvalid, match=rf"{file}:1:1: not well-formed XML"):
        Draft.opened(str(file))


WORDS = st.sampled_from(
    [b"behavior", b"scout1", b"name=", b"type=", b"5", b"world", b"uses", b"arc", b"capture", b"/>"]
)


PUT = st.sampled_from([b"strange", b"", b"x ", b"type=", b"wish", b"-1", b"text</a>"])


@settings(max_examples=share(25), suppress_health_check=list(HealthCheck))
@given(WORDS, PUT, st.integers(0, 12))
def test_a_file_with_any_fault_can_be_looked_at_or_is_told_to_be_no_xml(word: bytes, put: bytes, which: int) -> None:
    parts = SHIPPED[0].read_bytes().split(word)
    at = 1 + which % (len(parts) - 1)
    text = word.join(parts[:at]) + put + word.join(parts[at:])
    try:
        outline(text)
    except MissionInvalid:
        return
    draft = Draft("mission.xml", TextState(text))
    assert len(tree_view(draft)) == sum(node.tag != "parameter" for node in draft.mission)
    assert len(problems_view(draft)) == len(draft.problems)
    for node in draft.mission:
        element_view(draft, node.path, {})
    assert draft.problems or draft.rehearsal is not None


def test_no_planner_that_a_page_names_runs_on_the_server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "planner_of_a_page.py").write_text(
        "from pathlib import Path\nPath(__file__).with_name('ran').touch()\nclass Own: ...\n"
    )
    planner = '<parameter name="planner" value="planner_of_a_page:Own"/>'
    core = f'<core><service type="rc_manager">{planner}</service></core><hosts>'
    draft = Draft("m.xml", TextState(SHIPPED[0].read_bytes().replace(b"<hosts>", core.encode())))
    assert draft.problems == ()
    assert draft.rehearsal is None
    assert not (tmp_path / "ran").exists()
