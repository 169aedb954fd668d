"""The designer in a real browser: the tutorial done as it stands, by mouse at a desk and by fingers on a phone."""

from __future__ import annotations

import asyncio
import subprocess
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import web_browser
from axe import serious_findings
from design_hands import BIN, ROOT, Finger, Hands, Mouse, build_by_tutorial, served
from design_tutorial import tutorial_draft
from web_browser import SIZES, assert_no_sideways_scroll

from ui_console.design.keeping import path_of_draft

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

PRESS_AFTER_DRAG = """(handle) => {
  const heard = [];
  const fire = (target, kind, x, y) =>
    target.dispatchEvent(new PointerEvent(kind, {
      bubbles: true, pointerId: 7, pointerType: "touch", isPrimary: true, clientX: x, clientY: y,
    }));
  fire(handle, "pointerdown", 50, 50);
  fire(handle, "pointermove", 0, 0);
  if (document.querySelector(".ghost")) heard.push("drag");
  fire(handle, "pointerup", 0, 0);
  const tree = document.getElementById("tree");
  tree.addEventListener("click", () => heard.push("press"), { once: true });
  fire(tree, "pointerdown", 0, 0);
  fire(tree, "pointerup", 0, 0);
  tree.click();
  return heard;
}"""
"""All in one task of the page, as on a busy device: no timer is served between the drag and the press."""

BUTTONS_MOVED = """() => {
  const places = () =>
    [...document.querySelectorAll("header button, #panes button, #below-tabs button")].map((one) => {
      const { x, y } = one.getBoundingClientRect();
      return `${one.textContent} ${x} ${y}`;
    });
  const before = places();
  const words = {
    state: "changed, 12 problems",
    people: "with ben, somebody-with-a-rather-long-name",
    link: "NOT CONNECTED: no connection to the server",
  };
  for (const [id, text] of Object.entries(words)) document.getElementById(id).textContent = text;
  return places().filter((one) => !before.includes(one));
}"""
"""Buttons in other places after words of the header have become longer."""

SHOWN_AGAIN = """async (dialog) => {
  const dialogs = await import("./design_dialogs.js");
  const options = [{ label: "a", doc: "" }];
  const show = () => (dialog === "ask" ? dialogs.ask("Ask", "", []) : dialogs.choose("Choose", options));
  const isOpen = [];
  let answered = show();
  for (let times = 0; times < 2; times += 1) {
    if (dialog === "ask") document.getElementById("ask-form").requestSubmit();
    else document.querySelector("#choose-list button").click();
    await answered;
    answered = show();
    await new Promise((resolve) => setTimeout(resolve, 100));
    isOpen.push(document.getElementById(dialog).open);
  }
  return isOpen;
}"""


@asynccontextmanager
async def page_at(size: str, address: str, theme: str = "dark") -> AsyncIterator[Any]:
    """Open the page in a browser of this size; it never scrolls sideways."""
    async with web_browser.page_at(size, address, shows=".element", theme=theme, expects=()) as page:
        yield page
        await assert_no_sideways_scroll(page)


async def keep_picture(page: Any, name: str) -> None:
    await web_browser.keep_picture(page, f"design-{name}")


def checked(file: Path) -> bytes:
    """Return what the file holds, which ``check`` must find fine; nothing else may be left beside it."""
    done = subprocess.run([str(BIN / "scout-backbone"), "check", str(file)], check=False, capture_output=True)
    assert done.returncode == 0, done.stderr
    assert not path_of_draft(str(file)).exists()
    return file.read_bytes()


@pytest.mark.thorough
async def test_with_a_mouse_the_mission_of_the_tutorial_is_built_by_dragging(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    with served(file) as address:
        async with page_at("desktop", address) as page:
            mouse = Mouse(page)
            await build_by_tutorial(mouse, partial(keep_picture, page, "problem"))
            assert checked(file) == tutorial_draft().text
            await mouse.open("minute")
            await page.wait_for_selector("svg.minute rect.color-1")
            await keep_picture(page, "desktop")

            one, two = (mouse.row(f"behavior watch-scout{number} watch_for_motion priority 1") for number in (1, 2))
            await mouse.drag(two, one, share=0.05)
            await mouse.is_state("changed, fine")
            rows = page.locator(".element.tag-behavior")
            await page.wait_for_function(
                "() => document.querySelectorAll('.element.tag-behavior')[1].textContent.includes('watch-scout2')"
            )
            assert await rows.count() == 3
            asked: list[str] = []

            async def stay_or_go(dialog: Any) -> None:
                asked.append(dialog.type)
                await dialog.accept()

            page.on("dialog", stay_or_go)
            await page.reload()
            await mouse.is_state("changed, fine")
            assert asked == ["beforeunload"]
            await page.locator("#undo").click()
            await mouse.is_state("saved, fine")
            await page.wait_for_function(
                "() => document.querySelectorAll('.element.tag-behavior')[1].textContent.includes('watch-scout1')"
            )


@pytest.mark.slow
async def test_with_a_finger_on_a_phone_the_same_is_built(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    with served(file) as address:
        async with page_at("phone", address) as page:
            finger = Finger(page)
            await build_by_tutorial(finger, partial(asyncio.sleep, 0))
            assert checked(file) == tutorial_draft().text
            await finger.open("tree")
            await keep_picture(page, "phone")
            one, two = (finger.row(f"behavior watch-scout{number} watch_for_motion priority 1") for number in (1, 2))
            await finger.drag(two, one)
            await page.wait_for_function(
                "() => [...document.querySelectorAll('.element.tag-behavior')].at(-1).ariaLevel === '5'"
            )
            await two.tap()
            await page.locator("#actions [data-act=out]").tap()
            await page.wait_for_function(
                "() => [...document.querySelectorAll('.element.tag-behavior')].at(-1).ariaLevel === '4'"
            )
            await finger.is_state("saved, fine")


async def test_the_click_of_a_press_right_after_a_drag_counts(tmp_path: Path) -> None:
    with served(tmp_path / "guard.xml") as address:
        async with page_at("tablet", address) as page:
            handle = Mouse(page).part("behavior patrol").locator(".handle")
            assert await handle.evaluate(PRESS_AFTER_DRAG) == ["drag", "press"]


@pytest.mark.parametrize("size", SIZES)
async def test_no_word_of_the_header_moves_a_button(tmp_path: Path, size: str) -> None:
    with served(tmp_path / "guard.xml") as address:
        async with page_at(size, address) as page:
            assert await page.evaluate(BUTTONS_MOVED) == []


@pytest.mark.thorough
async def test_on_a_tablet_a_finger_drags_parts_and_keys_alone_add_move_raise_and_remove(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    with served(file) as address:
        async with page_at("tablet", address) as page:
            hands = Mouse(page)

            async def press_keys(*keys: str) -> None:
                for key in keys:
                    await page.keyboard.press(key)

            async def pick(text: str) -> None:
                await page.keyboard.press("a")
                await page.wait_for_selector("#choose[open]")
                await page.keyboard.type(text)
                await page.keyboard.press("Enter")
                await page.wait_for_selector("#ask[open]")
                await page.keyboard.press("Enter")
                await page.wait_for_selector("#ask", state="hidden")

            await Finger(page).drag(hands.part("behavior patrol"), hands.row("hosts"))
            await hands.see("behavior patrol patrol priority 1")
            await page.locator("#undo").tap()
            await hands.row("behaviors").wait_for(state="detached")
            await page.locator(".element").first.focus()
            await pick("behavior patrol")
            await hands.see("behavior patrol patrol priority 1")
            await page.locator(".element[aria-selected=true]").focus()
            await press_keys("+", "+", "-")
            await hands.see("behavior patrol patrol priority 2")
            await press_keys("ArrowUp")
            await pick("behavior hide")
            await hands.see("behavior hide hide priority 1")
            await page.locator(".element[aria-selected=true]").focus()
            await press_keys(">")
            await page.wait_for_selector(".element.tag-behavior[aria-level='4']")
            await press_keys("<")
            await page.wait_for_selector(".element.tag-behavior[aria-level='4']", state="detached")
            await press_keys("m", "ArrowUp", "Enter")
            await page.wait_for_selector(".element.tag-behavior[aria-level='4']")
            await press_keys("u")
            await page.wait_for_selector(".element.tag-behavior[aria-level='4']", state="detached")
            await press_keys("Shift+ArrowUp")
            await page.wait_for_function(
                "() => document.querySelector('.element.tag-behavior').textContent.includes('hide')"
            )
            await press_keys("Delete")
            await hands.row("behavior hide hide priority 1").wait_for(state="detached")
            await press_keys("u")
            await hands.see("behavior hide hide priority 1")
            await keep_picture(page, "tablet")
            await page.keyboard.press("Control+s")
            await page.locator("#notices").get_by_text("Saved as").wait_for()
            await hands.page.locator("#redo").click()
            await hands.row("behavior hide hide priority 1").wait_for(state="detached")


@pytest.mark.thorough
async def test_what_somebody_else_wrote_meanwhile_is_overwritten_only_when_told_so(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    file.write_bytes((ROOT / "mission.xml").read_bytes())
    with served(file) as address:
        async with page_at("desktop", address) as page:
            hands = Mouse(page)
            await hands.is_state("saved, fine")
            await hands.set("priority", "11")
            await hands.is_state("changed, fine")
            theirs = file.read_bytes() + b"<!-- theirs -->\n"
            file.write_bytes(theirs)
            await page.locator("#save").click()
            await page.locator("#choose").get_by_role("button", name="Take what the file holds").click()
            await hands.is_state("saved, fine")
            assert file.read_bytes() == theirs
            await page.locator("#undo").click()
            await hands.is_state("changed, fine")
            await page.locator("#revert").click()
            await hands.is_state("saved, fine")
            await page.locator("#undo").click()
            await hands.is_state("changed, fine")
            file.write_bytes(theirs + b"<!-- again -->\n")
            await page.locator("#save").click()
            await page.locator("#choose").get_by_role("button", name="Overwrite it").click()
            await hands.is_state("saved, fine")
            mine = (ROOT / "mission.xml").read_bytes().replace(b'priority="10"', b'priority="11"', 1)
            assert file.read_bytes() == mine


@pytest.mark.thorough
async def test_a_refused_value_stays_marked_where_it_was_written_and_escape_takes_it_back(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    file.write_bytes((ROOT / "mission.xml").read_bytes())
    with served(file) as address:
        async with page_at("desktop", address) as page:
            await Mouse(page).choose("resource scout2 scout")
            field = page.locator("#properties [data-key='name']")
            await field.fill("scout1")
            await field.press("Enter")
            await page.wait_for_selector("#properties [data-key='name'][aria-invalid='true']")
            why = await page.locator("#properties label:has([data-key='name']) .refused").inner_text()
            assert "has the name 'scout1' already" in why
            await page.locator("#properties [data-key='host']").focus()
            assert await field.input_value() == "scout1"
            assert await field.get_attribute("aria-invalid") == "true"
            await field.press("Escape")
            assert await field.input_value() == "scout2"
            assert await field.get_attribute("aria-invalid") is None
            await Hands(page).is_state("saved, fine")


@pytest.mark.thorough
async def test_a_long_value_widens_no_pane_and_one_that_is_too_long_is_refused_once(tmp_path: Path) -> None:
    with served(tmp_path / "guard.xml") as address:
        async with page_at("desktop", address) as page:
            name = page.locator("#properties [data-key='name']")
            await name.fill("n" * 300)
            await name.press("Enter")
            await page.locator("#target-shown").get_by_text("n" * 300).wait_for()
            await assert_no_sideways_scroll(page)
            await name.fill("n" * 10_000)
            await name.press("Enter")
            await page.locator("#properties .refused").get_by_text("too long for the page").wait_for()
            await name.blur()
            assert await page.locator("#notices p").count() == 1


@pytest.mark.thorough
async def test_enter_sets_what_is_written_and_the_focus_stays(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    file.write_bytes((ROOT / "mission.xml").read_bytes())
    with served(file) as address:
        async with page_at("desktop", address) as page:
            field = page.locator("#properties [data-key='priority']")
            await field.fill("11")
            await field.press("Enter")
            await Hands(page).is_state("changed, fine")
            assert await page.evaluate("() => document.activeElement.dataset.key") == "priority"
            await page.locator("#undo").click()
            await Hands(page).is_state("saved, fine")
            assert await page.locator("#undo").is_disabled(), "it was one change"


@pytest.mark.thorough
async def test_a_dialog_asks_for_what_is_required_and_keeps_answers_that_were_refused(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    with served(file) as address:
        async with page_at("desktop", address) as page:
            await page.locator(".element").first.focus()
            await page.keyboard.press("a")
            await page.locator("#choose-find").fill("behavior patrol")
            await page.keyboard.press("Enter")
            await page.locator("#ask [name=name]").fill("")
            await page.keyboard.press("Enter")
            assert await page.locator("#ask[open]").count() == 1, "a name is required"
            await page.locator("#ask [name=name]").fill("rounds")
            await page.locator("#ask [name=priority]").fill("high")
            await page.keyboard.press("Enter")
            await page.locator("#ask-refused").get_by_text("'high' is no priority").wait_for()
            assert await page.locator("#ask [name=name]").input_value() == "rounds"
            await page.locator("#ask [name=priority]").fill("7")
            await page.keyboard.press("Enter")
            await Hands(page).see("behavior rounds patrol priority 7")


@pytest.mark.thorough
@pytest.mark.parametrize("dialog", ["ask", "choose"])
async def test_a_dialog_shown_again_at_once_stays_open(tmp_path: Path, dialog: str) -> None:
    """The browser sends the close event of the first dialog when the second one is open already."""
    with served(tmp_path / "guard.xml") as address:
        async with page_at("desktop", address) as page:
            is_open = await page.evaluate(SHOWN_AGAIN, dialog)
    assert is_open == [True, True]


@pytest.mark.thorough
@pytest.mark.parametrize(("size", "theme"), [("desktop", "light"), ("phone", "dark")])
async def test_axe_finds_nothing_serious_in_the_designer(tmp_path: Path, size: str, theme: str) -> None:
    file = tmp_path / "guard.xml"
    file.write_bytes((ROOT / "mission.xml").read_bytes())
    with served(file) as address:
        async with page_at(size, address, theme) as page:
            found = {}
            for pane in ("parts", "tree", "details", "problems", "minute"):
                for tab in await page.locator(f"[role=tab][data-pane={pane}]").all():
                    await tab.dispatch_event("click")
                await page.wait_for_timeout(300)
                found[pane] = await serious_findings(page)
            await page.evaluate("() => document.getElementById('ask').showModal()")
            found["dialog"] = await serious_findings(page)
            assert {state: findings for state, findings in found.items() if findings} == {}
