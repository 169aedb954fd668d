"""The designer's keys, each of them, and the tutorial typed as it stands."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from design_keys import WATCH, known, press, settle
from screen_text import same_as_before, screen_text
from textual.binding import Binding
from textual.pilot import Pilot

from backbone.mission.class_facts import ClassFacts
from ui_console.design.draft import Draft
from ui_console.design.screen import DesignApp, PanelName, keys_help

ROOT = Path(__file__).parents[3]
SIZE = (100, 32)


def app_of(draft: Draft) -> DesignApp:
    return DesignApp(draft, known)


def shipped() -> Draft:
    return Draft.opened(str(ROOT / "tests" / "backbone" / "mission" / "everything_declared.xml"))


def two_hosts() -> Draft:
    text = shipped().text.replace(b"  </hosts>", b'    <host name="other" address="192.0.2.7"/>\n  </hosts>')
    return Draft("mission.xml", type(shipped().step)(text), saved=text)


# ---------------------------------------------------------------------- every key
async def test_siblings_change_places() -> None:
    app = app_of(two_hosts())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await press(pilot, "down down shift+down")
        changed = app.draft.text.partition(b"</hosts>")[0]
        assert changed.index(b'name="other"') < changed.index(b'name="base"')
        await press(pilot, "shift+up")
        assert app.draft.text == two_hosts().text
        await press(pilot, "J")
        assert app.draft.text.startswith(changed)
        await press(pilot, "K")
        assert app.draft.text == two_hosts().text


async def test_priorities_rise_and_fall_and_steps_go_back_and_forth() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        for key, priority in [
            ("plus", 11),
            ("equals_sign", 12),
            ("minus", 11),
            ("u", 12),
            ("ctrl+z", 11),
            ("U", 12),
            ("ctrl+y", 11),
            ("ctrl+y", 11),
        ]:
            await press(pilot, key)
            assert app.node.text("priority") == str(priority)
        assert app.draft.text == shipped().text.replace(b'priority="10"', b'priority="11"')
        await press(pilot, "down plus")
        assert app.draft.problems == ()


async def test_the_cursor_moves_and_pages_in_the_panel_that_tab_chose() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await press(pilot, "down down up")
        assert app.node.tag == "hosts"
        await press(pilot, "pagedown")
        far = app.node.path
        assert far > (3,)
        await press(pilot, "pageup")
        assert app.node.tag == "hosts"
        await press(pilot, "tab")
        assert app.chosen is PanelName.PROPERTIES
        await press(pilot, "tab tab shift+tab shift+tab")
        assert app.chosen is PanelName.PROPERTIES


async def test_a_section_folds_and_unfolds() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        assert "core … 6" in screen_text(app)
        await press(pilot, "down down down space down")
        assert app.node.text("type") == "nameserver"
        await press(pilot, "space")
        assert app.node.tag == "core"
        assert "core … 6" in screen_text(app)


async def to_watcher(pilot: Pilot[None], app: DesignApp, name: str) -> None:
    (path,) = [node.path for node in app.draft.mission if node.tag == "behavior" and node.text("name") == name]
    app.go_to(path)
    app.redraw()
    await pilot.pause()


async def test_a_behavior_goes_into_the_one_above_and_out_again() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await to_watcher(pilot, app, "watch-scout2")
        for into, out in [("greater_than_sign", "less_than_sign"), ("shift+right", "shift+left")]:
            await press(pilot, into)
            assert app.node.path == (5, 0, 0, 1)
            assert app.draft.problems == ()
            await press(pilot, out)
            assert app.draft.text == shipped().text
        await press(pilot, "shift+left shift+left")
        assert "refused" in screen_text(app)


async def test_an_element_is_removed_and_a_value_left_out() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await press(pilot, "down down tab down down x")
        assert b"tags=" not in app.draft.text.partition(b"<core>")[0]
        await press(pilot, "shift+tab delete")
        assert "problem" in screen_text(app)
        assert b"<host " not in app.draft.text
        await press(pilot, "up up delete")
        assert "refused" in screen_text(app)


async def test_a_property_is_changed_its_parameters_too() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await to_watcher(pilot, app, "watch-scout1")
        await press(pilot, "enter down down down down")
        assert "For how long what moves is in" in screen_text(app)
        await press(pilot, 'enter "6" enter')
        assert app.draft.description is not None
        assert app.draft.description.behaviors[0].children[0].parameters == {"view_s": 6}
        await press(pilot, 'e "7" escape')
        assert app.draft.description.behaviors[0].children[0].parameters == {"view_s": 6}


async def test_what_is_chosen_from_is_suggested() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await to_watcher(pilot, app, "watch-scout1")
        await press(pilot, "down down enter down enter")
        assert "One of: scout1, scout2, scout3" in screen_text(app)
        await press(pilot, '"scout"')
        await settle(pilot)
        await press(pilot, "right enter")
        assert app.node.text("name") == "scout1"


async def test_a_name_is_changed_wherever_it_is_spoken_of() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await press(pilot, 'down down n "station" enter')
        assert app.draft.text.count(b'host="station"') == 7
        assert app.draft.problems == ()
        await press(pilot, "up n")
        assert "has no name" in screen_text(app)


async def test_enter_on_a_problem_goes_to_its_element() -> None:
    draft = Draft("mission.xml", type(shipped().step)(shipped().text.replace(b'x-m="7.20"', b'x-m="72"')))
    app = app_of(draft)
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await press(pilot, "tab tab enter")
        assert (app.node.tag, app.node.text("name")) == ("scout", "scout2")
        assert app.chosen is PanelName.TREE
        await press(pilot, "d")
        assert "a dry run needs a mission" in screen_text(app)


async def test_the_first_minute_comes_and_goes() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await press(pilot, "d")
        assert "watch-scout1-capture: 6 turns" in screen_text(app)
        await press(pilot, "tab tab enter d")
        assert "none: check would say that it is fine" in screen_text(app)


async def test_the_catalogue_tells_what_a_class_says_of_itself() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await press(pilot, 'c "watch"')
        assert "view_s: number, at least 0, default 0.0" in screen_text(app)
        await press(pilot, "enter")
        assert "Looks for motion." in screen_text(app)
        await press(pilot, "escape c")
        await press(pilot, 'down up "hide"')
        assert "behavior  hide (not declared yet)" in screen_text(app)
        await press(pilot, "escape")
        assert app.draft.text == shipped().text


async def test_a_class_of_the_files_own_is_looked_up_only_when_asked() -> None:
    asked: list[str] = []

    async def ask(class_paths: Sequence[str]) -> dict[str, ClassFacts]:
        asked.extend(class_paths)
        return {path: ClassFacts("Mine.") for path in class_paths}

    text = shipped().text.replace(
        b"  </types>", b'    <type name="mine" class="mine.own:Mine" subsystem="mission_control"/>\n  </types>'
    )
    app = DesignApp(Draft("mission.xml", type(shipped().step)(text)), ask)
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await settle(pilot)
        assert WATCH in asked
        assert "mine.own:Mine" not in asked
        await press(pilot, 'c "mine" enter')
        assert "mine.own:Mine" in asked
        assert "Mine." in screen_text(app)


async def test_the_keys_and_the_text_are_told() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        for key in ("question_mark", "f1"):
            await press(pilot, key)
            assert "Move the cursor of the chosen panel." in screen_text(app)
            await press(pilot, "escape")
        await press(pilot, "t")
        assert '<mission name="iros2001" priority="10"' in screen_text(app)
        await press(pilot, "q")
        assert len(app.screen_stack) == 1


async def test_it_is_saved_and_somebody_elses_work_not_overwritten_unasked(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    app = app_of(Draft.new(str(file)))
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await press(pilot, "s")
        assert file.read_bytes() == app.draft.text
        file.write_bytes(b"theirs")
        await press(pilot, "plus ctrl+s")
        assert "Overwrite it?" in screen_text(app)
        await press(pilot, "n")
        assert file.read_bytes() == b"theirs"
        await press(pilot, "s y")
        assert file.read_bytes() == app.draft.text
        await press(pilot, f'w "{tmp_path / "two.xml"}" enter')
        assert (tmp_path / "two.xml").read_bytes() == app.draft.text
        await press(pilot, 'w "/no/such/place" enter')
        assert "not saved" in screen_text(app)


async def test_what_is_not_saved_is_not_left_unasked() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        for key in ("q", "ctrl+c", "ctrl+q"):
            await press(pilot, f"plus {key}")
            assert "not saved. Leave?" in screen_text(app)
            await press(pilot, "n")
            assert app.is_running
        await press(pilot, "u u u q")
        assert not app.is_running


async def test_a_refusal_is_told_with_its_remedy() -> None:
    app = app_of(shipped())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await press(pilot, 'a "resource scout" enter "scout1" enter')
        told = " ".join(screen_text(app).split())
        assert "has the name 'scout1' already" in told
        assert re.search("Give.*it a.*name", told)
        await press(pilot, 'a "behavior patrol" enter enter "soon" enter')
        assert "is no priority" in screen_text(app)
        await press(pilot, 'a "no such thing" enter escape')
        await press(pilot, 'a "behavior patrol" enter escape')
        assert app.draft.text == shipped().text


async def test_the_screen_looks_as_it_did() -> None:
    app = app_of(Draft("mission.xml", shipped().step, saved=shipped().text))
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await to_watcher(pilot, app, "watch-scout1")
        await settle(pilot)
        same_as_before(app, "design")
        await press(pilot, "d")
        same_as_before(app, "design-dry-run")
        await press(pilot, "a")
        same_as_before(app, "design-add")


# ---------------------------------------------------------------------- nothing was left out
def test_every_key_has_a_test_and_says_what_it_does() -> None:
    """Counts what is pressed in this file, so that a key nobody tries is found."""
    source = Path(__file__).read_text()
    bound = {key for one in DesignApp.BINDINGS if isinstance(one, Binding) for key in one.key.split(",")}
    missing = [key for key in bound if not re.search(rf'["\s\']{re.escape(key)}["\s]', source)]
    assert missing == []
    assert len(keys_help()) == len(DesignApp.BINDINGS)
    assert all(len(line) > 25 for line in keys_help())


def test_the_how_to_tells_every_key() -> None:
    names = {"plus": "+", "minus": "-", "greater_than_sign": ">", "less_than_sign": "<", "question_mark": "?"}
    page = (ROOT / "docs" / "how-to" / "design-a-mission.md").read_text()
    told = set(re.findall(r"`(\S+)`", "".join(line for line in page.splitlines() if line.startswith("| `"))))
    keys = [one.key.split(",")[0] for one in DesignApp.BINDINGS if isinstance(one, Binding)]
    assert {names.get(key, key) for key in keys} <= told
