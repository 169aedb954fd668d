"""Actions of people at the designer's page, with a mouse or a finger, and tutorials carried out by them."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
BIN = Path(sys.executable).parent
TUTORIAL = ROOT / "docs" / "tutorial" / "design-a-mission.md"
PANES = {"problem": "problems", "first minute": "minute"}
"""What the tutorial calls a pane → its name on the page."""


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


class Hands:
    """A person's actions at the page, by any pointer."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def row(self, told: str) -> Any:
        """Return the row of the element with these words, tag first."""
        return self.page.locator(f".element[data-told='{told}']")

    def part(self, label: str) -> Any:
        return self.page.locator(f".part[data-label='{label}']")

    async def add(self, label: str, to: str) -> None:
        raise NotImplementedError

    async def choose(self, told: str) -> None:
        raise NotImplementedError

    async def open(self, pane: str) -> None:
        """Open a pane."""
        for tab in await self.page.locator(f"#below-tabs [data-pane={pane}]").all():
            await tab.click()

    async def settle(self) -> None:
        """Return when the page shows all that was done."""
        await self.page.wait_for_selector("#designer[aria-busy=false]", state="attached")

    async def answer(self, **answers: str) -> None:
        """Answer the questions."""
        for name, value in answers.items():
            field = self.page.locator(f"#ask [name='{name.replace('_', '-')}']")
            await field.wait_for()
            if await field.evaluate("field => field.tagName") == "SELECT":
                await field.select_option(value)
            else:
                await field.fill(value)
        await self.page.locator("#ask button[value=done]").click()
        await self.page.wait_for_selector("#ask", state="hidden")
        await self.settle()

    async def set(self, name: str, value: str) -> None:
        """Set an attribute or a parameter of the chosen element."""
        await self.open("details")
        field = self.page.locator(f"#properties :is([data-key='{name}'], [data-key='parameter {name}'])")
        if await field.evaluate("field => field.tagName") == "SELECT":
            await field.select_option(value)
        else:
            await field.fill(value)
            await field.press("Enter")
        await self.settle()

    async def see(self, told: str) -> None:
        await self.open("tree")
        await self.row(told).first.wait_for()

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


async def nothing() -> None:
    """Keep no picture."""


async def build_by_tutorial(
    hands: Hands, keep_problem: Callable[[], Awaitable[None]] = nothing, tutorial: Path = TUTORIAL
) -> None:
    """Do what the tutorial says, and see what it says is shown.

    Args:
        hands: Mouse or finger.
        keep_problem: Called while a problem is shown.
        tutorial: Which one.
    """
    for kind, line in _steps(tutorial):
        if kind == "page":
            await _do(hands, line)
        else:
            await _see(hands, line)
            if line.startswith("problem: "):
                await keep_problem()


def _steps(tutorial: Path) -> list[tuple[str, str]]:
    blocks = re.findall(r"```(page|screen)\n(.*?)```", tutorial.read_text(), re.DOTALL)
    return [(kind, line) for kind, block in blocks for line in block.splitlines()]


async def _do(hands: Hands, line: str) -> None:
    quoted = re.findall(r'"([^"]*)"', line)
    match line.split(maxsplit=1)[0]:
        case "drag":
            rows = await hands.page.locator(".element").count()
            await hands.add(*quoted)
            grown = "rows => document.querySelectorAll('.element').length > rows"
            await hands.page.wait_for_function(
                f"rows => ({grown})(rows) || document.querySelector('#ask[open]')", arg=rows
            )
        case "answer":
            await hands.answer(**dict(re.findall(r'(\S+) "([^"]*)"', line)))
        case "choose":
            await hands.choose(*quoted)
        case "set":
            await hands.set(line.split()[1], *quoted)
        case "undo" | "save" as button:
            await hands.page.locator(f"#{button}").click()
        case unknown:
            raise AssertionError(f"the tutorial says {unknown}, which no hand can do")


async def _see(hands: Hands, line: str) -> None:
    where, _, words = line.partition(": ")
    if where in PANES:
        await hands.open(PANES[where])
        await hands.page.locator(f"#{PANES[where]}").get_by_text(words.removesuffix("…").strip()).first.wait_for()
    elif re.match("changed,|saved,", line):
        await hands.is_state(line)
    else:
        told = line.removeprefix("✗ ")
        await hands.see(told)
        assert ("✗" in await hands.row(told).first.inner_text()) == line.startswith("✗ ")
