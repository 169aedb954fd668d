"""Pages in a real browser, for the table of stops."""

from __future__ import annotations

import asyncio
import os
import re
import shutil
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Any

from measuring import BIN
from playwright.async_api import async_playwright
from stops_link import Relay, relay_to_port
from stops_places import ROBOT, Gesture, Place
from stops_terminal import TriedConsole

SIZES = {"desktop": (1440, 900), "tablet": (820, 1180), "phone": (390, 844)}
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), "")
ARGUMENTS = ["--no-sandbox", "--disable-gpu"]
WITHIN_S = 15.0
PRESS_S = 0.1  # chosen: six frames of the screen, at each of which the page reads its gamepad
CARD = f".robot[data-robot={ROBOT}]"
BUTTONS = {
    Gesture.RED_ONE: f"{CARD} .emergency",
    Gesture.RED_MINE: "#stop-mine",
    Gesture.RED_ALL: "#stop-all",
}
IN_A_DIALOG = {
    Gesture.RED_ONE: "#reading-stop",
    Gesture.RED_MINE: "#reading-stop",
    Gesture.RED_ALL: "#reading-stop-all",
}
"""An open dialog covers every red button except its own."""
GAMEPAD_BUTTONS = {Gesture.PAD_ONE: 1, Gesture.PAD_ALL: 3}
SAID = ("link", "blind-title", "unsure", "own", "lost-line", "let-go")
BEFORE = """
window.held = new Set();
const buttons = () => Array.from({ length: 16 }, (_none, number) => ({ pressed: window.held.has(number) }));
const pad = () => ({ connected: true, axes: [1, 0, 0, 0], buttons: buttons() });
Object.defineProperty(navigator, "getGamepads", { value: () => [pad()] });
"""


class Page(TriedConsole):
    """The page at one size."""

    def __init__(self, name: str, relay: Relay, page: Any) -> None:
        super().__init__(name, relay)
        self._page = page
        self._aimed: dict[Gesture, dict[str, float] | None] = {}
        self._has_gamepad = Gesture.PAD_ONE in self.kind.gestures

    async def take(self) -> None:
        """See ``TriedConsole``."""
        await self._page.wait_for_selector("body:not(.is-blind)")
        if await self._page.evaluate("() => document.getElementById('take').disabled"):
            return  # the console has requested its robot already
        await self._page.evaluate(f"() => document.querySelector('{CARD} .row button').click()")

    async def go(self, place: Place) -> None:
        """See ``TriedConsole``."""
        if place.open:
            await self._page.evaluate(f"() => {{ {place.open}; }}")
        if place.shows:
            await self._page.wait_for_function(f"() => {place.shows}", timeout=5000)

    async def leave(self, place: Place) -> None:
        """See ``TriedConsole``."""
        await self.let_go()
        if place.close:
            await self._page.evaluate(f"() => {{ {place.close}; }}")
        await self._page.evaluate("() => { document.activeElement.blur(); scrollTo(0, 0); }")

    async def aim(self, gestures: Sequence[Gesture]) -> None:
        """See ``TriedConsole``."""
        is_open = await self._page.evaluate("() => document.querySelector('dialog[open]') !== null")
        buttons = IN_A_DIALOG if is_open else BUTTONS
        for gesture in gestures:
            if gesture in buttons:
                button = self._page.locator(buttons[gesture]).first
                await button.evaluate("one => one.scrollIntoView({ block: 'center' })")
                self._aimed[gesture] = await button.bounding_box()

    async def give(self, gesture: Gesture) -> float:
        """See ``TriedConsole``."""
        if gesture in BUTTONS and gesture not in self._aimed:
            await self.aim([gesture])
        at_s = time.monotonic()
        if gesture in BUTTONS:
            await self._touch(self._aimed.pop(gesture))
        elif gesture in GAMEPAD_BUTTONS:
            await self._page.evaluate("number => { window.held.add(number); }", GAMEPAD_BUTTONS[gesture])
            await asyncio.sleep(PRESS_S)
            await self._page.evaluate("number => { window.held.delete(number); }", GAMEPAD_BUTTONS[gesture])
        else:
            await self._page.keyboard.press("Shift+X" if gesture is Gesture.ALL else "x")
        return at_s

    async def says(self) -> str:
        """See ``TriedConsole``."""
        ids = ", ".join(f"'{one}'" for one in SAID)
        shown = await self._page.evaluate(
            f"() => [{ids}].map((id) => document.getElementById(id)).filter((one) => one.checkVisibility())"
            ".map((one) => one.textContent).filter(Boolean)"
        )
        return " / ".join(shown)

    async def _hold(self) -> None:
        await self._page.keyboard.down("d")
        await asyncio.Event().wait()

    async def _release(self) -> None:
        await self._page.keyboard.up("d")

    async def _touch(self, box: dict[str, float] | None) -> None:
        """Press the finger, or the mouse, at a button's place, even if the button is covered."""
        if box is not None:
            press = self._page.mouse.click if self.name == "page desktop" else self._page.touchscreen.tap
            await press(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)

    async def _pids(self) -> list[int]:
        browser = await self._page.context.browser.new_browser_cdp_session()
        found = await browser.send("SystemInfo.getProcessInfo")
        await browser.detach()
        return [one["id"] for one in found["processInfo"] if one["type"] == "renderer"]

    async def plug_in(self) -> None:
        """Connect the page's gamepad, if it has one."""
        if self._has_gamepad:
            await self._page.evaluate("() => { dispatchEvent(new Event('gamepadconnected')); }")


@asynccontextmanager
async def page_present(name: str, environment: dict[str, str], mission: str) -> AsyncIterator[Page]:
    """Serve the mission's page, and open it in a browser of the size in the console's name."""
    words = [str(BIN / "scout-console"), "serve", "--port", "0", "--mission", mission]
    pipe = asyncio.subprocess.PIPE
    server = await asyncio.create_subprocess_exec(*words, env={**os.environ, **environment}, stdout=pipe)
    try:
        assert server.stdout is not None
        told = re.search(r"127\.0\.0\.1:(\d+)/#token=(\S+)", (await server.stdout.readline()).decode())
        assert told is not None, "the page is not served"
        size = name.removeprefix("page ")
        width, height = SIZES[size]
        async with relay_to_port(int(told[1])) as (relay, port), async_playwright() as playwright:
            browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
            context = await browser.new_context(
                viewport={"width": width, "height": height}, has_touch=size != "desktop", is_mobile=size == "phone"
            )
            shown = await context.new_page()
            shown.set_default_timeout(1000 * WITHIN_S)
            await shown.add_init_script(BEFORE)
            await shown.goto(f"http://127.0.0.1:{port}/#token={told[2]}&user={size}")
            await shown.wait_for_selector(CARD)
            page = Page(name, relay, shown)
            await page.plug_in()
            try:
                yield page
            finally:
                await page.let_go()
                await browser.close()
    finally:
        if server.returncode is None:
            server.terminate()
        await server.wait()
