"""The designer in a real browser: the tutorial's mission from nothing, by mouse at a desk and by fingers on a phone.

Both must save what the terminal's designer saves (see ``test_design_tutorial``), byte for byte.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any

import pytest
import web_browser
from axe import serious_findings
from design_keys import tutorial_draft
from web_browser import assert_no_sideways_scroll

from ui_console.design.keeping import path_of_draft

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

ROOT = Path(__file__).parents[3]
BIN = Path(sys.executable).parent


@contextmanager
def served(file: Path) -> Iterator[str]:
    """Serve the designer of this file; yields the page's address."""
    process = subprocess.Popen(
        [str(BIN / "scout-console"), "serve", "--design", str(file), "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/#token=\S+", address)
        yield address
        process.terminate()
        assert process.wait(20) == 0
    finally:
        if process.poll() is None:
            process.kill()
        process.wait(10)
        assert process.stdout is not None
        process.stdout.close()


@asynccontextmanager
async def page_at(size: str, address: str, theme: str = "dark") -> AsyncIterator[Any]:
    """Open the page in a browser of this size; it never scrolls sideways."""
    async with web_browser.page_at(size, address, shows=".element", theme=theme, expects=()) as page:
        yield page
        await assert_no_sideways_scroll(page)


async def keep_picture(page: Any, name: str) -> None:
    await web_browser.keep_picture(page, f"design-{name}")


class Hands:
    """What a person does at the page, whatever with."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def row(self, told: str) -> Any:
        """Return the row of the element of which this is told, tag first."""
        return self.page.locator(f".element[data-told='{told}']")

    def part(self, label: str) -> Any:
        return self.page.locator(f".part[data-label='{label}']")

    async def add(self, label: str, to: str) -> None:
        raise NotImplementedError

    async def choose(self, told: str) -> None:
        raise NotImplementedError

    async def open(self, pane: str) -> None:
        """Have a pane in sight."""

    async def answer(self, **answers: str) -> None:
        """Answer what is asked."""
        for name, value in answers.items():
            field = self.page.locator(f"#ask [name='{name.replace('_', '-')}']")
            await field.wait_for()
            if await field.evaluate("field => field.tagName") == "SELECT":
                await field.select_option(value)
            else:
                await field.fill(value)
        await self.page.locator("#ask button[value=done]").click()
        await self.page.wait_for_selector("#ask", state="hidden")

    async def set(self, name: str, value: str) -> None:
        """Set a property of the chosen element."""
        await self.open("details")
        field = self.page.locator(f"#properties [data-key='{name}']")
        await field.fill(value)
        await field.press("Enter")

    async def see(self, told: str) -> None:
        await self.open("tree")
        await self.row(told).wait_for()

    async def is_state(self, words: str) -> None:
        await self.page.locator("#state").get_by_text(words, exact=True).wait_for()


class Mouse(Hands):
    """A mouse at a desk: everything is dragged."""

    async def add(self, label: str, to: str) -> None:
        await self.part(label).scroll_into_view_if_needed()
        await self.drag(self.part(label).locator(".name"), self.row(to))

    async def choose(self, told: str) -> None:
        await self.row(told).click()
        await self.page.wait_for_selector(f"#details-title:text-is('{told}')")

    async def drag(self, source: Any, target: Any, share: float = 0.5) -> None:
        await target.scroll_into_view_if_needed()
        begin, end = await source.bounding_box(), await target.bounding_box()
        mouse = self.page.mouse
        await mouse.move(begin["x"] + begin["width"] / 2, begin["y"] + begin["height"] / 2)
        await mouse.down()
        await mouse.move(end["x"] + 90, end["y"] + end["height"] * share, steps=8)
        await self.page.wait_for_selector(".drop-into, .drop-before, .drop-after")
        await mouse.up()


class Finger(Hands):
    """A finger on a phone: panes are changed, things added to what was chosen, and dragged by their handles."""

    async def open(self, pane: str) -> None:
        await self.page.locator(f"#panes [data-pane={pane}]").tap()

    async def add(self, label: str, to: str) -> None:
        await self.choose(to)
        await self.open("parts")
        await self.page.locator("#find-part").fill(label)
        await self.part(label).get_by_role("button", name=f"Add {label}").tap()

    async def choose(self, told: str) -> None:
        await self.open("tree")
        await self.row(told).tap()
        await self.page.wait_for_selector(f"#target-shown:text-is('{told}')", state="attached")

    async def drag(self, source: Any, target: Any) -> None:
        """Drag by the handle with a finger."""
        touches = await self.page.context.new_cdp_session(self.page)
        for each in (target, source):
            await each.scroll_into_view_if_needed()
        begin = await source.locator(".handle").bounding_box()
        x, y = begin["x"] + begin["width"] / 2, begin["y"] + begin["height"] / 2

        async def send(kind: str, points: list[dict[str, float]]) -> None:
            await touches.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        await send("touchStart", [{"x": x, "y": y}])
        await send("touchMove", [{"x": x, "y": y - 10}])
        await self.page.wait_for_selector(".ghost")
        for _ in range(3):  # the tree scrolls while the finger is near its edge
            end = await target.bounding_box()
            await send("touchMove", [{"x": end["x"] + 120, "y": end["y"] + end["height"] / 2}])
        await self.page.wait_for_selector(".drop-into")  # what is under it, or what will hold it
        await send("touchEnd", [])


async def build(hands: Hands) -> None:
    """Do what the tutorial does, step by step."""
    mission = "mission guard priority 10"
    await hands.add("world", mission)
    await hands.see("world world simulated_world")
    await hands.add("target", "world world simulated_world")
    await hands.answer(name="pioneer", shape="pioneer", speed_m_s="0.5", path="0,3 9,3")
    await hands.see("target pioneer")
    for number, (kind, name) in enumerate(
        [
            ("command_radio", "radio"),
            ("video_frequency", "video1"),
            ("framegrabber", "grabber"),
            ("scout", "scout1"),
            ("scout", "scout2"),
        ]
    ):
        await hands.add(f"resource {kind}", "resources" if number else mission)
        await hands.see(f"resource {name} {kind}")
    await hands.choose("scout scout2 at 2, 0.5")
    await hands.set("x-m", "12")
    await hands.is_state("changed, 1 problem")
    await hands.open("tree")
    assert "✗" in await hands.row("scout scout2 at 12, 0.5").inner_text()
    await hands.open("problems")
    await hands.page.locator("#problems").get_by_text("scout scout2 is outside the room: x at 12 m").wait_for()
    if isinstance(hands, Mouse):
        await keep_picture(hands.page, "problem")
    await hands.page.locator("#undo").click()
    await hands.is_state("changed, fine")
    await hands.choose("scout scout2 at 2, 0.5")
    await hands.set("x-m", "7.2")
    await hands.see("scout scout2 at 7.2, 0.5")
    await hands.add("behavior surveillance", mission)
    await hands.see("behavior surveillance surveillance priority 1")
    await hands.choose("behavior surveillance surveillance priority 1")
    await hands.set("priority", "5")
    root = "behavior surveillance surveillance priority 5"
    await hands.see(root)
    for robot in ("scout1", "scout2"):
        await hands.add("behavior watch_for_motion", root)
        await hands.see("behavior watch-for-motion watch_for_motion priority 1")
        await hands.choose("behavior watch-for-motion watch_for_motion priority 1")
        await hands.set("name", f"watch-{robot}")
        watcher = f"behavior watch-{robot} watch_for_motion priority 1"
        await hands.see(watcher)
        await hands.add("arc capture", watcher)
        await hands.row("arc capture at least 5 s").nth(int(robot == "scout2")).wait_for(state="attached")
        await hands.add("wish scout", watcher)
        await hands.answer(name=robot)
        await hands.see(f"wish scout {robot}")
    await hands.is_state("changed, fine")


async def save(hands: Hands) -> None:
    await hands.page.locator("#save").click()
    await hands.is_state("saved, fine")


def checked(file: Path) -> bytes:
    """Return what the file holds, which ``check`` must find fine; nothing else may be left beside it."""
    done = subprocess.run([str(BIN / "scout-backbone"), "check", str(file)], check=False, capture_output=True)
    assert done.returncode == 0, done.stderr
    assert not path_of_draft(str(file)).exists()
    return file.read_bytes()


async def test_with_a_mouse_the_mission_of_the_tutorial_is_built_by_dragging(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    with served(file) as address:
        async with page_at("desktop", address) as page:
            mouse = Mouse(page)
            await build(mouse)
            await page.locator("#below-tabs [data-pane=minute]").click()
            await page.wait_for_selector("svg.minute rect.color-1")
            await page.locator("#minute").get_by_text("watch-scout1-capture: 6 turns").wait_for()
            await keep_picture(page, "desktop")

            one, two = (mouse.row(f"behavior watch-scout{number} watch_for_motion priority 1") for number in (1, 2))
            await mouse.drag(two, one, share=0.05)
            await mouse.is_state("changed, fine")
            rows = page.locator(".element.tag-behavior")
            await page.wait_for_function(
                "() => document.querySelectorAll('.element.tag-behavior')[1].textContent.includes('watch-scout2')"
            )
            assert await rows.count() == 3
            await page.locator("#undo").click()
            await page.wait_for_function(
                "() => document.querySelectorAll('.element.tag-behavior')[1].textContent.includes('watch-scout1')"
            )

            asked: list[str] = []

            async def stay_or_go(dialog: Any) -> None:
                asked.append(dialog.type)
                await dialog.accept()

            page.on("dialog", stay_or_go)
            await page.reload()
            await mouse.is_state("changed, fine")
            assert asked == ["beforeunload"]
            await save(mouse)
    assert checked(file) == tutorial_draft().text


@pytest.mark.slow
async def test_with_a_finger_on_a_phone_the_same_is_built(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    with served(file) as address:
        async with page_at("phone", address) as page:
            finger = Finger(page)
            await build(finger)
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
            await save(finger)
    assert checked(file) == tutorial_draft().text


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
