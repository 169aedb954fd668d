"""The designer's server on the loopback: designers share a draft, strangers and offenders change nothing."""

from __future__ import annotations

import asyncio
import contextlib
import json
from pathlib import Path
from typing import Any

import pytest
from design_stage import BEN, MISSION_XML, WITHIN_S, serving
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import DecodeError
from websockets.exceptions import ConnectionClosed, InvalidStatus

from ui_console.design.draft import Draft
from ui_console.design.keeping import path_of_draft
from ui_console.design.protocol import DesignIntent, Select, understand_designer
from ui_console.design.server import begin
from ui_console.web.login import MAX_MESSAGE_BYTES, Hello


def read(file: Path) -> bytes:
    return file.read_bytes()


def write(file: Path, text: bytes) -> None:
    file.write_bytes(text)


def link_to_itself(file: Path) -> None:
    file.unlink()
    file.symlink_to(file)


def names(folder: Path) -> set[str]:
    return {one.name for one in folder.iterdir()}


async def test_two_designers_see_one_draft_and_each_has_a_cursor(file: Path) -> None:
    async with serving(file) as served, served.page() as anna, served.page(BEN) as ben:
        await anna.wait(lambda: anna.view["people"] == ["anna", "ben"], "ben came")
        await ben.say(do="select", path=ben.path("resource radio"), number=1)
        await ben.wait(lambda: ben.view["element"]["tag"] == "resource", "ben's cursor")
        assert await anna.change(do="set", path=[], name="priority", value="11") is None
        await ben.wait(lambda: ben.has_element("mission iros2001 priority 11"), "anna's change")
        assert ben.view["element"]["tag"] == "resource"
        assert ben.view["status"]["changed_by"] == "anna"
        await ben.change(do="undo")
        await anna.wait(lambda: not anna.view["status"]["is_changed"], "ben took it back")


async def test_a_cursor_stays_on_its_element_when_somebody_else_removes_one_before_it(file: Path) -> None:
    async with serving(file) as served, served.page() as anna, served.page(BEN) as ben:
        await ben.say(do="select", path=ben.path("resource scout2"), number=1)
        await ben.wait(lambda: ben.view["element"]["told"] == "scout2 scout", "ben's cursor")
        await anna.change(do="remove", path=anna.path("resource radio"))
        await ben.wait(lambda: not ben.has_element("resource radio"), "anna's change")
        assert ben.view["element"]["told"] == "scout2 scout"
        assert ben.view["element"]["path"] == ben.path("resource scout2")


async def test_a_change_meant_for_an_older_draft_is_refused_with_who_changed_it(file: Path) -> None:
    async with serving(file) as served, served.page() as anna, served.page(BEN) as ben:
        revision = ben.view["status"]["revision"]
        await anna.change(do="remove", path=anna.path("robot scout3"))
        before = served.room.draft.text
        await ben.say(do="remove", path=[0], revision=revision)
        await ben.wait(lambda: ben.answers, "refused")
        assert ben.answers[0]["refused"] == "the mission was changed by anna meanwhile"
        assert served.room.draft.text == before


async def test_questions_are_asked_and_answered(file: Path) -> None:
    async with serving(file) as served, served.page() as anna:
        world = anna.path("world world")
        asked = await anna.change(do="take", path=world, label="furniture")
        assert asked is not None
        names = [one["name"] for one in asked["ask"]["asks"]]
        answers = ["shelf" if name == "name" else "0.5" for name in names]
        assert await anna.change(do="take", path=asked["path"], label=asked["ask"]["label"], answers=answers) is None
        assert anna.has_element("furniture shelf")
        assert anna.view["element"]["told"].startswith("shelf")


async def test_the_first_minute_is_told_while_it_is_looked_at_and_none_while_there_are_problems(file: Path) -> None:
    async with serving(file) as served, served.page() as anna:
        await anna.say(do="rehearse", is_shown=True)
        await anna.wait(lambda: anna.view.get("rehearsal"), "first minute")
        await anna.change(do="remove", path=anna.path("resource video1"))
        assert anna.view["status"]["problems"] > 0
        await anna.wait(lambda: anna.view["rehearsal"] is None, "none")
        await anna.change(do="undo")
        await anna.wait(lambda: anna.view["rehearsal"], "again")
        assert any(row["problems"] for row in anna.view["tree"]) is False


async def test_saving_keeps_every_other_byte_and_says_how_it_is(file: Path) -> None:
    before = read(file)
    async with serving(file) as served, served.page() as anna:
        await anna.change(do="set", path=[], name="priority", value="11")
        answer = await anna.change(do="save")
        assert answer == {"saved": str(file), "problems": 0}
        assert not anna.view["status"]["is_changed"]
    assert read(file) == before.replace(b'priority="10"', b'priority="11"', 1)
    assert names(file.parent) == {"guard.xml"}


async def test_saved_under_another_name_the_other_is_designed_and_the_first_is_as_it_was(file: Path) -> None:
    before = read(file)
    async with serving(file) as served, served.page() as anna:
        await anna.change(do="set", path=[], name="priority", value="11")
        refused = await anna.change(do="save", name="../night.xml")
        assert refused is not None
        assert "no name of a mission file" in refused["refused"]
        await anna.change(do="save", name="night.xml")
        assert anna.view["status"]["source"] == str(file.with_name("night.xml"))
        await anna.change(do="set", path=[], name="priority", value="12")
    assert read(file) == before
    assert names(file.parent) == {"guard.xml", "night.xml", ".night.xml.draft"}


async def test_what_somebody_else_wrote_is_kept_until_it_is_told_to_overwrite(file: Path) -> None:
    async with serving(file) as served, served.page() as anna:
        await anna.change(do="set", path=[], name="priority", value="11")
        theirs = read(file) + b"<!-- theirs -->\n"
        write(file, theirs)
        answer = await anna.change(do="save")
        assert answer is not None
        assert "holds something else" in answer["file_changed"]
        assert read(file) == theirs
        await anna.change(do="reread")
        assert not anna.view["status"]["is_changed"]
        write(file, b"<mission")
        answer = await anna.change(do="reread")
        assert answer is not None
        assert "not well-formed XML" in answer["refused"]
        await anna.change(do="save", overwrite=True)
    assert read(file) == theirs


async def test_a_file_that_has_become_a_loop_of_links_is_refused_and_saved_over(file: Path) -> None:
    async with serving(file) as served, served.page() as anna:
        link_to_itself(file)
        answer = await anna.change(do="reread")
        assert answer is not None
        assert "Too many levels of symbolic links" in answer["refused"]
        await anna.change(do="save")
    assert read(file) == MISSION_XML


async def test_an_unsaved_design_outlives_the_server_and_its_connections(file: Path) -> None:
    async with serving(file) as served:
        async with served.page() as anna:
            await anna.change(do="set", path=[], name="priority", value="11")
        async with served.page() as again:
            assert again.view["status"]["is_changed"]
            assert again.view["status"]["can_undo"]
    assert path_of_draft(str(file)).exists()
    assert read(file) == MISSION_XML
    async with serving(file) as served, served.page() as anna:
        assert anna.has_element("priority 11")
        await anna.change(do="save")
    assert not path_of_draft(str(file)).exists()


async def test_a_new_mission_that_nobody_touched_leaves_nothing(tmp_path: Path) -> None:
    async with serving(tmp_path / "guard.xml") as served, served.page() as anna:
        assert anna.view["status"]["is_new"]
    assert names(tmp_path) == set()


async def test_a_draft_that_cannot_be_kept_is_told(tmp_path: Path) -> None:
    folder = tmp_path / "missions"
    folder.mkdir()
    async with serving(folder / "guard.xml") as served, served.page() as anna:
        folder.rmdir()
        await anna.change(do="set", path=[], name="priority", value="11")
        await anna.wait(lambda: any("No such file" in one.get("notice", "") for one in anna.answers), "notice")


async def test_classes_are_looked_up_only_if_the_file_named_them_when_the_server_began(file: Path) -> None:
    async with serving(file) as served, served.page() as anna:
        await anna.wait(lambda: all(row["is_known"] for row in anna.view["palette"] if row["type"]), "stock looked up")
        assert await anna.change(do="take", path=[], label="types") is None
        section = anna.path("types")
        answers = ["spy", "somebody.elses:Spy", "mission_control"]
        assert await anna.change(do="take", path=section, label="type", answers=answers) is None
        await anna.say(do="look_up", type="spy")
        await anna.wait(lambda: anna.answers, "refused")
        assert "runs its code" in anna.answers[0]["refused"]
        assert "somebody.elses:Spy" not in served.asked
        await anna.change(do="save")
    async with serving(file) as served, served.page() as anna:
        await anna.say(do="look_up", type="spy")
        await anna.wait(lambda: any(row["type"] == "spy" and row["is_known"] for row in anna.view["palette"]), "known")


async def test_the_text_is_shown_as_it_would_be_saved(file: Path) -> None:
    async with serving(file) as served, served.page() as anna:
        await anna.say(do="text")
        await anna.wait(lambda: anna.answers, "text")
        assert anna.answers[0]["text"].encode() == read(file)


async def test_a_value_may_be_as_long_as_a_message_and_so_may_a_wrong_name_of_a_file(file: Path) -> None:
    async with serving(file) as served, served.page() as anna:
        assert await anna.change(do="set", path=[], name="name", value="x" * 3900) is None
        assert anna.has_element("x" * 3900)
        refused = await anna.change(do="save", name="x" * 3900)
        assert refused is not None
        assert "is no name of a mission file" in refused["refused"]


@pytest.mark.parametrize(
    ("first", "words"),
    [
        (b'{"do":"hello","token":"wrong"}', "showed a wrong token"),
        (b'{"do":"undo","revision":1}', "before it showed a token"),
        (b"x" * (MAX_MESSAGE_BYTES + 1), "more than 4096 bytes"),
        (b"\x00\x01", "means nothing"),
    ],
)
async def test_who_is_not_let_in_changes_nothing_and_the_designers_are_told(
    file: Path, first: bytes, words: str
) -> None:
    async with serving(file) as served, served.page() as anna:
        async with served.connection() as stranger:
            await stranger.send(first)
            with pytest.raises(ConnectionClosed):
                async with asyncio.timeout(WITHIN_S):
                    await stranger.recv()
        await anna.wait(lambda: any(words in one.get("notice", "") for one in anna.answers), words)
        assert not anna.view["status"]["is_changed"]


async def test_a_page_of_another_site_may_not_connect(file: Path) -> None:
    async with serving(file) as served, served.page() as anna:
        with pytest.raises(InvalidStatus, match="403"):
            async with served.connection(origin="http://evil.example"):
                pytest.fail("was let in")
        await anna.wait(lambda: any("another site" in one.get("notice", "") for one in anna.answers), "told")


async def test_a_designer_that_floods_makes_nobody_wait_and_is_cut_off_for_nonsense(file: Path) -> None:
    async with serving(file) as served, served.page() as anna, served.page(BEN) as ben:
        with contextlib.suppress(ConnectionClosed):
            for number in range(1_000):
                await ben.say(do="select", path=[number % 5], number=number)
                if number % 250 == 0:
                    await anna.change(do="set", path=[], name="priority", value=str(11 + number))
            for _ in range(10):
                await ben.say(do="format", disk="/")
        async with asyncio.timeout(WITHIN_S):
            await ben.socket.wait_closed()
        await anna.wait(lambda: any("ben at" in one.get("notice", "") for one in anna.answers), "told")
        await anna.wait(lambda: anna.view["people"] == ["anna"], "alone")


@settings(max_examples=share(150))
@given(
    st.binary(max_size=200)
    | st.recursive(st.none() | st.integers() | st.text(), st.lists).map(
        lambda value: json.dumps({"do": "move", "revision": 1, "path": value, "parent": []}).encode()
    )
)
def test_nonsense_is_never_understood_as_anything_else(data: bytes) -> None:
    try:
        said: Hello | DesignIntent = understand_designer(data)
    except (DecodeError, UnicodeError, RecursionError):
        return
    assert all(isinstance(number, int) and number >= 0 for number in getattr(said, "path", ()))


@pytest.mark.parametrize(
    "message",
    [
        {"do": "select", "path": [-1]},
        {"do": "select", "path": [0] * 33},
        {"do": "select", "path": ["0"]},
        {"do": "take", "revision": 1, "path": [], "label": "x" * 4097},
        {"do": "take", "revision": 1, "path": [], "label": "x", "answers": [""] * 17},
        {"do": "set", "revision": 1, "path": [], "name": "a", "value": "b", "more": 1},
        {"do": "save", "revision": "1"},
        {"do": "save", "revision": 1, "name": "x" * 4097},
        {"do": "undo"},
    ],
)
def test_what_is_too_much_or_of_another_type_means_nothing(message: dict[str, Any]) -> None:
    with pytest.raises(DecodeError):
        understand_designer(json.dumps(message))


def test_an_element_is_chosen_by_its_place() -> None:
    assert understand_designer('{"do":"select","path":[2,0],"number":7}') == Select((2, 0), 7)


def test_it_begins_with_what_was_not_saved_else_with_the_file_else_with_a_new_mission(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    assert begin(str(file))[0] == Draft.new(str(file))
    write(file, MISSION_XML)
    assert begin(str(file))[0].text == read(file)
